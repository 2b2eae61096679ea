"""Results of each kind of study as rows of text."""
