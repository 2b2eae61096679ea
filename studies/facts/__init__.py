"""Facts of results, one module for each subject, and the templates of their sentences."""
