"""Performance studies on floor histories of a user's own building model, held against toppling's building model."""

import dataclasses
from pathlib import Path

import numpy as np
import own_building
import pytest
import xarray as xr
from assessed import anchoring, assess
from check_facts import notes_named

import toppling as tp
from toppling.core.units import STANDARD_GRAVITY
from toppling.fragility.curves.means import resampled_means
from toppling.fragility.hazard.level_weights import level_weights
from toppling.motions.floors.histories import FloorHistories, History
from toppling.studies import Assessment, StudyError
from toppling.studies.buildings.branches import Sampling, combinations, rates_over_branches
from toppling.studies.buildings.variables import Year
from toppling.studies.command.cli import main
from toppling.studies.inventory.contents import Contents, Inventory
from toppling.studies.inventory.reading import read_inventory

ROOT = Path(tp.__file__).parent
EXAMPLES = ROOT / "studies/examples"

LAW = tp.EnergyConsistent()
LEVELS = np.array([0.2, 0.4, 0.8]) * STANDARD_GRAVITY
FRAME = tp.motions.Building.flexural_shear(0.5, storeys=3)
SHELF, CASE = (tp.catalogue[name] for name in ("bookcase-5-shelf", "display-cabinet-glass"))
THINGS = Inventory(
    (
        Contents("shelf", SHELF, 1, 3, value=300.0, consequences=("injury",), anchoring_cost=20.0),
        Contents("case", CASE, 3, 2, value=900.0, consequences=("injury",), anchoring_cost=40.0),
        Contents("held", SHELF, 3, 1, value=900.0, anchored=True),
        Contents("low", tp.Block(0.5, 1.5), 3, 1, value=100.0, anchoring_cost=10.0),
    ),
    "EUR",
)
HAZARD = tp.HazardCurve(
    np.array([0.05, 0.1, 0.2, 0.4, 0.8, 1.6]) * STANDARD_GRAVITY, [2e-2, 8e-3, 2.5e-3, 6e-4, 1e-4, 1e-5], "pga", "m s-2"
)
STUDY = """
title = "own"
[[models]]
law = "energy-consistent"
[motions]
{motions}
[performance]
inventory = "things.csv"
{asked}
"""
INVENTORY = "item,catalogue,floor,direction\nshelf,bookcase-5-shelf,1,x\ncase,display-cabinet-glass,3,{}\n"


def ground(n=12, seed=1):
    return tp.motions.scale_to(
        tp.motions.CloughPenzien(duration=6.0, dt=0.02).sample(n, seed=seed), STANDARD_GRAVITY, "pga"
    )


def histories(sets, levels=LEVELS, floors=(1, 3)):
    """The floor motions of the frame under the ground motions of each level, as histories of another model."""
    found = []
    for level, motions in zip(levels, sets, strict=True):
        moved = FRAME.floor_motions(motions, floors)
        for j, name in enumerate(moved["motion"].values):
            for k, floor in enumerate(floors):
                values = moved.values[j, k]
                found.append(History(float(level), str(name), str(floor), "", values, 0.02, "frame"))
    return FloorHistories.of(found, "m/s2")


@pytest.fixture(scope="module")
def same():
    """One set of motions at all levels, through the building model and as histories."""
    shaking = ground()
    # (scaled at its own level as the engine scales it: factor times floor acceleration)
    sets = [shaking.copy(data=level / STANDARD_GRAVITY * shaking.values) for level in LEVELS]
    built = assess(THINGS, Assessment(LAW, shaking, LEVELS, "pga", FRAME, HAZARD))
    return built, assess(THINGS, Assessment(LAW, histories(sets), LEVELS, "pga", hazard=HAZARD))


def sets_apart():
    """Other motions at each level."""
    sets = []
    for i, level in enumerate(LEVELS):
        one = ground(seed=5 + i)
        one = one.copy(data=level / STANDARD_GRAVITY * one.values)
        sets.append(one.assign_coords(motion=[f"{i}-{j}" for j in range(12)]))
    return sets


@pytest.fixture(scope="module")
def apart():
    """Other motions at each level."""
    return assess(THINGS, Assessment(LAW, histories(sets_apart()), LEVELS, "pga", hazard=HAZARD))


class TestAgainstTheBuildingModel:
    def test_the_same_set_at_every_level_gives_the_same_results(self, same):
        built, own = same
        assert 0.05 < float(built["probability"].mean()) < 0.95
        np.testing.assert_array_equal(own["overturned"], built["overturned"])
        assert set(own.data_vars) == set(built.data_vars)
        for name, one in built.data_vars.items():
            np.testing.assert_array_equal(own[name], one, err_msg=str(name))
            assert own[name].attrs == one.attrs
        assert own["motion"].values.tolist() == built["motion"].values.tolist()
        assert own["level"].attrs["long_name"] == "peak ground acceleration"
        assert "record" not in own.coords

    def test_one_set_of_an_elastic_building(self, same):
        built, _ = same
        one = histories([ground()], [STANDARD_GRAVITY])
        one = FloorHistories(one.levels, one.unit, one.texts, one.names, one.supports, one.histories, elastic=True)
        own = assess(THINGS, Assessment(LAW, one, LEVELS, "pga", hazard=HAZARD))
        for name, values in built.data_vars.items():
            np.testing.assert_array_equal(own[name], values, err_msg=str(name))

    def test_a_scenario_as_it_is(self):
        shaking = ground()
        built = assess(THINGS, Assessment(LAW, shaking, [1.0], "scale", FRAME))
        own = assess(THINGS, Assessment(LAW, histories([shaking], [1.0]), [1.0], "scale"))
        assert own.attrs["basis"] == "scenario"
        np.testing.assert_array_equal(own["overturned"], built["overturned"])

    @pytest.mark.slow
    @pytest.mark.parametrize(("decimals", "differing"), [(None, 0), (own_building.DECIMALS, 7)])
    def test_files_in_two_directions(self, tmp_path, decimals, differing):
        """Through files with all digits the same pieces fall; rounded to 1 mm/s² as in the example, nearly the same."""
        own_building.write(tmp_path, decimals=decimals)
        for name in ("own_building.toml", "own_building_inventory.csv"):
            (tmp_path / name).write_bytes((EXAMPLES / name).read_bytes())
        study = tp.Study.from_toml(tmp_path / "own_building.toml")
        own = study.run()
        everything = read_inventory(tmp_path / "own_building_inventory.csv")
        assert study.runs == own["overturned"].size == 3072
        others = 0
        for direction, building in own_building.BUILDINGS.items():
            rows = tuple(row for row in everything.rows if row.direction == direction)
            for i in range(len(own_building.LEVELS)):
                shaking = own_building.ground(i)
                built = assess(
                    Inventory(rows), Assessment(LAW, shaking, [1.0], "scale", building, variability=study.variability)
                )
                here = own["overturned"].sel(block=[row.label for row in rows]).isel(level=i).transpose("model", ...)
                others += int((here.values != built["overturned"].isel(level=0).values).sum())
        assert (
            abs(others - differing) <= differing / 2
            # (docs/howto/floor_histories.md says 7; other processors may round otherwise)
        )
        assert own["overturned"].any()
        assert not own["overturned"].all()


class TestLevelsWithMotionsOfTheirOwn:
    def test_names_of_the_motions(self, apart):
        assert apart["motion"].values[0] == "motion 1"
        assert apart["record"].dims == ("level", "motion")
        assert apart["record"].values[2, 3] == "2-3"

    def test_annual_values_are_the_weighted_means(self, apart):
        weights = level_weights(LEVELS, HAZARD).weights
        np.testing.assert_allclose(apart["level_weight"].values[1:], weights[1:], rtol=0.2)
        weights = apart["level_weight"].values
        for name, given in (
            ("rate", "probability"),
            ("annual_loss", "loss_mean"),
            ("any_rate", "any_probability"),
        ):
            expected = (apart[given].values * weights).sum(axis=-1)
            np.testing.assert_allclose(apart[name].values, expected, rtol=1e-12)

    @pytest.mark.slow
    def test_intervals_draw_each_level_by_itself(self, apart, same):
        """The spread of a resampled sum of independent levels is the root of the sum of their squares."""
        year = Year.of(apart, apart["level_weight"].values)
        flags = apart["overturned"].values.astype(float)[0, 0]
        values = year.total(flags)
        assert values.shape == (36,)
        expected = float((flags.mean(axis=1) * year.weights).sum())
        assert values.mean() == pytest.approx(expected, rel=1e-12)
        spread = resampled_means(values, 20_000, strata=year.strata(12)).std()
        of_levels = year.weights * flags.std(axis=1) / np.sqrt(12)
        assert spread == pytest.approx(np.sqrt((of_levels**2).sum()), rel=0.03)
        # a set that all levels share is drawn for all of them at once, which is wider
        together = Year.of(same[1], same[1]["level_weight"].values)
        assert together.strata(12)[0].tolist() == list(range(12))
        ends = [float(apart[f"rate{end}"][0, 0]) for end in ("_lower", "", "_upper")]
        assert ends[0] < ends[1] < ends[2]
        assert ends[2] - ends[0] == pytest.approx(4.0 * np.sqrt((of_levels**2).sum()), rel=0.25)

    def test_intervals_cover(self):
        """Of the rate of a threshold that each motion has for itself, with other motions at each level."""
        rng = np.random.Generator(np.random.PCG64(3))
        levels, weights, n = np.geomspace(0.5, 4.0, 6), 0.01 * np.geomspace(1.0, 0.01, 6), 20
        from scipy.stats import norm

        from toppling.fragility.curves.means import mean_interval

        chance = norm.cdf(np.log(levels / 1.5) / 0.4)
        true = float(weights @ chance)
        year = Year(weights, own_motions=True)
        sums = year.total((rng.random((400, 6, n)) < chance[:, None]).astype(float))
        found = mean_interval(sums, replicates=400, strata=year.strata(n))
        inside = float(((found.lower <= true) & (true <= found.upper)).mean())
        assert 0.89 < inside < 0.98

    @pytest.mark.parametrize("objective", ["loss", "number", "any", "injury"])
    def test_anchoring_saves_what_the_building_without_the_item_says(self, apart, objective):
        ranked = anchoring(apart, objective)
        value = {"loss": "annual_loss", "number": "annual_number", "any": "any_rate"}.get(objective)
        whole = (
            apart["consequence_rate"].sel(consequence="injury", place="building", drop=True)
            if value is None
            else apart[value].sel(place="building")
        )
        assert float(ranked["left"][0, 0]) == pytest.approx(float(whole[0]), rel=1e-12)
        assert float(ranked["left"][0, -1]) == pytest.approx(0.0, abs=1e-15)
        flags = apart["overturned"].values.astype(float)[0]
        weights = apart["level_weight"].values
        for item in ranked["block"].values:
            i = apart["block"].values.tolist().index(item)
            if objective in ("loss", "number"):
                amount = int(apart["count"][i]) * (float(apart["value"][i]) if objective == "loss" else 1.0)
                saved = amount * float(weights @ flags[i].mean(axis=1))
            else:
                words = [objective in str(one) or objective == "any" for one in apart["consequences"].values]
                others = np.delete(flags, i, axis=0)[np.delete(words, i)]
                saved = float(weights @ (flags[i] * (1.0 - others.max(axis=0))).mean(axis=1))
            row = ranked.sel(block=item)
            assert float(row["saving"][0]) == pytest.approx(saved, rel=1e-9, abs=1e-15)
            assert not float(row["saving_lower"][0]) > float(row["saving"][0])
        at_level = anchoring(apart, objective, level=float(LEVELS[1]))
        assert np.isfinite(at_level["saving"].values).all()


class TestModellingUncertainty:
    ALIKE = Inventory(tuple(dataclasses.replace(row, piece_class="all") for row in THINGS.rows), "EUR")

    @pytest.mark.slow
    def test_with_one_set_at_every_level_it_is_that_of_the_building_model(self):
        """Classes are joined motion by motion, at all levels of a motion."""
        shaking = ground()
        sets = [shaking.copy(data=level / STANDARD_GRAVITY * shaking.values) for level in LEVELS]
        built = assess(THINGS, Assessment(LAW, shaking, LEVELS, "pga", FRAME, HAZARD, modelling_dispersion=0.4))
        own = assess(THINGS, Assessment(LAW, histories(sets), LEVELS, "pga", hazard=HAZARD, modelling_dispersion=0.4))
        for name, values in built.data_vars.items():
            np.testing.assert_array_equal(own[name], values, err_msg=str(name))

    def test_one_class_under_motions_of_each_level(self, apart):
        """Rates are the chances at the levels with the weights of the hazard that holds the uncertainty."""
        found = assess(
            self.ALIKE, Assessment(LAW, histories(sets_apart()), LEVELS, "pga", hazard=HAZARD, modelling_dispersion=0.4)
        )
        assert float(found["level_weight"][0]) > 1.1 * float(apart["level_weight"][0])
        for name, given in (("rate", "probability"), ("any_rate", "any_probability")):
            np.testing.assert_array_equal(found[given], apart[given])
            expected = (found[given].values * found["level_weight"].values).sum(axis=-1)
            np.testing.assert_allclose(found[name].values, expected, rtol=1e-12)

    def test_several_classes_need_the_same_motions_at_all_levels(self):
        own = histories(sets_apart())
        with pytest.raises(ValueError, match="of several classes of pieces needs the same motions at all levels"):
            assess(THINGS, Assessment(LAW, own, LEVELS, "pga", hazard=HAZARD, modelling_dispersion=0.4))
        held = Inventory(tuple(dataclasses.replace(row, anchored=row.label != "case") for row in THINGS.rows), "EUR")
        assess(
            held, Assessment(LAW, own, LEVELS, "pga", hazard=HAZARD, modelling_dispersion=0.4)
        )  # (one class that may fall)

    def test_at_a_level_of_an_elastic_building(self):
        shaking = ground()
        one = dataclasses.replace(histories([shaking], [STANDARD_GRAVITY]), elastic=True)
        own = assess(THINGS, Assessment(LAW, one, LEVELS, "pga", modelling_dispersion=0.4))
        built = assess(THINGS, Assessment(LAW, shaking, LEVELS, "pga", FRAME, modelling_dispersion=0.4))
        for name in ("probability", "number_mean", "any_probability"):
            np.testing.assert_array_equal(own[name], built[name])


class TestBranches:
    def spread(self, assessment, sampling, inventory=THINGS):
        every = combinations({LAW.label: 1.0}, {"motions": 1.0}, {"hazard": (HAZARD, 1.0)})
        return rates_over_branches(every, {"motions": assessment}, inventory, sampling)

    @pytest.mark.slow
    def test_motions_are_drawn_level_by_level(self, apart):
        """Fractiles are those of resampled sums, each level by itself."""
        found = self.spread(apart, Sampling(4000, 0))
        for name, of in (("rate", "rate"), ("any_rate", "any_rate"), ("annual_loss", "annual_loss")):
            np.testing.assert_allclose(found[f"branch_{name}"].values[:, 0], apart[of].values[0], rtol=1e-12)
        year = Year.of(apart, apart["level_weight"].values)
        flags = apart["overturned"].values.astype(float)[0]
        standing = ~apart["anchored"].values
        together = 1.0 - (1.0 - flags[standing]).prod(axis=0)
        for values, fractiles in (
            (flags[0], found["epistemic_rate_fractile"].values[0]),
            (together, found["epistemic_any_rate_fractile"].values[0]),
        ):
            sums = resampled_means(year.total(values)[None], 20_000, seed=1, strata=year.strata(12))[0]
            np.testing.assert_allclose(fractiles[[0, -1]], np.quantile(sums, [0.05, 0.95]), rtol=0.03)

    def test_the_same_motions_are_drawn_at_all_levels(self, same):
        built, own = same
        drawn = self.spread(own, Sampling(500, 0))
        for name, values in self.spread(built, Sampling(500, 0)).data_vars.items():
            np.testing.assert_array_equal(drawn[name], values, err_msg=str(name))

    def test_several_classes_need_the_same_motions_at_all_levels(self, apart):
        with pytest.raises(ValueError, match="of several classes of pieces needs the same motions at all levels"):
            self.spread(apart, Sampling(100, 0, 0.4, True))
        found = self.spread(apart, Sampling(2000, 0, 0.4, True), TestModellingUncertainty.ALIKE)
        assert (found["epistemic_any_rate_fractile"][0, 0] < 0.7 * found["epistemic_any_rate"][0]).all()


def study(folder, motions='floors_index = "index.csv"', asked='im = "pga"', direction="x", index=None, more=""):
    header = "time (s),acceleration (g)\n"
    shake = ground(3).values / STANDARD_GRAVITY
    for j in range(3):
        rows = "".join(f"{i * 0.02:.2f},{value:.5f}\n" for i, value in enumerate(shake[j]))
        (folder / f"h{j}.csv").write_text(header + rows, encoding="utf-8")
    (folder / "things.csv").write_text(INVENTORY.format(direction), encoding="utf-8")
    lines = index or (
        "level (g),motion,floor,direction,file\n"
        + "".join(
            f"{level},{motion}{j},{floor},{way},h{j}.csv\n"
            for level, motion in ((0.5, "A"), (1.0, "B"))
            for j in range(3)
            for floor, way in ((1, "x"), (3, "x"), (3, "y"))
        )
    )
    (folder / "index.csv").write_text(lines, encoding="utf-8")
    (folder / "one.csv").write_text(ONE, encoding="utf-8")
    (folder / "plain.csv").write_text(PLAIN, encoding="utf-8")
    (folder / "f.csv").write_text(f"time,a/0 [m/s2],a/1 [m/s2],a/3 [m/s2]\n{SCENARIO}", encoding="utf-8")
    path = folder / "study.toml"
    path.write_text(STUDY.format(motions=motions, asked=asked) + more, encoding="utf-8")
    return path


ONE = "level (g),motion,floor,direction,file\n" + "".join(
    f"0.5,A{j},{floor},x,h{j}.csv\n" for j in range(3) for floor in (1, 3)
)
PLAIN = "motion,floor,file\nA,1,h0.csv\nA,3,h0.csv\nB,1,h1.csv\nB,3,h1.csv\n"


YEARLY = '[hazard]\nk = 2\nk0 = 1e-3\nunit = "g"\n'
OTHERS = """
[[branches]]
of = "motions"
names = ["motions", "other"]
weights = [0.5, 0.5]
[[motion_sets]]
name = "other"
[motion_sets.motions]
"""
SCENARIO = "".join(f"{i / 50},{i % 5 - 2},{i % 3 - 1},{i % 4 - 1.5}\n" for i in range(99))


class TestStudies:
    @pytest.mark.parametrize(("level", "said"), [(1.0, False), (9.81, True)])
    def test_the_ground_of_an_index_is_held_against_its_levels(self, tmp_path, level, said):
        """The histories have a PGA of 1 g."""
        rows = "".join(f"{level},A{j},{floor},h{j}.csv\n" for j in range(3) for floor in (0, 1, 3))
        notes = tp.Study.from_toml(study(tmp_path, index=f"level (g),motion,floor,file\n{rows}")).notes
        wanted = "the pga of floor 0 is not that of 1 level (at 9.81 g 0.10 to 0.10 times"
        assert any(wanted in note for note in notes) == said

    def test_directions_without_histories_in_them(self, tmp_path):
        plan = tp.Study.from_toml(study(tmp_path, index=PLAIN, asked="", direction="y"))
        assert "motion.directions_unused" in {fact.what for fact in plan.facts}
        assert "direction" not in plan.run().coords

    def test_another_level_is_another_study(self, tmp_path):
        path = study(tmp_path)
        first = tp.Study.from_toml(path).identity
        index = tmp_path / "index.csv"
        index.write_text(index.read_text().replace("1.0,B", "1.1,B"), encoding="utf-8")
        assert tp.Study.from_toml(path).identity != first

    def test_modelling_of_an_elastic_earthquake(self, tmp_path):
        path = study(tmp_path, 'floors_file = "f.csv"\nelastic = true', "modelling_dispersion = 0.4")
        plan = tp.Study.from_toml(path)
        assert plan.levels_run == 13
        assert "motion.floors_scaled_elastic" in {fact.what for fact in plan.facts}
        assert plan.run()["probability"].shape == (2, 1, 1)

    @pytest.mark.slow
    def test_branches_of_two_building_models(self, tmp_path):
        """Histories of two models at the same levels, one of them in a single direction."""
        other = ONE + ONE.partition("\n")[2].replace("0.5,A", "1.0,A")
        more = YEARLY + OTHERS + 'floors_index = "other.csv"\n'
        path = study(tmp_path, more=more)
        (tmp_path / "other.csv").write_text(other, encoding="utf-8")
        plan = tp.Study.from_toml(path)
        assert "motion.floor_histories" in {note.what for note in plan.facts if note.more.get("branch") == "other"}
        results = plan.run()
        assert results["branch_rate"].shape == (2, 2)
        np.testing.assert_allclose(results["branch_rate"].isel(branch=0), results["rate"].isel(model=0))
        assert plan.work == plan.runs + plan.perturbed_runs + 2 * 3 * 2
        (tmp_path / "other.csv").write_text(other.replace("x", "y"), encoding="utf-8")
        with pytest.raises(StudyError, match="motion_sets 'other': floor 1 has no histories in direction x"):
            tp.Study.from_toml(path)

    @pytest.mark.slow
    def test_motions_are_shown(self, tmp_path, capsys):
        assert main(["motions", str(study(tmp_path)), "--out", str(tmp_path / "shown")]) == 0
        assert "A0 at 0.5" in capsys.readouterr().out


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """The example, run with its files."""
    folder = tmp_path_factory.mktemp("own")
    for file in EXAMPLES.glob("own_building*"):
        (folder / file.name).write_bytes(file.read_bytes())
    assert main(["run", str(folder / "own_building.toml"), "--out", str(folder / "out")]) == 0
    return folder


@pytest.mark.slow
class TestExample:
    def test_levels_at_which_nothing_fell_are_named(self, finished):
        with xr.open_dataset(finished / "out/results.nc") as results:
            fell = results["overturned"].any(["model", "block", "variant", "motion"]).values
            assert fell.tolist() == [False, True, True, True]
            (silent,) = notes_named(results, "precision.levels_without_falls")
            assert (silent.names, silent.more["motions"]) == (("0.1 g",), 8)
            assert silent.value == pytest.approx(0.32, abs=0.005)

    def test_histories_are_those_of_the_command(self, tmp_path):
        for path in own_building.write(tmp_path):
            shipped = EXAMPLES / path.name
            if path.name == "own_building_index.csv":
                assert shipped.read_text() == path.read_text()
                continue
            ours, theirs = (np.loadtxt(one, delimiter=",", skiprows=1) for one in (path, shipped))
            np.testing.assert_allclose(ours, theirs, atol=1.01 * 10.0**-own_building.DECIMALS)


def test_refused(refusal):
    refusal()
