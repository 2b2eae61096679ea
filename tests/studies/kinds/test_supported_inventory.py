"""Inventories on benches and isolated platforms: every run is that of the same steps in Python; strikes are said."""

import dataclasses

import numpy as np
import pytest
from check_facts import facts_of, numbers_in
from study_texts import motions, study_in

import toppling as tp
from toppling.models.friction import FixedFriction
from toppling.motions import Building, CloughPenzien, Isolator, Support, Yielding, scale_to
from toppling.studies import Assessment, StudyError, assess
from toppling.studies.facts.method import method_of
from toppling.studies.inventory.contents import Contents, Inventory, Stand
from toppling.studies.inventory.reading import read_inventory

HEAD = f"""
title = "Vases on benches and platforms"
[[models]]
law = "energy-consistent"
{motions(6, 8, 0.01, 3)}"""
BUILDING = '[building]\nkind = "storeys"\nmasses_kg = [2e5, 2e5]\nstiffnesses_n_m = [2e8, 2e8]\n'
PERFORMANCE = '[performance]\ninventory = "things.csv"\nim = "pga"\nlevels = { values = [1.5, 3, 6], unit = "m/s2" }\n'
SUPPORTS = {
    "bench": ('kind = "bench"\nfrequency_hz = 4\n', Support(4.0)),
    "soft": ('kind = "linear"\nperiod_s = 2.0\ndamping = 0.15\n', Isolator.linear(2.0, 0.15)),
    "lead": ('kind = "bilinear"\nperiod_s = 2.5\nstrength = 0.05\nclearance_mm = 1\n', Isolator.bilinear(2.5, 0.05)),
    "held": (
        'kind = "pendulum"\nradius_m = 1.5\nfriction = 0.05\nclearance_mm = 10\nstop_frequency_hz = 10\n',
        Isolator.pendulum(1.5, 0.05, clearance=0.01, stop_frequency=10.0),
    ),
    "dish": ('kind = "pendulum"\nradius_m = 1.5\nfriction = 0.05\n', Isolator.pendulum(1.5, 0.05)),
}
LEVELS = (1.5, 3.0, 6.0)
LAW = tp.EnergyConsistent()
BLOCK = tp.Block(0.15, 0.75)


def table(*names):
    return "".join(f'[[supports]]\nname = "{name}"\n{SUPPORTS[name][0]}' for name in names)


def things(*lines):
    rows = (f"{name}-{floor},0.15,0.75,{floor},2,{support}" for name, floor, support in lines)
    return "item,width_m,height_m,floor,count,support\n" + "\n".join(rows) + "\n"


def study(folder, inventory, *parts):
    return study_in(folder, HEAD + "".join(parts), things=inventory)


def ground():
    return CloughPenzien(duration=8.0, dt=0.01).sample(6, 3)


def share(on_top):
    """The share of motions, as they are, that overturn the vase."""
    plain = on_top.drop_vars("own_level", errors="ignore")
    return float(tp.ida(BLOCK, LAW, plain, [1.0], "scale")["overturned"].mean())


def wanted(support, floor=0, frame=None):
    """The same in Python: motions scaled, through the building, through the support."""
    found = []
    for level in LEVELS:
        below = scale_to(ground(), level, "pga")
        if frame is not None:
            below = frame.floor_motions(below, floors=[floor]).isel(floor=0, drop=True)
            below = below.drop_vars("own_level", errors="ignore")
        found.append(share(below if support is None else support.motions(below)))
    return found


FLOOR = ("floor", 0, "")


@pytest.mark.slow
@pytest.mark.parametrize("yields", [False, True])
def test_in_a_building_every_run_is_that_of_the_steps_in_python(tmp_path, yields):
    frame = Building.from_storeys([2e5, 2e5], [2e8, 2e8], yielding=Yielding(0.1) if yields else None)
    lines = [("floor", 2, ""), *((name, 2, name) for name in SUPPORTS), ("dish", 0, "dish")]
    text = BUILDING + ("yield_coefficient = 0.1\n" if yields else "")
    result = study(tmp_path, things(*lines), text, table(*SUPPORTS), PERFORMANCE).run()
    expected = [wanted(None if not on else SUPPORTS[on][1], floor, frame) for _, floor, on in lines]
    np.testing.assert_array_equal(result["probability"].isel(model=0), expected)
    assert ("building_ductility" in result) == yields
    # (elastic benches alone are scaled with the ground, and give the same)
    alone = study(tmp_path, things(lines[0], ("bench", 2, "bench")), text, table("bench"), PERFORMANCE).run()
    np.testing.assert_array_equal(alone["probability"].isel(model=0), expected[:2])


@pytest.mark.slow
def test_motions_as_they_are_and_both_ways(tmp_path):
    asked = '[performance]\ninventory = "things.csv"\npolarity = "both"\n'
    result = study(tmp_path, things(FLOOR, ("dish", 0, "dish")), table("dish"), asked).run()
    both = [share(SUPPORTS["dish"][1].motions(sign * ground())) for sign in (1.0, -1.0)]
    np.testing.assert_allclose(result["probability"].isel(model=0, block=1), [np.mean(both)], rtol=1e-12)


def test_strikes_are_said_by_platform_and_level(tmp_path):
    made = study(tmp_path, things(("lead", 0, "lead")), table("lead"), PERFORMANCE)
    ways = [SUPPORTS["lead"][1].motions(scale_to(ground(), level, "pga")) for level in LEVELS]
    said = [doubt.sentence for doubt in made.doubts if doubt.kind == "strike"]
    assert len(said) == sum(bool((one["support_displacement"] > 1e-3).any()) for one in ways) > 0
    last = ways[-1]["support_displacement"]
    under = f"under {int((last > 1e-3).sum())} of 6 motions, by up to {float(last.max()):.3g} m"
    assert said[-1].startswith("support 'lead'")
    assert numbers_in(said[-1])[:3] == [0, 6, 0.001]
    assert under in said[-1]


@pytest.mark.slow
def test_modelled_strikes_are_counted(tmp_path):
    made = study(tmp_path, things(("held", 0, "held")), table("held"), PERFORMANCE)
    last = SUPPORTS["held"][1].motions(scale_to(ground(), LEVELS[-1], "pga"))
    said = [doubt.sentence for doubt in made.doubts if doubt.kind == "strike"]
    assert said[-1].startswith("support 'held'")
    assert numbers_in(said[-1])[:3] == [0, 6, 0.01]
    assert (
        f"({int(last['strikes'].sum())} strikes, up to {float(last['strike_acceleration'].max()):.3g} m/s²)" in said[-1]
    )
    on = facts_of(method_of, made.run())["support.on"]
    assert (on.names[0], on.more["clearance"], on.more["frequency"] > 0.0) == ("held", 10, True)


def test_a_stand_decides_the_identity(tmp_path):
    made = study(tmp_path, things(FLOOR, ("bench", 0, "bench")), table("bench"), PERFORMANCE)
    other = study(tmp_path, things(FLOOR, ("bench", 0, "")), PERFORMANCE)
    assert other.identity != made.identity
    stiffer = table("bench").replace("= 4", "= 5")
    assert study(tmp_path, things(FLOOR, ("bench", 0, "bench")), stiffer, PERFORMANCE).identity != made.identity


def test_pieces_slide_on_their_stand():
    """Slides and falls of what stands on a bench are those of the same piece on a floor that moves as the bench."""
    stand = Stand("bench", Support(4.0))
    row = Contents("vase", BLOCK, 0, friction=FixedFriction(0.18), stand=stand)
    above = assess(Inventory((row,)), Assessment(LAW, 3.0 * ground(), [1.0], "scale"))
    floor = Inventory((dataclasses.replace(row, stand=None),))
    same = assess(floor, Assessment(LAW, stand.support.motions(3.0 * ground()), [1.0], "scale"))
    below = assess(floor, Assessment(LAW, 3.0 * ground(), [1.0], "scale"))
    names = [str(name) for name in same.data_vars if same[name].dtype.kind in "bfi"]
    assert any("slip" in name or "slide" in name for name in names)
    for name in names:
        np.testing.assert_array_equal(above[name], same[name])
    assert not all(np.array_equal(below[name], same[name], equal_nan=True) for name in names if "sli" in name)


def test_what_stands_on_a_piece_shares_its_support(tmp_path):
    text = (
        "item,width_m,height_m,floor,friction,stands_on,support\n"
        "plinth,0.6,0.5,0,0.5,,bench\nbust,0.2,0.6,0,0.5,plinth,{}\n"
    )
    stands = {"bench": Stand("bench", Support(4.0))}
    (tmp_path / "good.csv").write_text(text.format("bench"))
    assert len(read_inventory(tmp_path / "good.csv", stands=stands)) == 2
    (tmp_path / "bad.csv").write_text(text.format(""))
    with pytest.raises(StudyError, match=r"must be on its own floor \(and support\)"):
        read_inventory(tmp_path / "bad.csv", stands=stands)


def test_refused(refusal):
    refusal()
