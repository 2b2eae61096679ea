"""The reference of all keys, as a script of the documentation makes it."""

import importlib
import sys
from pathlib import Path

import toppling as tp

sys.path.append(str(Path(tp.__file__).parent / "docs"))
made_keys = importlib.import_module("made_keys")
