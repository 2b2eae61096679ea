"""docs/architecture.svg: packages, the ideas inside them, and arrows from the imports as they are.

Ideas and what belongs to them stand in the tables of docs/architecture.md; `make drawing` draws, a test holds both to
the code.
"""

from __future__ import annotations

import ast
import re
import sys
from pathlib import Path
from xml.sax.saxutils import escape

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
PACKAGES = ("models", "motions", "fragility", "benchmarks", "studies")
BELOW = tuple(sorted(one.stem for one in ROOT.glob("*.py") if one.stem not in ("__init__", "__main__")))
"""Modules of the root, below everything (but for the door of the command)."""
WIDTH, LANE, PAD, LINE, CHAR = 720, 50, 12, 17, 6.1
COLOURS = {
    "models": "#dbe9f6",
    "motions": "#e3f1de",
    "fragility": "#fdebd3",
    "benchmarks": "#ececec",
    "studies": "#eadff2",
    "below": "#f5f5f5",
}

Ideas = dict[str, dict[str, list[str]]]


def ideas(text: str) -> Ideas:
    """Package → idea → modules, in the order of the tables: an idea knows only those above it."""
    found: Ideas = {}
    for part in re.split(r"^## ", text, flags=re.MULTILINE)[1:]:
        name = part.split("\n", 1)[0].strip().strip("`")
        if name in PACKAGES:
            rows = re.findall(r"^\| \*\*(.+?)\*\* \|.*?\| (.+?) \|$", part, flags=re.MULTILINE)
            found[name] = {idea: re.findall(r"`(\w+)`", modules) for idea, modules in rows}
    return found


def modules(root: Path = ROOT) -> dict[str, list[str]]:
    """Every module of each package but its face."""
    return {one: sorted(p.stem for p in (root / one).glob("*.py") if p.stem != "__init__") for one in PACKAGES}


def imports(root: Path = ROOT) -> dict[str, set[str]]:
    """What each module imports: `package.module`, `package` where it takes names from its face, `units`, `checks`."""
    found: dict[str, set[str]] = {}
    for package, names in modules(root).items():
        for name in names:
            targets: set[str] = set()
            for node in ast.walk(ast.parse((root / package / f"{name}.py").read_text(encoding="utf-8"))):
                if isinstance(node, ast.ImportFrom) and node.level:
                    targets |= _targets(node, package, root)
            found[f"{package}.{name}"] = targets
    return found


def _targets(node: ast.ImportFrom, package: str, root: Path) -> set[str]:
    parts = [*([package] if node.level == 1 else []), *(node.module.split(".") if node.module else [])]
    if len(parts) != 1:
        return {".".join(parts[:2])} if parts else {one.name for one in node.names}
    if parts[0] in BELOW:
        return {parts[0]}
    # names of the package's face, or modules of it
    return {
        f"{parts[0]}.{one.name}" if (root / parts[0] / f"{one.name}.py").is_file() else parts[0] for one in node.names
    }


def package_arrows(root: Path = ROOT) -> set[tuple[str, str]]:
    """(user, used) between packages, and to the modules below them."""
    pairs = {(user.split(".")[0], used.split(".")[0]) for user, targets in imports(root).items() for used in targets}
    return {(a, b) for a, b in pairs if a != b}


def idea_arrows(table: Ideas, root: Path = ROOT) -> set[tuple[str, str, str]]:
    """(package, user, used) between the ideas of a package."""
    of = {f"{p}.{m}": (p, idea) for p, each in table.items() for idea, names in each.items() for m in names}
    return {
        (of[user][0], of[user][1], of[used][1])
        for user, targets in imports(root).items()
        for used in targets
        if user in of and used in of and of[user][0] == of[used][0] and of[user][1] != of[used][1]
    }


def wrapped(names: list[str], characters: int) -> list[str]:
    """Names in lines."""
    lines, line = [], ""
    for name in names:
        longer = f"{line}, {name}" if line else name
        if line and len(longer) > characters:
            lines.append(line + ",")
            line = name
        else:
            line = longer
    return [*lines, line]


def box(package: str, each: dict[str, list[str]], x: float, y: float, width: float) -> tuple[str, float]:
    """One package with its ideas, and its height."""
    parts, at = [], y + PAD + LINE
    parts.append(f'<text x="{x + PAD}" y="{at}" font-weight="bold" font-size="16">{package}</text>')
    at += 8
    for idea, names in each.items():
        at += LINE
        parts.append(f'<text x="{x + PAD}" y="{at}" font-weight="bold" font-size="12">{escape(idea)}</text>')
        for line in wrapped(names, int((width - 2 * PAD - 8) / CHAR)):
            at += LINE - 2
            parts.append(f'<text x="{x + PAD + 8}" y="{at}" font-size="11.5" fill="#333">{escape(line)}</text>')
        at += 3
    height = at + PAD - y
    frame = (
        f'<rect x="{x}" y="{y}" width="{width}" height="{height:g}" rx="8" fill="{COLOURS[package]}" stroke="#777"/>'
    )
    return frame + "\n" + "\n".join(parts), height


def svg(table: Ideas, root: Path = ROOT) -> str:
    """The drawing: who uses whom, an arrow from user to used."""
    half, gap, lane = (WIDTH - 3 * LANE) / 2, 40, LANE
    column = WIDTH - 2 * lane
    parts, top, height, middle = [], {}, {}, {}
    y = 10.0
    for row in (("studies",), ("benchmarks",), ("fragility",), ("models", "motions")):
        each_width = column if len(row) == 1 else half
        tallest = 0.0
        for i, package in enumerate(row):
            x = lane + i * (half + LANE)
            text, high = box(package, table[package], x, y, each_width)
            parts.append(text)
            top[package], height[package], middle[package] = y, high, x + each_width / 2
            tallest = max(tallest, high)
        y += tallest + gap
    arrows = package_arrows(root)
    lines = []

    def straight(user: str, used: str, x: float) -> None:
        lines.append(_path(f"M{x:g},{top[user] + height[user]:g} V{top[used] - 3:g}"))

    def around(user: str, used: str, side: int, out: float, at: float) -> None:
        edge = lane if side < 0 else WIDTH - lane
        start = top[user] + height[user] * at
        end = top[used] + 22 + out / 2
        lines.append(_path(f"M{edge},{start:g} H{edge + side * out:g} V{end:g} H{edge + side * 3:g}"))

    drawn = {
        ("studies", "benchmarks"): lambda: straight("studies", "benchmarks", WIDTH / 2),
        ("benchmarks", "fragility"): lambda: straight("benchmarks", "fragility", WIDTH / 2),
        ("fragility", "models"): lambda: straight("fragility", "models", middle["models"]),
        ("fragility", "motions"): lambda: straight("fragility", "motions", middle["motions"]),
        ("studies", "fragility"): lambda: around("studies", "fragility", -1, 40, 0.4),
        ("studies", "models"): lambda: around("studies", "models", -1, 28, 0.5),
        ("benchmarks", "models"): lambda: around("benchmarks", "models", -1, 16, 0.5),
        ("studies", "motions"): lambda: around("studies", "motions", 1, 28, 0.5),
        ("benchmarks", "motions"): lambda: around("benchmarks", "motions", 1, 16, 0.5),
    }
    between = {(a, b) for a, b in arrows if b not in BELOW}
    if between - set(drawn):
        raise ValueError(
            f"no place is known for the arrows {sorted(between - set(drawn))}: add them to docs/drawing.py"
        )
    for pair in sorted(between):
        drawn[pair]()
    parts.append(
        f'<rect x="{lane}" y="{y - 20:g}" width="{column}" height="40" rx="8" fill="{COLOURS["below"]}" '
        f'stroke="#777"/>\n<text x="{lane + PAD}" y="{y + 5:g}" font-size="12">'
        f'<tspan font-weight="bold" font-size="16">{", ".join(BELOW)}</tspan>'
        f'<tspan dx="12">below everything</tspan></text>'
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {y + 32:g}" '
        f'font-family="Helvetica, Arial, sans-serif" role="img">\n'
        f"<title>Packages of toppling and who uses whom</title>\n"
        f'<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="8" markerHeight="8" orient="auto">'
        f'<path d="M0,0 L8,4 L0,8 z" fill="#444"/></marker></defs>\n'
        f'<rect width="{WIDTH}" height="{y + 32:g}" fill="white"/>\n' + "\n".join(parts + lines) + "\n</svg>\n"
    )


def _path(d: str) -> str:
    return f'<path d="{d}" fill="none" stroke="#444" stroke-width="1.6" marker-end="url(#tip)"/>'


def main(path: Path = HERE / "architecture.svg") -> None:
    """Draw."""
    table = ideas((HERE / "architecture.md").read_text(encoding="utf-8"))
    path.write_text(svg(table), encoding="utf-8")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
