"""A building exported from a performance study, in a whole assessment by pelicun's own runner.

Run through `exchange_pelicun.py`, by a Python that has pelicun and need not have this project.
"""

import json
import math
from contextlib import chdir

import numpy as np
import pandas as pd
from pelicun.tools.DL_calculation import run_pelicun

RUNS = 4000
SEED = 3
SPREAD = 0.15  # relative error of a standard deviation from so many runs, that of a rare fall


def configuration(folder, demands):
    """What the runner asks for beside the exported files."""
    return {
        "GeneralInformation": {"units": {"length": "m"}},
        "DL": {
            "Options": {
                "Seed": SEED,
                "UnitsFile": str(folder / "units.json"),
                "Sampling": {"SampleSize": RUNS},
            },
            "Demands": {"DemandFilePath": str(demands), "SampleSize": RUNS, "CoupledDemands": True},
            "Asset": {
                "ComponentAssignmentFile": str(folder / "components.csv"),
                "ComponentDatabase": "None",
                "ComponentDatabasePath": str(folder / "fragility.csv"),
                "NumberOfStories": 4,
            },
            "Damage": {"DamageProcess": "None"},
            "Losses": {
                "Repair": {
                    "ConsequenceDatabase": "None",
                    "ConsequenceDatabasePath": str(folder / "consequence_repair.csv"),
                    "MapApproach": "Automatic",
                    "DecisionVariables": {"Cost": True, "Time": False, "Carbon": False, "Energy": False},
                }
            },
            "Outputs": {
                "Damage": {"Sample": True},
                "Loss": {"Repair": {"Sample": True}},
                "Format": {"CSV": True, "JSON": False},
            },
        },
    }


def assess(folder, expected, level):
    """Run the assessment at a level of the ground motion: damaged quantities and costs of every run, by component."""
    out = folder / "pelicun"
    out.mkdir(exist_ok=True)
    demands = out / "demands.csv"
    values = [expected["unit"], *[level] * RUNS]
    pd.DataFrame({f"1-{expected['demand']}-0-1": values}, index=["Units", *range(RUNS)]).to_csv(demands)
    config = out / "configuration.json"
    config.write_text(json.dumps(configuration(folder, demands)), encoding="utf-8")
    with chdir(out):  # (the runner writes its logs where it stands)
        run_pelicun(
            str(config),
            demand_file=str(demands),
            output_path=str(out),
            realizations=RUNS,
            auto_script_path=None,
            custom_model_dir=None,
            output_format=None,
            detailed_results=False,
            coupled_edp=True,
        )
    return sample(out / "DMG_sample.zip", 0, 3), sample(out / "DV_repair_sample.zip", 2, None)


def sample(path, component, state):
    """The runs of each component: the sum of its columns (and of those in a damage state, where the name has one)."""
    found = pd.read_csv(path, index_col=0)
    found = found.drop(index="Units", errors="ignore").astype(float)
    parts = [name.split("-") for name in found.columns]
    keep = [state is None or one[state] != "0" for one in parts]
    found = found.loc[:, keep].T.groupby([one[component] for one, kept in zip(parts, keep, strict=True) if kept]).sum()
    return found.T


def check_building(folder, expected):
    """Mean falls and costs of each component within five standard errors of the study's own, at each of its levels.

    Returns the number of means compared, and the largest difference in standard errors.
    """
    checked, worst = 0, 0.0
    for k, level in enumerate(expected["levels"]):
        falls, costs = assess(folder, expected, level)
        for one in expected["components"]:
            n, p, blocks = one["number"], one["probability"][k], 1 if one["together"] else one["number"]
            # a block falls with probability p, and is n / blocks pieces
            error = n * math.sqrt(p * (1.0 - p) / (blocks * RUNS))
            mine = falls[one["id"]] if one["id"] in falls else np.zeros(RUNS)
            found = float(mine.mean())
            assert abs(found - n * p) <= 5.0 * error + 3.0 * n / RUNS, (one["id"], level, found, n * p)
            if p * (1.0 - p) > 0.05:
                # the number is spread as the blocks have it, and by no more or less
                assert math.isclose(mine.std(), error * math.sqrt(RUNS), rel_tol=SPREAD), (one["id"], level)
                worst = max(worst, abs(found - n * p) / error)
            cost = float(costs[one["id"]].mean()) if one["id"] in costs else 0.0
            assert math.isclose(cost, one["value"] * found, rel_tol=1e-6, abs_tol=1e-9), (one["id"], cost, found)
            checked += 1
    return checked, worst
