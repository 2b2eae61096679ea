"""pelicun's fragility tables and performance models of buildings, written; its tables read."""
