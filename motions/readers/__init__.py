"""Readers of record files: one module for each format, and `read`, which detects the format from the contents."""
