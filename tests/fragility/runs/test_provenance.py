"""Every dataset that is handed out says what it holds and what made it, and survives a file."""

import inspect
import json
import re
from itertools import product

import numpy as np
import pytest
import xarray as xr

import toppling as tp
from toppling import fragility, motions
from toppling.fragility import HazardCurve, RandomInputs, Uniform
from toppling.fragility.curves import published
from toppling.fragility.runs import provenance as read_back
from toppling.models.outputs import OUTPUTS

LEVELS = np.geomspace(0.5, 40.0, 10)
LAWS = [tp.HousnerImpact(), tp.EnergyConsistent()]
BLOCKS = [
    tp.Block(0.4, 1.9, name="shelf"),
    tp.Block(0.5, 1.2, name="crate"),
    tp.Block(0.6, 1.6, name="chest"),
    tp.Block(0.3, 1.0, name="rack"),
]
SHAKES = motions.CloughPenzien(duration=4.0, dt=0.02).sample(12)
SITE = HazardCurve.power_law(1e-4, 2.5, "pga", units="g")
INPUTS = RandomInputs({"e": Uniform(0.85, 1.0), "alpha_factor": Uniform(0.9, 1.1)})


@pytest.fixture(scope="module")
def runs():
    return tp.ida(BLOCKS, LAWS, SHAKES, LEVELS, outputs=("overturned", "peak_rotation", "uplifted"))


@pytest.fixture(scope="module")
def curves(runs):
    return tp.fit_fragility(runs, replicates=50, keep_replicates=True)


def uncertain():
    return fragility.uncertain_ida(INPUTS, BLOCKS[0], LAWS, SHAKES, LEVELS, samples=4)


def response(samples):
    return fragility.overturning_response(INPUTS, BLOCKS[0], LAWS[0], SHAKES, [3.0])(samples)


def exchanged(name, curves, path):
    """A curve written in an exchange format and read again."""
    getattr(fragility, f"write_{name}")(curves, path)
    return getattr(fragility, f"read_{name}")(path)


# what the public functions of `fragility` that return a dataset are called with
CALLS = {
    "adaptive_ida": lambda *_: fragility.adaptive_ida(
        BLOCKS,
        LAWS,
        motions.CloughPenzien(duration=4.0, dt=0.02),
        until={"rate": 0.9, "motions": {"least": 32, "most": 64}, "hazard": SITE},
    ),
    "annual_rate": lambda runs, curves, _: fragility.annual_rate(curves, SITE),
    "capacity_variance_shares": lambda runs, curves, _: fragility.capacity_variance_shares(runs),
    "cloud": lambda *_: fragility.cloud(BLOCKS, LAWS, SHAKES),
    "compare_forms": lambda runs, *_: fragility.compare_forms(runs),
    "epistemic_rates": lambda runs, curves, _: fragility.epistemic_rates(
        [fragility.Branch("a law", "motions", "a hazard", curves.isel(model=0), SITE, 1.0)]
    ),
    "fit_fragility": lambda runs, curves, _: curves,
    "goodness_of_fit": lambda runs, *_: fragility.goodness_of_fit(runs, replicates=5),
    "ida": lambda runs, *_: runs,
    "median_ratio": lambda runs, curves, _: fragility.median_ratio(
        curves, xr.Dataset({"median": curves["median"].isel(model=0, drop=True)}, attrs=curves.attrs)
    ),
    "overturning_capacity": lambda runs, *_: fragility.overturning_capacity(runs),
    "joint_falls": lambda *_: fragility.joint_falls(BLOCKS, LAWS, SHAKES, [3.0]),
    "overturning_probability": lambda runs, *_: fragility.overturning_probability(runs),
    "pooled": lambda *_: pooled(),
    "rank_measures": lambda runs, *_: fragility.rank_measures(runs, SHAKES, ["Sa(0.5)"], replicates=5),
    "read_pelicun": lambda runs, curves, folder: exchanged("pelicun", curves, folder / "curves.csv"),
    "resurrections": lambda runs, *_: fragility.resurrections(runs),
    "run_table": lambda *_: fragility.run_table(BLOCKS[0], LAWS[0], SHAKES, {"motion": [0, 1], "level": [2.0, 3.0]}),
    "screen": lambda runs, *_: fragility.screen(runs, SHAKES, friction=0.4, undecided=0.1),
    "size_for_rate": lambda runs, curves, _: fragility.size_for_rate(
        fragility.annual_rate(curves, SITE), rate=1e-4, along="width"
    ),
    "slide_runs": lambda runs, *_: fragility.slide_runs(runs, SHAKES, 0.3),
    "sobol_indices": lambda *_: fragility.sobol_indices(INPUTS, response, 4),
    "stripe_sufficiency": lambda *_: fragility.stripe_sufficiency(
        fragility.stripes(BLOCKS, LAWS, [SHAKES, SHAKES], [3.0, 4.0]), ["pgv"]
    ),
    "stripes": lambda *_: fragility.stripes(BLOCKS, LAWS, [SHAKES, SHAKES], [2.0, 4.0]),
    "surface_curves": lambda *_: fragility.surface_curves(pooled(), BLOCKS),
    "tornado": lambda *_: fragility.tornado(INPUTS, response),
    "uncertain_ida": lambda *_: uncertain(),
    "variance_shares": lambda runs, *_: fragility.variance_shares(runs["overturned"], ("motion", "model")),
    "with_modelling": lambda runs, curves, _: fragility.with_modelling(curves, 0.3),
}
OTHERS = {
    "RandomInputs.sample": lambda *_: INPUTS.sample(4),
    "fema_p58": lambda *_: published.fema_p58(),
    "p58_estimate": lambda *_: published.p58_estimate(BLOCKS),
    "japanese": lambda *_: published.japanese(BLOCKS),
    "measures": lambda *_: motions.measures(SHAKES),
    "response_spectrum": lambda *_: motions.response_spectrum(SHAKES, [0.5, 1.0]),
    "matching_report": lambda *_: motions.matching_report(SHAKES, motions.TargetSpectrum((0.1, 1.0), (1.0, 1.0))),
    "peaks": lambda *_: motions.Building.flexural_shear(0.8, storeys=3).peaks(SHAKES),
    "first overturnings": lambda runs, *_: tp.fit_fragility(runs, method="first-overturning"),
    "of counts": lambda *_: tp.fit_fragility(
        xr.Dataset({"overturnings": ("level", [1, 5, 9]), "runs": ("level", [10, 10, 10])}, {"level": [1.0, 2.0, 4.0]})
    ),
}


SLOW = ("rank_measures",)


def pooled():
    """Pooled curves of few motions."""
    shakes = motions.CloughPenzien(duration=4.0, dt=0.02)
    return fragility.pooled(BLOCKS, LAWS, shakes, until={"median": 0.9, "motions": {"least": 32, "most": 64}})


CLOCK = re.compile(r"\b20\d\d-\d\d-\d\d\b|\d\d:\d\d:\d\d")


def returns_a_dataset(name):
    found = getattr(fragility, name)
    return inspect.isfunction(found) and inspect.signature(found).return_annotation in (xr.Dataset, "xr.Dataset")


def test_all_public_functions_are_here():
    assert {name for name in fragility.__all__ if returns_a_dataset(name)} == {*CALLS}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name in SLOW else name for name in (*CALLS, *OTHERS)]
)
def test_says_what_it_is_and_survives_a_file(name, runs, curves, tmp_path):
    found = (CALLS | OTHERS)[name](runs, curves, tmp_path)
    for key, one in found.variables.items():
        assert one.attrs.get("units"), key
        assert one.attrs.get("long_name"), key
    for key in ("title", "Conventions", "schema", "toppling_version", "package_versions", "configuration"):
        assert key in found.attrs, key
    assert set(json.loads(found.attrs["package_versions"])) == {"numpy", "numba", "scipy"}
    assert isinstance(json.loads(found.attrs["configuration"]), dict)
    for where in (found, *found.variables.values()):
        for key, value in where.attrs.items():
            assert not isinstance(value, np.generic | bool | dict | None), (key, value)
            assert not CLOCK.search(str(value)), (key, value)
    path = tmp_path / "found.nc"
    found.to_netcdf(path)
    with xr.open_dataset(path) as again:
        xr.testing.assert_identical(again.load(), found)


def test_results_of_results_keep_what_they_were_made_of(runs, curves):
    """From the rate of a curve back to the blocks of its runs."""
    rates = fragility.annual_rate(curves, SITE)
    size = fragility.size_for_rate(rates, rate=1e-4, along="width")
    made_of = json.loads(size.attrs["configuration"])["rates"]["curves"]
    assert [block["name"] for block in made_of["blocks"]] == [block.name for block in BLOCKS]
    ranked = json.loads(fragility.rank_measures(runs, replicates=3, seed=4).attrs["configuration"])
    assert ranked["runs"] == json.loads(runs.attrs["configuration"])
    assert (ranked["replicates"], ranked["seed"]) == (3, 4)
    shares = fragility.capacity_variance_shares(runs)
    assert json.loads(shares.attrs["configuration"])["values"]["levels"] == LEVELS.tolist()
    indices = fragility.sobol_indices(INPUTS, response, 4)
    assert json.loads(indices.attrs["configuration"])["of"]["block"]["name"] == "shelf"


def test_a_configuration_of_others_is_no_obstacle(runs):
    """Files of others may have an attribute of that name: it stays, and nothing is read from it."""
    for strange in ("not JSON", "[1]", 5):
        counts = tp.overturning_probability(runs).assign_attrs(configuration=strange)
        fits = tp.fit_fragility(counts)
        assert fits.attrs["configuration"] == strange
        assert read_back.configuration_of(fits) == {}


class TestReadBack:
    """`fragility.provenance`: what runs were made of, from what is written on them."""

    def test_blocks_and_laws(self, runs):
        blocks, laws = read_back.blocks_of(runs), read_back.laws_of(runs)
        assert [(one.label, one.width, one.h, one.inertia) for one in blocks] == [
            (one.label, one.width, one.h, one.inertia) for one in BLOCKS
        ]
        assert laws == LAWS
        part = runs.isel(block=[2, 0], model=[1])
        assert [one.label for one in read_back.blocks_of(part)] == ["chest", "shelf"]
        assert read_back.laws_of(part) == LAWS[1:]

    def test_runs_again_are_the_same_runs(self, runs):
        """Blocks, laws, motions and factors read back, run as plain factors: bit by bit what was run."""
        records = read_back.records_of(runs, SHAKES)
        factors = read_back.factors_of(runs)
        for i in (0, 7):
            one = motions.from_array(records[i].acceleration, records[i].dt, [records[i].label])
            again = tp.ida(read_back.blocks_of(runs), read_back.laws_of(runs), one, factors[0, :, i], "scale")
            np.testing.assert_array_equal(again["peak_rotation"].values[..., 0], runs["peak_rotation"].values[..., i])

    def test_designs(self, runs):
        stripes = fragility.stripes(BLOCKS[:1], LAWS[0], [SHAKES, SHAKES], [2.0, 4.0])
        as_they_are = fragility.stripes(BLOCKS[:1], LAWS[0], [SHAKES, SHAKES], [2.0, 4.0], scale=False)
        cloud = fragility.cloud(BLOCKS[:1], LAWS[0], SHAKES)
        assert [read_back.design_of(one) for one in (runs, stripes, cloud)] == ["ida", "stripes", "cloud"]
        scaled = [read_back.scaled_to_levels(one) for one in (runs, stripes, as_they_are, cloud)]
        assert scaled == [True, True, False, False]
        # what is counted beside them does not make stripes an IDA
        counted = stripes.merge(tp.overturning_probability(stripes))
        assert read_back.design_of(counted) == "stripes"
        np.testing.assert_array_equal(read_back.factors_of(counted), read_back.factors_of(stripes))
        np.testing.assert_allclose(
            read_back.factors_of(stripes)[0, 0] * stripes["pga"], stripes["intensity"], rtol=1e-15
        )
        assert (read_back.factors_of(cloud) == 1.0).all()

    def test_scale_factors_of_slabs_are_parts_of_the_whole(self, runs):
        """For measures that depend on the block, too, at levels and in stripes."""
        normalised = tp.ida(BLOCKS, LAWS, SHAKES, [1.5, 3.0], "pga_normalised")
        stripes = tp.stripes(BLOCKS, LAWS, [SHAKES, SHAKES], [1.5, 3.0], "pgv_normalised")
        where = {"block": slice(1, 3), "motion": slice(2, 5)}
        for one in (runs, normalised, stripes):
            factors = read_back.scale_factors(one)
            whole = factors.values
            part = factors.part(where).values
            assert part.dims == whole.dims
            np.testing.assert_array_equal(part, whole.isel(where, missing_dims="ignore"))
            np.testing.assert_array_equal(whole, one["scale_factor"])

    def test_the_measure_of_the_levels(self, runs):
        assert read_back.level_measure(runs).name == "pga"
        floors = motions.Building.flexural_shear(0.5, storeys=2).floor_motions(SHAKES, floors=[2])
        below = tp.ida(BLOCKS[0], LAWS[0], floors, [2.0, 4.0], ground=SHAKES)
        found = read_back.level_measure(below)
        assert found.name == "ground_pga"
        assert read_back.levels_of_the_ground(below)
        np.testing.assert_allclose(found.values, np.abs(SHAKES).max("time"), rtol=1e-15)
        plain = tp.ida(BLOCKS[0], LAWS[0], SHAKES, [1.0, 2.0], "scale")
        assert read_back.level_measure(plain).measure is None
        np.testing.assert_array_equal(read_back.factors_of(plain)[0, :, 0], [1.0, 2.0])


@pytest.fixture(scope="module")
def shaken():
    """Motions of the ground and of a floor, and of floors with the ground below."""
    building = motions.Building.flexural_shear(0.5, storeys=2)
    return {
        "ground": (SHAKES, None),
        "floor": (building.floor_motions(SHAKES, floors=[2]), None),
        "ground below": (building.floor_motions(SHAKES, floors=[1, 2]), SHAKES),
    }


@pytest.mark.filterwarnings("ignore:.*sways")
class TestPlaces:
    """Whatever is in a measure says whether it is of the ground or of a floor."""

    @pytest.mark.parametrize("where", ["ground", "floor", "ground below"])
    @pytest.mark.parametrize(
        ("im", "words"),
        [("pgv", "peak {} velocity"), ("Sa(0.5)", "spectral acceleration at 0.5 s, 5 % damping, {} motion")],
    )
    def test_of_curves(self, shaken, where, im, words):
        shakes, ground = shaken[where]
        levels = np.geomspace(0.05, 4.0, 6) if im == "pgv" else LEVELS
        found = tp.ida(BLOCKS[:1], LAWS[:1], shakes, levels, im, ground=ground)
        place = where.partition(" ")[0]
        measure = words.format(place)
        assert found["level"].attrs["long_name"] == measure
        assert found["pga"].attrs["long_name"] == f"peak {'ground' if where == 'ground' else 'floor'} acceleration"
        fit = tp.fit_fragility(found, replicates=20, fractiles=[0.1])
        for name in ("median", "median_se", "median_lower", "fractile", "fractile_upper"):
            assert fit[name].attrs["long_name"].endswith(f": {measure}"), name
        capacities = fragility.overturning_capacity(found)
        for name in ("lower", "upper", "capacity"):
            assert capacities[name].attrs["long_name"].endswith(f": {measure}"), name
        hazard = HazardCurve([0.01, 0.1, 1.0, 10.0], [1.0, 0.1, 0.01, 1e-3], im, at=place)
        assert fragility.annual_rate(fit, hazard)["bin"].attrs["long_name"].endswith(f" of {measure}")

    def test_of_motions_and_of_other_measures(self, shaken):
        for where, place in (("ground", "ground"), ("floor", "floor"), ("ground below", "floor")):
            shakes, ground = shaken[where]
            named = motions.measures(shakes, ["pgd", "cav"])
            assert named["pgd"].attrs["long_name"] == f"peak {place} displacement"
            assert named["cav"].attrs["long_name"] == f"cumulative absolute velocity, {place} motion"
            found = tp.ida(BLOCKS[0], LAWS[0], shakes, np.geomspace(0.05, 4.0, 6), "pgv", ground=ground)
            ranked = fragility.rank_measures(found, replicates=5)
            names = dict(zip(ranked["measure"].values, ranked["measure_long_name"].values, strict=True))
            assert names["arias"] == f"Arias intensity, {place} motion"
            assert names["ground_pgv" if ground is not None else "pgv"].startswith(f"peak {where.split()[0]} velocity")

    def test_of_exported_curves(self, curves, tmp_path):
        """Of the ground where their motions are; else of the floor where the block stands."""
        unknown = curves.drop_dims("level").assign(median=curves["median"].assign_attrs(long_name="median"))
        for given, text in (
            (curves, "given the peak ground acceleration, made"),
            (unknown, "given the peak floor acceleration where the block stands, made"),
        ):
            written = fragility.write_nrml(given.isel(model=0), tmp_path / "curves.xml")
            assert text in written.paths[0].read_text(encoding="utf-8")


class TestAmplitude:
    """Which motions have an amplitude of their own is said by what made them, not by what they are called."""

    def test_generators_say_it(self):
        free = {name for name, one in motions.GENERATORS.items() if not one.own_amplitude}
        assert free == {
            "kanai-tajimi",
            "clough-penzien",
            "evolutionary-kanai-tajimi",
            "evolutionary-clough-penzien",
            "site-based",
            "spectrum-compatible",
            "ac156",
        }
        assert not any(one.own_amplitude for one in motions.PULSES.values())

    @pytest.mark.slow
    def test_it_goes_with_the_motions(self):
        """Through scaling, corrections, buildings, matching and files; what says nothing has one."""
        record = motions.from_array(np.sin(np.arange(400) / 8.0), 0.02, ["KanaiTajimi of the name"])
        for one, expected in ((SHAKES, False), (record, True)):
            passed = [
                motions.scale_to(one, 2.0),
                motions.highpass(one, 0.2),
                motions.Building.flexural_shear(0.5, storeys=2).floor_motions(one, floors=[2]),
                xr.DataArray.from_dict(one.to_dict()),
            ]
            for again in passed:
                assert {record.own_amplitude for record in motions.records(again)} == {expected}
        target = motions.TargetSpectrum((0.2, 1.0, 4.0), (4.0, 4.0, 0.5))
        assert not motions.match(record, target)["own_amplitude"].any()
        assert all(one.own_amplitude for one in motions.records(record.drop_vars("own_amplitude")))
        with pytest.raises(TypeError, match="own_amplitude must be True or False, got 1"):
            motions.from_array([0.0, 1.0], 0.1, own_amplitude=1)

    def test_screened_by_it_alone(self):
        record = motions.from_array(SHAKES.values, 0.02, [f"KanaiTajimi {i}" for i in range(12)], "CloughPenzien")
        far = [
            fragility.screen(tp.ida(BLOCKS[0], LAWS[0], one, [100.0]))["outside"].sel(reason="scaled_far").item()
            for one in (SHAKES, record)
        ]
        assert far == [0.0, 1.0]


HAZARD = tp.HazardCurve([0.1, 1.0, 10.0], [1.0, 0.03, 0.0005], "pga")
DERIVED = {
    "reached": lambda runs: tp.fragility.reached(runs).to_dataset(name="fell"),
    "overturning_probability": tp.overturning_probability,
    "fit_fragility": tp.fit_fragility,
    "goodness_of_fit": tp.fragility.goodness_of_fit,
    "overturning_capacity": tp.fragility.overturning_capacity,
    "rank_measures": lambda runs: tp.fragility.rank_measures(runs, replicates=0),
}


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    path = tmp_path_factory.mktemp("merging") / "runs.nc"
    motions = tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(6)
    blocks = [tp.Block(0.4, 1.6, name="a"), tp.Block(0.4, 2.0, name="b")]
    tp.ida(blocks, tp.HousnerImpact(), motions, [1.0, 2.0, 4.0]).to_netcdf(path)
    return path


class TestMerging:
    """What is made of a reopened dataset merges with it without a warning of xarray."""

    @pytest.mark.filterwarnings("error::FutureWarning")
    @pytest.mark.parametrize("name", DERIVED)
    def test_with_runs(self, stored, name):
        with xr.open_dataset(stored) as runs:
            merged = runs.merge(DERIVED[name](runs))
        with xr.open_dataset(stored) as runs:
            again = DERIVED[name](runs).merge(runs)
        assert merged["alpha"].values.tolist() == again["alpha"].values.tolist() != []

    @pytest.mark.filterwarnings("error::FutureWarning")
    def test_with_each_other_and_with_rates(self, stored, tmp_path):
        with xr.open_dataset(stored) as runs:
            tp.fit_fragility(runs).to_netcdf(tmp_path / "curves.nc")
            assert "median" in tp.overturning_probability(runs).merge(tp.fit_fragility(runs))
        with xr.open_dataset(tmp_path / "curves.nc") as curves:
            assert "median" in tp.annual_rate(curves, HAZARD).merge(curves)


RESAMPLED = {"intervals": "bootstrap", "replicates": 10, "keep_replicates": True}


class TestNothingSelected:
    """Of no block, or no law, there are empty results with all variables."""

    @pytest.fixture(scope="class")
    @classmethod
    def motions(cls):
        return [motions.CloughPenzien(duration=10.0, dt=0.01).sample(8, seed) for seed in (1, 2)]

    @pytest.mark.parametrize("dim", ["block", "model"])
    @pytest.mark.parametrize("options", [{}, RESAMPLED, {"form": "isotonic"}], ids=str)
    @pytest.mark.parametrize("design", ["ida", "stripes", "cloud", "counts", "normalised"])
    def test_curves_and_rates(self, motions, design, options, dim):
        runs = {
            "ida": lambda: tp.ida(BLOCKS[:2], LAWS, motions[0], [1.0, 2.0, 4.0]),
            "stripes": lambda: tp.stripes(BLOCKS[:2], LAWS, motions, [2.0, 4.0]),
            "cloud": lambda: tp.cloud(BLOCKS[:2], LAWS, motions[0]),
            "counts": lambda: tp.overturning_probability(tp.ida(BLOCKS[:2], LAWS, motions[0], [1.0, 2.0, 4.0])),
            "normalised": lambda: tp.cloud(BLOCKS[:2], LAWS, motions[0], "pga_normalised"),
        }[design]()
        empty = runs.isel({dim: []})
        curves = tp.fit_fragility(empty, **options)
        assert curves["median"].sizes == {"block": 2, "model": 2, dim: 0}
        assert curves["median"].attrs["units"] == ("1" if design == "normalised" else "m s-2")
        if design in ("ida", "stripes"):
            assert tp.overturning_probability(empty)["probability"].sizes[dim] == 0
        if design != "normalised" and "form" not in options:  # (without curves, tables of them have no levels)
            rates = tp.annual_rate(curves, HAZARD)
            assert rates["rate"].sizes == curves["median"].sizes
        if options.get("intervals"):
            assert curves["median_sample"].sizes["replicate"] == 10

    @pytest.mark.parametrize(
        ("name", "dim"),
        [
            *product(("screen", "rank_measures", "notes"), ("block", "model", "level", "motion")),
            ("fit_fragility", "level"),
            ("fit_fragility", "motion"),
        ],
    )
    def test_other_answers_need_runs(self, runs, name, dim):
        """One sentence, of what is missing; curves of no block or law are empty (`test_curves_and_rates`)."""
        function = getattr(fragility, name)
        arguments = () if name in ("notes", "fit_fragility") else (SHAKES,)
        with pytest.raises(ValueError, match=rf" must hold at least one {dim}, got none$"):
            function(runs.isel({dim: []}), *arguments)

    def test_further_ones(self, motions, runs, curves):
        stripes = tp.stripes(BLOCKS[0], LAWS, motions, [2.0, 4.0])
        for call in (
            lambda: fragility.stripe_sufficiency(stripes.isel(block=[])),
            lambda: fragility.screen(stripes.isel(block=[]), motions),
            lambda: fragility.rank_measures(stripes.isel(block=[]), motions),
            lambda: tp.plot.fragility(curves.isel(block=[])),
        ):
            with pytest.raises(ValueError, match=r" must hold at least one block, got none$"):
                call()
        with pytest.raises(ValueError, match=r"^runs must hold at least one level, got none$"):
            fragility.overturning_capacity(runs.isel(level=[]))


@pytest.mark.parametrize("law", [tp.HousnerImpact(0.9, geometry="linear"), tp.Sliding(0.3)], ids=["rocking", "sliding"])
def test_a_history_has_the_words_of_runs(law):
    strap = tp.Restraint.strap(1.8, strength=500.0)
    held = {"restraint": strap, "mass": 80.0} if isinstance(law, tp.HousnerImpact) else {}
    motion = tp.motions.CloughPenzien(duration=4.0, dt=0.02).sample(1, seed=1)
    history = tp.simulate(tp.Block(0.4, 1.8, **held), law, motion)
    results = [name for name, variable in history.data_vars.items() if not variable.dims]
    assert len(results) > 9
    for name in results:
        output = OUTPUTS[name]
        assert (history[name].attrs["long_name"], history[name].attrs["units"]) == (output.text, output.units), name
        assert history[name].dtype.kind == np.dtype(output.kind).kind or name in ("slips", "mode"), name
