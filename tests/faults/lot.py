"""The lot of the faults: lines of three packages, drawn with a seed; at commit 0e788eb it prints the faults' places."""

import random
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SEED = 50
SHARES = {"motions": 15, "fragility": 22, "studies": 23}


def main() -> None:
    """Print as many places as a package has faults; every line has the same chance."""
    draw = random.Random(SEED)
    for package, number in SHARES.items():
        lines = [
            (path.relative_to(ROOT), line)
            for path in sorted((ROOT / package).rglob("*.py"))
            for line, _ in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1)
        ]
        for path, line in draw.sample(lines, number):
            print(f"{path}:{line}")


if __name__ == "__main__":
    main()
