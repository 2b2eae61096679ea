"""The source paper's claims: free rocking in closed form, convergence under pulses, verdicts that follow the data."""

import math
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from sensitivity_cases import BLOCK, STUDY, of_law, study_of

import toppling as tp
from toppling.benchmarks.claims.claims import FAILS, HOLDS, OPEN, claims, evidence_of
from toppling.benchmarks.claims.evidence import convergence, evidence, pulses
from toppling.benchmarks.claims.figures import figures
from toppling.benchmarks.claims.free_decay import free_decay, impact_decay, impact_times

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
        np.testing.assert_allclose(found["decay_time"][0], impact_times(BLOCK, 0.5, e), rtol=1e-11)
        np.testing.assert_allclose(found["decay_peak"][0], impact_decay(0.5, e), rtol=1e-11)
        assert abs(found["period_error"].item()) < 1e-12

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
        assert np.isnan([nothing[name].item() for name in ("decay_error", "period_error")]).all()
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
    def test_the_rigid_block_against_itself(self, over_delta):
        here = of_law(over_delta, "housner")
        assert not here["pulse_error"].any()
        assert not here["uplift_alone"].any()

    def test_vassiliou_does_not_know_delta(self, over_delta):
        rate = of_law(over_delta, "vassiliou")["viscous_rate"]
        assert np.all(rate == rate.isel(value=0))
        for law in ("giannini-masiani", "makris-konstantinidis"):
            # c = 2 zeta sqrt(I_O k0), k0 = (1/delta - 1) |k_r|
            own = of_law(over_delta, law)["viscous_rate"] / np.sqrt(1.0 / over_delta["value"] - 1.0)
            np.testing.assert_allclose(own, own.isel(value=[0]).values.repeat(4, axis=1))

    def test_convergence_to_the_rigid_block(self, tmp_path):
        """First order (physics.md), farther off with the paper's elastic rest; none of the viscous laws."""
        laws = (tp.EnergyConsistent(), tp.DiscreteDamping(rest="rigid"), tp.DiscreteDamping(), tp.GianniniMasiani())
        study = study_of(tmp_path, STUDY, '[sensitivity]\nparameter = "delta"\nvalues = [1e-5, 1e-4, 1e-3]')
        study = replace(study, blocks=study.blocks[:1], models=laws)
        found = convergence([pulses(study.blocks[0], study.grid)], study.blocks, study.grid, study.sweep)
        order = found["convergence_order"][1][0]
        error = found["pulse_error"][1][0]
        assert order[:2] == pytest.approx(1.0, abs=0.01)
        assert order[2] == pytest.approx(1.0, abs=0.05)
        assert np.all(error[2] > 2.0 * error[0])
        assert order[3] < 0.0

    def test_pulses_of_the_rigid_limit(self, over_delta, tmp_path):
        """The root mean square again, from runs of its own."""
        study = study_of(tmp_path, STUDY, DELTA)
        peaks = pulses(study.blocks[0], study.grid).transpose("model", "level").values / study.blocks[0].alpha
        law = study.grid.laws.index(tp.EnergyConsistent(delta=0.01))
        rigid = study.grid.laws.index(tp.HousnerImpact(geometry="bilinear"))
        calm = (peaks[rigid] >= 0.2) & (peaks[rigid] <= 0.5)
        assert 2 < calm.sum() < calm.size
        expected = math.sqrt(np.mean((peaks[law] - peaks[rigid])[calm] ** 2))
        found = of_law(over_delta, "energy-consistent")["pulse_error"].sel(value=0.01)[0]
        assert found.item() == pytest.approx(expected)

    def test_without_loss(self, over_e):
        here = over_e.sel(value=1.0)
        for law in ("discrete", "giannini-masiani", "makris-konstantinidis", "energy-consistent"):
            np.testing.assert_allclose(of_law(here, law)["decay_peak"], 0.5, rtol=1e-10)
        assert "pulse_error" not in over_e

    def test_figures(self, over_delta, over_e):
        names = ["decay_error", "free_rocking", "convergence"]
        for results, expected in ((over_delta, names), (over_e, names[:2])):
            found = dict(figures(results))
            assert list(found) == expected
            assert all(isinstance(one, Figure) and one.get_figwidth() <= 5.5 for one in found.values())
        assert found["free_rocking"].get_suptitle().startswith(f"{over_e['block'].values[0]}: ")


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
        assert f"{alike.number:.2f} ({alike.lower:.2f}–{alike.upper:.2f}) times" in alike.text
        decay = found["discrete damping outperforms in free decay"]
        assert decay.number == pytest.approx(np.abs(of_law(at, "discrete", "elastic")["decay_error"]).mean().item())
        assert found["the coefficient of Vassiliou et al. does not depend on δ"].number == 0.0
        assert found["energy-consistent damping is the rigid block"].lower > 0.8
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

    def test_medians_beyond_the_levels_are_left_out_and_counted(self, over_delta):
        part = evidence_of(over_delta)
        broken = over_delta.copy(deep=True)
        broken["median_ratio"][0, 2] = np.inf
        broken["log_median_sample"][0, 2] = np.inf
        ratio = part._replace(results=broken).ratio(2, None)
        assert (ratio.known, ratio.pairs) == (1, 2)
        assert np.isfinite(ratio.numbers).all()
        assert "1 of 2 pairs" in ratio.words

    def test_laws_that_are_missing(self, over_delta):
        found = claims(over_delta.isel(model=[5]))
        assert [one.claim for one in found] == ["energy-consistent damping is the rigid block"]
        assert claims(over_delta.isel(model=[6])) == []
