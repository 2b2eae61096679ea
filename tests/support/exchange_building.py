"""A building exported from a performance study, in a whole assessment by pelicun's own runner.

Run through `exchange_pelicun.py`, by a Python that has pelicun and need not have this project.
"""

import json
import math
from contextlib import chdir

import numpy as np
import pandas as pd
from pelicun.tools.DL_calculation import run_pelicun
from scipy.stats import spearmanr

RUNS = 4000
SEED = 3
SPREAD = 0.15  # relative error of a standard deviation from so many runs, that of a rare fall


def configuration(folder, demands, expected):
    """What the runner asks for beside the exported files."""
    lasting = any(one["downtime"][0] is not None for one in expected["components"])
    return {
        "GeneralInformation": {"units": {"length": "m"}},
        "DL": {
            "Options": {
                "Seed": SEED,
                "UnitsFile": str(folder / "units.json"),
                "Sampling": {"SampleSize": RUNS},
                "RepairCostAndTimeCorrelation": expected["correlation"],
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
                    "DecisionVariables": {"Cost": True, "Time": lasting, "Carbon": False, "Energy": False},
                }
            },
            "Outputs": {
                "Damage": {"Sample": True},
                "Loss": {"Repair": {"Sample": True}},
                "Format": {"CSV": True, "JSON": False},
                # (a column for each row of quantities: the longest downtime is of one row)
                "Settings": {"CondenseDS": True, "AggregateColocatedComponentResults": False},
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
    config.write_text(json.dumps(configuration(folder, demands, expected)), encoding="utf-8")
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
    losses = out / "DV_repair_sample.zip"
    return sample(out / "DMG_sample.zip", 0, -1), *(sample(losses, 2, None, kind) for kind in ("Cost", "Time"))


def sample(path, component, state, kind=None):
    """The runs of each component, a column for each row of quantities (of those in a damage state, of one kind)."""
    found = pd.read_csv(path, index_col=0)
    found = found.drop(index="Units", errors="ignore").astype(float)
    columns = {}
    for name in found.columns:
        parts = name.split("-")
        if (state is None or parts[state] != "0") and (kind is None or parts[0] == kind):
            columns.setdefault(parts[component], []).append(found[name].to_numpy())
    return {name: np.array(one).T for name, one in columns.items()}


def check_building(folder, expected):
    """Falls, costs and downtimes of each component by the study's own, at each of its levels.

    Means are within five standard errors, and so are the standard deviations of what is drawn.  Returns the number of
    means compared, and the largest difference in standard errors.
    """
    checked, worst = 0, 0.0
    for k, level in enumerate(expected["levels"]):
        falls, costs, times = assess(folder, expected, level)
        for one in expected["components"]:
            n, p, blocks = one["number"], one["probability"][k], 1 if one["together"] else one["number"]
            # a block falls with probability p, and is n / blocks pieces
            error = n * math.sqrt(p * (1.0 - p) / (blocks * RUNS))
            none = np.zeros((RUNS, 1))
            mine = falls.get(one["id"], none).sum(axis=1)
            found = float(mine.mean())
            assert abs(found - n * p) <= 5.0 * error + 3.0 * n / RUNS, (one["id"], level, found, n * p)
            if p * (1.0 - p) > 0.05:
                # the number is spread as the blocks have it, and by no more or less
                assert math.isclose(mine.std(), error * math.sqrt(RUNS), rel_tol=SPREAD), (one["id"], level)
                worst = max(worst, abs(found - n * p) / error)
            cost = costs.get(one["id"], none).sum(axis=1)
            if one["value"] is not None:
                assert math.isclose(cost.mean(), one["value"] * found, rel_tol=1e-6, abs_tol=1e-9), (one["id"], found)
            longest = times.get(one["id"], none).max(axis=1)
            for drawn, values in ((one["cost"][k], cost), (one["downtime"][k], longest)):
                if drawn is not None:
                    worst = max(worst, check_drawn(one, p, drawn, values))
                    checked += 2
            check_together(one, p, expected["correlation"], costs, times)
            checked += 1
    return checked, worst


def check_drawn(one, chance, drawn, values):
    """Mean and standard deviation of a cost or a downtime; returns the difference of the means in standard errors."""
    mean, deviation, kurtosis = drawn
    if chance * RUNS < 100.0:  # (too few falls for a standard deviation)
        return 0.0
    error = deviation / math.sqrt(RUNS)
    assert abs(values.mean() - mean) <= 5.0 * error, (one["id"], values.mean(), mean, error)
    share = 5.0 * math.sqrt((kurtosis - 1.0) / (4.0 * RUNS))
    assert abs(values.std() / deviation - 1.0) <= share, (one["id"], values.std(), deviation, share)
    return abs(values.mean() - mean) / error


def check_together(one, chance, correlation, costs, times):
    """Cost and downtime of a single piece that fell are correlated as the option says (rank correlation)."""
    if one["together"] or one["downtime"][0] is None or one["cost"][0] is None or chance * RUNS < 400.0:
        return
    cost, time = costs[one["id"]][:, 0], times[one["id"]][:, 0]
    fell = cost > 0.0
    found = spearmanr(cost[fell], time[fell]).statistic
    expected = 6.0 / math.pi * math.asin(correlation / 2.0)
    assert abs(found - expected) <= 5.0 / math.sqrt(fell.sum()), (one["id"], found, expected)
