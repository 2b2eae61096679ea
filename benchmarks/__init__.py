"""How fast and how right: the engine beside its rivals, against a 40-digit truth.  `toppling bench` runs it."""
