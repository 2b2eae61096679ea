"""The schema of study files, for other programs, as JSON Schema."""
