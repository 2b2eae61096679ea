"""Studies that hold every pair of features at least once: a covering array of `pairs/features.toml`.

Features that exclude one another are listed with their reasons in `pairs/constraints.toml`.  After a change of either
`python pair_cases.py` keeps the rows that still stand and adds what is missing.
"""

import copy
import csv
import io
import itertools
import json
import math
import random
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

from case import HERE, Case

FOLDER = HERE / "pairs"
SEED = 50
# Rows tried for each that is kept: with more of them rows become a little fewer and the search slower.
TRIES = 12
PERFORMANCE = ("performance", "scenario")
ANALYSES = ("ida", "stripes", "cloud", "performance")
# Columns that an inventory calls otherwise than a block does.
COLUMNS = {"restraint": "anchored", "name": "item"}

Row = dict[str, str]


@cache
def features() -> dict[str, dict[str, dict[str, Any]]]:
    """Return the values of every factor, each with its fragment of a study file."""
    return tomllib.loads((FOLDER / "features.toml").read_text(encoding="utf-8"))


@cache
def constraints() -> list[dict[str, frozenset[str]]]:
    """Return sets of values of two or more factors that no row may have together."""
    tables = tomllib.loads((FOLDER / "constraints.toml").read_text(encoding="utf-8"))["apart"]
    return [
        {factor: _values(factor, values) for factor, values in table.items() if factor != "because"} for table in tables
    ]


def _values(factor: str, values: Sequence[str]) -> frozenset[str]:
    """Return the values, or all others of the factor if the first is ``but``."""
    known = set(features()[factor])
    named = set(values) - {"but"}
    if named - known:
        raise ValueError(f"constraints.toml: {factor}: no such value: {sorted(named - known)}")
    return frozenset(known - named if values[0] == "but" else named)


class Space(NamedTuple):
    """All values as bits of whole numbers.

    names: factor and value of each bit.
    factors: bits of each factor.
    apart: bits that go with none of a value, by value.
    larger: constraints of three factors and more, as bits of each factor.
    """

    names: list[tuple[str, str]]
    factors: dict[str, int]
    apart: list[int]
    larger: list[list[int]]

    def rest(self, domain: int, bit: int) -> int:
        """Return what may still be chosen after a value, 0 if some factor is left without any."""
        factor = self.factors[self.names[bit][0]]
        domain &= ~self.apart[bit] & ~(factor & ~(1 << bit))
        for masks in self.larger:
            free = [mask for mask in masks if domain & self.around(mask) & ~mask]
            if not free:
                return 0
            if len(free) == 1:
                domain &= ~free[0]
        return domain if all(domain & mask for mask in self.factors.values()) else 0

    def around(self, mask: int) -> int:
        """Return all bits of the factor of some values."""
        return self.factors[self.names[mask.bit_length() - 1][0]]


@cache
def space() -> Space:
    """Return features and constraints as bits."""
    names = [(factor, value) for factor, values in features().items() for value in values]
    place = {name: bit for bit, name in enumerate(names)}
    factors = {factor: sum(1 << place[factor, value] for value in values) for factor, values in features().items()}
    apart = [0] * len(names)
    larger = []
    for constraint in constraints():
        masks = [sum(1 << place[factor, value] for value in values) for factor, values in constraint.items()]
        if len(masks) > 2:
            larger.append(masks)
            continue
        for mask, other in itertools.permutations(masks):
            for bit in bits(mask):
                apart[bit] |= other
    return Space(names, factors, apart, larger)


def bits(mask: int) -> Iterator[int]:
    """Yield the places of the bits of a number."""
    while mask:
        low = mask & -mask
        yield low.bit_length() - 1
        mask ^= low


def generate(ran: Iterable[Row]) -> list[Row]:
    """Return rows that hold every pair of values that a row can hold and that none of those that ran to their end has.

    What is not asked of them has the first values of the factors, which are the simplest.
    """
    chance = random.Random(SEED)
    values = space()
    every = (1 << len(values.names)) - 1
    missing = [every & ~values.apart[bit] & ~values.factors[name[0]] for bit, name in enumerate(values.names)]
    for row in ran:
        held = sum(1 << values.names.index(name) for name in row.items())
        for bit in bits(held):
            missing[bit] &= ~held
    rows = []
    while any(missing):
        first = max(range(len(missing)), key=lambda bit: (missing[bit].bit_count(), -bit))
        partners = list(bits(missing[first]))
        seeds = [chance.choice(partners) for _ in range(TRIES)]
        candidates = [_fill(values, missing, (first, second), chance) for second in seeds]
        if not any(candidates):
            # A pair that no row can hold is no longer asked for, after a search that would find any.
            second = seeds[0]
            candidates = [_search(values, (first, second))]
            if candidates == [0]:
                missing[first] &= ~(1 << second)
                missing[second] &= ~(1 << first)
                continue
        best = max(candidates, key=lambda row: sum((missing[bit] & row).bit_count() for bit in bits(row)))
        for bit in bits(best):
            missing[bit] &= ~best
        rows.append(dict(values.names[bit] for bit in bits(best)))
    return rows


def _fill(values: Space, missing: Sequence[int], pair: tuple[int, int], chance: random.Random) -> int:
    """Return a row about a pair, factor by factor with the values that hold most missing pairs; 0 at a dead end."""
    domain, chosen = (1 << len(values.names)) - 1, 0
    for bit in pair:
        domain = values.rest(domain, bit) if domain >> bit & 1 else 0
        chosen |= 1 << bit
    factors = list(values.factors.values())
    chance.shuffle(factors)
    for factor in factors:
        if factor & chosen:
            continue
        best = sorted(bits(domain & factor), key=lambda bit: (-(missing[bit] & chosen).bit_count(), bit))
        for bit in best:
            if rest := values.rest(domain, bit):
                domain, chosen = rest, chosen | 1 << bit
                break
        else:
            return 0
    return chosen


def can_hold(first: tuple[str, str], second: tuple[str, str]) -> bool:
    """Return True if some row can hold two values, each given as its factor and its name."""
    values = space()
    return bool(_search(values, [values.names.index(name) for name in (first, second)]))


def _search(values: Space, pair: Sequence[int]) -> int:
    """Return some row that holds the values, 0 if there is none."""
    domain = (1 << len(values.names)) - 1
    for bit in pair:
        domain = values.rest(domain, bit) if domain >> bit & 1 else 0
    return _complete(values, domain, list(pair)) if domain else 0


def _complete(values: Space, domain: int, chosen: list[int]) -> int:
    held = {values.names[bit][0] for bit in chosen}
    open_factors = [domain & mask for factor, mask in values.factors.items() if factor not in held]
    if not open_factors:
        return domain
    for bit in bits(min(open_factors, key=int.bit_count)):
        rest = values.rest(domain, bit)
        if rest and (row := _complete(values, rest, [*chosen, bit])):
            return row
    return 0


@cache
def rows() -> dict[str, Row]:
    """Return the stored rows by number."""
    with (FOLDER / "rows.csv").open(encoding="utf-8", newline="") as file:
        return {line.pop("row"): line for line in csv.DictReader(file)}


@cache
def outcomes() -> dict[str, Row]:
    """Return how each row ended, by number: what refused it, and the sentence; a row that is not there was not run."""
    with (FOLDER / "outcomes.csv").open(encoding="utf-8", newline="") as file:
        return {line.pop("row"): line for line in csv.DictReader(file)}


def ran() -> dict[str, Row]:
    """Return the stored rows that ran to their end, by number."""
    return {number: row for number, row in rows().items() if number in outcomes() and not outcomes()[number]["code"]}


def write_rows() -> None:
    """Write the stored rows again, without those that hold what is apart, and with rows for pairs that did not run."""
    kept = {
        number: row
        for number, row in rows().items()
        if not any(all(row[factor] in apart[factor] for factor in apart) for apart in constraints())
    }
    last = max(map(int, rows()), default=0)
    missing = generate([row for number, row in ran().items() if number in kept])
    new = {f"{number:04}": row for number, row in enumerate(missing, last + 1)}
    with (FOLDER / "rows.csv").open("w", encoding="utf-8", newline="") as file:
        table = csv.DictWriter(file, ["row", *features()], lineterminator="\n")
        table.writeheader()
        table.writerows({"row": number, **row} for number, row in (kept | new).items())


def cases() -> list[Case]:
    """Return a case for every row."""
    return [case(name, row) for name, row in rows().items()]


def case(name: str, row: Row) -> Case:
    """Return the study of a row, its inputs and its commands; fragments of one value take turns by the row's number."""
    number = int(name) if name.isdecimal() else 0
    study: dict[str, Any] = {"title": f"Pairs {name}"}
    for factor, value in row.items():
        fragment = features()[factor][value]
        if isinstance(fragment, list):
            fragment = fragment[number % len(fragment)]
        _merge(study, copy.deepcopy(fragment))
    im, unit, middle = (study.pop(key) for key in ("im", "unit", "middle"))
    _merge(study, {next(key for key in ANALYSES if key in study): study.pop("analysis", {})})
    levels = study.pop("levels", {"values": ["$0.5", "$1.5", "$6.0"], "unit": "$unit"})
    words = {"im": im, "unit": unit, "levels": levels, "k0": round(2e-3 * middle**2.5, 9)}
    study = _said(study, words, middle)
    commands = [["run", "study.toml", "--out", "out", "--verbose"], *study.pop("also", [])]
    files = _contents(study, row)
    if row["analysis"] == "performance" and row["motions"] == "floors-index":
        del study["performance"]["levels"]
    if row["analysis"] == "performance" and row["motions"] == "floors-file":
        study["motions"]["elastic"] = True
    if "number" in study["motions"] and "generator" not in study["motions"]:
        del study["motions"]["number"]
    if "include" in study:
        files["common.toml"] = toml({"motions": study.pop("motions")})
    files["study.toml"] = toml(study)
    if row["then"] == "compare":
        # The laws differ by what every one of them has: the arm of the shaking, or Housner's geometry.
        arm, shape = ("lever", {"R": "h"}, "R"), ("geometry", {"bilinear": "linear"}, "bilinear")
        laws = [
            {**law, key: swapped.get(law.get(key, ""), other)}
            for law in study["models"]
            for key, swapped, other in [shape if law["law"] == "housner" else arm]
        ]
        files["other.toml"] = toml({**study, "title": "Other", "models": laws})
    inputs = _inputs(im, unit, middle)
    for _ in range(2):
        files.update({key: text for key, text in inputs.items() if _is_named(key, files)})
    return Case(f"pairs/{name}", files, commands)


def _merge(table: dict[str, Any], fragment: Mapping[str, Any]) -> None:
    """Put a fragment into a table, key by key."""
    for key, value in fragment.items():
        if isinstance(value, dict) and isinstance(table.get(key), dict):
            _merge(table[key], value)
        elif isinstance(value, list) and isinstance(table.get(key), list):
            table[key] = [*table[key], *value]
        else:
            table[key] = value


def _said(content: Any, words: Mapping[str, Any], middle: float) -> Any:
    """Return content with what begins with ``$`` said of the row's measure."""
    if isinstance(content, dict):
        return {key: _said(value, words, middle) for key, value in content.items()}
    if isinstance(content, list):
        return [_said(value, words, middle) for value in content]
    if isinstance(content, str) and content.startswith("$"):
        word = content[1:]
        return _said(words[word], words, middle) if word in words else float(f"{float(word) * middle:.6g}")
    return content


def _contents(study: dict[str, Any], row: Row) -> dict[str, str | bytes]:
    """Put the blocks into the study, or into a file, which is returned; the model's own keys go to every law."""
    block, others, alike = study.pop("block"), study.pop("others", []), study.pop("alike", None)
    for model in study["models"]:
        model.update(study.get("model", {}))
    study.pop("model", None)
    blocks = [{"name": "first", **block}]
    if alike:
        blocks.append({**blocks[0], "name": "second", **({"height_m": 1.3} if "height_m" in block else {})})
    blocks += [{"name": f"other {number}", **other} for number, other in enumerate(others, 1)]
    if row["company"] == "file":
        own = {key: block[key] for key in ("e", "delta") if key in block}
        blocks = [{**own, **other} for other in blocks]
    if row["depth"] == "none" and "pair" not in row["components"]:
        for other in blocks:
            other.pop("depth_m", None)
    if row["analysis"] not in PERFORMANCE:
        if "blocks_file" not in study:
            study["blocks"] = blocks
            return {}
        return {"blocks.csv": sheet(blocks)}
    floor = study.get("building", {}).get("floors", [1 if row["motions"].startswith("floors") else 0])[0]
    lines = [{"floor": floor, **{COLUMNS.get(key, key): value for key, value in line.items()}} for line in blocks]
    if row["motions"] == "floors-index":
        lines = [{"direction": "x", **line} for line in lines]
    if "support" in study:
        study["supports"] = [{"name": "base", **study.pop("support")}]
        for line in lines if row["inventory"] == "stands-on" else lines[:1]:
            line["support"] = "base"
    return {"inventory.csv": sheet(lines)}


def sheet(lines: Sequence[Mapping[str, Any]]) -> str:
    """Return a CSV of some lines."""
    text = io.StringIO()
    table = csv.DictWriter(text, list(dict.fromkeys(key for line in lines for key in line)), lineterminator="\n")
    table.writeheader()
    table.writerows({key: "yes" if value is True else value for key, value in line.items()} for line in lines)
    return text.getvalue()


def toml(study: Mapping[str, Any]) -> str:
    """Return a study as text: what is no table first, then tables and lists of tables."""
    lines = [f"{key} = {inline(value)}" for key, value in study.items() if not _is_table(value)]
    for key, value in study.items():
        if _is_table(value):
            head = f"[[{key}]]" if isinstance(value, list) else f"[{key}]"
            for table in value if isinstance(value, list) else [value]:
                lines += ["", head, *(f"{name} = {inline(content)}" for name, content in table.items())]
    return "\n".join([*lines, ""])


def _is_table(value: Any) -> bool:
    return isinstance(value, dict) or (isinstance(value, list) and isinstance(value[0], dict))


def inline(value: Any) -> str:
    """Return a value of TOML on one line."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {inline(content)}" for key, content in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(inline, value)) + "]"
    return json.dumps(value, ensure_ascii=False)


def _is_named(key: str, files: Mapping[str, str | bytes]) -> bool:
    """Return True if some text names a file, or the folder that it is in."""
    folder = key.split("/", maxsplit=1)[0] + ("/*" if "/" in key else "")
    return any(f'"{folder}' in text or f",{folder}," in text for text in files.values() if isinstance(text, str))


def shaking(number: int, index: int, step: float = 0.02) -> float:
    """Return a sample of a plain record, g: three sines in an envelope that ends in quiet."""
    time = index * step
    sines = sum(math.sin((2.0 + 0.7 * number) * (1 + turn) * time + turn * number) / (1 + turn) for turn in range(3))
    return 0.15 * (1 + 0.4 * number) * sines * math.exp(-((time - 2.0) ** 2) / 1.5)


def _inputs(im: str, unit: str, middle: float) -> dict[str, str]:
    """Return every file that a row may name."""
    curve = [(0.1, 5e-2), (0.5, 8e-3), (1.0, 2e-3), (2.0, 3e-4), (6.0, 1e-5)]
    levels = [(f"{factor * middle:.6g}", rate) for factor, rate in curve]
    head = f"{im} ({unit})" if "," not in im else f'"{im} ({unit})"'
    chances = [(level, 1 - math.exp(-50 * rate)) for level, rate in levels]
    measure = f'"{im}"' if "," in im else im
    return {
        "spectrum.csv": "period (s),sa (g)\n" + "".join(f"{p},{a}\n" for p, a in SPECTRUM),
        "selection.csv": f"measure,unit,median,sigma\n{measure},{unit},{middle},0.6\nd5_95,s,4,0.4\n",
        "rates.csv": f"{head},rate (1/yr)\n" + "".join(f"{x},{rate:g}\n" for x, rate in levels),
        "chances.csv": f"{head},probability in 50 yr\n" + "".join(f"{x},{chance:.6g}\n" for x, chance in chances),
        "periods.csv": f"{head},return period (yr)\n" + "".join(f"{x},{1 / rate:.6g}\n" for x, rate in levels),
        "realisations.csv": f"{head},rate (1/yr) weight 0.4,rate (1/yr) weight 0.6\n"
        + "".join(f"{x},{rate:g},{0.5 * rate:g}\n" for x, rate in levels),
        "floors.csv": _table(
            *[(f"{name}/{floor} [g]", number + 2 * floor) for number, name in enumerate("ABC") for floor in (0, 1)]
        ),
        "index.csv": f"level ({unit}),motion,floor,direction,file,column\n"
        + "".join(
            f"{level * middle:g},M{motion},1,{way},histories.csv,M{motion} {way}\n"
            for level in (0.5, 1.5, 6.0)
            for motion in range(3)
            for way in "xy"
        ),
        "histories.csv": _table(
            *[(f"M{motion} {way} (g)", motion + 3 * (way == "y")) for motion in range(3) for way in "xy"]
        ),
        **{f"plain/{number}.csv": _table(("acceleration (g)", number)) for number in range(4)},
        **{
            f"both/R{number}-{way}.csv": _table(("acceleration (g)", number + turn))
            for number in range(4)
            for turn, way in enumerate(("N", "E", "UP"))
        },
        **_hazard_exports(im, middle),
    }


SPECTRUM = [(0.05, 0.6), (0.1, 0.8), (0.5, 1.0), (1.0, 0.6), (2.0, 0.3), (4.0, 0.1)]


@cache
def _table(*columns: tuple[str, int]) -> str:
    """Return a table of records of 6 s, a heading and a number each."""
    head = ",".join(["time" if "[" in columns[0][0] else "time (s)", *(name for name, _ in columns)])
    lines = [
        ",".join([f"{0.02 * index:.2f}", *(f"{shaking(number, index):.6f}" for _, number in columns)])
        for index in range(300)
    ]
    return "\n".join([head, *lines, ""])


def _hazard_exports(im: str, middle: float) -> dict[str, str]:
    """Return hazard curves as OpenQuake, nshmp-haz and the USGS' services write them, of a measure in g."""
    name = {"pga": "PGA", "Sa(1.0)": "SA(1.0)"}.get(im, im)
    levels = [f"{factor * middle:.6g}" for factor in (0.1, 0.4, 1.6, 6.0)]
    usgs = {"pga": "PGA", "Sa(1.0)": "SA1P0"}.get(im, im)
    response = {
        "metadata": {"imt": {"value": usgs, "display": usgs}, "xvalues": list(map(float, levels))},
        "data": [{"component": "Total", "yvalues": [5e-2, 1e-2, 5e-4, 1e-5]}],
    }
    return {
        "openquake.csv": f"#,,,,,,\"kind='mean', investigation_time=50.0, imt='{name}'\"\nlon,lat,depth,"
        + ",".join(f"poe-{level}" for level in levels)
        + "\n10.0,45.0,0.0,9.0E-01,4.0E-01,2.0E-02,5.0E-04\n10.5,45.5,0.0,9.5E-01,5.0E-01,3.0E-02,6.0E-04\n",
        "nshmp.csv": "name,lon,lat,"
        + ",".join(levels)
        + "\nConcord CA,-122.0,37.95,5e-2,1e-2,5e-4,1e-5\nOakland CA,-122.25,37.8,4e-2,9e-3,4e-4,9e-6\n",
        "usgs.json": json.dumps({"status": "success", "date": "2026-01-01", "response": [response]}),
    }


if __name__ == "__main__":
    write_rows()
