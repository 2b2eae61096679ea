"""The rooms of the package: docs/architecture.md's tables and docs/architecture.svg, both made from the code.

A room is a folder of one of the five packages that holds code, or a module that lies directly in a package.  The text
of a room is its docstring; its floor is one more than the highest floor among the rooms that it imports from.
`make drawing` writes both; tests/test_architecture.py compares them with the code.
"""

from __future__ import annotations

import ast
import re
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import escape

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
PACKAGES = ("models", "motions", "fragility", "benchmarks", "studies")
BELOW = tuple(sorted(one.stem for one in ROOT.glob("*.py") if one.stem not in ("__init__", "__main__")))
"""Modules of the root: every room may use them, and they use no room."""
BEGIN, END = "<!-- rooms: begin -->\n", "<!-- rooms: end -->\n"
WIDTH, LANE, GAP, PAD = 720, 44, 34, 12
"""Widths in px: the drawing, the margins for arrows around packages, the space between packages and inside them."""
COLOURS = {
    "models": "#dbe9f6",
    "motions": "#e3f1de",
    "fragility": "#fdebd3",
    "benchmarks": "#ececec",
    "studies": "#eadff2",
    "below": "#f5f5f5",
}

Place = tuple[str, ...]
"""The path of a module or folder inside the repository, without `.py`."""
Uses = dict[str, set[str]]
"""The rooms that each room imports from."""


# The imports


def modules(root: Path = ROOT) -> dict[Place, Path]:
    """Return every module of the five packages, the `__init__` of rooms and packages included."""
    files = (path for package in PACKAGES for path in sorted((root / package).rglob("*.py")))
    return {path.relative_to(root).with_suffix("").parts: path for path in files}


def imported(path: Path, root: Path = ROOT) -> set[tuple[Place, str]]:
    """Return the modules that a file imports, each with the name taken: relative imports, wherever they stand.

    A module, a folder or a package that is itself the name taken has an empty name.
    """
    found: set[tuple[Place, str]] = set()
    folder = path.relative_to(root).parts[:-1]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level:
            inside = folder[: len(folder) + 1 - node.level]
            base = (*inside, *(node.module.split(".") if node.module else ()))
            for one in node.names:
                whole = root.joinpath(*base, one.name)
                is_place = not base or whole.with_suffix(".py").is_file() or whole.is_dir()
                found.add(((*base, one.name), "") if is_place else (base, one.name))
    return found


def room_of(place: Place, root: Path = ROOT) -> str:
    """Return the room of a module or folder: its folder, or the module itself where it lies directly in a package."""
    if place[-1] == "__init__":
        place = place[:-1]
    inside_room = len(place) > 2 and not root.joinpath(*place).is_dir()
    return "/".join(place[:-1] if inside_room else place)


def module_uses(root: Path = ROOT) -> dict[Place, set[str]]:
    """Return the rooms and root modules that each module imports from, but for those of the packages' faces.

    A name that is taken from the face of a package counts as taken from the room that the face takes it from; a package
    that is imported as a whole counts as all rooms of its face.
    """
    files = modules(root)
    faces = {
        package: {name: room_of(place, root) for place, name in imported(files[(package, "__init__")], root)}
        for package in PACKAGES
        if (package, "__init__") in files
    }

    def rooms(place: Place, name: str) -> set[str]:
        face = faces.get(place[0], {}) if len(place) == 1 else {}
        return {face[name]} if name in face else set(face.values()) if face else {room_of(place, root)}

    return {
        user: {room for place, name in imported(path, root) for room in rooms(place, name)} - {room_of(user, root)}
        for user, path in files.items()
        if len(user) > 2 or user[-1] != "__init__"
    }


def uses(root: Path = ROOT) -> Uses:
    """Return the rooms and root modules that each room imports from."""
    found: Uses = {}
    for module, used in module_uses(root).items():
        found.setdefault(room_of(module, root), set()).update(used)
    return found


def floors(used_by: Uses) -> dict[str, int]:
    """Return the floor of each room: 1 + the highest floor among the rooms it uses; root modules stand on floor 0.

    Raises ValueError, naming the rooms, where rooms use each other in a circle.
    """
    found: dict[str, int] = {}

    def floor(room: str, users: tuple[str, ...]) -> int:
        if room in users:
            raise ValueError("rooms in a circle: " + " → ".join((*users[users.index(room) :], room)))
        if room not in used_by:
            return 0
        if room not in found:
            found[room] = 1 + max((floor(one, (*users, room)) for one in used_by[room]), default=0)
        return found[room]

    for room in used_by:
        floor(room, ())
    return found


def package_arrows(used_by: Uses) -> set[tuple[str, str]]:
    """Return (user, used) between packages, and from packages to the root modules."""
    pairs = {(user.split("/")[0], used.split("/")[0]) for user, each in used_by.items() for used in each}
    return {(user, used) for user, used in pairs if user != used}


# The rooms


@dataclass(frozen=True)
class Room:
    """A folder of code, or a module that lies directly in a package."""

    package: str
    name: str  # the path inside the package: "exchange/nrml", "block.py"
    floor: int
    text: str  # the first paragraph of the folder's docstring, or the first line of the module's
    modules: tuple[str, ...]  # none for a module


def docstring(path: Path) -> str:
    """Return the first paragraph of a file's docstring, in one line."""
    text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    return " ".join(text.split("\n\n")[0].split())


def first_line(path: Path) -> str:
    """Return the first line of a file's docstring; where a sentence goes on in the next, the first paragraph."""
    text = (ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "").split("\n")[0]
    return " ".join(text.split()) if text.endswith(".") else docstring(path)


def rooms_of(used_by: Uses, root: Path = ROOT) -> list[Room]:
    """Return all rooms, package by package, those of low floors first."""
    found = []
    for place, floor in floors(used_by).items():
        package, _, name = place.partition("/")
        path = root / place
        if path.is_dir():
            inside = tuple(sorted(one.stem for one in path.glob("*.py") if one.stem != "__init__"))
            found.append(Room(package, name, floor, docstring(path / "__init__.py"), inside))
        else:
            found.append(Room(package, f"{name}.py", floor, first_line(path.with_suffix(".py")), ()))
    return sorted(found, key=lambda one: (PACKAGES.index(one.package), one.floor, one.name))


# The tables


def cell(text: str) -> str:
    """Return the text as a cell of a Markdown table."""
    return text.replace("|", "\\|").replace("*", "\\*")


def tables(rooms: list[Room], root: Path = ROOT) -> str:
    """Return a section with a table for each package, and one for the modules of the root."""
    parts = ["## `toppling`\n\nThe modules of the root lie below all rooms and import only each other.\n"]
    rows = "".join(f"| `{name}` | {cell(first_line(root / f'{name}.py'))} |\n" for name in BELOW)
    parts.append(f"| module | what it holds |\n|---|---|\n{rows}")
    for package in PACKAGES:
        parts.append(f"## `{package}`\n\n{docstring(root / package / '__init__.py')}\n")
        rows = "".join(
            f"| {one.floor} | `{one.name}{'/' if one.modules else ''}` | {cell(one.text)} | "
            f"{', '.join(f'`{name}`' for name in one.modules)} |\n"
            for one in rooms
            if one.package == package
        )
        parts.append(f"| floor | room | what it holds | modules |\n|---|---|---|---|\n{rows}")
    return "\n".join(parts)


def page(text: str, rooms: list[Room], root: Path = ROOT) -> str:
    """Return the architecture page with its tables made anew."""
    before, rest = text.split(BEGIN)
    return before + BEGIN + "\n" + tables(rooms, root) + "\n" + END + rest.split(END)[1]


# The drawing


def width_of(text: str, size: float) -> float:
    """Return the width of a text in px, estimated for the widest of the fonts that stand in for Helvetica."""
    narrow = sum(letter in "iljtfrI.,:;'|()/ " for letter in text)
    return size * (0.37 * narrow + 0.635 * (len(text) - narrow))


def wrapped(text: str, width: float, size: float) -> list[str]:
    """Return the text in lines that fit the width."""
    lines: list[str] = []
    for word in text.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and width_of(longer, size) <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    return lines


def few_words(room: Room, width: float, size: float, most: int = 3) -> list[str]:
    """Return the first words of a room's text, in at most so many lines.

    The first sentence, where two lines hold it; otherwise what stands before its colon, or, where that only repeats the
    room's name, what stands after; and of this as many parts as fit.
    """
    text = re.split(r"(?<=[a-z`0-9)])\.(?:\s|$)", room.text)[0].replace("`", "")
    head, _, tail = text.partition(": ")
    name = {word for part in re.split(r"[/_.]", room.name) for word in (part, f"{part}s", part.rstrip("s"))}
    repeats = set(re.findall(r"\w+", head.lower())) <= name | {"the", "a", "toppling"}
    if tail and (repeats or len(wrapped(text, width, size)) > 2):
        text = tail[0].upper() + tail[1:] if repeats else head
    while len(wrapped(text, width, size)) > most:
        shorter = re.sub(r"(, (?!.*, )| and (?!.* and )|; ).*$", "", text).rstrip(",")
        if shorter == text:
            return [*wrapped(text, width, size)[: most - 1], wrapped(text, width, size)[most - 1].rstrip(",") + " …"]
        text = shorter
    return wrapped(text, width, size)


def band(rooms: list[Room], x: float, y: float, width: float, across: int) -> tuple[list[str], float]:
    """Return the boxes of the rooms of one floor, in lines of at most `across`, and their height."""
    parts, start, between = [], y, 7.0
    lines = -(-len(rooms) // across)
    while rooms:
        count = -(-len(rooms) // lines)
        row, rooms, lines = rooms[:count], rooms[count:], lines - 1
        each = (width - between * (count - 1)) / count
        words = [few_words(one, each - 16, 12.5, 3 if each > 150 else 4) for one in row]
        height = 28.0 + 15.0 * max(map(len, words))
        for i, (one, text) in enumerate(zip(row, words, strict=True)):
            left = x + i * (each + between)
            name = f"{one.name}/" if one.modules else one.name
            parts.append(
                f'<rect x="{left:g}" y="{y:g}" width="{each:g}" height="{height:g}" rx="5" fill="white" '
                f'stroke="#999" stroke-width="0.8"/>\n'
                f'<text x="{left + 8:g}" y="{y + 18:g}" font-weight="bold" font-size="14">{escape(name)}</text>'
            )
            parts += [
                f'<text x="{left + 8:g}" y="{y + 34 + 15 * k:g}" font-size="12.5" fill="#333">{escape(line)}</text>'
                for k, line in enumerate(text)
            ]
        y += height + between
    return parts, y - between - start


def box(package: str, rooms: list[Room], x: float, y: float, width: float) -> tuple[str, float]:
    """Return one package with its rooms, the highest floor on top, and its height."""
    parts = [f'<text x="{x + PAD:g}" y="{y + 24:g}" font-weight="bold" font-size="17">{package}</text>']
    at = y + 36
    across = 3 if width > WIDTH / 2 else 2
    for floor in sorted({one.floor for one in rooms}, reverse=True):
        each, height = band([one for one in rooms if one.floor == floor], x + 32, at, width - 32 - PAD, across)
        parts.append(
            f'<text x="{x + 20:g}" y="{at + 17:g}" font-size="12" fill="#555" text-anchor="middle">{floor}</text>'
        )
        parts += each
        at += height + 9
    height = at + 3 - y
    frame = (
        f'<rect x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" rx="8" fill="{COLOURS[package]}" '
        f'stroke="#777"/>'
    )
    return frame + "\n" + "\n".join(parts), height


def svg(rooms: list[Room], arrows: set[tuple[str, str]]) -> str:
    """Return the drawing: packages with their rooms by floor, and an arrow from each package to each one it uses."""
    column = WIDTH - 2.0 * LANE
    half = (column - GAP) / 2
    parts, top, height, middle = [], {}, {}, {}
    caption = (
        "A number is a floor: rooms use only rooms of lower floors. A name with / is a folder.",
        "An arrow runs from a package to one that it uses.",
    )
    parts += [
        f'<text x="{LANE}" y="{18 + 17 * i}" font-size="12.5" fill="#333">{line}</text>'
        for i, line in enumerate(caption)
    ]
    y = 48.0
    for row in (("studies",), ("benchmarks",), ("fragility",), ("models", "motions")):
        each_width = column if len(row) == 1 else half
        tallest = 0.0
        for i, package in enumerate(row):
            x = LANE + i * (half + GAP)
            text, high = box(package, [one for one in rooms if one.package == package], x, y, each_width)
            parts.append(text)
            top[package], height[package], middle[package] = y, high, x + each_width / 2
            tallest = max(tallest, high)
        y += tallest + GAP
    lines = []

    def straight(user: str, used: str, x: float) -> None:
        lines.append(_path(f"M{x:g},{top[user] + height[user]:g} V{top[used] - 2:g}"))

    def around(user: str, used: str, side: int, out: float, at: float) -> None:
        edge = LANE if side < 0 else WIDTH - LANE
        start = top[user] + height[user] * at
        end = top[used] + 6 + out
        lines.append(_path(f"M{edge},{start:g} H{edge + side * out:g} V{end:g} H{edge + side * 2:g}"))

    drawn = {
        ("studies", "benchmarks"): lambda: straight("studies", "benchmarks", WIDTH / 2),
        ("benchmarks", "fragility"): lambda: straight("benchmarks", "fragility", WIDTH / 2),
        ("fragility", "models"): lambda: straight("fragility", "models", middle["models"]),
        ("fragility", "motions"): lambda: straight("fragility", "motions", middle["motions"]),
        ("studies", "fragility"): lambda: around("studies", "fragility", -1, 36, 0.5),
        ("studies", "models"): lambda: around("studies", "models", -1, 24, 0.55),
        ("benchmarks", "models"): lambda: around("benchmarks", "models", -1, 12, 0.5),
        ("studies", "motions"): lambda: around("studies", "motions", 1, 24, 0.5),
        ("benchmarks", "motions"): lambda: around("benchmarks", "motions", 1, 12, 0.5),
    }
    between = {(user, used) for user, used in arrows if used not in BELOW}
    if between - set(drawn):
        raise ValueError(
            f"no place is known for the arrows {sorted(between - set(drawn))}: add them to docs/drawing.py"
        )
    for pair in sorted(between):
        drawn[pair]()
    end = y + 62
    parts.append(
        f'<rect x="{LANE}" y="{y:g}" width="{column:g}" height="50" rx="8" fill="{COLOURS["below"]}" stroke="#777"/>\n'
        f'<text x="{LANE + PAD}" y="{y + 21:g}" font-weight="bold" font-size="14">'
        f"{', '.join(f'{name}.py' for name in BELOW)}</text>\n"
        f'<text x="{LANE + PAD}" y="{y + 39:g}" font-size="12.5" fill="#333">'
        f"modules of the root, below all rooms</text>"
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {end:g}" '
        f'font-family="Helvetica, Arial, sans-serif" role="img">\n'
        f"<title>Packages of toppling, their rooms by floor, and who uses whom</title>\n"
        f'<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="8" markerHeight="8" orient="auto">'
        f'<path d="M0,0 L8,4 L0,8 z" fill="#444"/></marker></defs>\n'
        f'<rect width="{WIDTH}" height="{end:g}" fill="white"/>\n' + "\n".join(parts + lines) + "\n</svg>\n"
    )


def _path(d: str) -> str:
    return f'<path d="{d}" fill="none" stroke="#444" stroke-width="1.6" marker-end="url(#tip)"/>'


def main(folder: Path = HERE) -> None:
    """Write the tables and the drawing."""
    used_by = uses()
    rooms = rooms_of(used_by)
    path = folder / "architecture.md"
    path.write_text(page(path.read_text(encoding="utf-8"), rooms), encoding="utf-8")
    (folder / "architecture.svg").write_text(svg(rooms, package_arrows(used_by)), encoding="utf-8")


if __name__ == "__main__":
    main()
