"""The schema of study files, for other programs: as JSON Schema, and as the reference of all keys in Markdown."""
