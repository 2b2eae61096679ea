"""Branches in study files: held to studies of their own, one for each combination, and what is refused."""

import json
import math

import numpy as np
import pytest
from check_facts import facts_of
from exchange_cases import read_table
from study_texts import HAZARD, IDA, study_of

import toppling as tp
from toppling.core.facts import Fact
from toppling.core.units import STANDARD_GRAVITY
from toppling.motions.arrays import digest, records
from toppling.studies import show
from toppling.studies.command.cli import main
from toppling.studies.facts import answer_curves as curves
from toppling.studies.facts.footnotes import footnotes
from toppling.studies.facts.notes import notes_of
from toppling.studies.facts.say import say
from toppling.studies.plots.risk import spread_figure
from toppling.studies.report.page import write_report
from toppling.studies.store.worker_motions import motions_again
from toppling.studies.tables.blocks import lead_blocks
from toppling.studies.tables.branches import branch_rates
from toppling.studies.text.curve_notes import SLIPS_WITHOUT_BRANCHES

BLOCK = '[[blocks]]\ncatalogue = "bookcase-5-shelf"\n'
LAWS = '[[models]]\nlaw = "housner"\n[[models]]\nlaw = "discrete"\n'


def motions(seed, table="motions"):
    made = f'generator = "clough-penzien"\nnumber = 12\nseed = {seed}\nduration_s = 6\ndt_s = 0.02\n'
    return f"[{table}]\n{made}"


OTHER = f'[[motion_sets]]\nname = "other"\n{motions(5, "motion_sets.motions")}'
HIGH = '[[hazards]]\nname = "high"\nhazard = { k0 = 3e-4, k = 2, unit = "g" }\n'


def branches(of, **weights):
    names, values = json.dumps([*weights]), [*weights.values()]
    return f'[[branches]]\nof = "{of}"\nnames = {names}\nweights = {values}\n'


ALL = (
    branches("models", housner=0.75, discrete=0.25)
    + branches("motions", motions=0.6, other=0.4)
    + branches("hazard", hazard=0.5, high=0.5)
)
FIT = "[fit]\nreplicates = 100\n"


def of_modelling(found):
    return [fact for fact in notes_of(found) if "modelling_" in fact.what]


@pytest.mark.parametrize("k0", [3e-4, 0.03])
def test_hazards_that_are_orders_apart_are_doubted(tmp_path, k0):
    """0.03 x^-2 beside 1e-4 x^-2.5 per year: 300 times as often at 1 g, as levels in m/s² taken as g would be."""
    more = (HAZARD, HIGH.replace("3e-4", str(k0)), branches("hazard", hazard=0.5, high=0.5))
    for made in (
        study_of(tmp_path, BLOCK, LAWS, motions(1), IDA, *more),
        inventory_study(tmp_path, LAWS, motions(1), PERFORMANCE, *more),
    ):
        said = [one.sentence for one in made.doubts if "in 'high' and" in one.sentence]
        assert len(said) == (k0 > 0.01)
        assert all("another unit" in one for one in said)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """The results of a study with two laws, two sets of motions and two hazard curves."""
    parts = (BLOCK, LAWS, motions(1), OTHER, IDA, HAZARD, HIGH, FIT, ALL)
    return study_of(tmp_path_factory.mktemp("branches"), *parts).run()


class TestBranches:
    @pytest.mark.slow
    def test_each_branch_is_a_study_of_its_own(self, found, tmp_path):
        rates, ends = {}, {}
        for name, seed in (("motions", 1), ("other", 5)):
            for hazard, text in (("hazard", HAZARD), ("high", '[hazard]\nk0 = 3e-4\nk = 2\nunit = "g"\n')):
                own = study_of(tmp_path, BLOCK, LAWS, motions(seed), IDA, text, FIT).run()
                rates |= {(law, name, hazard): own["rate"].values[0, k] for k, law in enumerate(own["law"].values)}
                upper = own["rate_modelling_upper"].values[0]
                ends |= {(law, name, hazard): upper[k] for k, law in enumerate(own["law"].values)}
        laws = dict(zip(found["model"].values, found["law"].values, strict=True))
        names = [*zip(*(found[f"branch_{of}"].values for of in ("model", "motions", "hazard")), strict=True)]
        each = np.array([rates[laws[model], motions, hazard] for model, motions, hazard in names])
        np.testing.assert_array_equal(found["branch_rate"].values[0], each)
        assert found["epistemic_rate"].item() == pytest.approx(float(each @ found["branch_weight"].values), rel=1e-12)
        of_range = np.array([ends[laws[model], motions, hazard] for model, motions, hazard in names])
        mean = float(of_range @ found["branch_weight"].values)
        assert found["epistemic_rate_modelling_upper"].item() == pytest.approx(mean, rel=1e-12)
        assert found["branch_weight"].sum().item() == pytest.approx(1.0, rel=1e-12)
        assert found["epistemic_spread"].sum().item() == pytest.approx(1.0)

    def test_the_study_itself_stays_as_it_is(self, found, tmp_path):
        plain = study_of(tmp_path, BLOCK, LAWS, motions(1), IDA, HAZARD, FIT).run()
        for name in plain.data_vars:
            np.testing.assert_array_equal(found[name], plain[name])
        assert {*plain.coords} <= {*found.coords}
        assert found["law"].dims == ("model",)

    def test_notes_name_the_motions(self, tmp_path):
        """Curves of a branch that rest on few runs are said to, as those of the study's own motions are."""
        few = OTHER.replace("number = 12", "number = 2")
        weights = branches("motions", motions=0.6, other=0.4)
        found = study_of(tmp_path, BLOCK, LAWS, motions(1), few, IDA, HAZARD, FIT, weights).run()
        said = [one for one in notes_of(found) if one.more.get("branch") == "other"]
        (apart,) = (one for one in said if one.what == "curve.separated")
        assert (apart.value, apart.more["of"]) == (1, 2)

    @pytest.mark.slow
    def test_slips_are_not_spread_and_that_is_said(self, found, tmp_path):
        weights = branches("motions", motions=0.6, other=0.4)
        parts = (BLOCK, LAWS, motions(1), OTHER, IDA, HAZARD, FIT, weights, "[friction]\nstatic = 0.3\n")
        assert SLIPS_WITHOUT_BRANCHES in notes_of(study_of(tmp_path, *parts).run())
        assert SLIPS_WITHOUT_BRANCHES not in notes_of(found)

    def test_workers_make_the_motions_of_branches(self, tmp_path):
        one = study_of(tmp_path, BLOCK, LAWS, motions(1), OTHER, IDA, HAZARD, HIGH, FIT, ALL)
        made = {digest(record) for record in motions_again(json.dumps(one.configuration))}
        assert made == {digest(record) for array in one.arrays for record in records(array)}
        assert len(made) == 24

    @pytest.mark.slow
    @pytest.mark.parametrize("weights", ["", branches("hazard", hazard=0.5, high=0.5)])
    def test_a_rate_that_nothing_bounds_is_not_known(self, weights, tmp_path):
        """Every run falls at 3 g, and an isotonic curve may be 1 below: the rate is at least 1e-4 x 3^-2.5."""
        levels = '[ida]\nim = "pga"\nlevels = { values = [3.0, 4.0], unit = "g" }\n'
        fit = '[fit]\nform = "isotonic"\nreplicates = 100\n'
        parts = ('accept = ["level"]\n', BLOCK, LAWS, motions(1), levels, HAZARD, HIGH if weights else "", weights, fit)
        found = study_of(tmp_path, *parts).run(tmp_path / "out")
        least = 1e-4 * 3.0**-2.5
        assert np.isnan(found["rate"]).all()
        assert np.isnan(found["risk_probability"]).all()
        np.testing.assert_allclose(found["rate_lower"], least, rtol=1e-9)
        np.testing.assert_allclose(found["risk_probability_lower"], -math.expm1(-50.0 * least), rtol=1e-9)
        assert np.isinf(found["rate_upper"]).all()
        for name in ("epistemic_rate", "epistemic_rate_fractile", "branch_rate", "epistemic_rate_modelling_upper"):
            assert not weights or np.isnan(found[name]).all(), name
        facts = facts_of(curves.answer, found)
        table = lead_blocks(found)
        if weights:
            assert "rate.unbounded_branch" in facts
            assert not {"rate", "chance"} & {column.key for column in table.columns}
            rates = branch_rates(found)
            assert [column.key for column in rates.columns] == ["name"]
        else:
            assert facts["rate.at_least"].lower == pytest.approx(-math.expm1(-50.0 * least))
            assert table.texts("chance")[0].startswith("at least 0.032")
        write_report(tmp_path / "out/results.nc")

    def test_the_size_counts_the_runs_of_branches(self, tmp_path):
        plain = study_of(tmp_path, BLOCK, LAWS, motions(1), IDA, HAZARD, FIT)
        one = study_of(tmp_path, BLOCK, LAWS, motions(1), OTHER, IDA, HAZARD, HIGH, FIT, ALL)
        assert one.work - plain.work == 2 * 12 * 7
        assert "168 under" in one.words
        assert one.identity != plain.identity


class TestModelling:
    @pytest.mark.slow
    def test_in_the_mean(self, tmp_path):
        """With a power-law hazard every rate is exp(k² beta_m²/2) times that without, and the curves are the same."""
        plain = study_of(tmp_path, BLOCK, LAWS, motions(1), IDA, HAZARD, FIT).run()
        found = study_of(tmp_path, BLOCK, LAWS, motions(1), IDA, HAZARD, FIT, "modelling_dispersion = 0.4\n").run()
        np.testing.assert_allclose(found["rate"], plain["rate"] * np.exp(0.5 * 2.5**2 * 0.4**2), rtol=1e-10)
        np.testing.assert_array_equal(found["dispersion"], plain["dispersion"])
        assert "epistemic_rate" not in found
        # (a capacity c has the rate k0 c^-k; the range is about rates without beta_m, 0.3 where none is given)
        for one, beta in ((plain, 0.3), (found, 0.4)):
            for end, sign in (("lower", -1.0), ("upper", 1.0)):
                wanted = plain["rate"] * np.exp(sign * 2.5 * 1.28 * beta)
                np.testing.assert_allclose(one[f"rate_modelling_{end}"], wanted, rtol=1e-10)
                chance = 1.0 - np.exp(-50.0 * wanted)
                np.testing.assert_allclose(one[f"risk_probability_modelling_{end}"], chance, rtol=1e-9)
                level = plain["half_level"] * np.exp(-sign * 1.28 * beta)
                np.testing.assert_allclose(
                    one[f"half_level_modelling_{'lower' if sign > 0 else 'upper'}"], level, rtol=1e-12
                )
        more = {"yearly": True, "spread": False}
        assert of_modelling(found) == [Fact("rate.modelling_included", 0.4, more=more)]
        assert of_modelling(plain) == [Fact("uncertainty.modelling_none")]

    @pytest.mark.slow
    def test_in_the_mean_of_branches(self, tmp_path):
        """Every rate of the branches holds beta_m, as the rates of the laws do, and no fractile spreads it again."""
        of = branches("models", housner=0.75, discrete=0.25)
        plain = study_of(tmp_path, BLOCK, LAWS, motions(1), IDA, HAZARD, FIT, of).run()
        more = "modelling_dispersion = 0.4\n"
        found = study_of(tmp_path, BLOCK, LAWS, motions(1), IDA, HAZARD, FIT, more, of).run()
        for name in ("rate", "epistemic_rate", "epistemic_rate_fractile", "branch_rate"):
            np.testing.assert_allclose(found[name], plain[name] * np.exp(0.5 * 2.5**2 * 0.4**2), rtol=1e-9)
        assert [fact.value for fact in footnotes(found) if fact.what == "rate.modelling_included"] == [0.4]

    @pytest.mark.slow
    def test_exported_dispersions_say_what_they_hold(self, tmp_path, capsys):
        more = "modelling_dispersion = 0.4\n"
        found = study_of(tmp_path, BLOCK, LAWS, motions(1), IDA, HAZARD, FIT, more).run(tmp_path / "out")
        beta = found["dispersion"].values[0]
        for option, held, total in (((), 0.0, beta), (("--with-modelling",), 0.4, np.hypot(beta, 0.4))):
            assert main(["export", str(tmp_path / "out"), "--format", "csv", *option]) == 0
            curves = read_table(tmp_path / "out/export/curves.csv")
            np.testing.assert_allclose(curves["dispersion"].values[0], total, rtol=1e-12)
            assert (curves["modelling_dispersion"] == held).all()
            law = ("--model", "housner")
            assert main(["export", str(tmp_path / "out"), "--format", "pelicun", *law, *option]) == 0
            table = tp.fragility.read_pelicun(tmp_path / "out/export/fragility.csv")
            np.testing.assert_allclose(table["dispersion"].values.ravel(), total[:1], rtol=1e-12)
            said = (tmp_path / "out/export/fragility.json").read_text(encoding="utf-8")
            assert ("uncertainty of 0.4" if option else "without modelling uncertainty") in said
        assert main(["export", str(tmp_path / "out"), "--format", "xlsx", "--with-modelling"]) == 2
        assert "--with-modelling" in capsys.readouterr().err
        plain = study_of(tmp_path, BLOCK, LAWS, motions(1), IDA, HAZARD, FIT).run(tmp_path / "plain")
        assert plain.attrs["modelling_dispersion"] == 0.0
        assert main(["export", str(tmp_path / "plain"), "--format", "csv", "--with-modelling"]) == 2
        assert "modelling_dispersion = 0" in capsys.readouterr().err

    @pytest.mark.slow
    @pytest.mark.parametrize(
        ("where", "option", "dispersion", "rates"),
        [
            ("mean", (), 0.0, 0.4),
            ("mean", ("--with-modelling",), 0.4, None),
            ("fractiles", (), 0.0, None),
            ("fractiles", ("--with-modelling",), 0.4, 0.0),
        ],
    )
    def test_exported_rates_say_what_they_hold(self, tmp_path, where, option, dispersion, rates):
        """A rate is the study's: of the curve in its row, or the row says how much its rate holds."""
        law, more = '[[models]]\nlaw = "housner"\n', f'modelling_dispersion = 0.4\nmodelling = "{where}"\n'
        study_of(tmp_path, BLOCK, law, motions(1), IDA, HAZARD, FIT, more).run(tmp_path / "out")
        assert main(["export", str(tmp_path / "out"), "--format", "csv", *option]) == 0
        row = read_table(tmp_path / "out/export/curves.csv")
        held = row.get("rate_modelling_dispersion")
        assert row["modelling_dispersion"].item() == dispersion
        assert (None if held is None else held.item()) == rates
        # the mean rate under H = k0 x^-k is k0 median^-k exp(k² beta²/2); beta holds what the row says of its rate
        squared = row["dispersion"].item() ** 2 - dispersion**2 + (dispersion if rates is None else rates) ** 2
        median = row["median"].item() / STANDARD_GRAVITY
        expected = 1e-4 * median**-2.5 * np.exp(0.5 * 2.5**2 * squared)
        assert row["rate"].item() == pytest.approx(expected, rel=1e-6)

    @pytest.mark.slow
    def test_in_the_fractiles(self, tmp_path):
        more = 'modelling_dispersion = 0.4\nmodelling = "fractiles"\n'
        plain = study_of(tmp_path, BLOCK, LAWS, motions(1), IDA, HAZARD, FIT).run()
        found = study_of(tmp_path, BLOCK, LAWS, motions(1), IDA, HAZARD, FIT, more).run()
        np.testing.assert_array_equal(found["rate"], plain["rate"])
        factor = float(found["epistemic_rate"].item() / plain["rate"].values[0, 0])
        assert factor == pytest.approx(np.exp(0.5 * 2.5**2 * 0.4**2), rel=1e-10)
        assert found["branch_model"].values.tolist() == ["housner e=e_R"]


INVENTORY = (
    "item,catalogue,floor,count,value,currency,consequence,class\n"
    "shelf,bookcase-5-shelf,0,3,300,EUR,injury,\n"
    "case,display-cabinet-glass,0,2,900,EUR,blocks-exit,\n"
    "tall shelf,bookcase-6-shelf,0,1,,,,shelves\n"
)
RANGE = '{ from = 0.1, to = 2, number = 7, spacing = "log", unit = "g" }'
LEVELS = f'[performance]\ninventory = "inventory.csv"\nlevels = {RANGE}\n'
PERFORMANCE = LEVELS + "replicates = 100\n"


def inventory_study(folder, *parts):
    (folder / "inventory.csv").write_text(INVENTORY, encoding="utf-8")
    return study_of(folder, *parts)


@pytest.fixture(scope="module")
def building(tmp_path_factory):
    """The results of an inventory study with two laws, two sets of motions and two hazard curves."""
    folder = tmp_path_factory.mktemp("building")
    return inventory_study(folder, LAWS, motions(1), OTHER, PERFORMANCE, HAZARD, HIGH, ALL).run(folder / "out"), folder


class TestInventories:
    def test_slips_are_not_spread_and_that_is_said(self, building, tmp_path):
        slides = "[friction]\nstatic = 0.3\n"
        weights = branches("motions", motions=0.6, other=0.4)
        parts = (LAWS, motions(1), OTHER, PERFORMANCE, HAZARD, weights, slides)
        assert SLIPS_WITHOUT_BRANCHES in notes_of(inventory_study(tmp_path, *parts).run())
        assert SLIPS_WITHOUT_BRANCHES not in notes_of(building[0])

    def test_the_exported_table(self, building):
        found, folder = building
        assert main(["export", str(folder / "out"), "--format", "csv"]) == 0
        lines = (folder / "out/export/pieces.csv").read_text(encoding="utf-8").splitlines()
        cells = dict(
            zip(lines[0].split(","), next(one for one in lines if one.startswith("shelf,")).split(","), strict=True)
        )
        rates = [found["epistemic_rate"].sel(block="shelf").item()]
        of_shelf = found["epistemic_rate_fractile"].sel(block="shelf")
        rates += [of_shelf.sel(epistemic_fractile=end).item() for end in (0.05, 0.95)]
        names = [f"chance_in_50_years_over_branches{end}" for end in ("", "_5_percent", "_95_percent")]
        values = [float(next(cells[one] for one in cells if one.split(" ")[0] == name)) for name in names]
        np.testing.assert_allclose(values, [-math.expm1(-50.0 * rate) for rate in rates], rtol=1e-9)

    def test_the_size_counts_the_runs_of_branches(self, tmp_path):
        plain = inventory_study(tmp_path, LAWS, motions(1), PERFORMANCE, HAZARD)
        one = inventory_study(tmp_path, LAWS, motions(1), OTHER, PERFORMANCE, HAZARD, HIGH, ALL)
        assert one.work - plain.work == 3 * 2 * 12 * 7
        assert "504 under" in one.words
        assert one.identity != plain.identity
        made = {digest(record) for record in motions_again(json.dumps(one.configuration))}
        assert made == {digest(record) for array in one.arrays for record in records(array)}


class TestBeyond:
    def test_branches_say_what_they_rest_on(self, tmp_path):
        """A hazard curve that ends early: its branch is named with the share, in a note and in the table's title."""
        short = '[[hazards]]\nname = "short"\nhazard = { levels = [0.01, 0.02], rates = [1e-2, 2e-3], unit = "g" }\n'
        weights = branches("hazard", hazard=0.5, short=0.5)
        found = study_of(tmp_path, BLOCK, LAWS, motions(1), IDA, HAZARD, short, FIT, weights).run()
        beyond = found["branch_share_beyond"].values.reshape(-1)
        assert beyond[1] > 0.9
        assert beyond[0] < 0.2
        (fact,) = (one for one in notes_of(found) if one.what == "rate.branches_beyond")
        assert (fact.value, fact.more["branches"], fact.more["of"]) == (beyond[1], (beyond > 0.05).sum(), 2)
        assert "short" in fact.names[0]
        assert "1 of 2" in branch_rates(found).note

    def test_fits_of_branches_are_counted(self, tmp_path):
        plain = study_of(tmp_path, BLOCK, LAWS, motions(1), IDA, HAZARD, FIT)
        one = study_of(tmp_path, BLOCK, LAWS, motions(1), OTHER, IDA, HAZARD, HIGH, FIT, ALL)
        assert one.curves == 2 * plain.curves
        assert one.seconds_of_fits(2) == pytest.approx(2.0 * plain.seconds_of_fits(2))


@pytest.mark.slow
def test_another_state_is_named(tmp_path):
    """Titles, names and sentences of branches are of the state that the study asks for."""
    weights = branches("models", housner=0.75, discrete=0.25)
    found = study_of(tmp_path, BLOCK, LAWS, motions(1), IDA, HAZARD, FIT, 'state = "uplifted"\n', weights).run()
    assert "a block uplifts" in branch_rates(found).note
    state = found.attrs["state"]
    assert f"annual rate of {state}" in found["epistemic_rate"].attrs["long_name"]
    assert spread_figure(found).axes[0].get_xlabel().replace("\n", " ") == f"Annual rate of {state}"
    fact = next(curves.answer(found))
    assert (fact.what, fact.more["verb"]) == ("rate.unbounded_branch", "uplifts")
    assert "overturn" not in say(fact, "page")


@pytest.mark.slow
def test_branches_without_any_rate_have_no_figure(tmp_path):
    """Where every run overturns there is no curve, hence no rate to draw over branches; all else is written."""
    thin = '[[blocks]]\nwidth_m = 0.15\nheight_m = 0.75\n[[models]]\nlaw = "energy-consistent"\n'
    sets = [text.replace("number = 12", "number = 4\ns0_m2_s3 = 0.3") for text in (motions(1), OTHER)]
    weights = branches("motions", motions=0.5, other=0.5)
    results = study_of(tmp_path, thin, *sets, '[cloud]\nim = "pga"\n', HAZARD, weights).run(tmp_path / "out")
    assert results["overturned"].all()
    assert "branches" not in [name for name, _ in show.figures(results)]
    assert write_report(tmp_path / "out/results.nc")[0].is_file()
