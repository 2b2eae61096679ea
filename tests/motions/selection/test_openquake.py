"""Correlations, conditional spectra and files beside OpenQuake: run where openquake.engine is installed.

`.ci/environments` makes such an environment.  Some tests are of traps: what OpenQuake does without a word, so that its
numbers must not be taken as they are.
"""

import csv
import math
import os
import subprocess
import sys

import numpy as np
import pytest
from scipy.special import ndtr

from toppling import motions as mo
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.fragility import read_hazard
from toppling.motions.selection import correlations

imt = pytest.importorskip("openquake.hazardlib.imt")

from openquake.hazardlib.calc.cond_spectra import get_cs_out  # noqa: E402
from openquake.hazardlib.contexts import simple_cmaker  # noqa: E402
from openquake.hazardlib.cross_correlation import BakerJayaram2008, Bradley2012  # noqa: E402
from openquake.hazardlib.gsim.boore_2014 import BooreEtAl2014  # noqa: E402
from openquake.hazardlib.tom import PoissonTOM  # noqa: E402

pytestmark = pytest.mark.openquake

PERIODS = (0.05, 0.1, 0.2, 0.3, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 5.0)
YEARS = 50.0
RUPTURES = (mo.Scenario(6.5, 20e3, 400.0), mo.Scenario(7.0, 10e3, 400.0, "reverse"))
RATES = (0.01, 0.003)


def named(label):
    return imt.from_string(label)


class TestCorrelations:
    def test_spectral_ordinates(self):
        """At 61 periods with those around which the formula changes."""
        periods = [*np.geomspace(0.01, 10.0, 57), 0.1089, 0.1091, 0.1999, 0.2001]
        theirs = BakerJayaram2008()
        for a in periods:
            for b in periods:
                expected = theirs.get_correlation(named(f"SA({a})"), named(f"SA({b})"))
                assert correlations.spectral(a, b) == pytest.approx(expected, abs=1e-13)

    def test_peak_velocity(self):
        theirs = Bradley2012()
        for period in np.geomspace(0.011, 10.0, 101):
            expected = theirs.get_correlation(named("PGV"), named(f"SA({period})"))
            assert correlations.velocity_spectral(period) == pytest.approx(expected, abs=1e-13)
        assert theirs.get_correlation(named("PGV"), named("PGA")) == correlations.PGV_PGA

    @pytest.mark.parametrize(("period", "jump"), [(0.1, 0.0016), (0.75, 0.0003), (2.5, 0.001)])
    def test_trap_the_formula_jumps_and_they_take_the_other_side(self, period, jump):
        expected = Bradley2012().get_correlation(named("PGV"), named(f"SA({period})"))
        assert abs(correlations.velocity_spectral(period) - expected) == pytest.approx(jump, rel=0.4)
        above = Bradley2012().get_correlation(named("PGV"), named(f"SA({period * (1 - 1e-9)})"))
        assert correlations.velocity_spectral(period) == pytest.approx(above, abs=1e-7)

    def test_trap_the_peak_velocity_is_taken_as_a_spectral_ordinate_of_no_period(self):
        """Its Baker-Jayaram gives PGV the correlations of T = 0 instead of refusing it: 0.52 with Sa(1), not 0.79."""
        silent = BakerJayaram2008().get_correlation(named("PGV"), named("SA(1.0)"))
        assert silent == pytest.approx(correlations.spectral(0.01, 1.0), abs=0.01)
        ours = correlations.by_formulas([mo.measure_named("pgv"), mo.Sa(1.0)])[0, 1]
        assert ours == pytest.approx(0.7855676999, abs=1e-10)
        assert ours - silent > 0.25

    def test_trap_spectral_ordinates_without_correlation(self):
        """Its Bradley gives 0 between two spectral ordinates, so that a matrix of it alone has independent ones."""
        assert Bradley2012().get_correlation(named("SA(1.0)"), named("SA(1.1)")) == 0
        assert correlations.spectral(1.0, 1.1) > 0.95

    def test_trap_the_two_together_form_no_matrix(self):
        """Each program's formulas do not; ours are repaired, and say by how much."""
        spectral, velocity = BakerJayaram2008(), Bradley2012()
        periods = [1.01 * period for period in PERIODS]  # (beside the jumps)
        names = [named(f"SA({period})") for period in periods] + [named("PGV")]
        joined = np.array(
            [
                [(velocity if "PGV" in (a.string, b.string) else spectral).get_correlation(a, b) for b in names]
                for a in names
            ]
        )
        assert np.linalg.eigvalsh(joined)[0] < -0.005
        target = mo.Target([*(mo.Sa(period) for period in periods), "pgv"], *np.ones((2, 12)))
        covariance = np.array(target._covariance)
        assert np.linalg.eigvalsh(covariance)[0] > 0.0
        assert np.abs(covariance - joined).max() == pytest.approx(target.correlation_change, rel=1e-9)
        assert 0.001 < target.correlation_change < correlations.DOUBTFUL_CHANGE


def contexts(labels, ruptures=RUPTURES):
    """OpenQuake's maker of contexts and the ruptures at one site, with what its conditional spectra ask for."""
    maker = simple_cmaker(
        [BooreEtAl2014()], labels, cross_correl=BakerJayaram2008(), poes=[0.1], truncation_level=9.0,
        investigation_time=YEARS,
    )  # fmt: skip
    plain = maker.new_ctx(len(ruptures))
    found = np.recarray(len(ruptures), dtype=np.dtype([*plain.dtype.descr, ("probs_occur", "<f8", (0,))]))
    for name in plain.dtype.names:
        found[name] = plain[name]
    found.mag = [one.magnitude for one in ruptures]
    found.rjb = [1e-3 * one.distance for one in ruptures]
    found.rake = [90.0 if one.faulting == "reverse" else 0.0 for one in ruptures]
    found.vs30 = [one.vs30 for one in ruptures]
    found.occurrence_rate = RATES[: len(ruptures)]
    return maker, found


def exceedances(maker, found, at, level):
    """Annual rates at which each rupture exceeds a level of the measure `at`."""
    means, sigmas = maker.get_mean_stds([found])[:2, 0]
    return found.occurrence_rate * ndtr((means[at] - math.log(level)) / sigmas[at])


def spectra(maker, found, at, level, rate):
    """OpenQuake's conditional medians (g, cm/s) and sigmas at a level of the measure `at`, which has that rate."""
    maker.poes = [-math.expm1(-YEARS * rate)]
    time = PoissonTOM(YEARS)
    levels = np.array([[level]])
    first = get_cs_out(maker, found, at, levels, time)[0]
    second = get_cs_out(maker, found, at, levels, time, first)[0]
    return np.exp(first[:, 0, 1, 0] / first[:, 0, 0, 0]), np.sqrt(second[:, 0, 2, 0] / second[:, 0, 0, 0])


class TestConditionalSpectra:
    LABELS = tuple(f"SA({period})" for period in PERIODS)
    MEASURES = tuple(mo.Sa(period) for period in PERIODS)
    AT = PERIODS.index(1.0)

    @pytest.mark.parametrize(("number", "level"), [(1, 0.1), (1, 0.4), (2, 0.2), (2, 0.8)])
    def test_of_one_and_of_two_ruptures(self, number, level):
        """Lin et al. (2013), with OpenQuake's medians and sigmas: to 1e-9."""
        maker, found = contexts(self.LABELS, RUPTURES[:number])
        means, sigmas = maker.get_mean_stds([found])[:2, 0]
        shares = exceedances(maker, found, self.AT, level)
        medians, spread = spectra(maker, found, self.AT, level, shares.sum())
        targets = [
            mo.Target(self.MEASURES, G * np.exp(means[:, r]), sigmas[:, r], given=mo.Sa(1.0)) for r in range(number)
        ]
        assert max(one.correlation_change for one in targets) == 0.0
        ours = mo.Mixture(targets, shares).at(G * level)
        np.testing.assert_allclose(ours.medians / G, medians, rtol=1e-9)
        np.testing.assert_allclose(ours.sigmas, spread, rtol=0, atol=2e-8)

    @pytest.mark.parametrize("level", [0.15, 0.5])
    def test_from_the_scenarios_to_the_spectrum(self, level):
        """Ground-motion models by pyGMM here and by OpenQuake there: to 1e-5."""
        maker, found = contexts(self.LABELS)
        shares = exceedances(maker, found, self.AT, level)
        medians, spread = spectra(maker, found, self.AT, level, shares.sum())
        target = mo.expected_target(RUPTURES, "Sa(1.0)", self.MEASURES, weights=shares)
        ours = target.at(level * G)
        np.testing.assert_allclose(ours.medians / G, medians, rtol=1e-5)
        np.testing.assert_allclose(ours.sigmas, spread, rtol=0, atol=1e-5)

    def test_trap_the_given_measure_scatters_where_level_and_rate_differ(self):
        """A rate 1 % off that of the level, as of an interpolated curve: theirs has a sigma at T*, ours none."""
        maker, found = contexts(self.LABELS)
        shares = exceedances(maker, found, self.AT, 0.4)
        _, spread = spectra(maker, found, self.AT, 0.4, 1.01 * shares.sum())
        assert 0.005 < spread[self.AT] < 0.05
        ours = mo.expected_target(RUPTURES, "Sa(1.0)", self.MEASURES, weights=shares).at(0.4 * G)
        assert ours.sigmas[self.AT] == 0.0

    def test_trap_the_conditional_peak_velocity(self):
        """With PGV among OpenQuake's measures its median at Sa(1) = 0.4 g is 25 cm/s, by Bradley's formula 31."""
        maker, found = contexts(("SA(1.0)", "PGV"), RUPTURES[:1])
        rate = exceedances(maker, found, 0, 0.4).sum()
        medians, spread = spectra(maker, found, 0, 0.4, rate)
        ours = mo.expected_target(RUPTURES[0], "Sa(1.0)", ["Sa(1.0)", "pgv"]).at(0.4 * G)
        assert 100.0 * ours.medians[1] == pytest.approx(31.46386229, rel=1e-6)
        assert ours.sigmas[1] == pytest.approx(0.4031170648, rel=1e-6)
        silent = correlations.spectral(0.01, 1.0)
        assert medians[1] == pytest.approx(14.86829403 * math.exp(silent * 0.651475249 * 1.4647146957), rel=0.01)
        assert medians[1] / (100.0 * ours.medians[1]) < 0.85
        assert spread[1] > 1.3 * ours.sigmas[1]


SOURCE = """<pointSource id="{name}" name="{name}" tectonicRegion="Active Shallow Crust">
<pointGeometry><gml:Point><gml:pos>{longitude!r} 0.0</gml:pos></gml:Point>
<upperSeismoDepth>0.0</upperSeismoDepth><lowerSeismoDepth>20.0</lowerSeismoDepth></pointGeometry>
<magScaleRel>WC1994</magScaleRel><ruptAspectRatio>2.0</ruptAspectRatio>
<incrementalMFD minMag="{magnitude}" binWidth="0.1"><occurRates>{rate}</occurRates></incrementalMFD>
<nodalPlaneDist><nodalPlane probability="1.0" strike="0.0" dip="90.0" rake="{rake}"/></nodalPlaneDist>
<hypoDepthDist><hypoDepth probability="1.0" depth="10.0"/></hypoDepthDist></pointSource>"""
MODEL = """<?xml version="1.0" encoding="UTF-8"?>
<nrml xmlns:gml="http://www.opengis.net/gml" xmlns="http://openquake.org/xmlns/nrml/0.4">
<sourceModel name="two">{}</sourceModel></nrml>"""
TREE = """<?xml version="1.0" encoding="UTF-8"?>
<nrml xmlns="http://openquake.org/xmlns/nrml/0.4"><logicTree logicTreeID="{kind}">
<logicTreeBranchSet uncertaintyType="{kind}" branchSetID="{kind}" {applies}>
<logicTreeBranch branchID="only"><uncertaintyModel>{model}</uncertaintyModel>
<uncertaintyWeight>1.0</uncertaintyWeight></logicTreeBranch></logicTreeBranchSet></logicTree></nrml>"""
JOB = """[general]
description = two ruptures
{kind}
sites = 0.0 0.0
number_of_logic_tree_samples = 0
rupture_mesh_spacing = 1
width_of_mfd_bin = 0.1
reference_vs30_type = measured
reference_vs30_value = 400.0
reference_depth_to_2pt5km_per_sec = 2.0
reference_depth_to_1pt0km_per_sec = 50.0
source_model_logic_tree_file = sources.xml
gsim_logic_tree_file = models.xml
investigation_time = 50.0
{measures}
truncation_level = 9
maximum_distance = 100.0
"""
RUN = """import sys
from openquake.commonlib import logs
logs.dbcmd("upgrade_db")
from openquake.calculators.base import run_calc
for job in sys.argv[1:]:
    run_calc(job, exports="csv", export_dir=job[:-4])
"""


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """The files of OpenQuake for two vertical faults across the equator, 20 km east and 10 km west of a site on it."""
    folder = tmp_path_factory.mktemp("openquake")
    degree = math.pi * 6371.0 / 180.0
    sources = [
        SOURCE.format(name=name, longitude=1e-3 * sign * one.distance / degree, magnitude=one.magnitude, rate=rate,
                      rake=90.0 if one.faulting == "reverse" else 0.0)
        for name, sign, one, rate in zip("ab", (1, -1), RUPTURES, RATES, strict=True)
    ]  # fmt: skip
    region = 'applyToTectonicRegionType="Active Shallow Crust"'
    measures = ", ".join(f'"{name}": logscale(0.005, 3.0, 200)' for name in TestConditionalSpectra.LABELS)
    velocity = '"SA(0.2)": logscale(0.005, 3.0, 50), "SA(1.0)": logscale(0.005, 3.0, 50), "PGV": logscale(0.5, 300, 50)'
    spectra_job = "calculation_mode = classical\npostproc_func = conditional_spectrum.main\ncross_correlation = "
    spectra_job += "BakerJayaram2008\nimt_ref = SA(1.0)\npoes = 0.1 0.02"
    disaggregation = "calculation_mode = disaggregation\niml_disagg = {'SA(1.0)': 0.4}\nmag_bin_width = 0.1\n"
    disaggregation += "distance_bin_width = 1.0\ncoordinate_bin_width = 1.0\nnum_epsilon_bins = 2\n"
    disaggregation += "disagg_outputs = Mag_Dist Mag_Dist_Eps"
    for name, text in {
        "two.xml": MODEL.format("".join(sources)),
        "sources.xml": TREE.format(kind="sourceModel", applies="", model="two.xml"),
        "models.xml": TREE.format(kind="gmpeModel", applies=region, model="BooreEtAl2014"),
        "spectra.ini": JOB.format(kind=spectra_job, measures=f"intensity_measure_types_and_levels = {{{measures}}}"),
        "velocity.ini": JOB.format(kind=spectra_job, measures=f"intensity_measure_types_and_levels = {{{velocity}}}"),
        "shares.ini": JOB.format(kind=disaggregation, measures=""),
        "run.py": RUN,
    }.items():
        (folder / name).write_text(text, encoding="utf-8")
    own = {"OQ_DISTRIBUTE": "no", "OQ_DATADIR": str(folder / "data"), "HOME": str(folder)}
    for name in ("data", "oqdata"):
        (folder / name).mkdir()
    done = subprocess.run(
        [sys.executable, "run.py", "spectra.ini", "velocity.ini", "shares.ini"], cwd=folder, env=os.environ | own,
        text=True, capture_output=True, check=False, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    return folder


def only(folder, pattern):
    (found,) = folder.glob(pattern)
    return found


class TestFiles:
    AT = PERIODS.index(1.0)

    def rate(self, level):
        maker, found = contexts(("SA(1.0)",))
        return float(exceedances(maker, found, 0, level).sum())

    def test_hazard_curve(self, exported):
        """Read as it is written, and that of the two ruptures to the digits of the file."""
        curve = read_hazard(only(exported, "spectra/hazard_curve-mean-SA(1.0)*.csv"))
        levels = G * np.array([0.1, 0.2, 0.4, 0.8])
        expected = [self.rate(level / G) for level in levels]
        np.testing.assert_allclose(curve.rate_at(levels), expected, rtol=2e-3)

    def test_conditional_spectra(self, exported):
        """The whole way: OpenQuake's job beside the mixture of pyGMM's two ruptures, at its levels, to 0.2 %."""
        path = only(exported, "spectra/conditional-spectrum-0*.csv")
        with path.open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
        read = mo.read_target(path, "Sa(1.0)")
        assert [one.label for one in read.measures] == [one.label for one in TestConditionalSpectra.MEASURES]
        for poe in (0.1, 0.02):
            own = [row for row in rows if float(row["poe"]) == poe]
            level = G * float(own[self.AT]["mea"])
            assert self.rate(level / G) == pytest.approx(-math.log1p(-poe) / YEARS, rel=2e-3)
            found = read.at(level)
            np.testing.assert_allclose(found.medians / G, [float(row["mea"]) for row in own], rtol=1e-12)
            maker, context = contexts(("SA(1.0)",))
            weights = exceedances(maker, context, 0, level / G)
            ours = mo.expected_target(RUPTURES, "Sa(1.0)", TestConditionalSpectra.MEASURES, weights=weights).at(level)
            np.testing.assert_allclose(ours.medians, found.medians, rtol=2e-3)
            np.testing.assert_allclose(ours.sigmas, found.sigmas, rtol=0, atol=2e-3)

    def test_trap_a_peak_velocity_at_period_0(self, exported):
        """OpenQuake's file has PGV, cm/s, in the place of PGA, g: refused, not read as 30 g."""
        with pytest.raises(mo.TargetError, match="times the largest Sa: OpenQuake writes a PGV there"):
            mo.read_target(only(exported, "velocity/conditional-spectrum-0*.csv"), "Sa(1.0)")

    @pytest.mark.parametrize("kind", ["Mag_Dist", "Mag_Dist_Eps"])
    def test_disaggregation(self, exported, kind):
        """The two ruptures with the shares that their rates have."""
        found = mo.read_disaggregation(only(exported, f"shares/{kind}-0*.csv"), column="rlz0")
        assert found.measure == mo.Sa(1.0)
        assert found.level == pytest.approx(0.4 * G, rel=1e-5)
        maker, context = contexts(("SA(1.0)",))
        expected = exceedances(maker, context, 0, 0.4)
        order = np.argsort(found.magnitude)
        np.testing.assert_allclose(found.magnitude[order], [6.5, 7.0], atol=0.051)
        np.testing.assert_allclose(found.distance[order], [20e3, 10e3], atol=501.0)
        np.testing.assert_allclose(found.share[order], expected / expected.sum(), rtol=1e-3)
