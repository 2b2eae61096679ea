"""Damaged study files and inventories: whatever stands in them, a plan is a Study or one sentence.

A mutant is decided by its number alone, so a failure is found again by it.  Run as a command for many of them:
``python tests/support/fuzz_studies.py FIRST NUMBER``.
"""

import os
import random
import re
import resource
import signal
import sys
import tempfile
import time
import warnings
from collections import Counter
from pathlib import Path
from typing import NamedTuple

import jsonschema

import toppling as tp
from toppling.studies import StudyError
from toppling.studies.file import json_schema
from toppling.studies.file.include import read_content
from toppling.studies.file.schema import StudyFile
from toppling.studies.plan import size

EXAMPLES = Path(tp.__file__).parent / "studies" / "examples"
# Bounds of a mutant's plan, s of processor time, and of all, bytes.
MOST_SECONDS = 2.0
MOST_MEMORY = 2**30
# In place of the 5e8 that studies may have: a mutant with a valid number of a million motions is no defect, only slow.
MOST_NUMBERS = 200_000
CHECK = jsonschema.Draft202012Validator(json_schema.study_schema())

NUMBERS = (
    "0", "-0.0", "-1", "1", "2", "3", "1e308", "-1e308", "1e-308", "5e-324", "1e400", "nan", "-nan", "inf", "-inf",
    "1e9", "1e-9", "0.5", "1e15", "999999999999", "1000000000000000", "9223372036854775807", "9223372036854775808",
    "-9223372036854775809", "0x7fffffff", "0o777", "0b11", "1_000_000", "1__0", "007", "1.", ".5", "1e", "+5",
    "9" * 400, "9" * 5000, "1e-400", "0.1e1", "4294967296",
)  # fmt: skip
WORDS = (
    '""', "''", '"x"', '"\\u0000"', '"\\u001b[2J"', '"\\u202e"', '"\\ud800"', '"\\U0010ffff"', '"a\\nb"', '"é"', '"💥"',
    '"../../etc/passwd"', '"/etc/passwd"', '"/dev/zero"', '"/dev/stdin"', '"/proc/self/mem"', '"~/x"', '"."', '".."',
    '"/"', '"**"', '"/**/*"', '"**/**/**"', '"*"', '"[a-"', '"a\\u0000b"', '"' + "x" * 300 + '"',
    '"' + "A/" * 3000 + '"',
    '"' + "x" * 100_000 + '"', '"inventory.csv"', '"study.toml"', '"nan"', '"1e400"', '"g"', '"m/s"', '"pga"', '"PGA"',
    '"Sa(1.0)"', '"Sa()"', '"Sa(nan)"', '"Sa(1e400)"', '"AvgSa(0.2:2.0:1000000000)"', '"AvgSa(0:0:0)"', '"FIV3(1.0)"',
    '"Sa(' + "1" * 3000 + ')"', '"Sa(1.0"', '"scale"', '"pgv_normalised"', '"housner"', '"viscous"', '"discrete"',
    '"overturned"', '"number"', '"{x}"', '"%s%n"', '"${HOME}"', '"[bold]"', '"|"', '"\\\\"', '"""multi\nline"""',
)  # fmt: skip
OTHERS = (
    "true", "false", "[]", "{}", "[[]]", "[{}]", "{ a = 1 }", "[1, 2]", "[1.0, -1.0]", '["x"]', "[1, 'x']", "[nan]",
    "1979-05-27", "07:32:00", "1979-05-27T07:32:00Z", "[" * 50 + "]" * 50, "[" * 3000 + "]" * 3000,
    "{ a = " * 30 + "1" + " }" * 30, "[" + "1, " * 20_000 + "1]", "[0.1, 0.2, 0.3]", '[["a", "b"]]', "[true]",
    '{ values = [1.0], unit = "g" }', '{ kind = "stationary" }', "[[1.0, 2.0], [2.0, 1.0]]",
)  # fmt: skip
LINES = (
    "[building]", 'kind = "flexural-shear"', 'kind = "storeys"', "period_s = 0.5", "storeys = 500", "floors = [0, 1]",
    "floors = [99999999]", "masses_kg = [1e308, 1e-308]", "stiffnesses_n_m = [1e308, 1e308]", "damping = [0.05]",
    "modes = 1000000000", '[[blocks]]\nwidth_m = 0.5\nheight_m = 1.5', "[friction]\nstatic = 0.5", "[measures]",
    '[measures]\nalso = ["Sa(1.0)", "Sa(1.0)"]', '[fit]\nform = "isotonic"', "[fit]\nstate = 0.5", '[fit]\nstate = "x"',
    "[uncertainty]\nsamples = 1000000000000",
    "[uncertainty.inputs]\ne = { distribution = 'uniform', lower = 0, upper = 1 }",
    '[hazard]\nk0 = 1e-4\nk = 2\nunit = "g"', "[hazard]\nk0 = 1e308\nk1 = 1e308\nk2 = -1e308\nunit = 'g'", "[cloud]",
    '[[models]]\nlaw = "viscous"\nzeta = 0.1', '[[stripes.at]]\nlevel = 1', 'records = "../../etc/passwd"',
    'records = ["**/*"]', 'floors_file = "/dev/zero"', 'pulse = "half-sine"', "omega_rad_s = 1e-12", "dt_s = 1e-12",
    "number = 1000000000", "duration_s = 1e12", 'target = "../../etc/passwd"', 'include = ["study.toml"]',
    'include = ["/etc/passwd"]', 'include = ["../" , "/dev/zero"]', '[performance]\ninventory = "inventory.csv"',
    "pieces = 1000000000", "variants = 1000000000", "realisations = 1000000000000", "replicates = 999999", "= 1", "[",
    "]]", "[motions]", "[[motions]]", "[motions.envelope]", "a.b.c.d.e = 1", '"" = 1', '"\\u0000" = 1', "\x00",
    "\x1b[2J", "\u202e = 1", "\ufeff", "k" * 5000 + " = 1", "seed = -1", "seed = 9223372036854775808", "# \x01",
    "x = '''", 'blocks_file = "inventory.csv"', 'blocks_file = "/dev/zero"', 'blocks_file = "study.toml"',
)  # fmt: skip
CELLS = (
    "", "0", "-1", "1e308", "nan", "inf", "1e400", "9" * 400, "999999999", "1000000000", '"', '""', "'", "=1+1", "\x00",
    "é", "\u202e", "x" * 300, "x" * 100_000, "bookcase-5-shelf", "yes", "maybe", "|", "||", "a|b|c", "0.5", "1,5",
    "1.000,5",
    "../../etc/passwd", "loss", "any", "EUR", "𝟙", "٣", "1_0", "0x10", "\r", "\t", ";",
)  # fmt: skip


def bases() -> list[dict[str, str]]:
    """The example studies with the inventory beside them, their motions few and short: what counts is the plan."""
    inventory = (EXAMPLES / "inventory.csv").read_text(encoding="utf-8")
    found = []
    # (the clinic first: what follows is made of it, and of the first other study that has what it needs)
    for path in sorted(EXAMPLES.glob("*.toml"), key=lambda one: (one.stem != "clinic", one.stem == "branches", one)):
        text = re.sub(r"(?m)^dt_s = .*\n", "", path.read_text(encoding="utf-8"))
        text = text.replace(
            "[stripes.select]\nnumber = 40", '[stripes.select]\noutside = "keep"\nfactor = [1e-3, 1e3]\n"number" = 2'
        )
        text = re.sub(r"(?m)^number = \d+", "number = 2\ndt_s = 0.2", text)
        if "[until]" in text:
            text = text.replace("number = 2", "number = 34").replace("[until]", "[until]\nmotions = { least = 32 }")
        text = text.replace("samples = 64", "samples = 2").replace("sobol = 64", "sobol = 8")
        if path.with_suffix(".csv").is_file():  # (inventories with the columns that the clinic's lacks)
            table = path.with_suffix(".csv").read_text(encoding="utf-8")
            found.append({"study.toml": text.replace(f"{path.stem}.csv", "inventory.csv"), "inventory.csv": table})
            continue
        named = re.search(r'(?m)^target = "(\w+_target)\.csv"', text)
        if named is not None:
            target = (EXAMPLES / f"{named[1]}.csv").read_text(encoding="utf-8")
            found.append({"study.toml": text.replace(named[1], "target"), "target.csv": target})
            continue
        if path.stem == "region":
            found.append({"study.toml": text.replace("region_blocks", "blocks"), "blocks.csv": REGION})
            continue
        if path.stem == "own_building":  # (few histories, all in one file)
            table = (EXAMPLES / "own_building_inventory.csv").read_text(encoding="utf-8")
            text = text.replace("own_building_", "").replace('"index.csv"', '"index.csv"\nunit = "g"')
            found.append({"study.toml": text, "inventory.csv": table, "index.csv": INDEX, "r.csv": RECORD})
            continue
        found.append({"study.toml": text, "inventory.csv": inventory})
    # what examples do not have: records, a file of a hazard curve, an included file
    head, tail = (found[0]["study.toml"].find(mark) for mark in ("[motions]", "[building]"))
    records = (
        found[0]["study.toml"][:head] + '[motions]\nrecords = "r.csv"\nunit = "g"\n\n' + found[0]["study.toml"][tail:]
    )
    found.append({**found[0], "study.toml": records, "r.csv": RECORD})
    risk = next(one for one in found if "[hazard]\nlevels" in one["study.toml"] and "[ida]" in one["study.toml"])
    curve = re.sub(r"(?m)^(levels|rates) = \[.*\n|^unit = .*\n", "", risk["study.toml"]) + 'file = "h.csv"\n'
    found.append({"study.toml": curve, "h.csv": HAZARD})
    common = found[0]["study.toml"][head:tail]
    rest = 'include = ["common.toml"]\n' + found[0]["study.toml"].replace(common, "[motions]\nseed = 5\n")
    found.append({**found[0], "study.toml": rest, "common.toml": common})
    # a file of blocks in the place of those of a study
    inside = next(
        one["study.toml"] for one in found if "[[blocks]]" in one["study.toml"] and "[ida]" in one["study.toml"]
    )
    without = re.sub(r"(?ms)^\[\[blocks\]\].*?(?=^\[)", "", inside)
    found.append({"study.toml": f'blocks_file = "blocks.csv"\n{without}', "blocks.csv": BLOCKS})
    return found


INDEX = "level (g),motion,floor,direction,file\n" + "".join(
    f"{level},{motion},{floor},{direction},r.csv\n"
    for level, motion in ((0.1, "A"), (0.1, "B"), (0.4, "C"), (0.4, "D"))
    for floor, direction in ((1, "x"), (3, "x"), (3, "y"))
)
HAZARD = "pgv (m/s),probability in 50 yr\n0.02,0.95\n0.05,0.6\n0.1,0.3\n0.2,0.1\n0.4,0.02\n0.8,0.003\n"
BLOCKS = (
    "name,catalogue,width_m,height_m,cm_height_m,inertia_factor,alpha_rad,R_m\n,bookcase-5-shelf,,,,,,\n"
    "cabinet,,0.5,1.8,,,,\ntop,,0.5,1.8,1.1,1.3,,\nslender,,,,,,0.2,1.5\n"
)
REGION = "name,width_m,height_m\n" + "".join(
    f"shelf {i},{0.3 + 0.01 * i:.2f},{1.2 + 0.13 * (i % 4):.2f}\n" for i in range(9)
)
RECORD = "time (s),acceleration\n" + "".join(f"{0.05 * i:.2f},{0.1 * (i % 7 - 3):.1f}\n" for i in range(60))


class Outcome(NamedTuple):
    """What became of a mutant: a kind ('Study', 'refused', or what is wrong) and the sentence."""

    kind: str
    sentence: str
    seconds: float


def mutant(number: int, whole: list[dict[str, str]]) -> dict[str, bytes]:
    """The files of one mutant: one of them damaged in one to four places, as text and as bytes."""
    random_ = random.Random(number)
    files = dict(random_.choice(whole))
    name = random_.choices(list(files), weights=[6 if one == "study.toml" else 2 for one in files])[0]
    text = files[name]
    for _ in range(random_.choice((1, 1, 1, 2, 3, 4))):
        damage = random_.choice(TOML if name.endswith(".toml") else TABLE)
        text = damage(text, random_)
    data = text.encode("utf-8", "surrogatepass")
    if random_.random() < 0.15:
        data = _bytes(data, random_)
    found = {one: content.encode() for one, content in files.items()}
    found[name] = data
    if random_.random() < 0.01:
        del found[random_.choice(list(found))]
    return found


def _bytes(data: bytes, random_: random.Random) -> bytes:
    """The same as other bytes: flipped, cut, doubled, in another encoding."""
    kind = random_.randrange(5)
    at = random_.randrange(len(data) + 1)
    if kind == 0:
        flipped = bytearray(data or b"x")
        for _ in range(random_.choice((1, 2, 8))):
            flipped[random_.randrange(len(flipped))] ^= 1 << random_.randrange(8)
        return bytes(flipped)
    if kind == 1:
        return data[:at]
    if kind == 2:
        return data + data
    if kind == 3:
        text = data.decode("utf-8", "replace")
        return text.encode(random_.choice(("utf-16", "utf-32", "latin-1", "utf-8-sig", "cp037")), "replace")
    return data[:at] + random_.choice((b"\0", b"\xff", b"\xc3\x28", b"\r", b"\r\n", b"\xe2\x80\xa8")) + data[at:]


def _value(text: str, random_: random.Random) -> str:
    """One value of a key another."""
    found = list(re.finditer(r"(?m)(?<== )[^,\n}{\[\]]+", text))
    if not found:
        return text
    one = random_.choice(found)
    value = random_.choice(random_.choice((NUMBERS, WORDS, OTHERS)))
    return text[: one.start()] + value + text[one.end() :]


def _key(text: str, random_: random.Random) -> str:
    """One key misspelt, in capitals, or another table's."""
    found = list(re.finditer(r"(?m)\b[a-zA-Z_0-9]+(?= =)", text))
    if not found:
        return text
    one, other = random_.choice(found), random_.choice(found)
    name = one.group()
    changed = random_.choice((name[:-1], name.upper(), name + "x", name[::-1], other.group(), "include", "title"))
    return text[: one.start()] + changed + text[one.end() :]


def _line(text: str, random_: random.Random) -> str:
    """One line left out, doubled, moved, or another put in."""
    lines = text.split("\n")
    at = random_.randrange(len(lines))
    kind = random_.randrange(4)
    if kind == 0:
        del lines[at]
    elif kind == 1:
        lines.insert(at, lines[at])
    elif kind == 2:
        lines.insert(random_.randrange(len(lines)), lines.pop(at))
    else:
        lines.insert(at, random_.choice(LINES))
    return "\n".join(lines)


def _heading(text: str, random_: random.Random) -> str:
    """One heading of another kind of table, or of another table."""
    found = list(re.finditer(r"(?m)^\[+[a-z_.]+\]+$", text))
    if not found:
        return text
    one, other = random_.choice(found), random_.choice(found)
    name = one.group().strip("[]")
    changed = random_.choice((f"[{name}]", f"[[{name}]]", other.group(), f"[{name}.x]", f"[{name[:-1]}]", ""))
    return text[: one.start()] + changed + text[one.end() :]


def _text(text: str, random_: random.Random) -> str:
    """A stretch of characters cut out or doubled."""
    at, length = random_.randrange(len(text) + 1), random_.choice((1, 3, 20, 200))
    return text[:at] + random_.choice(("", 2 * text[at : at + length], "\x00", "[[", "}", '"')) + text[at + length :]


def _cell(text: str, random_: random.Random) -> str:
    """One cell of a table another."""
    lines = text.split("\n")
    at = random_.randrange(len(lines))
    cells = lines[at].split(",")
    cells[random_.randrange(len(cells))] = random_.choice(CELLS)
    lines[at] = ",".join(cells)
    return "\n".join(lines)


TOML = (_value, _value, _value, _value, _key, _line, _line, _heading, _text)
TABLE = (_cell, _cell, _cell, _line, _text)


def outcome(files: dict[str, bytes], folder: Path) -> Outcome:
    """Plan a mutant in `folder`, which holds nothing else."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in os.listdir(folder):
        if name not in files:
            (folder / name).unlink()
    for name, data in files.items():
        (folder / name).write_bytes(data)
    path = folder / "study.toml"
    start = time.process_time()
    try:
        with warnings.catch_warnings(action="error", category=RuntimeWarning):
            tp.Study.from_toml(path)
    except StudyError as error:
        kind, sentence = "refused", str(error)
    except Exception as error:
        kind, sentence = f"escaped: {type(error).__name__}", str(error)[:300]
    else:
        kind, sentence = "Study", ""
    seconds = time.process_time() - start
    if kind == "refused":
        named = str(folder) in sentence or sentence.startswith("/")
        if not (sentence.isprintable() and len(sentence) < 400 and named):
            kind = "no sentence"
    elif kind == "Study":
        content = read_content(path, StudyFile).content
        wrong = [f"{one.json_path}: {one.message[:100]}" for one in CHECK.iter_errors(content)]
        if wrong:
            kind, sentence = "not of the schema", "; ".join(wrong)
    if seconds > MOST_SECONDS and kind in {"refused", "Study"}:
        kind, sentence = "slow", f"{seconds:.1f} s: {sentence}"
    left = sorted(str(one.relative_to(folder)) for one in folder.rglob("*"))
    if left != sorted(files):
        kind, sentence = "wrote files", ", ".join(left)
    return Outcome(kind, sentence, seconds)


def ready(folder: Path) -> None:
    """Plan what is not damaged: compiled code is made or loaded now, and in no mutant's time."""
    for files in bases():
        outcome({name: text.encode() for name, text in files.items()}, folder)


def failures(first: int, number: int, folder: Path) -> tuple[Counter[str], list[str]]:
    """Plan mutants `first` … `first + number - 1`: how many of each kind, and what is wrong with those that are."""
    whole = bases()
    kinds: Counter[str] = Counter()
    wrong = []
    bound, size.MOST_NUMBERS = size.MOST_NUMBERS, MOST_NUMBERS
    try:
        ready(folder / "mutant")
        for i in range(first, first + number):
            found = outcome(mutant(i, whole), folder / "mutant")
            kinds[found.kind] += 1
            if found.kind not in {"Study", "refused"}:
                wrong.append(f"{i}: {found.kind}: {found.sentence}")
    finally:
        size.MOST_NUMBERS = bound
    return kinds, wrong


def main(first: int, number: int) -> int:
    """As a command: bounded memory, a plan that hangs is ended."""

    def hangs(*_: object) -> None:
        raise TimeoutError("a plan hangs")

    signal.signal(signal.SIGALRM, hangs)
    own = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    start = time.monotonic()
    wrong: list[str] = []
    kinds: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        for at in range(first, first + number, 1000):
            signal.alarm(600)
            some, bad = failures(at, min(1000, first + number - at), Path(folder))
            kinds += some
            wrong += bad
            print("\n".join([*bad, f"{at + 1000 - first:,} mutants, {time.monotonic() - start:.0f} s"]), flush=True)
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - own
    print(f"{number} mutants from {first} in {time.monotonic() - start:.0f} s: {dict(kinds)}, {grown / 1024:.0f} MiB")
    return 1 if wrong or grown * 1024 > MOST_MEMORY else 0


if __name__ == "__main__":
    os.environ.setdefault("COLUMNS", "100")
    sys.exit(main(*(int(one) for one in sys.argv[1:3])))
