"""Answers of every public function of toppling, toppling.studies, toppling.plot and toppling.animate."""

from pathlib import Path

import matplotlib as mpl
import numpy as np

import toppling as tp
from toppling import studies
from toppling.fragility import RandomInputs, Uniform, overturning_response, rank_measures, sobol_indices, uncertain_ida

mpl.use("Agg")

SHELF = tp.Block(0.25, 1.2, name="shelf")
GROUND = tp.motions.CloughPenzien(duration=6.0, dt=0.02).sample(8, seed=2)
LAW = tp.EnergyConsistent()
LEVELS = [1.0, 2.0, 4.0, 8.0]
FRAME = tp.motions.Building.flexural_shear(0.5, storeys=2)


def _inventory():
    cost = studies.Consequence(300.0, 0.4)
    return studies.Inventory(
        (
            studies.Contents("shelf", SHELF, 2, 4, consequences=("injury",), anchoring_cost=20.0, cost=cost),
            studies.Contents("case", tp.Block(0.4, 1.5), 0, 2, value=900.0, anchoring_cost=40.0),
            studies.Contents("fixed", SHELF, 0, 3, value=5000.0, anchored=True),
        ),
        "EUR",
    )


def _assessed():
    hazard = tp.HazardCurve.power_law(1e-2, 2.0, "pga")
    return studies.assess(_inventory(), studies.Assessment(LAW, GROUND, LEVELS, "pga", FRAME, hazard, replicates=50))


def _shown(axes):
    """Return what a figure shows: labels, the numbers of its lines and the texts of its legend."""
    legend = axes.get_legend()
    return {
        "labels": [axes.get_title(), axes.get_xlabel(), axes.get_ylabel()],
        "lines": [np.asarray(line.get_xydata(), dtype=float) for line in axes.lines],
        "texts": [text.get_text() for text in axes.texts],
        "legend": [] if legend is None else [text.get_text() for text in legend.get_texts()],
    }


def consequences():
    scores = np.array([0.1, 0.5, 0.9])
    cost, injury = studies.Consequence(100.0, 0.5), studies.Injury(0.5, 0.2)
    return {
        "at": cost.at(scores),
        "mean": cost.mean,
        "of_several": [cost.of_several(4), cost.of_several(4, greatest=True)],
        "injury": [injury.at(scores), injury.mean],
    }


def inventories():
    read, made = studies.read_inventory("inventory.csv"), _inventory()
    made.check_supports()
    return {
        "read_inventory": [[row.label, row.count, row.value, row.block.alpha] for row in read.rows],
        "of_reading": [read.pieces, read.value, read.currency, read.consequences],
        "made": [made.pieces, made.value, made.consequences],
        "loss": [row.loss for row in made.rows],
    }


def assessments():
    found = _assessed()
    return {
        "assess": found,
        "anchoring": studies.anchoring(found, "number", level=4.0),
        "anchoring_by_cost": studies.anchoring(found, per_cost=True, replicates=50),
    }


def kinds():
    kinds = {
        "curves": studies.FragilityStudy,
        "room": studies.PerformanceStudy,
        "sensitivity": studies.SensitivityStudy,
        "uncertainty": studies.UncertaintyStudy,
    }
    found = {}
    for name, kind in kinds.items():
        study = studies.Study.from_toml(f"{name}.toml")
        assert isinstance(study, kind)
        study.prepare()
        study.refuse_occupied(Path(f"{name} results"))
        found[name] = {
            "results": study.run(f"{name} results"),
            "again": study.run(f"{name} results").sizes,
            "words": [study.title, study.words, list(study.notes)],
            "counts": [study.work, study.runs, study.all_runs],
            "seconds_of_fits": study.seconds_of_fits(2),
        }
    curves, sensitivity = (studies.Study.from_toml(f"{name}.toml") for name in ("curves", "sensitivity"))
    curves.check_sizes()
    curves.check_state()
    found["inputs_of"] = sensitivity.inputs_of(sensitivity.models[0])
    try:
        tp.Study.from_toml("missing.toml")
    except studies.StudyError as error:
        found["refused"] = str(error)
    return found


def plots_of_one_block():
    motion = tp.motions.Ricker(5.0, 8.0, dt=0.01).sample()
    response = tp.simulate(SHELF, tp.HousnerImpact(), motion)
    return {
        "history": _shown(tp.plot.history(response)),
        "history_of_two": _shown(tp.plot.history([response, tp.free_rocking(SHELF, LAW, 0.1, 1.0)], labels=["a", "b"])),
        "hysteresis": _shown(tp.plot.hysteresis(response)),
        "moment": _shown(tp.plot.moment(SHELF, LAW)),
        "phase": _shown(tp.plot.phase(response)),
        "sliding": _shown(tp.plot.sliding([SHELF])),
    }


def plots_of_results():
    runs = tp.ida([SHELF, tp.Block(0.3, 1.2, name="case")], LAW, GROUND, LEVELS)
    curves = tp.fit_fragility(runs, replicates=50)
    rates = tp.annual_rate(curves, tp.HazardCurve.power_law(1e-2, 2.0, "pga"), outside="least")
    inputs = RandomInputs({"alpha_factor": Uniform(0.9, 1.1), "e": Uniform(0.85, 1.0)})
    response = overturning_response(inputs, SHELF, tp.HousnerImpact(), GROUND, [2.0, 4.0])
    return {
        "fragility": _shown(tp.plot.fragility(curves, block="shelf")),
        "indices": _shown(tp.plot.indices(sobol_indices(inputs, response, 8, replicates=20).isel(output=0))),
        "inventory": _shown(tp.plot.inventory(_assessed())),
        "inventory_exceedance": _shown(tp.plot.inventory(_assessed(), view="exceedance")),
        "measures": _shown(tp.plot.measures(rank_measures(runs, GROUND, replicates=20), block="shelf")),
        "risk": _shown(tp.plot.risk(rates, block="shelf")),
        "sensitivity": _shown(tp.plot.sensitivity(studies.Study.from_toml("sensitivity.toml").run())),
        "uncertainty": _shown(tp.plot.uncertainty(studies.Study.from_toml("uncertainty.toml").run())),
        "samples": uncertain_ida(inputs, SHELF, tp.HousnerImpact(), GROUND, LEVELS, samples=4),
    }


def film():
    response = tp.simulate(SHELF, tp.HousnerImpact(), tp.motions.Ricker(5.0, 8.0, dt=0.01).sample())
    return {"animate": tp.animate(response, "film.gif", speed=4.0, fps=10, size=240).name}


def top_level():
    """Names of toppling itself that the scripts of its packages take from there."""
    names = [
        tp.Bed, tp.Block, tp.DiscreteDamping, tp.Edge, tp.EnergyConsistent, tp.GianniniMasiani, tp.HazardCurve,
        tp.HousnerImpact, tp.MakrisKonstantinidis, tp.Restraint, tp.Sliding, tp.Study, tp.Vassiliou, tp.ViscousDamping,
        tp.Wall, tp.animate, tp.annual_rate, tp.cloud, tp.fit_fragility, tp.free_rocking, tp.ida,
        tp.overturning_probability, tp.read_hazard, tp.simulate, tp.stripes,
    ]  # fmt: skip
    return {"names": [name.__name__ for name in names], "catalogue": len(tp.catalogue)}
