"""What stands on pedestals is lost with them: totals, ranking, recommendation, table and answer of a study agree."""

import numpy as np
import pytest
from study_texts import ida, laws, motions, power_law, study_of

from toppling.studies.buildings.pieces import pieces_of
from toppling.studies.tables.pieces import exported_pieces

STUDY = (
    laws("housner")
    + 'geometry = "bilinear"\n'
    + laws("energy-consistent")
    + '[[branches]]\nof = "models"\nnames = ["housner e=e_R geometry=bilinear", "energy-consistent"]\n'
    + "weights = [0.6, 0.4]\n"
    + motions(20, 8, 0.01)
    + ida(0.1, 0.2, 0.3, 0.5, 0.8).replace("[ida]", '[performance]\ninventory = "objects.csv"')
    + power_law(1e-4, 2)
)
OBJECTS = """item,width_m,height_m,floor,count,value,currency,anchored,anchoring_cost,friction,stands_on
pedestal,0.2,1.2,0,1,100,EUR,,50,0.9,
vase,0.2,0.5,0,1,50000,EUR,,50,0.9,pedestal
clock,0.15,0.35,0,1,1000,EUR,yes,,,pedestal
plinth,0.2,1.3,0,2,300,EUR,,50,0.9,
bronze,0.15,0.35,0,2,40000,EUR,yes,,,plinth
"""


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("carried")
    return study_of(folder, STUDY, objects=OBJECTS).run()


def annual_loss(results, model, held=()):
    """The annual loss under a law with some lines held, from the flags and weights alone."""
    flags = results["overturned"].isel(model=model).values.astype(bool)
    fell = {str(item): flags[i] & (item not in held) for i, item in enumerate(results["block"].values)}
    lost = 100.0 * fell["pedestal"] + 50e3 * (fell["pedestal"] | fell["vase"]) + 1000.0 * fell["pedestal"]
    lost = lost + (2 * 300.0 + 2 * 40e3) * fell["plinth"]
    return float(results["level_weight"].values @ lost.mean(axis=-1))


@pytest.mark.parametrize("model", [0, 1])
def test_totals_savings_and_branches(results, model):
    pedestal, vase = (results["overturned"].sel(block=item).values[model].astype(bool) for item in ("pedestal", "vase"))
    assert (pedestal & ~vase).any()
    assert (pedestal & vase).any()
    here, whole = results.isel(model=model), annual_loss(results, model)
    assert here["annual_loss"].sel(place="building").item() == pytest.approx(whole, rel=1e-12)
    assert here["block_annual_loss"].sum("block").item() == pytest.approx(whole, rel=1e-12)
    assert here["ranked_left"].values[0] == pytest.approx(whole, rel=1e-12)
    assert results["branch_annual_loss"].values[0, model] == pytest.approx(whole, rel=1e-9)
    for item in ("pedestal", "vase", "plinth"):
        saved = whole - annual_loss(results, model, (item,))
        for name in ("ranked_saving", "block_annual_saving"):
            assert here[name].sel(block=item).item() == pytest.approx(saved, rel=1e-9), (name, item)


def test_recommendation_table_and_answer(results):
    """The plinth, whose load is fixed to it; of the pedestal, which moves in the falls of its vase, nothing is said."""
    found = {one.item: one for one in pieces_of(results)}
    saved = annual_loss(results, 0) - annual_loss(results, 0, ("plinth",))
    assert saved == pytest.approx(80_600.0 * results["rate"].sel(block="plinth").values[0], rel=1e-12)
    assert found["plinth"].saving.value == pytest.approx(saved, rel=1e-9)
    assert np.isnan([found[item].saving.value for item in ("pedestal", "vase")]).all()
    (row,) = [row for row in exported_pieces(results).lines if row["item"] == "plinth"]
    assert row["saving_a_year"].value == pytest.approx(saved, rel=1e-9)
    ranked = results.isel(model=0)["ranked_saving"]
    assert ranked.sel(block="plinth").item() == pytest.approx(saved, rel=1e-9)
