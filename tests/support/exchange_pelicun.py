"""Exported tables read by the real pelicun: `make test-exchange`.

Run by a Python that has pelicun and need not have this project: `python tests/support/exchange_pelicun.py FOLDER`.
"""

import json
import math
import sys
from pathlib import Path

import dlml
import jsonschema
import numpy as np
import pandas as pd
import pelicun
from exchange_building import check_building
from library_metadata import SCHEMAS
from pelicun.assessment import Assessment
from scipy.special import ndtr

RUNS = 10_000
SEED = 1


def damage(folder, rows, demand_of, direction, runs=RUNS):
    """Assess one component of each row under its demand (the same in direction 1, half of it in 2) in one go.

    Returns the parameters that pelicun reads, SI, and the fraction of runs in each damage state or a worse one.
    """
    assessment = Assessment({"PrintLog": False, "Seed": SEED})
    assessment.stories = len(rows)
    columns = {}
    for location, row in enumerate(rows, start=1):
        # the contents of a storey stand on the floor below it, where pelicun takes floor demands
        at = location - 1 if row["demand"] in ("PFA", "PFV") else location
        for way, share in ((1, 1.0), (2, 0.5)):
            columns[f"{row['demand']}-{at}-{way}"] = [row["unit"]] + [share * demand_of(row)] * runs
    index = ["Units", *map(str, range(runs))]
    assessment.demand.load_sample(pd.DataFrame(columns, index=index))
    ids = [row["id"] for row in rows]
    marginals = {
        "Units": "ea",
        "Location": [str(location) for location in range(1, len(rows) + 1)],
        "Direction": str(direction),
        "Theta_0": 1,
        "Family": np.nan,
        "Blocks": 1,
    }
    assessment.asset.load_cmp_model({"marginals": pd.DataFrame(marginals, index=ids)})
    assessment.asset.generate_cmp_sample(runs)
    assessment.damage.load_model_parameters([str(folder / rows[0]["file"])], set(ids))
    assessment.damage.calculate()
    sample = assessment.damage.save_sample()
    fractions = {}
    for row in rows:
        mine = sample[row["id"]].T.groupby(level="ds").sum().T.mean()
        count = len(row["probability"])
        fractions[row["id"]] = [sum(mine.get(str(j), 0.0) for j in range(i, count + 1)) for i in range(1, count + 1)]
    return assessment.damage.ds_model.damage_params, fractions


def probable(fraction, probability, runs=RUNS):
    """Whether a fraction of runs is what a probability gives: within 5 standard deviations, and 3 runs."""
    return abs(fraction - probability) <= 5.0 * math.sqrt(probability * (1.0 - probability) / runs) + 3.0 / runs


def check_table(folder, rows):
    """Parameters to rounding; probabilities by pelicun's own sampling at each level of the first limit state."""
    checked = 0
    for k in range(len(rows[0]["levels"])):
        parameters, fractions = damage(folder, rows, lambda row, k=k: row["levels"][k], direction=1)
        for row in rows:
            mine = parameters.loc[row["id"]]
            factor = 1.0 if row["directional"] else 1.2
            assert mine["Demand", "Directional"] == row["directional"], row["id"]
            for i, (median, dispersion) in enumerate(zip(row["median"], row["dispersion"], strict=True), start=1):
                # (pandas reads a number to a unit in its last place)
                assert math.isclose(mine[f"LS{i}", "Theta_0"], median, rel_tol=1e-15), row["id"]
                assert math.isclose(mine[f"LS{i}", "Theta_1"], dispersion, rel_tol=1e-15), row["id"]
                ratio = row["levels"][k] / row["levels"][2]  # the third is the first median
                expected = float(ndtr(math.log(factor * ratio * row["median"][0] / median) / dispersion))
                if row["directional"]:
                    assert math.isclose(expected, row["probability"][i - 1][k], rel_tol=1e-9), row["id"]
                found = fractions[row["id"]][i - 1]
                assert probable(found, expected), (row["id"], i, k, found, expected)
                checked += 1
    return checked


def check_directions(folder, row):
    """What Demand-Directional and the component's direction do: why ours is 1, and direction 0 none at all."""
    ratio = row["levels"][1] / row["levels"][2]

    def expected(factor):
        return float(ndtr(math.log(factor * ratio) / row["dispersion"][0]))

    found = {}
    for direction, factor in ((1, 1.0), (2, 0.5), (0, 1.2)):
        _, fractions = damage(folder, [row], lambda one: one["levels"][1], direction)
        found[direction] = fractions[row["id"]][0]
        assert probable(found[direction], expected(factor)), (direction, found, expected(factor))
    assert not probable(found[0], row["probability"][0][1])
    return {f"direction {key}": f"{value:.4f}" for key, value in found.items()}, row["probability"][0][1]


def check_incomplete(folder, name):
    """A row without an estimate is one that pelicun leaves out by itself."""
    table = pd.read_csv(folder / name, index_col=0)
    missing = table.index[table["Incomplete"] == 1].tolist()
    assert missing
    whole = table.index[table["Incomplete"] == 0].tolist()
    assessment = Assessment({"PrintLog": False})
    assessment.damage.load_model_parameters([str(folder / name)], {*missing, *whole}, warn_missing=False)
    assert sorted(assessment.damage.missing_components) == sorted(missing)
    return missing


def check_metadata(folder):
    """Every JSON of ours by our rules, and our rules by every JSON of the library itself."""
    ours = 0
    for path in sorted(folder.rglob("*.json")):
        found = json.loads(path.read_text(encoding="utf-8"))
        if "_GeneralInformation" in found:
            kind = "consequence_repair" if path.stem == "consequence_repair" else "fragility"
            jsonschema.Draft7Validator(SCHEMAS[kind]).validate(found)
            ours += 1
    assert ours
    theirs = 0
    for path in sorted(Path(dlml.__file__).parent.rglob("*.json")):
        if path.stem in SCHEMAS:
            found = json.loads(path.read_text(encoding="utf-8"))
            jsonschema.Draft7Validator(SCHEMAS[path.stem]).validate(found)
            theirs += 1
    assert theirs
    return ours, theirs


def check_multilinear(folder, rows):
    """Curves that are not lognormal, by pelicun's own sampling."""
    checked = 0
    for k in range(len(rows[0]["levels"])):
        _, fractions = damage(folder, rows, lambda row, k=k: row["levels"][k], direction=1)
        for row in rows:
            (found,), expected = fractions[row["id"]], row["probability"][0][k]
            assert abs(found - expected) <= 2e-4 or probable(found, expected), (row["id"], k, found, expected)
            checked += 1
    return checked


def main(folder):
    expected = json.loads((folder / "expected.json").read_text(encoding="utf-8"))
    ours, theirs = check_metadata(folder)
    print(f"metadata: {ours} files of ours by the library's rules, which {theirs} files of its own keep")
    tables = expected["multilinear"]
    checked = sum(
        check_multilinear(folder, [row for row in tables if row["file"] == file])
        for file in sorted({row["file"] for row in tables})
    )
    print(f"multilinear: {len(tables)} components, {checked} probabilities agree")
    for building in expected["buildings"]:
        checked, worst = check_building(folder / building["folder"], building)
        print(
            f"{building['folder']}: {checked} numbers, costs and downtimes agree, means by {worst:.1f} standard errors"
        )
    rows = expected["pelicun"]
    files = sorted({row["file"] for row in rows})
    checked = sum(check_table(folder, [row for row in rows if row["file"] == file]) for file in files)
    print(
        f"pelicun {pelicun.__version__}: {len(rows)} components of {len(files)} tables, {checked} probabilities agree"
    )
    ours = next(row for row in rows if row["file"] == "pga.csv")
    found, probability = check_directions(folder, ours)
    print(f"{ours['id']}: P = {probability:.4f}; pelicun in {', '.join(f'{k}: {v}' for k, v in found.items())}")
    print(f"left out as incomplete: {', '.join(check_incomplete(folder, 'pga.csv'))}")


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve())
