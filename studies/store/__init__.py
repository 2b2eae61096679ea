"""The folder of a study: locks, shards, progress, and results that are written whole or not at all."""
