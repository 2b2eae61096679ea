"""Cases of the command: every command with every option, and wrong uses of each."""

from __future__ import annotations

import math

from case import Case

BLOCKS = """
[[blocks]]
name = "narrow"
width_m = 0.35
height_m = 1.6

[[blocks]]
name = "wide"
width_m = 0.6
height_m = 1.6
"""
MODELS = """
[[models]]
law = "housner"
e = 0.9

[[models]]
law = "energy-consistent"
"""
MOTIONS = """
[motions]
generator = "clough-penzien"
number = 4
seed = 1
duration_s = 4
dt_s = 0.02
"""
IDA = """
[ida]
im = "pga"
levels = { from = 0.1, to = 1.2, number = 6, spacing = "log", unit = "g" }
"""
HAZARD = """
[hazard]
k0 = 1e-3
k = 2.5
unit = "g"
"""
CURVES = f'title = "Two cabinets"\n{BLOCKS}{MODELS}{MOTIONS}{IDA}'
MODELLING = "\n[fit]\nmodelling_dispersion = 0.3\n"
BUILDING = f"""
title = "A room"

[report]
client = "A client"

[[models]]
law = "energy-consistent"
{MOTIONS}
[building]
kind = "flexural-shear"
period_s = 0.4
storeys = 2
floors = [0, 2]

[performance]
inventory = "inventory.csv"
im = "pga"
levels = {{ from = 0.1, to = 1.2, number = 5, spacing = "log", unit = "g" }}
budget = 300
{HAZARD}"""
INVENTORY = """item,catalogue,width_m,height_m,floor,count,value,currency,anchoring_cost
bookcase,bookcase-5-shelf,,,0,2,400,EUR,60
plinth,,0.3,1.2,2,1,900,EUR,150
"""
RECORD = "time_s,acceleration_g\n" + "".join(
    f"{0.02 * step:.2f},{0.5 * math.sin(0.25 * step) * math.exp(-(((step - 60) / 30) ** 2)):.6f}\n"
    for step in range(151)
)
OTHER_RECORD = "time_s,acceleration_g\n" + "".join(
    f"{0.01 * step:.2f},{0.4 * math.sin(0.1 * step) * math.exp(-(((step - 100) / 50) ** 2)):.6f}\n"
    for step in range(301)
)
TARGET = "period (s),sa (g)\n0.05,0.4\n0.2,0.9\n0.5,0.8\n1.0,0.4\n3.0,0.1\n"
TOO_FEW = f"""
title = "Too few motions"
blocks_file = "blocks.csv"

[[models]]
law = "energy-consistent"
e = 0.9
{MOTIONS.replace("number = 4", "number = 64")}
[ida]
im = "pga"
levels = "pooled"

[until]
median = 0.25
motions = {{ least = 64, most = 64 }}
runs_per_motion = 1
"""
EDIT = """import netCDF4

with netCDF4.Dataset("out/results.nc", "a") as results:
    results["overturned"][:] = 1
"""
CUT = """from pathlib import Path

path = Path("out/results.nc")
path.write_bytes(path.read_bytes()[:2000])
"""
LONG = (
    CURVES.replace("number = 4", "number = 400")
    .replace("duration_s = 4", "duration_s = 20")
    .replace("number = 6", "number = 24")
)

COMMANDS = ("run", "status", "new", "app", "simulate", "motions", "catalogue", "export", "report", "compare")
SIZES = ("--width", "0.4m", "--height", "180cm")
CABINET = ("simulate", *SIZES)
RICKER = ("--period", "0.8s", "--pga", "0.4g")


def cases() -> list[Case]:
    """Return all cases of the command."""
    return [*_help(), *_starters(), *_runs(), *_reads(), *_simulations(), *_motions(), *_wrong(), *_processes()]


def _help() -> list[Case]:
    """Return help of every command, and what needs no files."""
    shown = [[name, "--help"] for name in (*COMMANDS, "schema")]
    return [
        Case("commands/help", {}, [["--help"], *shown, ["--version"], ["-h"]]),
        Case("commands/catalogue", {}, [["catalogue"]]),
        Case("commands/schema", {}, [["schema"], ["schema", "--out", "study.schema.json"]]),
    ]


def _starters() -> list[Case]:
    """Return every starter, and a forecast of each."""
    return [
        Case(
            f"commands/new_{kind}",
            {"occupied/file": "mine"},
            [
                ["new", kind, kind],
                ["run", f"{kind}/study.toml", "--dry-run"],
                ["new", kind, "occupied"],
            ],
        )
        for kind in ("bookcase", "hazard", "inventory", "records", "scenario")
    ]


def _runs() -> list[Case]:
    """Return runs of studies with each option, and again after finished ones."""
    run = ["run", "study.toml", "--out", "out"]
    return [
        Case(
            "commands/run",
            {"study.toml": CURVES, "other.toml": CURVES.replace("seed = 1", "seed = 2")},
            [
                [*run, "--dry-run"],
                ["status", "out"],
                run,
                run,
                [*run, "--dry-run"],
                [*run, "--verbose"],
                [*run, "--fresh"],
                [*run, "--fresh", "--dry-run", "--verbose"],
                ["run", "other.toml", "--out", "out"],
                ["run", "other.toml", "--out", "out", "--dry-run"],
                ["run", "other.toml", "--out", "out", "--fresh"],
                ["status", "out"],
                ["status", "out", "--json"],
                ["status", "out", "--verify", "--json"],
            ],
        ),
        Case("commands/run_in_results", {"study.toml": CURVES}, [["run", "study.toml"], ["status", "results/study"]]),
        Case(
            "commands/changed_decision",
            {"study.toml": BUILDING, "dearer.toml": BUILDING.replace("300", "100"), "inventory.csv": INVENTORY},
            [run, ["run", "dearer.toml", "--out", "out"], ["run", "dearer.toml", "--out", "out", "--verbose"]],
        ),
        Case(
            "commands/status_without_result",
            {
                "study.toml": TOO_FEW,
                "blocks.csv": "name,width_m,height_m\na,0.3,1.2\nb,0.35,1.4\nc,0.4,1.7\n",
                "empty/note.txt": "nothing",
            },
            [
                run,
                ["status", "out"],
                ["status", "out", "--json"],
                ["status", "out", "--verify"],
                ["status", "empty"],
                ["status", "missing"],
                ["status", "study.toml"],
            ],
        ),
    ]


def _reads() -> list[Case]:
    """Return exports, reports and comparisons of finished results."""
    run = ["run", "study.toml", "--out", "out"]
    curves = {"study.toml": CURVES + HAZARD + MODELLING, "edit.py": EDIT, "cut.py": CUT}
    room = {"study.toml": BUILDING, "inventory.csv": INVENTORY, "edit.py": EDIT}
    export = ["export", "out", "--format"]
    formats = ("pelicun", "nrml", "csv", "xlsx")
    return [
        Case(
            "commands/export_curves",
            curves,
            [
                run,
                *([*export, format_] for format_ in formats),
                *([*export, format_, "--model", "housner", "--out", "housner"] for format_ in formats),
                *([*export, format_, "--with-modelling", "--out", "both", "--verify"] for format_ in formats),
                [*export, "csv", "--model", "no law"],
                [*export, "pelicun", "--ids", "NAME"],
            ],
        ),
        Case(
            "commands/export_building",
            room,
            [
                run,
                *([*export, format_] for format_ in formats),
                [*export, "pelicun", "--ids", "B.20.11", "--out", "ids", "--model", "energy-consistent", "--verify"],
                [*export, "csv", "--with-modelling"],
                [*export, "csv", "--ids", "NAME"],
                [*export, "xlsx", "--model", "housner"],
            ],
        ),
        Case(
            "commands/report",
            room,
            [
                run,
                ["report", "out"],
                ["report", "out", "--format", "md", "--out", "markdown"],
                ["report", "out", "--format", "html", "--out", "folder", "--verify"],
                ["report", "out/results.nc", "--out", "pages/page.md"],
                ["report", "out", "--out", "out/results.nc"],
            ],
        ),
        Case(
            "commands/json",
            curves,
            [
                run,
                ["report", "out", "--json"],
                ["report", "out", "--json", "--format", "md"],
                ["compare", "out", "out", "--laws", "housner", "energy-consistent", "--json"],
            ],
        ),
        Case(
            "commands/edited",
            curves,
            [
                run,
                ["python", "edit.py"],
                ["status", "out"],
                ["status", "out", "--verify"],
                ["report", "out", "--verify"],
                ["report", "out"],
                [*export, "csv"],
                [*export, "csv", "--verify"],
                ["compare", "out", "out", "--laws", "housner", "energy-consistent", "--verify"],
                run,
                ["python", "cut.py"],
                ["status", "out"],
                ["report", "out"],
                [*export, "csv"],
                ["compare", "out", "out"],
                run,
            ],
        ),
        Case(
            "commands/compare",
            {"study.toml": CURVES + HAZARD, "b.toml": CURVES.replace("number = 4", "number = 3")},
            [
                ["run", "study.toml"],
                ["run", "b.toml", "--out", "b"],
                ["compare", "results/study", "b/results.nc"],
                ["compare", "study.toml", "b", "--out", "page", "--verify"],
                ["compare", "study.toml", "--laws", "housner", "energy-consistent", "--output", "laws"],
                ["compare", "study.toml", "b", "--laws", "housner", "energy-consistent", "--out", "both"],
                ["compare", "study.toml", "b", "--empty-laws", "--out", "empty"],
                ["compare", "study.toml"],
                ["compare", "study.toml", "--laws", "housner", "housner"],
                ["compare", "study.toml", "missing"],
            ],
        ),
        Case(
            "commands/compare_buildings",
            {"study.toml": BUILDING, "b.toml": BUILDING.replace("0.4", "0.6"), "inventory.csv": INVENTORY},
            [
                ["run", "study.toml"],
                ["run", "b.toml"],
                ["compare", "study.toml", "b.toml"],
            ],
        ),
    ]


def _simulations() -> list[Case]:
    """Return single histories: every option, every law, walls, restraints and films."""
    laws = {
        "housner": ("--geometry", "bilinear", "--lever", "R"),
        "discrete": ("--delta", "0.04", "--rest", "rigid"),
        "energy-consistent": ("--restitution-factor", "0.95"),
        "giannini-masiani": ("--e", "0.92"),
        "makris-konstantinidis": (),
        "vassiliou": ("--coefficient", "0.03"),
        "viscous": ("--zeta", "0.05"),
    }
    scenes = {
        "wall": ("--wall-gap", "20mm", "--wall-height", "1.2m", "--wall-restitution", "0.5", "--front-gap", "0.5m"),
        "leaning": ("--cm-offset", "-20mm", "--lean", "1deg", "--cm-height", "0.8m", "--inertia-factor", "1.4"),
        "bed": ("--bed-settlement", "2mm", "--law", "energy-consistent", "--rest", "soft"),
        "strap": (
            *("--geometry", "linear", "--mass", "100kg", "--wall-gap", "0mm"),
            *("--restraint", "strap,height=1.7m,strength=267N,stiffness=20N/mm,slack=5mm"),
        ),
        "bracket": (
            *("--geometry", "linear", "--mass", "100kg"),
            *("--restraint", "bracket,height=1.7m,strength=900N,stiffness=100N/mm,count=2"),
        ),
    }  # fmt: skip
    shelf = ("simulate", "bookcase-5-shelf")
    json = ("--json", "--pga", "0.4g", "--period", "0.8s")
    return [
        Case(
            "commands/simulate_laws",
            {},
            [[*CABINET, "ricker", "--law", law, *laws[law], *json, "--out", law] for law in laws],
        ),
        Case(
            "commands/simulate_scenes",
            {},
            [[*CABINET, "ricker", *scenes[scene], *json, "--out", scene] for scene in scenes],
        ),
        Case("commands/simulate_text", {}, [[*CABINET, "ricker", *scenes["wall"], *RICKER]]),
        Case(
            "commands/simulate_catalogue",
            {"record.csv": RECORD, "study.toml": CURVES},
            [
                [*shelf, "site-based-scenario", "--seed", "1", "--index", "1", "--pga", "0.4g", "--out", "scenario"],
                [*shelf, "clough-penzien", "--placed", "--set", "duration_s=4", "--pga", "6m/s2", "--out", "placed"],
                [*shelf, "record.csv", "--scale", "1.5", "--out", "record"],
                [*shelf, "record.csv", "--set", "highpass_hz=0.2", "--set", "baseline_order=1", "--out", "corrected"],
                [*shelf, "study.toml", "--index", "2", "--scale", "8", "--json"],
            ],
        ),
        Case(
            "commands/simulate_film",
            {},
            [
                [*CABINET, "half-sine", "--period", "0.5s", "--pga", "0.5g", "--animate", "--speed", "8"],
                [*CABINET, "half-sine", "--period", "0.5s", "--pga", "0.5g"],
            ],
        ),
    ]


def _motions() -> list[Case]:
    """Return looks at motions of studies and of records."""
    files = {
        "records/first.csv": RECORD,
        "records/second.csv": OTHER_RECORD,
        "study.toml": CURVES,
        "target.csv": TARGET,
    }
    floors = {"study.toml": BUILDING, "inventory.csv": INVENTORY}
    scenario = CURVES.replace('"clough-penzien"', '"site-based-scenario"').replace(
        "duration_s = 4", "magnitude = 6.5\ndistance_m = 15000\nvs30_m_s = 700"
    )
    return [
        Case(
            "commands/motions",
            files,
            [
                ["motions", "study.toml", "--out", "of_study"],
                ["motions", "study.toml", "--json", "--damping", "0.1"],
                ["motions", "records/*.csv", "--target", "target.csv", "--out", "of_records"],
                ["motions", "records/first.csv", "records/second.csv", "--json", "--target", "target.csv"],
            ],
        ),
        Case("commands/motions_of_floors", floors, [["motions", "study.toml"]]),
        Case("commands/motions_of_scenario", {"study.toml": scenario}, [["motions", "study.toml", "--json"]]),
    ]


def _wrong() -> list[Case]:
    """Return wrong uses, each with the word that its refusal names."""
    files = {
        "study.toml": CURVES,
        "record.csv": RECORD,
        "bad_target.csv": "period (s),acc (g)\n1,1\n",
        "broken.toml": "title = \n",
        "text.nc": "no results",
    }
    cabinet, short = CABINET, ("--period", "0.8s")
    strap = "strap,height=1.7m"
    uses: dict[str, tuple[tuple[str, ...], str]] = {
        "unknown_command": (("rnu",), "rnu"),
        "bad_option": (("--colour",), "--colour"),
        "run_without_study": (("run",), "STUDY"),
        "run_missing": (("run", "missing.toml"), "missing.toml"),
        "run_broken": (("run", "broken.toml"), "broken.toml"),
        "run_folder": (("run", "."), "."),
        "run_unknown_option": (("run", "study.toml", "--dry"), "--dry"),
        "run_out_is_file": (("run", "study.toml", "--out", "record.csv"), "record.csv"),
        "run_two_studies": (("run", "study.toml", "other.toml"), "other.toml"),
        "run_scheduler": (("run", "study.toml", "--scheduler", "nowhere"), "--scheduler"),
        "run_negative_flag": (("run", "study.toml", "--no-fresh"), "--no-fresh"),
        "status_without_folder": (("status",), "FOLDER"),
        "status_missing": (("status", "missing"), "missing"),
        "new_kind": (("new", "sofa", "folder"), "KIND"),
        "new_without_folder": (("new", "records"), "FOLDER"),
        "new_file": (("new", "records", "record.csv"), "record.csv"),
        "simulate_without_motion": (("simulate", "bookcase-5-shelf"), "MOTION"),
        "simulate_nothing": (("simulate",), "MOTION"),
        "simulate_block": (("simulate", "bookcase-9", "ricker", *short), "bookcase-9"),
        "simulate_motion": ((*cabinet, "rickr", *short), "rickr"),
        "simulate_record": ((*cabinet, "missing.at2"), "missing.at2"),
        "simulate_pulse_without_period": ((*cabinet, "ricker"), "--period"),
        "simulate_period_of_record": ((*cabinet, "record.csv", *short), "--period"),
        "simulate_seed_of_record": ((*cabinet, "record.csv", "--seed", "1"), "--seed"),
        "simulate_index": ((*cabinet, "record.csv", "--index", "1"), "--index"),
        "simulate_negative_index": ((*cabinet, "record.csv", "--index", "-1"), "--index"),
        "simulate_scale_and_pga": ((*cabinet, "record.csv", "--scale", "2", "--pga", "1g"), "--scale"),
        "simulate_scale": ((*cabinet, "record.csv", "--scale", "0"), "--scale"),
        "simulate_pga_without_unit": ((*cabinet, "record.csv", "--pga", "0.4"), "--pga"),
        "simulate_set": ((*cabinet, "clough-penzien", "--set", "duration_s"), "--set"),
        "simulate_set_of_record": ((*cabinet, "record.csv", "--set", "duration_s=3"), "duration_s"),
        "simulate_set_seed": ((*cabinet, "clough-penzien", "--set", "seed=3"), "seed"),
        "simulate_law": ((*cabinet, "ricker", *short, "--law", "hausner"), "hausner"),
        "simulate_foreign_option": ((*cabinet, "ricker", *short, "--zeta", "0.1"), "zeta"),
        "simulate_viscous": ((*cabinet, "ricker", *short, "--law", "viscous"), "zeta"),
        "simulate_restitution": ((*cabinet, "ricker", *short, "--e", "1.2"), "e"),
        "simulate_two_blocks": ((*cabinet, "bookcase-5-shelf", "ricker", *short), "--width"),
        "simulate_width": (("simulate", "--width", "400", "--height", "1.8", "ricker", *short), "--width"),
        "simulate_without_height": (("simulate", "--width", "40cm", "ricker", *short), "--height"),
        "simulate_placed": ((*cabinet, "ricker", *short, "--placed"), "--placed"),
        "simulate_mass": ((*cabinet, "ricker", *short, "--mass", "100"), "--mass"),
        "simulate_wall_gap": ((*cabinet, "ricker", *short, "--wall-gap", "-2mm"), "--wall-gap"),
        "simulate_wall_height": ((*cabinet, "ricker", *short, "--wall-height", "1m"), "wall_height"),
        "simulate_restraint": ((*cabinet, "ricker", *short, "--restraint", "rope"), "--restraint"),
        "simulate_restraint_part": ((*cabinet, "ricker", *short, "--restraint", strap + ",size=1m"), "size"),
        "simulate_restraint_twice": ((*cabinet, "ricker", *short, "--restraint", strap + ",height=1m"), "height"),
        "simulate_restraint_count": ((*cabinet, "ricker", *short, "--restraint", strap + ",count=a"), "count"),
        "simulate_speed": ((*cabinet, "half-sine", *short, "--animate", "--speed", "0"), "--speed"),
        "simulate_number": ((*cabinet, "record.csv", "--scale", "much"), "--scale"),
        "motions_nothing": (("motions",), "INPUTS"),
        "motions_missing": (("motions", "missing.at2"), "missing.at2"),
        "motions_pattern": (("motions", "none/*.at2"), "none/*.at2"),
        "motions_two_studies": (("motions", "study.toml", "record.csv"), "study.toml"),
        "motions_damping": (("motions", "record.csv", "--damping", "1.5"), "damping"),
        "motions_target": (("motions", "record.csv", "--target", "bad_target.csv"), "bad_target.csv"),
        "catalogue_argument": (("catalogue", "sofa"), "sofa"),
        "export_without_format": (("export", "out"), "--format"),
        "export_format": (("export", "out", "--format", "pdf"), "--format"),
        "export_missing": (("export", "missing", "--format", "csv"), "missing"),
        "export_text": (("export", "text.nc", "--format", "csv"), "text.nc"),
        "report_missing": (("report", "missing"), "missing"),
        "report_text": (("report", "text.nc"), "text.nc"),
        "report_format": (("report", "text.nc", "--format", "doc"), "--format"),
        "compare_one": (("compare", "text.nc"), "--laws"),
        "compare_text": (("compare", "text.nc", "text.nc"), "text.nc"),
        "compare_one_law": (("compare", "text.nc", "--laws", "housner"), "--laws"),
        "compare_without_results": (("compare", "study.toml", "study.toml"), "study.toml"),
        "schema_out": (("schema", "--out", "record.csv/schema.json"), "record.csv"),
    }
    return [Case(f"commands/wrong/{name}", files, [arguments], [word]) for name, (arguments, word) in uses.items()]


def _processes() -> list[Case]:
    """Return cases whose commands are real processes: exit codes and signals."""
    study = {"study.toml": CURVES, "broken.toml": CURVES.replace("height_m", "hight_m")}
    long = {"study.toml": LONG}
    run = ["run", "study.toml", "--out", "out"]
    return [
        Case("processes/version", {}, [["--version"]], process=True),
        Case("processes/help", {}, [["--help"]], process=True),
        Case("processes/unknown_command", {}, [["rnu"]], ["rnu"], process=True),
        Case("processes/unknown_option", study, [["run", "study.toml", "--fast"]], ["--fast"], process=True),
        Case("processes/missing_study", {}, [["run", "missing.toml"]], ["missing.toml"], process=True),
        Case("processes/refused_study", study, [["run", "broken.toml"]], ["hight_m"], process=True),
        Case("processes/run", study, [run, run, ["status", "out", "--json"]], process=True),
        Case("processes/new", {}, [["new", "bookcase", "mine"], ["new", "bookcase", "mine"]], ["mine"], process=True),
        Case("processes/interrupted", long, [["SIGINT", *run], ["status", "out", "--verify"], run], process=True),
        Case("processes/terminated", long, [["SIGTERM", *run], run], process=True),
    ]
