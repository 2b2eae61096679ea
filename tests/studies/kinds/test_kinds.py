"""Studies of every kind from TOML: what the file asks for is what the functions give, and mistakes get one sentence."""

import math

import numpy as np
import pytest
import xarray as xr
from check_facts import facts_of
from scipy.interpolate import CubicHermiteSpline
from study_texts import BLOCKS, HAZARD, IDA, laws, motions, study_in, tower

import toppling as tp
from toppling.fragility import uncertain_ida
from toppling.fragility.runs.provenance import blocks_of
from toppling.studies import Assessment, StudyError, assess, read_inventory
from toppling.studies.buildings.pieces import ranking_of
from toppling.studies.command.cli import main
from toppling.studies.facts import answer_building as building
from toppling.studies.plan.risk import risk_of
from toppling.studies.report.page import write_report

pytestmark = [pytest.mark.lowest, pytest.mark.newest]

MODELS = laws("energy-consistent", "discrete")
MOTIONS = motions(24)
LEVELS = np.exp(np.linspace(0.0, np.log(12.0), 7))
PIECES = [tp.Block(0.35, 1.6, name="narrow"), tp.Block(0.6, 1.6, name="wide")]
LAWS = [tp.EnergyConsistent(), tp.DiscreteDamping()]


def shakes(seed=1, n=24):
    return tp.motions.CloughPenzien(duration=6.0, dt=0.02).sample(n, seed=seed)


def write(folder, *parts):
    path = folder / "study.toml"
    path.write_text('title = "a study"\n' + "".join(parts), encoding="utf-8")
    return path


def run(folder, *parts):
    path = write(folder, *parts)
    assert main(["run", str(path), "--out", str(folder / "out"), "--verbose"]) == 0
    with xr.open_dataset(folder / "out/results.nc") as results:
        return results.load()


@pytest.mark.slow
class TestFits:
    def test_states_forms_and_outputs(self, tmp_path):
        fit = '[fit]\nform = "uplift-lognormal"\nstate = 0.5\nfractiles = [0.1]\nreplicates = 100\nconfidence = 0.9\n'
        found = run(tmp_path, 'outputs = ["impact_velocity"]\n', BLOCKS, MODELS, MOTIONS, IDA, fit)
        runs = tp.ida(
            PIECES, LAWS, shakes(), LEVELS, outputs=["overturned", "peak_rotation", "uplifted", "impact_velocity"]
        )
        np.testing.assert_array_equal(found.impact_velocity, runs.impact_velocity)
        options = {"form": "uplift-lognormal", "state": 0.5, "fractiles": (0.1,), "replicates": 100}
        curves = tp.fit_fragility(runs, 0.9, **options)
        for name in ("median", "median_lower", "uplift_median", "fractile"):
            np.testing.assert_array_equal(found[name], curves[name])
        counts = tp.overturning_probability(runs, 0.9, state=0.5)
        np.testing.assert_array_equal(found.overturnings, counts.overturnings)
        assert found.attrs["state"] == "|theta|/alpha > 0.5"


@pytest.mark.slow
class TestRisk:
    def test_rates_and_the_size_that_meets_the_target(self, tmp_path, capsys):
        asked = HAZARD + 'years = 20\nprobability = 0.05\nalong = "width"\n'
        found = run(tmp_path, BLOCKS, MODELS, MOTIONS, IDA, asked)
        curves = tp.fit_fragility(tp.ida(PIECES, LAWS, shakes(), LEVELS), keep_replicates=True)
        hazard = tp.HazardCurve.power_law(1e-4, 2.5, "pga", "g")
        direct = tp.annual_rate(curves, hazard, 20.0)
        own = risk_of(found)
        for name in ("rate", "rate_lower", "probability", "probability_upper", "share"):
            np.testing.assert_array_equal(own[name], direct[name])
        out = capsys.readouterr().out
        assert "in 20 years" in out
        assert "Size for a 5 % chance of" in " ".join(out.split())
        width = found.size_width.values
        rates = found.rate.values
        goal = -np.log1p(-0.05) / 20.0
        inside = (rates[0] > goal) & (rates[1] < goal)
        np.testing.assert_array_equal(np.isfinite(width), inside)
        assert ((width[inside] > 0.35) & (width[inside] < 0.6)).all()


class TestUncertainty:
    TABLE = """
[uncertainty]
samples = 6
seed = 3
sobol = 8

[uncertainty.inputs]
e = { distribution = "uniform", lower = 0.85, upper = 1.0 }
R_factor = { distribution = "lognormal", median = 1.0, dispersion = 0.1, lower = 0.7, upper = 1.4 }
"""

    @pytest.mark.slow
    def test_runs_shares_and_indices(self, tmp_path, capsys):
        found = run(tmp_path, BLOCKS, MODELS, MOTIONS, IDA, self.TABLE)
        from toppling.fragility import Lognormal, RandomInputs, Uniform

        inputs = RandomInputs({"e": Uniform(0.85, 1.0), "R_factor": Lognormal(1.0, 0.1, 0.7, 1.4)})
        direct = uncertain_ida(
            inputs, PIECES[1], LAWS, shakes(), LEVELS, "pga", "overturned", samples=inputs.sample(6, 3)
        )
        np.testing.assert_array_equal(found.overturned.isel(block=1), direct.overturned)
        np.testing.assert_allclose(found.probability.isel(block=1), direct.overturned.mean(["sample", "motion"]))
        share = found.flag_share.isel(block=0)
        np.testing.assert_allclose(share.sum("component").where(share.notnull().all("component")).dropna("level"), 1.0)
        assert found.sobol_total.dims == ("block", "model", "input", "output")
        assert {"sobol_first_upper", "friction_uplift"} <= {*found.data_vars}
        out = capsys.readouterr().out
        assert "Sobol’ indices" in out
        for name in ("uncertainty", "sobol"):
            assert (tmp_path / f"out/{name}.png").stat().st_size > 10_000


INVENTORY = """item,width_m,height_m,floor,count,value,currency,consequence
shelf,0.35,1.8,0,3,100,EUR,blocks-exit
cabinet,0.45,1.6,2,2,400,EUR,
"""
BUILDING = tower(0.5, 2)
PERFORMANCE = """
[performance]
inventory = "things.csv"
im = "pga"
levels = { values = [1.0, 2.0, 4.0, 8.0], unit = "m/s2" }
replicates = 200
"""


class TestPerformance:
    @pytest.fixture(autouse=True)
    def _inventory(self, tmp_path):
        (tmp_path / "things.csv").write_text(INVENTORY, encoding="utf-8")

    @pytest.mark.slow
    def test_in_a_year(self, tmp_path, capsys):
        found = run(tmp_path, MODELS, MOTIONS, BUILDING, PERFORMANCE, HAZARD)
        building = tp.motions.Building.flexural_shear(period=0.5, storeys=2)
        hazard = tp.HazardCurve.power_law(1e-4, 2.5, "pga", "g")
        things = read_inventory(tmp_path / "things.csv")
        direct = assess(
            things, Assessment(LAWS, shakes(), [1.0, 2.0, 4.0, 8.0], "pga", building, hazard, replicates=200)
        )
        for name in ("overturned", "annual_loss", "annual_loss_upper", "loss_rate"):
            np.testing.assert_array_equal(found[name], direct[name])
        ranked = ranking_of(found)
        assert set(ranked["block"].values) == {"shelf", "cabinet"}
        assert ranked.attrs["objective"] == "loss"
        out = capsys.readouterr().out
        titles = "Pieces", "Expected per year"
        assert [out.index(title) for title in titles] == sorted(out.index(title) for title in titles)
        assert sorted(one.name for one in (tmp_path / "out").glob("*.png")) == [
            "anchoring.png", "exceedance.png", "loss.png", "number.png",
        ]  # fmt: skip

    @pytest.mark.slow
    def test_a_piece_that_does_not_fit_is_named(self, tmp_path):
        """The code requires the rack; the museum case would pay, and the rest of the budget is not enough for it."""
        columns = "item,width_m,height_m,floor,count,value,currency,consequence,code_class,mass_kg,anchoring_cost\n"
        rack = "rack,0.3,2.0,0,1,300,EUR,injury,storage,100,90\n"
        case = "museum case,0.3,1.9,0,1,90000,EUR,,,80,350\n"
        (tmp_path / "things.csv").write_text(columns + rack + case, encoding="utf-8")
        code = 'code = { standard = "ec8", ag_g = 0.25, soil_factor = 1.2, component_period_s = 0 }\nbudget = 100\n'
        found = run(tmp_path, MODELS, MOTIONS, BUILDING, PERFORMANCE + code, HAZARD)
        assert found["budget_chosen"].isel(model=0).values.tolist() == [True, False]
        fact = facts_of(building.actions, found)["budget.beyond"]
        assert (fact.value, fact.names, fact.more["costs"]) == (10.0, ("“museum case” (ground)",), [350.0])

    @pytest.mark.parametrize(
        ("parts", "message"),
        [
            (
                (PERFORMANCE + 'code = { standard = "ec8", ag_g = 0.2 }\n',),
                "performance.code.soil_factor.*performance.code.component_period_s",
            ),
            *(
                (
                    (
                        f'{PERFORMANCE}code = {{ standard = "ec8", ag_g = {ag}, soil_factor = 1, '
                        f"component_period_s = {period} }}\n",
                    ),
                    f"performance.code.{key}: must be",
                )
                for ag, period, key in ((0.2, 20, "component_period_s"), (1.96, 0, "ag_g"))
            ),
        ],
    )
    def test_mistakes(self, tmp_path, parts, message):
        with pytest.raises(StudyError, match=message) as error:
            tp.Study.from_toml(write(tmp_path, MODELS, MOTIONS, BUILDING, *parts))
        assert "\n" not in str(error.value)


def test_files_beside_the_study_decide_its_results(tmp_path):
    """A changed inventory or hazard file is another study: old results are refused, not returned."""
    (tmp_path / "site.csv").write_text("pga (g),rate (1/yr)\n0.02,0.1\n0.2,4e-3\n1.5,2e-5\n", encoding="utf-8")
    (tmp_path / "things.csv").write_text(INVENTORY, encoding="utf-8")
    for parts, name, old, new in (
        ((BLOCKS, MODELS, MOTIONS, IDA, '[hazard]\nfile = "site.csv"\n'), "site.csv", "4e-3", "8e-3"),
        ((MODELS, MOTIONS, BUILDING, PERFORMANCE), "things.csv", "shelf,0.35,1.8,0,3", "shelf,0.35,1.8,0,9"),
    ):
        path = write(tmp_path, *parts)
        before = tp.Study.from_toml(path).identity
        text = (tmp_path / name).read_text(encoding="utf-8")
        (tmp_path / name).write_text(text.replace(old, new), encoding="utf-8")
        assert tp.Study.from_toml(path).identity != before


@pytest.mark.slow
@pytest.mark.parametrize(
    "hazard",
    ["k0 = 1e-4\nk = 2.5\n", "k0 = 1e-4\nk1 = 2.5\nk2 = 0.2\n", "levels = [0.15, 0.4]\nrates = [1e-2, 1e-3]\n"],
)
def test_a_single_piece_in_a_year_is_its_own_curve(tmp_path, hazard):
    """The annual number of one piece is the rate of the cubic through its observed fractions, summed here in steps."""
    (tmp_path / "things.csv").write_text("item,width_m,height_m,floor,count\nshelf,0.35,1.6,0,1\n", encoding="utf-8")
    levels = 'levels = { from = 0.5, to = 30.0, number = 9, spacing = "log", unit = "m/s2" }\n'
    asked = '[performance]\ninventory = "things.csv"\nim = "pga"\nreplicates = 100\n' + levels
    found = run(tmp_path, '[[models]]\nlaw = "housner"\n', MOTIONS, asked, f'[hazard]\nunit = "g"\n{hazard}')
    p = found["probability"].isel(block=0)
    assert (p.isel(level=0) == 0.0).all()
    assert (p.isel(level=-1) == 1.0).all()
    assert (p.diff("level") >= 0.0).all()  # (as it must be to be a curve)
    at = np.log(p["level"].values)
    step = at[1] - at[0]
    slopes = np.gradient([*p.values[0], 1.0], step)[:-1]
    cubic = CubicHermiteSpline(at, p.values[0], slopes)
    fine = np.linspace(at[0], at[-1], 100_001)
    curve = tp.Study.from_toml(tmp_path / "study.toml").hazard
    rates = curve.rate_at(np.exp(fine))
    inside = cubic(0.5 * (fine[1:] + fine[:-1])) @ -np.diff(rates)
    np.testing.assert_allclose(found.block_annual_number.isel(block=0), inside + rates[-1], rtol=1e-5)


SHELF = "[[blocks]]\nwidth_m = 0.4\nheight_m = 1.8\n"
HOUSNER = '[[models]]\nlaw = "housner"\n'


STIFF = '[[models]]\nlaw = "giannini-masiani"\ne = 0.3\n'
SPREAD = '[uncertainty]\ninputs = { R_factor = { distribution = "lognormal", median = 1.0, dispersion = 0.08 } }\n'
PIECES_OF_A_STUDY = {
    "pieces": ('im = "pga_normalised"\nlevels = { values = [0.7, 1.5], unit = "1" }\n', r"performance\.im"),
    "anchored": (
        'im = "pga"\nlevels = { values = [0.7], unit = "g" }\nobjective = "blocks-exit"\n',
        r"performance\.objective: nothing is left .* 'blocks-exit'",
    ),
    "stiff": (
        'im = "pga"\nlevels = { values = [0.7, 1.5], unit = "g" }\n',
        r"models\[2\]: '0\.4.* under giannini-masiani .* delta must be at least",
    ),
}


@pytest.mark.parametrize("name", PIECES_OF_A_STUDY)
def test_what_can_be_known_is_refused_before_the_runs(name, tmp_path):
    """Of an inventory; of blocks in `tests/golden/refused/sentences.toml`."""
    asked, message = PIECES_OF_A_STUDY[name]
    (tmp_path / "pieces.csv").write_text(
        "item,width_m,height_m,floor,anchored,consequence\nshelf,0.4,1.8,0,no,\ndesk,0.4,1.8,0,yes,blocks-exit\n"
    )
    models = HOUSNER + (STIFF + "delta = 1e-9\n") * (name == "stiff")
    text = f'{models}[performance]\ninventory = "pieces.csv"\n{asked}'
    (tmp_path / "study.toml").write_text(f'title = "Late"\n{text}{motions(4)}')
    with pytest.raises(StudyError, match=message):
        tp.Study.from_toml(tmp_path / "study.toml")


def test_the_forecast_of_a_sweep_over_delta_is_of_its_values(tmp_path):
    """A thin zone is solved in pieces: 2 dt q/sqrt(delta), some 350 for each sample, of 1e-7 s and more each."""
    seconds = []
    for delta in (1e-7, 0.05):
        sweep = f'[sensitivity]\nparameter = "delta"\nvalues = [{delta}, 0.06]\n'
        study = study_in(tmp_path, f'title = "Sweep"\n{SHELF}{STIFF}{IDA}{sweep}{motions(32)}')
        seconds.append(study.room.seconds / study.work)
    assert seconds[0] > 1000.0 * seconds[1]


@pytest.mark.slow
def test_uncertain_blocks_of_which_some_have_a_scene(tmp_path):
    """They run together, and the page says of each what stands around it."""
    study_in(
        tmp_path,
        'title = "Mixed"\n[[models]]\nlaw = "housner"\n[motions]\ngenerator = "kanai-tajimi"\nnumber = 4\n'
        "duration_s = 5\ndt_s = 0.02\n"
        '[[blocks]]\nname = "leaning"\nwidth_m = 0.4\nheight_m = 1.8\nlean_deg = 1.0\n'
        '[[blocks]]\nname = "free"\nwidth_m = 0.3\nheight_m = 1.7\n'
        '[ida]\nlevels = { values = [0.2, 0.5, 1.1], unit = "g" }\n'
        + SPREAD.replace("[uncertainty]", "[uncertainty]\nsamples = 3"),
    ).run(tmp_path / "out")
    leaning, free = blocks_of(xr.open_dataset(tmp_path / "out/results.nc"))
    assert leaning.lean == pytest.approx(math.radians(1.0))
    assert free.lean == 0.0
    assert leaning.width / leaning.height == pytest.approx(0.4 / 1.8)
    text = write_report(tmp_path / "out/results.nc", tmp_path, "md")[0].read_text()
    assert "| leaning |" in text
    assert "free" in text
