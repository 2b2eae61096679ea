"""Remembered runs: results as if they were run again, without a run, and only of what is the same to the last bit."""

import itertools

import numpy as np
import pytest

import toppling as tp
from toppling.fragility.runs import runners
from toppling.fragility.runs.runners import Remembered

BLOCKS = [tp.Block(0.3, height, name=f"{height}") for height in (1.2, 1.6, 2.0)]
LAWS = [tp.HousnerImpact(), tp.EnergyConsistent()]
LEVELS = [1.0, 3.0, 6.0]
OUTPUTS = ["overturned", "peak_rotation"]


@pytest.fixture(scope="module")
def shaking():
    return tp.motions.CloughPenzien(duration=6.0, dt=0.02).sample(5)


def run(shaking, blocks, client=None, levels=LEVELS, **options):
    return tp.ida(blocks, LAWS, shaking, levels, outputs=OUTPUTS, client=client, **options)


def same(first, other):
    return all(first[name].identical(other[name]) for name in OUTPUTS)


def test_what_was_run_is_not_run_again(shaking):
    memory = Remembered()
    every = run(shaking, BLOCKS, memory)
    assert same(every, run(shaking, BLOCKS))
    ran = memory.ran
    assert ran == every["overturned"].size
    for blocks in (BLOCKS, BLOCKS[1:], [BLOCKS[2], BLOCKS[0]]):
        assert same(run(shaking, blocks, memory), run(shaking, blocks))
    assert memory.ran == ran
    more = [*BLOCKS[1:], tp.Block(0.4, 1.5, name="new")]
    assert same(run(shaking, more, memory), run(shaking, more))
    assert memory.ran == ran + ran // len(BLOCKS)


@pytest.mark.parametrize("options", [{"levels": [1.0, 3.0, 6.5]}, {"skip": False}])
def test_other_factors_and_options_are_run(shaking, options):
    memory = Remembered()
    run(shaking, BLOCKS, memory)
    ran = memory.ran
    assert same(run(shaking, BLOCKS, memory, **options), run(shaking, BLOCKS, **options))
    assert memory.ran == 2 * ran


def test_other_motions_are_run(shaking):
    memory = Remembered()
    run(shaking, BLOCKS, memory)
    other = shaking.copy(data=np.nextafter(shaking.values, np.inf))
    ran = memory.ran
    assert same(run(other, BLOCKS, memory), run(other, BLOCKS))
    assert memory.ran == 2 * ran


def test_measures_of_each_block_are_passed_on(shaking):
    memory = Remembered()
    for _ in range(2):
        results = run(shaking, BLOCKS, memory, im="pga_normalised")
        assert same(results, run(shaking, BLOCKS, im="pga_normalised"))
    assert memory.ran == 0


def test_runs_that_were_left_are_not_remembered(shaking, monkeypatch):
    memory, works = Remembered(), []
    original = Remembered.run

    def kept(self, work, chunks):
        works.append((work, chunks))
        yield from original(self, work, chunks)

    monkeypatch.setattr(Remembered, "run", kept)
    run(shaking, BLOCKS, Remembered())
    work, chunks = works[0]
    halves = [chunk._replace(stop=2) for chunk in chunks if chunk.first == 0]
    assert len([*itertools.islice(original(memory, work, halves), 1)]) == 1
    ran = memory.ran
    assert same(run(shaking, BLOCKS, memory), run(shaking, BLOCKS))
    assert memory.ran == ran + work.runs


def test_too_much_is_forgotten(shaking, monkeypatch):
    memory = Remembered()
    run(shaking, BLOCKS, memory)
    ran = memory.ran
    monkeypatch.setattr(runners, "MOST_REMEMBERED", ran)
    assert same(run(shaking, BLOCKS, memory), run(shaking, BLOCKS))
    assert memory.ran == 2 * ran
