"""The JSON schema of study files and the reference of all keys, as the scripts of the documentation make them."""

import importlib
import sys
from pathlib import Path

import toppling as tp

sys.path.append(str(Path(tp.__file__).parent / "docs"))
made_keys, made_schema = (importlib.import_module(name) for name in ("made_keys", "made_schema"))
