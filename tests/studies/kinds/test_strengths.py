"""The strength that a restraint needs for a target, held to studies that are run with exactly that strength."""

import math

import numpy as np
import pytest
from check_facts import facts_of
from study_texts import IDA, motions

import toppling as tp
from toppling.studies.command.verdict import verdict
from toppling.studies.facts import answer_curves as curves
from toppling.studies.facts.say import say
from toppling.studies.plan.restraints import needed_strengths

CABINET = '[[blocks]]\nname = "cabinet"\nwidth_m = 0.45\nheight_m = 1.8\nwall_gap_mm = 20\nmass_kg = 120\n'
STRAP = '{}kind = "strap", height_m = 1.7, strength_n = {}{}'
LAW = '[[models]]\nlaw = "housner"\ngeometry = "linear"\n'
HAZARD = '[hazard]\nk0 = 1e-4\nk = 2.5\nunit = "g"\nyears = 50\n[fit]\nreplicates = 100\n'
LEVELS = IDA.replace("to = 12.0, number = 7", "to = 20.0, number = 8")
ONE_LEVEL = '[ida]\nim = "pga"\nlevels = { values = [14.0], unit = "m/s2" }\n'


def study(folder, strength, target=None, rest=LEVELS + HAZARD, option=None, before=""):
    more = "" if target is None else f", target = {target}"
    block = CABINET + "restraint = { " + STRAP.format("", strength, more) + " }\n"
    file = folder / f"{strength}.toml"
    file.write_text(f'title = "Strap"\n{before}{block}{LAW}{motions(12)}{rest}', encoding="utf-8")
    return tp.Study.from_toml(file, option)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    return study(tmp_path_factory.mktemp("strengths"), 600, 0.002).run()


def chance(folder, strength, **options):
    found = study(folder, strength, **options).run()
    at_level = "risk_probability" not in found
    return float(found["probability" if at_level else "risk_probability"].values.ravel()[0])


@pytest.mark.slow
def test_the_strength_found_is_needed(results, tmp_path):
    """A study with exactly that strength keeps the target, and one with 7 % less does not."""
    needed = float(results["needed_strength"].item())
    assert results["needed_strength"].attrs["units"] == "N"
    assert 600 < needed < 19200
    assert chance(tmp_path, needed) <= 0.002 < chance(tmp_path, round(0.93 * needed, 1))
    tried, chances = (results[f"tried_{name}"].values.ravel() for name in ("strength", "chance"))
    assert (chances[tried >= needed] <= 0.002).all()
    assert tried[tried < needed][-1] > needed / 1.06
    assert chances[tried == 600].item() == pytest.approx(float(results["risk_probability"].item()), rel=1e-9)


def test_a_target_of_the_command_is_the_key(results, tmp_path):
    found = study(tmp_path, 600, option=0.002)
    assert found.configuration["blocks"][0]["restraint"]["target"] == 0.002
    named = CABINET + 'restraint = "kit"\n[restraints.kit]\nkind = "strap"\nheight_m = 1.7\nstrength_n = 600\n'
    (tmp_path / "named.toml").write_text('title = "a"\n' + named + LAW + motions(12) + LEVELS + HAZARD, "utf-8")
    assert tp.Study.from_toml(tmp_path / "named.toml", 0.002).targets == found.targets == (0.002,)


@pytest.mark.slow
def test_at_a_level_without_a_hazard(tmp_path):
    found = study(tmp_path, 300, 0.1, ONE_LEVEL).run()
    needed = float(found["needed_strength"].item())
    assert chance(tmp_path, needed, rest=ONE_LEVEL) <= 0.1 < chance(tmp_path, round(0.93 * needed, 1), rest=ONE_LEVEL)
    fact = facts_of(curves.answer, found)["restraint.needed"]
    assert (fact.value, fact.more["level"]) == (needed, pytest.approx(14.0 / 9.80665))
    assert math.isnan(fact.more["years"])


def test_where_the_answer_is_read(results):
    fact, needed = facts_of(curves.answer, results)["restraint.needed"], float(results["needed_strength"].item())
    assert fact.more["tried"] == results["tried_strength"].values.ravel().tolist()
    assert (fact.value, fact.names, fact.more["target"], fact.more["years"]) == (needed, ("“cabinet”",), 0.002, 50.0)
    assert say(fact, "page") in verdict(results, True)[0]


def step(strongest_that_misses, *more):
    """A block falls with a strength that misses, or with one of `more`."""

    def chances(held, law):
        strengths = [block.restraint.strength for block in held]
        return np.array([float(s <= strongest_that_misses or s in more) for s in strengths])

    return chances


@pytest.mark.parametrize(
    ("chances", "needed"),
    [
        (step(1000.0), 1050.0),  # (600 √2 … : 849, 1010, 1100, 1050: the last that misses is below 1,000)
        (step(1000.0, 4800.0), 5010.0),  # (a stronger one is worse: what is needed is above it)
        (step(math.inf), math.inf),
        (step(0.0), 75.0),
        (lambda held, law: np.full(len(held), np.nan), math.inf),  # (not shown is not kept)
    ],
)
def test_the_search(chances, needed):
    held = tp.Block(0.45, 1.8, mass=120.0, restraint=tp.Restraint.strap(1.7, 600.0))
    free = tp.Block(0.45, 1.8, name="free")
    found = needed_strengths([free, held], [None], [math.nan, 0.5], chances)
    assert math.isnan(found["needed_strength"][0, 0])
    assert float(found["needed_strength"][1, 0]) == pytest.approx(needed, rel=0.06)
    tight = tp.Block(0.45, 1.8, mass=120.0, restraint=tp.Restraint.strap(1.7, 600.0, preload=200.0))
    assert needed_strengths([tight], [None], [0.5], step(0.0))["needed_strength"].item() == 300.0


@pytest.mark.slow
def test_interrupted_searches_go_on(results, tmp_path):
    """Fewer runs than are announced leave no trace: results in a folder are those without one."""
    kept = study(tmp_path, 600, 0.002).run(tmp_path / "out")
    assert float(kept["needed_strength"].item()) == float(results["needed_strength"].item())
