"""Make pages of the documentation: `python -m toppling.benchmarks.pages NAME … [--few]`.

A page is a module with a function `main`.  With `--few` it has a tenth of its motions and goes into results/few.
"""

from __future__ import annotations

import sys
import time
from importlib import import_module
from pathlib import Path

import matplotlib as mpl


def main(names: list[str]) -> int:
    """Make the pages of these names, or list all; the exit code."""
    modules = {path.stem: path for path in sorted(Path(__file__).parent.glob("*.py"))}
    pages = [name for name, path in modules.items() if "\ndef main() -> None:" in path.read_text(encoding="utf-8")]
    if not names or not set(names) <= set(pages):
        print(f"pages: {', '.join(pages)}", file=sys.stderr)
        return 2 if names else 0
    mpl.use("Agg")
    for name in names:
        began = time.perf_counter()
        import_module(f".{name}", __package__).main()
        print(f"{name}: {time.perf_counter() - began:.0f} s", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main([name for name in sys.argv[1:] if name != "--few"]))
