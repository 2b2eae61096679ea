"""pelicun's fragility tables and performance models of buildings."""
