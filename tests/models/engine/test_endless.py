"""A bound on the events of a run: what would take hours is refused within seconds."""

import dataclasses

import numpy as np
import pytest
from stress_cases import answer, compile_engine

import toppling as tp
from toppling.fragility import RandomInputs, Uniform, uncertain_ida
from toppling.fragility.runs.plan import SECONDS_PER_SAMPLE, seconds_per_sample
from toppling.models.engine.tables import MOST_PIECES
from toppling.models.laws import refuse_endless
from toppling.models.runs import EndlessRunError, run_many

SECONDS = 10.0  # of processor time, for one run at the bound
NICHE = tp.Block(
    0.0006, 0.0009, mass=1e-6, wall=tp.Wall(0.0, restitution=1.0, front_gap=4e-12),
    restraint=tp.Restraint.tendon(1e-4, width=0.0006),
)  # fmt: skip
TALL = tp.Block(2.0, 19.5)
MOTIONS = tp.motions.from_array(np.sin(np.arange(6250)) * np.ones((64, 1)), 0.8)
WAYS = {
    "ida": lambda law: tp.ida(TALL, law, MOTIONS, [1.0]),
    "adaptive": lambda law: tp.adaptive_ida(TALL, law, MOTIONS),
    "simulate": lambda law: tp.simulate(TALL, law, MOTIONS[:1]),
    "uncertain": lambda law: uncertain_ida(INPUTS, TALL, law, MOTIONS, [1.0], samples=2),
}
INPUTS = RandomInputs({"alpha_factor": Uniform(0.99, 1.01)})


@pytest.mark.slow
def test_a_block_that_rattles_in_a_niche_without_loss():
    """Walls 4e-12 m away and e = 1: some 1e10 impacts in the record."""
    compile_engine()
    law = tp.EnergyConsistent(e=1.0, delta=1e-4, rest="rigid")
    shakes = 2e4 * np.random.default_rng(1).standard_normal(1500)
    with pytest.raises(EndlessRunError, match=f"more than {MOST_PIECES:,} events"):
        answer_raises(law.oscillator(NICHE), shakes, 0.15)


def answer_raises(oscillator, record, dt):
    """Run in the time that a run at the bound takes; raise what it raises."""

    def run():
        try:
            return run_many([oscillator], np.ones((1, 1)), record, dt)
        except EndlessRunError as error:
            return error

    found = answer(run, seconds=SECONDS)
    if isinstance(found, EndlessRunError):
        raise found


class TestStiffZones:
    @pytest.mark.parametrize("law", [
        tp.GianniniMasiani(e=0.9, delta=1e-9),
        tp.DiscreteDamping(e=0.9, delta=1e-9),
        tp.ViscousDamping(100.0, delta=1e-9),
    ], ids=lambda law: law.label)  # fmt: skip
    def test_the_plan_knows_what_they_cost(self, law):
        """A vibration of frequency w is followed in pieces of 1/(2 w): w is at least q sqrt(n), 1e4 times p here."""
        oscillator = law.oscillator(TALL)
        pieces = 2.0 * 0.99 * TALL.p * np.sqrt(1e9) * 0.01
        assert seconds_per_sample(oscillator, 0.01) > 50.0 * SECONDS_PER_SAMPLE
        assert oscillator.pieces(0.01) > pieces

    def test_usual_laws_cost_what_they_did(self):
        laws = tp.GianniniMasiani(), tp.DiscreteDamping(), tp.EnergyConsistent(), tp.HousnerImpact(geometry="linear")
        for law in laws:
            assert seconds_per_sample(law.oscillator(tp.Block(0.4, 1.8)), 0.01) == SECONDS_PER_SAMPLE

    @pytest.mark.slow
    @pytest.mark.parametrize("way", WAYS)
    @pytest.mark.parametrize("law", [
        tp.GianniniMasiani(e=0.9, delta=1e-9),
        tp.MakrisKonstantinidis(e=0.9, delta=1e-9),
        tp.Vassiliou(delta=1e-9, coefficient=90.0),
    ], ids=lambda law: law.label)  # fmt: skip
    def test_hopeless_ones_are_refused_before_the_runs(self, law, way):
        """The delta of the sentence does, and a third of it does not; 2 T q/sqrt(delta) pieces of 5000 s, undamped."""
        with pytest.raises(ValueError, match=r"too stiff for motions of 50.. s .* delta must be at least") as found:
            WAYS[way](law)
        least = float(str(found.value).rpartition(" ")[2])
        undamped = (2.0 * 5000.0 * TALL.p / 5e6) ** 2
        assert undamped < least < 10.0 * undamped
        with pytest.raises(ValueError, match="too stiff"):
            refuse_endless(TALL, dataclasses.replace(law, delta=least / 3.0), 5000.0)
        refuse_endless(TALL, dataclasses.replace(law, delta=least), 5023.0)


def test_refused(refusal):
    refusal()
