"""Curves exported for other programs, and what those should find in them: `make test-exchange` reads both.

Run by this project's Python: `python tests/support/exchange_set.py FOLDER`.
"""

import json
import math
import sys
from pathlib import Path

import numpy as np
import xarray as xr
from scipy.optimize import isotonic_regression
from scipy.special import ndtr

import toppling as tp
from toppling.fragility import write_nrml, write_pelicun
from toppling.fragility.curves import published
from toppling.studies.command.building_files import write_building_files
from toppling.studies.inventory.contents import Contents
from toppling.studies.inventory.reading import read_inventory

RATIOS = (0.4, 0.8, 1.0, 1.3, 2.5)  # of the demand to the median
DEMANDS = {"pga": ("PFA", "g", 9.80665), "pgv": ("PFV", "mps", 1.0), "Sa(1.0)": ("SA_1.0", "g", 9.80665)}
IMTS = {"pga": ("PGA", 9.80665), "pgv": ("PGV", 0.01), "Sa(1.0)": ("SA(1.0)", 9.80665)}
AT_LEVELS = (5, 8, 11)  # positions among the levels of a building's study
FEW, PGA, ALIKE = (
    ("number = 100", "number = 20"),
    ('im = "Sa(0.5)"', 'im = "pga"'),
    ("variability =", "# variability ="),
)
BUILDINGS = {
    "independent": ("clinic", "SA_0.5", "g", 9.80665, [FEW]),
    "alike": ("clinic", "PGA", "g", 9.80665, [FEW, PGA, ALIKE]),
    "drawn": ("laboratory", "SA_0.5", "g", 9.80665, [FEW]),
    "drawn-alike": ("laboratory", "PGA", "g", 9.80665, [FEW, PGA, ALIKE]),
}
"""Studies of examples: demand, unit and its SI value, and changes of the text; pieces alike or not."""
DRAWS = 1_000_000
"""Pieces that are drawn for the means and the spreads expected of costs and downtimes."""


def fitted(im: str) -> xr.Dataset:
    """Curves fitted to real runs, one of which has no estimate."""
    blocks = [tp.catalogue["bookcase-5-shelf"], tp.Block(0.45, 1.95, name="=cabinet; δ & <1>"), tp.Block(3.0, 1.0)]
    laws = [tp.DiscreteDamping(e=0.9), tp.HousnerImpact(e=0.9)]
    motions = tp.motions.CloughPenzien(duration=8.0, dt=0.01).sample(25, seed=1)
    levels = {"pga": np.geomspace(1.0, 10.0, 8), "pgv": np.geomspace(0.1, 2.0, 8), "Sa(1.0)": np.geomspace(0.5, 9.0, 8)}
    return tp.fit_fragility(tp.ida(blocks, laws, motions, levels[im], im))


def curves_of(limit_states: bool) -> xr.Dataset:
    """Curves made up: three limit states of one component, or the ground's velocity under another name of demand."""
    if limit_states:
        return xr.Dataset(
            {
                "median": (("block", "limit_state"), [[1.0, 2.0, 3.5]], {"units": "m s-2"}),
                "dispersion": (("block", "limit_state"), [[0.3, 0.35, 0.5]], {"units": "1"}),
            },
            {"block": ["vase"], "limit_state": ["uplift", "rocking", "overturning"]},
            {"im": "pga"},
        )
    return xr.Dataset(
        {"median": ("block", [0.6], {"units": "m s-1"}), "dispersion": ("block", [0.4], {"units": "1"})},
        {"block": ["rack"]},
        {"im": "pgv", "im_at": "ground"},
    )


def lognormal(curves: xr.Dataset, name: str) -> dict[str, list[tuple[float, float]]]:
    """Median and dispersion of every limit state of every component that has them, by the id that the writer gave."""
    found: dict[str, list[tuple[float, float]]] = {}
    dims = curves["median"].dims
    flat = curves[["median", "dispersion", "id"]].stack(row=dims) if dims else curves
    for i in range(flat.sizes["row"]):
        one = flat.isel(row=i)
        if math.isfinite(one["median"].item()):
            found.setdefault(str(one["id"].item()), []).append((one["median"].item(), one["dispersion"].item()))
    assert found, name
    return found


def plain(name: str) -> str:
    """Return the id that OpenQuake gets for one with points."""
    return name.replace(".", "_")


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    sets = {
        "fema": (published.fema_p58(), "pgv"),
        "pga": (fitted("pga"), "pga"),
        "velocity": (fitted("pgv"), "pgv"),
        "spectral": (fitted("Sa(1.0)"), "Sa(1.0)"),
        "states": (curves_of(limit_states=True), "pga"),
        "ground": (curves_of(limit_states=False), "pgv"),
    }
    expected: dict[str, list[dict[str, object]]] = {"pelicun": [], "openquake": []}
    for name, (curves, im) in sets.items():
        table = write_pelicun(curves, folder / f"{name}.csv")
        model = write_nrml(curves, folder / f"{name}.xml", tail=1e-6)
        named = tp.fragility.read_pelicun(table.paths[0])  # for the ids alone: the numbers expected are the curves' own
        named = named.assign({key: (curves[key].dims, curves[key].values) for key in ("median", "dispersion")})
        assert {plain(one) for one in table.missing} == {plain(one) for one in table.ids} - set(model.ids)
        demand, unit, factor = ("PGV", "mps", 1.0) if name == "ground" else DEMANDS[im]
        imt, iml = IMTS[im]
        for key, states in lognormal(named, name).items():
            levels = [ratio * states[0][0] for ratio in RATIOS]
            common = {"id": key, "probability": [[float(ndtr(math.log(x / m) / b)) for x in levels] for m, b in states]}
            expected["pelicun"].append(
                {
                    **common,
                    "file": f"{name}.csv",
                    "demand": demand,
                    "unit": unit,
                    "levels": [x / factor for x in levels],
                    "median": [m for m, _ in states],
                    "dispersion": [b for _, b in states],
                    "directional": int(name != "fema"),
                }
            )
            expected["openquake"].append(
                {
                    **common,
                    "id": plain(key),
                    "file": f"{name}.xml",
                    "imt": imt,
                    "levels": [x / iml for x in levels],
                    "error": 1e-12,
                }
            )
    expected["openquake"] += other_forms(folder)
    expected["multilinear"] = multilinear_forms(folder)
    expected["buildings"] = [building(folder, name) for name in BUILDINGS]
    (folder / "expected.json").write_text(json.dumps(expected, indent=1), encoding="utf-8")
    print(
        f"{len(expected['pelicun'])} components in {len(sets)} tables, {len(expected['openquake'])} functions written"
    )


def building(folder: Path, name: str) -> dict[str, object]:
    """An example, exported for a whole assessment, and the falls, costs and downtimes that its study expects."""
    example, demand, unit, factor, changes = BUILDINGS[name]
    examples = Path(tp.__file__).parent / "studies" / "examples"
    text = (examples / f"{example}.toml").read_text(encoding="utf-8")
    inventory = examples / ("inventory.csv" if example == "clinic" else f"{example}.csv")
    for old, new in ((inventory.name, inventory.as_posix()), *changes):
        assert old in text
        text = text.replace(old, new)
    study = folder / f"{name}.toml"
    study.write_text(text, encoding="utf-8")
    tp.Study.from_toml(study).run(folder / f"{name}-results")
    results = folder / f"{name}-results" / "results.nc"
    write_building_files(results, folder / name, prefix="CLINIC")
    with xr.open_dataset(results) as stored:
        found = stored.isel(model=0).load()
    lines = read_inventory(inventory).rows
    assert [one.label for one in lines] == found["block"].values.tolist()
    together = found.attrs["pieces"] == "alike"
    components = []
    for i, one in enumerate(found["probability"].transpose("block", "level").values):
        rising = bool((np.diff(one) >= 0.0).all())  # the table has made the others rise
        p = one if rising else isotonic_regression(one).x
        chance = [float(p[k]) for k in AT_LEVELS]
        number = int(found["count"].values[i])
        drawn = [consequences_of(lines[i], number, together, at, i) for at in chance]
        components.append(
            {
                "id": f"CLINIC.{i + 1:03d}",
                "number": number,
                "value": float(found["value"].values[i]) if lines[i].cost is None else None,
                "together": together,
                "probability": chance,
                "cost": [one for one, _ in drawn],
                "downtime": [one for _, one in drawn],
            }
        )
    levels = [float(found["level"].values[k]) / factor for k in AT_LEVELS]
    correlation = 0.7 if example == "laboratory" else 0.0
    return {
        "folder": name,
        "demand": demand,
        "unit": unit,
        "levels": levels,
        "components": components,
        "correlation": correlation,
    }


def consequences_of(line: Contents, number: int, together: bool, chance: float, seed: int) -> list[list[float] | None]:
    """Mean, standard deviation and kurtosis of a line's cost and longest downtime, drawn piece by piece.

    None where the line gives no distribution.
    """
    rng = np.random.default_rng(seed)
    draws = DRAWS // number
    falls = rng.random((draws, 1 if together else number)) < chance
    found: list[list[float] | None] = []
    for given, joined in ((line.cost, np.sum), (line.downtime, np.max)):
        if given is None:
            found.append(None)
            continue
        scores = rng.standard_normal((draws, number))
        if given.distribution == "normal":
            values = given.median * (1.0 + given.dispersion * scores)
            assert (values < 0.0).mean() < 1e-3  # (else the truncation would matter here)
            values = np.maximum(values, 0.0)
        else:
            values = given.median * np.exp(given.dispersion * scores)
        each = joined(falls * values, axis=1)
        apart, deviation = each - each.mean(), float(each.std())
        kurtosis = float((apart**4).mean() / deviation**4) if deviation > 0.0 else 0.0
        found.append([float(each.mean()), deviation, kurtosis])
    return found


def multilinear_forms(folder: Path) -> list[dict[str, object]]:
    """Curves with a factor of uplift, a step and a smooth one, and one without parameters, for pelicun."""
    uplift, isotonic = uplifting_curves(), isotonic_curve()
    write_pelicun(uplift, folder / "multilinear.csv")
    write_pelicun(isotonic, folder / "free.csv")
    x = np.array([1.5, 1.99, 2.01, 2.5, 3.0, 4.0, 8.0])
    base = ndtr(np.log(x / 3.0) / 0.4)
    free = np.array([0.75, 1.5, 2.0, 3.0, 4.0, 9.0])
    found = [
        ("step", "multilinear.csv", "PFA", "g", x / 9.80665, np.where(x >= 2.0, base, 0.0)),
        ("smooth", "multilinear.csv", "PFA", "g", x / 9.80665, base * ndtr(np.log(x / 2.0) / 0.2)),
        ("free", "free.csv", "PFV", "mps", free, np.array([0.05, 0.1, 0.1, 0.4, 0.7, 0.7])),
    ]
    return [
        {"id": key, "file": file, "demand": demand, "unit": unit, "levels": at.tolist(), "probability": [p.tolist()]}
        for key, file, demand, unit, at, p in found
    ]


def uplifting_curves() -> xr.Dataset:
    """A step and a smooth factor of uplift."""
    return xr.Dataset(
        {
            "median": ("block", [3.0, 3.0], {"units": "m s-2"}),
            "dispersion": ("block", [0.4, 0.4], {"units": "1"}),
            "uplift_median": ("block", [2.0, 2.0], {"units": "m s-2"}),
            "uplift_dispersion": ("block", [0.0, 0.2], {"units": "1"}),
        },
        {"block": ["step", "smooth"]},
        {"im": "pga", "form": "uplift-lognormal"},
    )


def isotonic_curve() -> xr.Dataset:
    """A curve without parameters."""
    return xr.Dataset(
        {"probability": (("block", "level"), [[0.0, 0.1, 0.1, 0.7]], {"units": "1"})},
        {"block": ["free"], "level": ("level", np.array([0.5, 1.0, 2.0, 4.0]), {"units": "m s-1"})},
        {"im": "pgv", "form": "isotonic"},
    )


def other_forms(folder: Path) -> list[dict[str, object]]:
    """Curves that are no lognormal: a step and a smooth factor of uplift, and one without parameters."""
    uplift, isotonic = uplifting_curves(), isotonic_curve()
    write_nrml(uplift, folder / "uplift.xml", tail=1e-6)
    write_nrml(isotonic, folder / "isotonic.xml")
    x = np.array([0.5, 1.0, 1.5, 1.999, 2.0, 2.5, 4.0, 8.0])
    base = ndtr(np.log(x / 3.0) / 0.4)
    found = [
        ("step", "uplift.xml", "PGA", x / 9.80665, np.where(x >= 2.0, base, 0.0), 1e-4),
        ("smooth", "uplift.xml", "PGA", x / 9.80665, base * ndtr(np.log(x / 2.0) / 0.2), 1e-4),
        ("free", "isotonic.xml", "PGV", np.array([50.0, 100.0, 150.0, 300.0, 400.0, 900.0]),
         np.array([0.0, 0.1, 0.1, 0.4, 0.7, 0.7]), 1e-12),
    ]  # fmt: skip
    return [
        {"id": key, "file": file, "imt": imt, "levels": at.tolist(), "probability": [p.tolist()], "error": error}
        for key, file, imt, at, p, error in found
    ]


if __name__ == "__main__":
    main(Path(sys.argv[1]))
