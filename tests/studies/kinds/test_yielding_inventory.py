"""Inventories in a building that yields: every run is that of the same steps in Python, and a collapse is said."""

import numpy as np
import pytest
from check_facts import doubts_of, facts_of, notes_named
from study_texts import changed, motions, study_in

import toppling as tp
from toppling.fragility import slide_runs
from toppling.models.friction import Contact, LognormalFriction
from toppling.motions import Building, CloughPenzien, Yielding, scale_to
from toppling.studies import StudyError
from toppling.studies.facts.method import inputs_of, method_of
from toppling.studies.inventory.reading import read_inventory

TEXT = f"""
title = "An office in a building that yields"
[[models]]
law = "energy-consistent"
{motions(6, 8, 0.01, 3)}[building]
kind = "storeys"
masses_kg = [2e5, 2e5]
stiffnesses_n_m = [2e8, 2e8]
yield_coefficient = 0.15
p_delta = true
[performance]
inventory = "things.csv"
im = "Sa(0.5)"
levels = {{ values = [4, 12], unit = "m/s2" }}
"""
THINGS = (
    "item,width_m,height_m,floor,count,value\ncabinet,0.4,1.8,0,2,100\nshelf,0.4,1.8,2,3,200\nvase,0.08,0.5,1,1,50\n"
)
LEVELS = (4.0, 12.0)
LAW = tp.EnergyConsistent()


def study(folder, *changes, more="", things=THINGS):
    return study_in(folder, changed(TEXT, *changes) + more, things=things)


def ground(seed=3, number=6):
    return CloughPenzien(duration=8.0, dt=0.01).sample(number, seed)


CODE = '[performance.code]\nstandard = "asce7-22"\nsds_g = 0.5\ndesign_category = "D"\n'


@pytest.mark.slow
def test_a_default_strength_takes_the_hazard_of_the_code(tmp_path):
    """S_DS of [performance.code] and S_D1 of the building: the same floors as with the strength by hand."""
    by_code = ("yield_coefficient = 0.15", 'system = "special-braced-frame"\nsd1_g = 0.3')
    result = study(tmp_path, by_code, more=CODE).run()
    coefficient = 2.0 / 6.0 * min(0.5, 0.3 / float(frame().periods[0]))
    same = study(tmp_path, ("yield_coefficient = 0.15", f"yield_coefficient = {coefficient!r}"), more=CODE).run()
    np.testing.assert_allclose(result["building_ductility"], same["building_ductility"], rtol=1e-9)
    assert len(notes_named(result, "building.default_strength")) == 1
    given = facts_of(inputs_of, result)["building.given"]
    assert "Default strength" in " ".join(given.names)
    with pytest.raises(StudyError, match="are of one site: state one of them"):
        study(tmp_path, (by_code[0], f"{by_code[1]}\nsds_g = 0.6"), more=CODE)
    with pytest.raises(StudyError, match="without one there is no default strength"):
        study(tmp_path, by_code)


def frame(strength=None):
    return Building.from_storeys([2e5, 2e5], [2e8, 2e8], yielding=strength)


def yielding(coefficient=0.15):
    return frame(Yielding(coefficient, p_delta=True))


def chances(floors, folder, levels=LEVELS):
    """The share of the motions that overturn each line, by runs of each block on its own floor: (item, level)."""
    rows = read_inventory(folder / "things.csv").rows
    found = np.empty((len(rows), len(floors)))
    for i, row in enumerate(rows):
        for k, moved in enumerate(floors):
            here = moved.sel(floor=row.floor, drop=True).drop_vars("own_level", errors="ignore")
            runs = tp.ida(row.block, LAW, here, [1.0], "scale")
            found[i, k] = float(runs["overturned"].mean())
    return found


@pytest.mark.slow
def test_every_run_is_that_of_the_steps_in_python(tmp_path):
    result = study(tmp_path).run()
    scaled = [scale_to(ground(), level, "Sa(0.5)") for level in LEVELS]
    floors = [yielding().floor_motions(one) for one in scaled]
    wanted = chances(floors, tmp_path)
    np.testing.assert_array_equal(result["probability"].isel(model=0), wanted)
    # (an elastic building shakes them otherwise, but for those on the ground)
    elastic = chances([frame().floor_motions(one) for one in scaled], tmp_path)
    assert (elastic[0] == wanted[0]).all()
    assert (elastic[1:] != wanted[1:]).any()
    ductility = [one["ductility"].values for one in floors]
    np.testing.assert_allclose(result["building_ductility"], ductility, rtol=1e-12)
    assert (result["building_collapsed"] == 0).all()
    given = facts_of(inputs_of, result)["building.given"]
    assert (len(given.names), given.more["yields"]) == (2, True)
    assert "12 m/s2 drifts" in given.names[1]
    assert {"building.yields", "building.elastic"} & facts_of(method_of, result).keys() == {"building.yields"}


@pytest.mark.slow
def test_motions_as_they_are_are_not_scaled(tmp_path):
    as_they_are = ('im = "Sa(0.5)"\nlevels = { values = [4, 12], unit = "m/s2" }\n', "")
    result = study(tmp_path, as_they_are).run()
    floors = [yielding().floor_motions(ground())]
    np.testing.assert_array_equal(result["probability"].isel(model=0), chances(floors, tmp_path))
    np.testing.assert_allclose(result["building_ductility"], [floors[0]["ductility"]], rtol=1e-12)


HAZARD = '[hazard]\nk0 = 1e-2\nk = 2\nunit = "m/s2"\n'


@pytest.mark.slow
def test_both_ways(tmp_path):
    result = study(tmp_path, ("[performance]", '[performance]\npolarity = "both"'), more=HAZARD).run()
    plain = study(tmp_path, more=HAZARD).run()
    assert result.sizes["motion"] == 2 * plain.sizes["motion"]
    for ways in (slice(0, None, 2), slice(1, None, 2)):
        np.testing.assert_array_equal(result["building_ductility"][:, ways], plain["building_ductility"])
    # (what is on the floors falls as it does under the motions and the reversed ones through the building)
    scaled = [scale_to(ground(), level, "Sa(0.5)") for level in LEVELS]
    halves = [chances([yielding().floor_motions(sign * one) for one in scaled], tmp_path) for sign in (1.0, -1.0)]
    np.testing.assert_allclose(result["probability"].isel(model=0), np.mean(halves, axis=0), rtol=1e-12)


@pytest.mark.slow
def test_branches_of_motions_go_through_the_building_too(tmp_path):
    others = (
        '[[motion_sets]]\nname = "others"\nmotions = { generator = "clough-penzien", number = 6, duration_s = 8, '
        'dt_s = 0.01, seed = 8 }\n[[branches]]\nof = "motions"\nnames = ["motions", "others"]\nweights = [0.5, 0.5]\n'
    )
    found = study(tmp_path, more=HAZARD + others).run()
    own = [study(tmp_path, ("seed = 3", f"seed = {seed}"), more=HAZARD).run() for seed in (3, 8)]
    each = [one["annual_number"].isel(model=0).values for one in own]
    assert not np.array_equal(each[0], each[1])
    np.testing.assert_allclose(found["branch_annual_number"], np.transpose(each), rtol=1e-12)


@pytest.mark.slow
def test_a_collapse_is_an_outcome_and_said(tmp_path, capsys):
    weak = (
        ("yield_coefficient = 0.15", "yield_coefficient = 0.01"),
        ("values = [4, 12]", "values = [4, 60]"),
        ("masses_kg = [2e5, 2e5]", "masses_kg = [9e5, 9e5]"),
    )
    made = study(tmp_path, *weak)
    result = made.run()
    building = Building.from_storeys([9e5, 9e5], [2e8, 2e8], yielding=Yielding(0.01, p_delta=True))
    with pytest.warns(tp.motions.CollapsingBuilding):
        floors = [building.floor_motions(scale_to(ground(), level, "Sa(0.5)")) for level in (4.0, 60.0)]
    np.testing.assert_array_equal(result["building_collapsed"], [one["collapsed"].values for one in floors])
    assert (result["building_collapsed"][1] > 0).any()
    np.testing.assert_array_equal(result["probability"].isel(model=0), chances(floors, tmp_path))
    (doubt,) = doubts_of(result, "collapse")
    assert "60 m/s2" in doubt
    assert doubt in made.notes
    collapses = facts_of(method_of, result)["building.collapses"]
    assert (collapses.value, collapses.more["cases"]) == (int((result["building_collapsed"] > 0).sum()), 12)


def test_motions_of_all_levels_are_judged_together(tmp_path, monkeypatch):
    monkeypatch.setattr("toppling.studies.plan.size.MOST_NUMBERS", 500_000)
    with pytest.raises(StudyError, match="all levels would hold"):
        study(tmp_path, ("duration_s = 8", "duration_s = 80"), ("number = 6", "number = 20"))


PIECES = {"cabinet": (tp.Block(0.4, 1.8), 0, None), "vase": (tp.Block(0.02, 0.12), 2, 20)}
"""Block, floor, and distance to an obstacle in mm."""


@pytest.mark.slow
@pytest.mark.parametrize("polarity", ["as recorded", "both"])
def test_slides_and_trips_on_floors_that_do_not_scale(tmp_path, polarity):
    """Chances that are neither 0 nor 1, of the runs of each piece on its own floor at each level, one by one."""
    friction = LognormalFriction(0.15, 0.4)
    more = (
        f'polarity = "{polarity}"\n[friction]\nstatic = 0.15\ndispersion = 0.4\nkinetic_ratio = 0.9\nslips_m = [0.02]\n'
    )
    lines = [f"{name},{b.width},{b.height},{floor},{trip or ''}" for name, (b, floor, trip) in PIECES.items()]
    things = "\n".join(["item,width_m,height_m,floor,trip_mm", *lines, ""])
    result = study(tmp_path, more=more, things=things).run()
    seen = set()
    for k, level in enumerate(LEVELS):
        moved = yielding().floor_motions(scale_to(ground(), level, "Sa(0.5)"))
        for name, (block, floor, trip) in PIECES.items():
            here = moved.sel(floor=floor, drop=True).drop_vars("own_level", errors="ignore")
            runs = tp.ida(block, LAW, here, [1.0], "scale")
            slid = slide_runs(runs, here, Contact(friction, 0.9), draws=20, trip=None if trip is None else 1e-3 * trip)
            expected = {"slip": (slid["slide_peak"].values > 0.02).mean()}
            if trip is not None:
                expected["trip"] = slid["trips"].values.mean()
            for what, chance in expected.items():
                value = result[f"{what}_probability"].sel(block=name).values.ravel()[k]
                assert value == pytest.approx(chance, rel=1e-12), (what, name, level)
                seen |= {(what, bool(0.0 < chance < 1.0))}
    assert {("slip", True), ("trip", True)} <= seen
