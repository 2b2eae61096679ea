"""Studies of a region: curves from one surface a law, what the file may hold, kills, reports, and what is refused."""

import shutil

import numpy as np
import pytest
import xarray as xr
from check_facts import notes_named
from real_processes import killed_at, same_after_ten_kills
from study_texts import motions, study_in

import toppling as tp
from toppling.core.doubts import ImplausibleInput
from toppling.fragility.analyses import region_runs
from toppling.fragility.surfaces.checks import BLOCKS, MOTIONS
from toppling.models.block_array import BlockArray
from toppling.studies.command.cli import main
from toppling.studies.command.forecast import forecast
from toppling.studies.command.status import status_of
from toppling.studies.command.verdict import verdict
from toppling.studies.facts import answer_curves as curves
from toppling.studies.facts.say import say
from toppling.studies.file.blocks import read_blocks
from toppling.studies.plots.fragility import fragility_figure
from toppling.studies.plots.region import maps
from toppling.studies.region.reading import read_region
from toppling.studies.region.rows import event_levels, examples
from toppling.studies.tables.region import spread, surfaces
from toppling.studies.text.error import StudyError

pytestmark = pytest.mark.lowest

STUDY = f"""
title = "Shelves of a region"
blocks_file = "blocks.csv"
[[models]]
law = "energy-consistent"
{motions(2000, 6, 0.02, 4)}[ida]
im = "pga"
levels = "pooled"
[until]
median = 0.25
motions = {{ least = 32 }}
"""
HAZARD = "[hazard]\nk0 = 1e-4\nk = 2\nunit = 'g'\n"


def csv(n=40, start="name,width_m,height_m\n"):
    heights = np.linspace(1.2, 2.0, n)
    widths = heights / (3.0 + 2.0 * np.modf(np.arange(n) * 0.618)[0])
    return start + "".join(f"shelf {i},{w:.3f},{h:.3f}\n" for i, (w, h) in enumerate(zip(widths, heights, strict=True)))


@pytest.fixture
def study(tmp_path):
    return lambda text=STUDY, blocks=None: study_in(tmp_path, text, blocks=csv() if blocks is None else blocks)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pooled")
    return study_in(folder, STUDY + HAZARD, blocks=csv()).run(folder / "out"), folder / "out/results.nc"


def columns(tmp_path, text):
    (tmp_path / "own.csv").write_text(text, encoding="utf-8")
    return tmp_path / "own.csv"


@pytest.mark.parametrize(
    "text",
    [
        csv(),
        "# a comment\n\n" + csv(5),
        csv(5).replace("\n", "\r\n"),
        "height_m;name;width_m\n1.8; a ;0.4\n\n1.6;b;0.5\n",
        "name,width_m,height_m,cm_height_m,inertia_factor\na,0.4,1.8,0.7,1.3\nb,0.5,1.6,,\n",
        "name,alpha_rad,R_m,inertia_factor\na,0.2,0.9,\nb,0.25,1.0,1.4\n",
        "name,alpha_rad,R_m,width_m,height_m\na,0.2,0.9,,\nb,,,0.4,1.8\n",
        # these are read line by line
        'name,width_m,height_m\n"shelf, left",0.4,1.8\nb,0.5,1.6\n',
        "name;width_m;height_m\na;0,4;1,8\nb;0,5;1,6\n",
        "name,catalogue,width_m,height_m\na,bookcase-5-shelf,,\nb,,0.5,1.6\n",
        "width_m,height_m\n0.4,1.8\n0.5,1.6\n",
    ],
)
def test_columns_are_what_lines_give(text, tmp_path):
    file = columns(tmp_path, text)
    found, own = read_region(file), BlockArray.of(read_blocks(file))
    assert found.names.tolist() == own.names.tolist()
    for name in ("width", "height", "cm_height", "inertia"):
        np.testing.assert_allclose(getattr(found, name), getattr(own, name), rtol=1e-15)


def test_a_table_read_by_columns_has_the_warnings_of_lines(tmp_path):
    text = "# dimensions in ft\nname,width_m,height_m\na,1.2,5.0\n#b,1.3,5.5\nc,1.4,5.2"
    for read in (read_region, read_blocks):
        with pytest.warns(ImplausibleInput) as caught:
            read(columns(tmp_path, text))
        said = " ".join(str(warning.message) for warning in caught)
        assert all(part in said for part in ("a comment says 'dimensions in ft'", "line 4: left out", "no line end"))


def test_the_range_of_a_wrong_model_is_about_the_rate(finished):
    """Rates of a hazard of slope 2 go with the inverse square of all capacities."""
    results, _ = finished
    for end, sign in (("lower", -1.0), ("upper", 1.0)):
        factor = results[f"rate_modelling_{end}"] / results["rate"]
        np.testing.assert_allclose(factor, np.exp(sign * 2.0 * 0.3 * 1.2815516), rtol=2e-3)


def test_shares_of_rates_are_those_of_the_curves(finished):
    results, _ = finished
    hazard = tp.HazardCurve.power_law(1e-4, 2.0, "pga", "g")
    curves = xr.Dataset(
        {"median": results["median"], "dispersion": results["dispersion"]}, attrs={"im": "pga", "form": "lognormal"}
    )
    rates = tp.annual_rate(curves, hazard)
    for side in ("below", "above"):
        np.testing.assert_allclose(results[f"rate_share_{side}"], rates[f"share_{side}"], rtol=1e-9, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("at", [1, 3])
def test_an_interrupted_study_goes_on_and_has_the_same_bytes(at, finished, tmp_path, monkeypatch):
    for name in ("study.toml", "blocks.csv"):
        shutil.copy(finished[1].parents[1] / name, tmp_path)
    study = tp.Study.from_toml(tmp_path / "study.toml")
    with killed_at(at, monkeypatch, region_runs, "run_wave"):
        study.run(tmp_path / "out")
    assert status_of(tmp_path / "out").state == "interrupted"
    study.run(tmp_path / "out")
    assert (tmp_path / "out/results.nc").read_bytes() == finished[1].read_bytes()


def test_other_blocks_are_another_study(study, finished):
    one, other = study(STUDY + HAZARD), study(STUDY + HAZARD, csv(41))
    assert one.identity == finished[0].attrs["identity"]
    assert other.identity != one.identity


@pytest.mark.slow
def test_floors_of_a_building_are_made_before(study):
    building = '[building]\nkind = "flexural-shear"\nperiod_s = 0.5\nstoreys = 3\nfloors = [3]\n[until]'
    text = STUDY.replace("[until]", building).replace("number = 2000", "number = 100").replace("0.25", "0.5")
    one = study(text)
    assert one.design.generator is None
    results = one.run()
    assert set(results["motions_run"].values.tolist()) <= {64, 96, 100}


@pytest.mark.slow
def test_both_ways_takes_a_motion_twice(study):
    both = study(STUDY.replace('im = "pga"', 'im = "pga"\npolarity = "both"'))
    results = both.run()
    motions = results["run_motion"].values
    _, counts = np.unique(motions, return_counts=True)
    assert (counts == 32).all()


def test_the_forecast_has_a_range_that_holds_the_motions(study):
    one = study(STUDY.replace("median = 0.25", "median = 0.1"))
    few, usual, many = one.design.expected
    # (730 motions were seen for three hundred shelves, 582 for two thousand)
    assert few < 582
    assert many > 730
    assert one.design.runs_of(usual) == 16 * usual + BLOCKS * max(MOTIONS, usual // 6)
    lines = forecast(one)
    assert "at most" in lines[0]
    assert "of runs on" in lines[2]


def test_curves_are_drawn_of_blocks_at_both_ends_and_in_the_middle(finished):
    results, _ = finished
    drawn = examples(results)
    medians = results["half_level"].values[:, 0]
    found = drawn["half_level"].values[:, 0]
    assert (found[0], found[-1]) == (medians.min(), medians.max())
    assert drawn.sizes["block"] == 3
    caption = fragility_figure(drawn).get_label()
    assert "Lines" in caption
    assert "Ticks" not in caption
    assert "Points" not in caption


def test_maps_are_of_areas_or_of_lines(finished):
    results, _ = finished
    # (results of an analysis in Python have no axis of their curves)
    for given in (results, results.drop_vars("intensity")):
        assert [name for name, _ in maps(given)] == ["map_half_level", "map_rate"]
    one = next(figure for _, figure in maps(results.isel(block=[0])))
    assert one.axes[0].get_yscale() == "log"


def test_maps_of_blocks_without_an_area(finished):
    """On a line of slenderness and size, and where too few blocks have a rate for an area, or none."""
    results, _ = finished
    few, size = results.isel(block=slice(30)), np.linspace(0.5, 1.4, 30)
    line = few.assign_coords(R=("block", size), alpha=("block", np.arctan(1.0 / (3.0 + 2.0 * (size - 0.5)))))
    one = next(figure for _, figure in maps(line))
    assert one.axes[0].get_yscale() == "log"
    one.draw_without_rendering()
    labels = [label.get_text() for label in one.axes[0].get_yticklabels()]
    assert len(labels) >= 2
    assert all(float(label) > 0.0 for label in labels), labels
    for known in (0, 2):
        rates = few["rate"].copy(deep=True)
        rates[known:] = np.inf
        drawn = dict(maps(few.assign(rate=rates)))["map_rate"]
        assert drawn.axes[0].get_ylabel() == "Size R (m)"
        assert len(drawn.axes[0].texts) == (known == 0)


def test_tables_say_what_was_reached_and_of_how_many(finished):
    assert "25 %" in surfaces(finished[0]).note
    assert "40 blocks" in spread(finished[0]).note


def test_the_export_has_every_curve(finished, tmp_path):
    assert main(["export", str(finished[1]), "--out", str(tmp_path), "--format", "csv"]) == 0
    assert len((tmp_path / "curves.csv").read_text(encoding="utf-8").splitlines()) >= 41


@pytest.mark.slow
def test_a_study_that_no_result_can_be_made_of_says_so(study, tmp_path, capsys):
    """Its status does not promise that the same command goes on; another try clears what it says."""
    made = study(STUDY.replace("number = 2000", "number = 64").replace("{ least = 32 }", "{ least = 64, most = 64 }"))
    made = study(made_text := (tmp_path / "study.toml").read_text().replace("[until]", "[until]\nruns_per_motion = 1"))
    assert "runs_per_motion" in made_text
    out = tmp_path / "out"
    for _ in range(2):
        with pytest.raises(StudyError, match="64 motions of 1 block each are too few for a surface"):
            made.run(out)
        lines = status_of(out).lines(out)
        assert any("without a result" in line for line in lines)
        assert not any("goes on" in line for line in lines)


def test_squat_and_implausible_blocks_are_named(study):
    found = study(blocks=csv() + "plinth,1.2,1.3\ntower,3.0,25\n")
    assert [fact.names for fact in found.squat] == [("plinth",)]
    assert any(one.kind == "block size" and "tower" in one.sentence for one in found.doubts)


EVENTS = '[events]\nlevels = { values = [0.3, 0.5], unit = "g" }\nmotions = 40\nsample = 25\n'


@pytest.mark.parametrize(("levels", "doubted"), [("0.3, 0.5", False), ("30, 40", True)])
def test_levels_of_events_are_doubted(study, levels, doubted):
    doubts = study(STUDY + EVENTS.replace("0.3, 0.5", levels)).doubts
    assert ("level" in {doubt.kind for doubt in doubts}) == doubted


@pytest.fixture(scope="module")
def with_events(tmp_path_factory):
    folder = tmp_path_factory.mktemp("events")
    made = study_in(folder, STUDY + EVENTS, blocks=csv())
    told: list[tuple[int, int]] = []
    results = made.run(folder / "out", progress=lambda *counts: told.append(counts))
    return made, results, folder / "out/results.nc", told


def test_progress_counts_surfaces_and_events(with_events):
    made, results, path, told = with_events
    assert not notes_named(results, "region.joint_falls")
    done, totals = (np.array(one) for one in zip(*told, strict=True))
    assert (np.diff(done) >= 0).all()
    assert (done[:-1] < totals[:-1]).all()
    assert done[-1] == totals[-1] > results["run_level"].size + made.event_runs  # (and runs that check surfaces)
    line = path.with_name("run.log").read_text().splitlines()[-1]
    assert f"finished: {done[-1]:,} runs, " in line


def test_the_answer_says_how_much_falls_in_one_event(with_events):
    """At each level the mean share of the region and the range of nine tenths of the events; of many levels three."""
    results = with_events[1]
    one = results.isel(model=0)
    events = [fact for fact in curves.answer(results) if fact.what == "region.event"]
    assert [fact.value for fact in events] == one["fallen_mean"].values.tolist()
    for fact, level, (low, _, high) in zip(events, (0.3, 0.5), one["fallen_quantile"].values, strict=True):
        assert (fact.level, fact.lower, fact.upper) == (pytest.approx(level), low, high)
        assert (fact.unit, fact.more["number"], fact.more["share"]) == ("g", 40, pytest.approx(0.9))
        assert say(fact, "page") in verdict(results, True)[0]
    many = xr.concat([results[["fallen_mean", "fallen_quantile"]].isel(event_level=[0])] * 5, "event_level")
    many = many.assign_coords(event_level=9.80665 * np.array([0.1, 0.2, 0.3, 0.4, 0.5])).assign_attrs(results.attrs)
    many["fallen_mean"][0] = [0.01, 0.12, 0.3, 0.55, 0.8]
    many = many.assign(results[["half_level"]].data_vars).assign_coords(intensity=results["intensity"])
    assert [event[0] / 9.80665 for event in event_levels(many)] == pytest.approx([0.2, 0.4, 0.5])
    assert event_levels(results.drop_vars("fallen_mean")) == []


def test_columns_of_what_blocks_have_of_their_own(study, tmp_path):
    text = "name,width_m,height_m,e,delta\na,0.4,1.8,0.9,0.05\nb,0.5,1.6,0.92,0.03\n"
    found = read_region(columns(tmp_path, text))
    np.testing.assert_array_equal(found.own["e"], [0.9, 0.92])
    np.testing.assert_array_equal(found.own["delta"], [0.05, 0.03])
    one = study(blocks=text)
    other = study(blocks=text.replace("0.03", "0.04"))
    assert one.region.own["delta"][1] == 0.03
    assert one.identity != other.identity


@pytest.mark.slow
def test_a_study_of_blocks_with_their_own_e(study, tmp_path):
    table = csv().splitlines()
    text = "\n".join([f"{table[0]},e", *(f"{line},{0.86 + 0.002 * i:.3f}" for i, line in enumerate(table[1:]))])
    results = study(blocks=text + "\n").run(tmp_path / "out")
    assert results["model"].values.tolist() == ["energy-consistent e=own δ=0.05"]
    np.testing.assert_allclose(results["own_e"], 0.86 + 0.002 * np.arange(40))
    assert np.isfinite(results["check_e"].values).any()
    assert len(list(maps(results))) == 1


@pytest.mark.slow
def test_ten_kills_change_nothing(tmp_path):
    """Killed ten times, whenever it has kept something new, a study with rates has the bytes of an undisturbed run."""
    (tmp_path / "study.toml").write_text(STUDY.replace("0.25", "0.2") + HAZARD, encoding="utf-8")
    (tmp_path / "blocks.csv").write_text(csv(), encoding="utf-8")
    assert same_after_ten_kills(tmp_path)
