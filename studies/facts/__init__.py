"""Facts of results, one module for each subject, and the templates that say them."""
