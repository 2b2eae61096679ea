"""The source paper's claims: free rocking in closed form, verdicts that follow the data."""

import math

import numpy as np
import pytest
from sensitivity_cases import BLOCK, STUDY, of_law
from study_texts import study_of

import toppling as tp
from toppling.benchmarks.claims.claims import FAILS, HOLDS, OPEN, claims, evidence_of
from toppling.benchmarks.claims.evidence import evidence, free_decay, impact_decay, impact_times

DELTA = """
[sensitivity]
parameter = "delta"
values = [0.002, 0.01, 0.05, 0.1]
replicates = 100
"""
E = """
[sensitivity]
parameter = "e"
values = [0.9, 1.0]
replicates = 100
"""


def evidence_over(folder, text):
    study = study_of(folder, STUDY, text)
    return evidence(study, study.run())


@pytest.fixture(scope="module")
def over_delta(tmp_path_factory):
    return evidence_over(tmp_path_factory.mktemp("delta"), DELTA)


@pytest.fixture(scope="module")
def over_e(tmp_path_factory):
    return evidence_over(tmp_path_factory.mktemp("e"), E)


class TestFreeDecay:
    def test_closed_form(self):
        """Housner's peaks, and an impact at a time: each leaves e² of the energy x - x²/2."""
        np.testing.assert_allclose(
            impact_decay(0.5, 0.925)[[1, 2, 5, 10]], [0.401434, 0.328487, 0.190023, 0.082244], atol=5e-7
        )
        x = 0.7
        for found in impact_decay(0.7, 0.9, 6):
            assert found == pytest.approx(x, rel=1e-12)
            x = 1.0 - math.sqrt(1.0 - 2.0 * 0.81 * (x - 0.5 * x * x))

    def test_small_energies_keep_their_digits(self):
        """Far down, x_n² is negligible: x_n = e^(2n) (x0 - x0²/2)."""
        last = impact_decay(0.5, 0.1, 8)[-1]
        assert last == pytest.approx(0.375e-16, rel=1e-12)

    @pytest.mark.parametrize("e", [0.7, 0.925, 1.0])
    def test_times_are_those_of_the_rigid_block(self, e):
        law = tp.HousnerImpact(e=e, geometry="bilinear")
        found = free_decay(BLOCK, [law], [e])
        np.testing.assert_allclose(found["decay_peak"][0], impact_decay(0.5, e), rtol=1e-11)
        times = tp.models.free_rocking(BLOCK, law, 0.5 * BLOCK.alpha, 40.0 / BLOCK.p)["peak_times"].values
        np.testing.assert_allclose(times[:11] * BLOCK.p, impact_times(BLOCK, 0.5, e), rtol=1e-11)

    def test_peaks_of_the_laws(self):
        """Peaks 1, 2, 5, 10 of the 8th-order integration in physics.md."""
        laws = [tp.DiscreteDamping(e=0.925), tp.Vassiliou(), tp.GianniniMasiani(e=0.925)]
        found = free_decay(BLOCK, laws, [0.925] * 3)["decay_peak"].values[:, [1, 2, 5, 10]]
        expected = [
            [0.41131983, 0.34490885, 0.21770197, 0.11808315],
            [0.43717884, 0.38875676, 0.29051030, 0.19996001],
            [0.34195436, 0.25803813, 0.14066521, 0.07245964],
        ]
        np.testing.assert_allclose(found, expected, atol=6e-9)

    def test_error_is_a_mean_over_peaks(self):
        found = free_decay(BLOCK, [tp.DiscreteDamping(e=0.925)], [0.925])
        ratio = (found["decay_peak"] / found["decay_rigid"]).values[0, 1:]
        assert found["decay_error"].item() == pytest.approx(ratio.mean() - 1.0)

    def test_peaks_that_are_not_there_count_as_the_edge(self):
        """Overdamped, the block comes to rest without another peak outside its zone."""
        nothing = free_decay(BLOCK, [tp.DiscreteDamping(e=0.05)], [0.05])  # (below its zone at once, without a warning)
        assert np.isnan(nothing["decay_error"].item())
        found = free_decay(BLOCK, [tp.MakrisKonstantinidis(e=0.5, delta=0.01)], [0.925])
        assert found.sizes["half_cycle"] == 11
        assert np.isnan(found["decay_peak"].values[0, -1])
        peaks = np.where(np.isnan(found["decay_peak"]), 0.01, found["decay_peak"])[0, 1:]
        assert found["decay_error"].item() == pytest.approx((peaks / impact_decay(0.5, 0.925)[1:]).mean() - 1.0)

    def test_every_delta_of_the_energy_consistent_law(self):
        laws = [tp.EnergyConsistent(e=0.9, delta=delta) for delta in (1e-4, 0.01, 0.2)]
        assert np.abs(free_decay(BLOCK, laws, [0.9] * 3)["decay_error"]).max() < 1e-12

    def test_without_loss(self):
        laws = [law(e=1.0) for law in (tp.DiscreteDamping, tp.EnergyConsistent, tp.GianniniMasiani)]
        laws.append(tp.MakrisKonstantinidis(e=1.0))
        found = free_decay(BLOCK, laws, [1.0] * 4)
        np.testing.assert_allclose(found["decay_peak"], 0.5, rtol=1e-11)


class TestEvidence:
    def test_vassiliou_does_not_know_delta(self, over_delta):
        rate = of_law(over_delta, "vassiliou")["viscous_rate"]
        assert np.all(rate == rate.isel(value=0))
        for law in ("giannini-masiani", "makris-konstantinidis"):
            # c = 2 zeta sqrt(I_O k0), k0 = (1/delta - 1) |k_r|
            own = of_law(over_delta, law)["viscous_rate"] / np.sqrt(1.0 / over_delta["value"] - 1.0)
            np.testing.assert_allclose(own, own.isel(value=[0]).values.repeat(4, axis=1))

    def test_without_loss(self, over_e):
        here = over_e.sel(value=1.0)
        for law in ("discrete", "giannini-masiani", "makris-konstantinidis", "energy-consistent"):
            np.testing.assert_allclose(of_law(here, law)["decay_peak"], 0.5, rtol=1e-10)


class TestClaims:
    def test_numbers_are_those_of_the_results(self, over_delta):
        found = {one.claim: one for one in claims(over_delta)}
        assert len(found) == 12
        at = over_delta.sel(value=0.05)
        median = at["median"]
        gm, discrete = (of_law(median, law, "elastic") for law in ("giannini-masiani", "discrete"))
        alike = found["Giannini–Masiani performs like discrete damping under shaking"]
        assert alike.number == pytest.approx(float(np.exp(np.log(gm / discrete).mean("block"))))
        assert alike.lower <= alike.number <= alike.upper
        decay = found["discrete damping outperforms in free decay"]
        assert decay.number == pytest.approx(np.abs(of_law(at, "discrete", "elastic")["decay_error"]).mean().item())
        (coefficient,) = (claim for name, claim in found.items() if name.startswith("the coefficient"))
        assert coefficient.number == 0.0
        (rigid,) = (claim for name, claim in found.items() if name.endswith("the rigid block"))
        assert rigid.lower > 0.8
        assert all(one.verdict in (HOLDS, FAILS, OPEN) for one in found.values())

    def test_verdicts_follow_the_data(self, over_delta):
        """The same results with one law's replicates put in another's place."""

        def verdict(**changes):
            part = over_delta.copy(deep=True)
            for name, values in changes.items():
                part[name][:, 1] = values
            return {one.claim: one.verdict for one in claims(part)}

        claim = "Giannini–Masiani performs like discrete damping under shaking"
        own, median = over_delta["log_median_sample"].values, over_delta["median"].values
        like = {"log_median_sample": own[:, 0], "median": median[:, 0]}
        assert verdict(**like)[claim] == HOLDS
        assert verdict(log_median_sample=own[:, 0] + 1.0, median=median[:, 0] * np.e)[claim] == FAILS
        wide = own[:, 0] + np.linspace(-0.5, 0.5, own.shape[-1])
        assert verdict(log_median_sample=wide, median=median[:, 0])[claim] == OPEN

    def test_decay_is_judged_case_by_case(self, over_delta):
        claim = "discrete damping outperforms in free decay"

        def verdict(error):
            part = over_delta.copy(deep=True)
            part["decay_error"][:, 0] = np.array(error)[:, None]
            return next(one.verdict for one in claims(part) if one.claim == claim)

        assert [verdict([0.0, 0.0]), verdict([0.0, 9.0]), verdict([9.0, 9.0])] == [HOLDS, OPEN, FAILS]

    def test_medians_beyond_the_levels_are_left_out(self, over_delta):
        part = evidence_of(over_delta)
        broken = over_delta.copy(deep=True)
        broken["median_ratio"][0, 2] = np.inf
        broken["log_median_sample"][0, 2] = np.inf
        assert np.isfinite(part._replace(results=broken).ratio(2, None)).all()

    def test_laws_that_are_missing(self, over_delta):
        found = claims(over_delta.isel(model=[5]))
        assert [claim.claim.split()[0] for claim in found] == ["energy-consistent"]
        assert claims(over_delta.isel(model=[6])) == []
