"""The study file: its keys and tables, checked once, and its published schema."""
