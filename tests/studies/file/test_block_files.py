"""Studies of many blocks: a file of them, what is shown of them, and what they take."""

import json
import logging
import re
import tracemalloc

import numpy as np
import pytest
import xarray as xr
from check_facts import numbers_in
from exchange_cases import read_table
from study_texts import motions

import toppling as tp
from toppling.core.doubts import ImplausibleInput
from toppling.fragility import rank_measures
from toppling.fragility.fitting.fit import CurveOptions, fit_curves
from toppling.fragility.numerics import slabs
from toppling.fragility.runs.factors import BlockFactors, dense, either_side
from toppling.fragility.runs.oscillators import OscillatorGrid
from toppling.fragility.runs.plan import Chunk, Work
from toppling.fragility.runs.provenance import factors_of, factors_under
from toppling.fragility.runs.request import labelled_sequence
from toppling.fragility.runs.scaling import scaling
from toppling.fragility.validity.notes import block_facts, block_notes
from toppling.models.laws import oscillator_of
from toppling.motions.arrays import records
from toppling.studies import StudyError, show
from toppling.studies.command.cli import main
from toppling.studies.command.forecast import fits
from toppling.studies.facts.answer_curves import answer
from toppling.studies.facts.say import say
from toppling.studies.file.blocks import read_blocks
from toppling.studies.store.progress import Display
from toppling.studies.store.watch import Watch
from toppling.studies.tables.registry import tables
from toppling.studies.text.block_order import MOST_BLOCKS, RATE, chosen_of, places, shown

STUDY = """title = "Many"
outputs = ["overturned"]
{blocks}

[[models]]
law = "discrete"

[[models]]
law = "housner"
geometry = "linear"

{motions}
[ida]
im = "pga"
levels = {{ values = [1.0, 2.0, 4.0], unit = "m/s2" }}
"""
FILE = 'blocks_file = "blocks.csv"'


def written(tmp_path, table, blocks=FILE, name="study.toml"):
    (tmp_path / "blocks.csv").write_text(table, encoding="utf-8")
    (tmp_path / name).write_text(STUDY.format(blocks=blocks, motions=motions(3)), encoding="utf-8")
    return tmp_path / name


def many(n):
    width, height = np.random.default_rng(2).uniform([0.2, 1.0], [0.6, 2.5], (n, 2)).T
    lines = [f"b{i},{w:.4f},{h:.4f}" for i, (w, h) in enumerate(zip(width, height, strict=True))]
    return "\n".join(["name,width_m,height_m", *lines]) + "\n"


class TestReading:
    def test_every_way_of_saying_what_a_block_is(self, tmp_path):
        path = tmp_path / "blocks.csv"
        path.write_text(
            "name;catalogue;width_m;height_m;cm_height_m;inertia_factor;alpha_rad;R_m\n"
            ";bookcase-5-shelf;;;;;;\n"
            "# a comment\n"
            "cabinet;;0,5;1,8;;;;\n"
            "top-heavy;;0,5;1,8;1,1;1,3;;\n"
            "slender;;;;;;0,2;1,5\n",
            encoding="utf-8",
        )
        shelf, cabinet, heavy, slender = read_blocks(path)
        assert (shelf.label, shelf.width) == ("bookcase-5-shelf", tp.catalogue["bookcase-5-shelf"].width)
        assert cabinet == tp.Block(0.5, 1.8, name="cabinet")
        assert heavy == tp.Block(0.5, 1.8, 1.1, 1.3, "top-heavy")
        assert slender == tp.Block.from_slenderness(0.2, 1.5, name="slender")

    def test_comments_end_with_their_lines_whatever_ends_these(self, tmp_path):
        path = tmp_path / "blocks.csv"
        for end in ("\n", "\r\n", "\r"):
            path.write_bytes(end.join(["# of", "name,width_m,height_m", "#old,1,2", "a,1,2", ""]).encode())
            with pytest.warns(ImplausibleInput, match=r"blocks.csv, line 3: left out, since # begins a comment"):
                assert [block.label for block in read_blocks(path)] == ["a"]

    def test_a_catalogue_item_with_another_centre_of_mass(self, tmp_path):
        path = tmp_path / "blocks.csv"
        path.write_text("catalogue,cm_height_m,inertia_factor\nbookcase-5-shelf,1.2,1.3\n")
        (own,) = read_blocks(path)
        (stated,) = tp.Study.from_toml(
            written(
                tmp_path,
                many(1),
                '[[blocks]]\ncatalogue = "bookcase-5-shelf"\ncm_height_m = 1.2\ninertia_factor = 1.3\n',
            )
        ).blocks
        assert own == stated
        assert own.h == 1.2

    def test_studies_that_vary_blocks_hold_fewer(self, tmp_path):
        path = written(tmp_path, many(2001))
        inputs = "delta = { distribution = 'uniform', lower = 0.04, upper = 0.06 }"
        varied = f"[uncertainty]\nsamples = 8\ninputs = {{ {inputs} }}\n"
        path.write_text(path.read_text().replace('outputs = ["overturned"]\n', "") + varied)
        with pytest.raises(StudyError, match="blocks_file: a study of this kind holds at most 2,000 blocks, got 2,001"):
            tp.Study.from_toml(path)


class TestStudies:
    def test_same_results_as_blocks_in_the_study_file(self, tmp_path):
        table = many(5)
        inside = "\n".join(
            f'[[blocks]]\nname = "{name}"\nwidth_m = {width}\nheight_m = {height}\n'
            for name, width, height in (line.split(",") for line in table.splitlines()[1:])
        )
        beside = tp.Study.from_toml(written(tmp_path, table)).run()
        within = tp.Study.from_toml(written(tmp_path, table, inside)).run()
        xr.testing.assert_equal(beside, within)

    @pytest.mark.slow
    def test_another_table_is_another_study(self, tmp_path, capsys):
        path = written(tmp_path, many(3))
        out = str(tmp_path / "out")
        assert main(["run", str(path), "--out", out]) == 0
        again = written(tmp_path, many(3).replace("b2", "c2"))
        capsys.readouterr()
        assert main(["run", str(again), "--out", out]) == 2
        assert "records or tables" in capsys.readouterr().err


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    path = written(tmp_path_factory.mktemp("many"), many(120))
    path.write_text(path.read_text().replace("seed = 1", "seed = 5"))  # (under which half of them stand)
    return tp.Study.from_toml(path).run()


class TestSlabs:
    """Blocks that are worked on apart: nothing is other than of all together."""

    RISK = """
[measures]
also = ["Sa(0.5)"]

[hazard]
levels = [0.5, 1.0, 2.0, 4.0, 8.0]
rates = [0.2, 0.1, 0.03, 0.005, 0.0004]
unit = "m/s2"
"""

    @pytest.mark.slow
    def test_same_results(self, tmp_path, monkeypatch):
        path = written(tmp_path, many(11))
        text = path.read_text().replace('outputs = ["overturned"]', 'outputs = ["overturned", "peak_rotation"]')
        path.write_text(text + self.RISK)
        whole = tp.Study.from_toml(path).run()
        parts = []
        monkeypatch.setattr(slabs, "BLOCKS", 4)
        real = slabs._joined
        monkeypatch.setattr(slabs, "_joined", lambda found, dim: parts.append(len(found)) or real(found, dim))
        cut = tp.Study.from_toml(path).run()
        assert max(parts) >= 3
        xr.testing.assert_identical(cut, whole)

    def test_what_measures_say_of_a_block_does_not_depend_on_others(self, results):
        shakes = tp.motions.CloughPenzien(duration=6.0, dt=0.02).sample(5, seed=3)
        blocks = [tp.Block(0.4 + 0.02 * i, 1.5, name=f"b{i}") for i in range(5)]
        outputs = ["overturned", "peak_rotation"]
        options = {"levels": [1.0, 2.0, 4.0, 8.0], "im": "pga", "outputs": outputs}
        many, one = (
            tp.ida(some, tp.HousnerImpact(geometry="linear"), shakes, **options) for some in (blocks, blocks[2])
        )
        found = rank_measures(many, shakes, ["Sa(0.5)"], replicates=20).isel(block=[2])
        alone = rank_measures(one, shakes, ["Sa(0.5)"], replicates=20)
        for name in alone.data_vars:
            np.testing.assert_array_equal(found[name].values, alone[name].values, err_msg=str(name))


class TestForecast:
    def test_curves_are_counted_once_for_each_floor(self, tmp_path):
        path = written(tmp_path, many(30))
        building = """[building]
kind = "flexural-shear"
storeys = 3
period_s = 0.5
"""
        assert tp.Study.from_toml(path).curves == 60
        path.write_text(path.read_text() + building)
        plan = tp.Study.from_toml(path)
        assert plan.curves == 60 * len(plan.design.floors) == 60 * len({*plan.design.floors})

    def test_what_many_curves_take(self, tmp_path):
        few, many_ = (tp.Study.from_toml(written(tmp_path, many(n))) for n in (10, 510))
        assert many_.room.memory - few.room.memory >= 1000 * 3e3
        assert many_.room.left - few.room.left >= 1000 * 1e3
        assert fits(few) == "fits"
        assert fits(many_).startswith("fits of 1,020")
        path = written(tmp_path, many(10))
        path.write_text(path.read_text() + "[fit]\nreplicates = 100_000\n")
        one = tp.Study.from_toml(path)
        assert one.seconds_of_fits(1) > 50.0 * few.seconds_of_fits(1)
        assert fits(one).startswith("fits of 20")


class TestManyBlocks:
    def test_those_with_the_lowest_medians_are_shown(self, results):
        found = shown(results)
        assert found.sizes["block"] == MOST_BLOCKS
        assert found.attrs["shown_of"] == 120
        # (Housner's law is the one that answers are of)
        median = results["half_level"].isel(model=1)
        known = np.sort(median.values[np.isfinite(median.values)])
        np.testing.assert_array_equal(found["half_level"].isel(model=1).values[: known.size], known[:MOST_BLOCKS])
        few = results.isel(block=slice(0, MOST_BLOCKS))
        assert shown(few) is few

    def test_those_that_always_fell_come_first(self, results):
        """A block that fell in every run has no level of half: no reason to leave it out."""
        law, status = 1, results["status"].values.copy()
        median, probability = results["half_level"].values.copy(), results["probability"].values.copy()
        median[:, law], status[:, law], probability[:, law] = (np.arange(120) + 1.0) / 30.0, "ok", 0.5
        median[[110, 115], law], status[[110, 115], law] = np.nan, "all overturned"
        median[:10, law], status[:10, law] = np.nan, "no overturning"
        median[3, law], status[3, law], probability[3, law] = np.nan, "not increasing", 0.6
        probability[:3, law] = probability[4:10, law] = 0.0
        changed = results.assign(
            half_level=(results["half_level"].dims, median, results["half_level"].attrs),
            status=(results["status"].dims, status),
            probability=(results["probability"].dims, probability),
            median=results["median"] * np.nan,  # (curves that cross are told elsewhere)
        )
        place = places(changed).values
        assert np.argsort(place)[:4].tolist() == [110, 115, 10, 11]
        assert np.argsort(place)[-10:].tolist() == [3, 0, 1, 2, 4, 5, 6, 7, 8, 9]
        assert shown(changed)["block"].values[:3].tolist() == ["b110", "b115", "b10"]
        said = {fact.what: fact for fact in answer(changed)}
        always, rank = said["curve.always"], said["curve.rank"]
        assert (always.value, always.names, always.more["cases"]) == (2, ("“b110”",), 120)
        assert (rank.value, rank.more["name"]) == (118, "“b10”")
        assert rank.names or rank.more["all"]  # (whose intervals overlap with its own)
        assert "curve.spread" not in {fact.what for fact in answer(changed.isel(block=[110, 115, *range(40, 50)]))}
        status[10:110, law] = status[111:115, law] = status[116:, law] = "no overturning"
        (none,) = answer(
            changed.assign(half_level=changed["half_level"] * np.nan, status=(results["status"].dims, status))
        )
        assert dict(zip(none.names, none.more["counts"], strict=True)) == {
            "all overturned": 2,
            "no overturning": 117,
            "not increasing": 1,
        }

    def test_names_are_no_mathematics_in_figures(self, results):
        few = results.isel(block=[0, 1]).assign_coords(block=[r"$\frac{a}$", "$x$"])
        figure = dict(show.figures(few))["fragility"]
        figure.canvas.draw()
        names = [text.get_text() for text in figure.axes[0].texts]
        assert names[:2] == [r"\$\frac{a}\$", r"\$x\$"]

    def test_other_kinds_are_cut_too(self, results):
        other = results.assign_attrs(kind="uncertainty")
        assert shown(other, most=12).sizes["block"] == 12
        assert numbers_in(chosen_of(shown(other, most=12))) == [12, 120]
        performance = results.assign_attrs(kind="performance")
        assert shown(performance) is performance

    def test_rates_have_an_order_of_their_own(self, results):
        rate = xr.zeros_like(results["median"]) + np.arange(120.0)[:, None]
        found = shown(results.assign(rate=rate), RATE)
        assert found["block"].values[0] == "b119"
        assert numbers_in(chosen_of(found)) == [MOST_BLOCKS, 120]
        assert chosen_of(found).endswith("highest rates")
        # (those that always fell have none: they are the first by medians)
        status = results["status"].copy()
        status[7] = "all overturned"
        place = places(results.assign(rate=rate.where(rate != 7.0), status=status), RATE).values
        assert place[7] == np.isfinite(np.delete(rate.isel(model=1).values, 7)).sum() > 50

    @pytest.mark.slow
    def test_titles_say_that_they_are_not_all(self, results):
        (table,) = tables(results)
        assert f"{MOST_BLOCKS} of 120" in table.note
        assert len(table.rows) == 3 * MOST_BLOCKS
        figure = dict(show.figures(results))["fragility"]
        assert "12 of 120" in figure.get_label()

    def test_answers_are_of_all(self, results):
        halves = results["half_level"].isel(model=1)
        known = np.sort(halves.values[~np.isnan(halves.values)])
        few, half = np.quantile(np.where(np.isinf(known), 1e9, known), [0.1, 0.5])
        assert few < 4.0 < half  # (the highest level: what lies above it is not reached)
        first, *others = answer(results)
        assert first.names == (f"“{results['block'].values[int(np.nanargmin(halves))]}”",)
        (spread,) = (fact for fact in others if fact.what == "curve.spread")
        assert (spread.value, spread.lower, spread.upper) == (np.inf, pytest.approx(few / 9.80665), np.inf)
        assert (spread.more["pieces"], spread.more["beyond"]) == (known.size, np.isinf(known).sum())

    @pytest.mark.parametrize(
        ("greatest", "ends", "said"),
        [
            (
                3.9,
                (0.042752, 0.200502, 0.358252),
                "below 0.043 g for a tenth of 120 pieces, below 0.20 g for half of them and",
            ),
            (
                6.0,
                (0.065772, 0.308464, np.inf),
                "below 0.066 g for a tenth of 120 pieces and below 0.31 g for half of them.",
            ),
            (60.0, (np.inf,) * 3, "Half of the motions overturn fewer than a tenth of 120 pieces at any level. No"),
        ],
    )
    def test_spread_of_medians_within_the_levels(self, results, greatest, ends, said):
        """Medians k greatest/120: the quantile q lies at (1 + 119 q) greatest/120."""
        halves = results["half_level"].copy()
        halves[:, 1] = np.arange(1, 121) * greatest / 120.0
        halves = halves.where(halves <= float(results["level"].max()), np.inf)
        (spread,) = (fact for fact in answer(results.assign(half_level=halves)) if fact.what == "curve.spread")
        assert (spread.lower, spread.value, spread.upper) == pytest.approx(ends, rel=1e-4)
        assert said in say(spread, "page")

    def test_chances_of_many_are_counted(self, results):
        chance = xr.zeros_like(results["half_level"]) + np.where(np.arange(120) < 5, 0.6, 0.02)[:, None]
        found = results.assign(rate=chance / 50.0, risk_probability=chance.where(chance["block"] != "b7"))
        for end in ("lower", "upper"):
            found[f"rate_{end}"], found[f"risk_probability_{end}"] = chance / 50.0, chance
        (counts,) = (fact for fact in answer(found.assign_attrs(years=50.0)) if fact.what == "rate.counts")
        assert (counts.value, counts.more["counts"]) == (119, [(0.5, 5), (0.1, 5), (0.01, 119)])

    def test_few_sentences_of_many_blocks(self):
        squat = [tp.Block(1.0, 1.0 + 0.01 * i, name=f"s{i}") for i in range(8)]
        (fact,) = block_facts([*squat, tp.Block(1.0, 1.15, name="more")])
        assert (fact.what, fact.lower, fact.upper) == ("block.squat", 1.0, pytest.approx(1.15))
        assert fact.names == (*(f"s{i}" for i in range(8)), "more")
        huge = [tp.Block(10.0, 40.0, name=f"h{i}") for i in range(9)]
        (said,) = block_notes(huge)
        assert numbers_in(said)[:8] == [9, 9, 20, 10, 40, 1, 4, 10]
        assert "and 6 more" in said
        (tiny,) = block_notes([tp.Block(4e-4, 1.8e-3, name="mm"), tp.Block(0.3, 1.0)])
        assert numbers_in(tiny) == [1, 2, 0.01, 0.0004, 0.0018]

    def test_one_pass_tells_labels_apart(self):
        blocks = [tp.Block(0.5, 1.5, name=f"b{i}") for i in range(20_000)]
        assert len(labelled_sequence("blocks", blocks, tp.Block)) == 20_000
        with pytest.raises(ValueError, match="blocks must have unique labels, got 'b7' more than once"):
            labelled_sequence("blocks", [*blocks, blocks[7]], tp.Block)


class TestOscillatorsMadeWhenWanted:
    LAWS = (tp.DiscreteDamping(), tp.HousnerImpact(), tp.Vassiliou())

    def test_every_slice_is_that_of_the_list(self):
        blocks = [tp.Block(0.3 + 0.01 * i, 1.5) for i in range(5)]
        made = OscillatorGrid(blocks, lambda block: [oscillator_of(block, law) for law in self.LAWS], 3)
        every = [oscillator_of(block, law) for block in blocks for law in self.LAWS]
        assert len(made) == 15
        assert list(made) == every
        assert made[7] == every[7]
        assert made[-1] == every[-1]
        for start in range(16):
            for stop in range(17):
                assert made[start:stop] == tuple(every[start:stop])
                assert made[start:stop:-2] == tuple(every[start:stop:-2])
        assert made[::-1] == tuple(every[::-1])
        assert made[-4:-1] == tuple(every[-4:-1])
        assert made[np.int64(3)] == every[3]
        with pytest.raises(IndexError):
            made[15]

    @pytest.mark.slow
    def test_they_take_no_memory(self):
        blocks = [tp.Block(0.3, 1.5, name=f"b{i}") for i in range(2000)]
        made = OscillatorGrid(blocks, lambda block: [oscillator_of(block, law) for law in self.LAWS], 3)
        peaks = []
        for _ in range(4):
            tracemalloc.start()
            assert sum(1 for _ in made) == 6000
            peaks.append(tracemalloc.get_traced_memory()[1])
            tracemalloc.stop()
        # Python keeps some thousand tuples for later, and tables of its own grow once: the least is what a pass needs.
        assert min(peaks) < 100_000


class TestFactorsOfBlocks:
    """Factors that differ from block to block are as many as runs: they are made for a chunk at a time."""

    LEVELS = np.array([0.5, 1.0, 2.0])
    BLOCKS = tuple(tp.Block(0.3 + 0.01 * i, 1.5, name=f"b{i}") for i in range(5))

    def test_parts_are_those_of_all(self):
        shakes = tp.motions.CloughPenzien(duration=5.0, dt=0.02).sample(4)
        for im in ("pga_normalised", "pgv_normalised"):
            found = scaling(self.LEVELS, records(shakes), im, self.BLOCKS)
            factors = found.factors
            assert isinstance(factors, BlockFactors)
            assert factors.shape == (5, 3, 4)
            whole = self.LEVELS[:, None] / found.measured[:, None, :]
            np.testing.assert_array_equal(dense(factors), whole)
            np.testing.assert_array_equal(factors.part(slice(1, 3), slice(2, 4)), whole[1:3, :, 2:4])
            chosen = np.array([True, False, False, True])
            np.testing.assert_array_equal(factors.part(motions=chosen), whole[..., chosen])
            np.testing.assert_array_equal(np.concatenate(list(factors.parts())), whole)
            for one in (factors, whole):
                both = dense(either_side(one, 1e-6))
                np.testing.assert_array_equal(both, np.concatenate([whole * (1 + 1e-6), whole * (1 - 1e-6)], axis=1))
            runs = tp.ida(self.BLOCKS, tp.HousnerImpact(geometry="linear"), shakes, self.LEVELS, im)
            np.testing.assert_array_equal(dense(factors_under(runs, chosen)), factors_of(runs)[:, :, chosen])

    def test_a_chunk_has_its_own(self):
        shakes = records(tp.motions.CloughPenzien(duration=5.0, dt=0.02).sample(4))
        factors = scaling(self.LEVELS, shakes, "pga_normalised", self.BLOCKS).factors
        whole = np.repeat(dense(factors), 2, axis=0)  # under two laws
        law = tp.HousnerImpact(geometry="linear")
        oscillators = [oscillator_of(block, law) for block in self.BLOCKS for _ in range(2)]
        for work in (Work(oscillators, tuple(shakes), one) for one in (factors, dense(factors))):
            for chunk in (Chunk(0, 10, 0, 4), Chunk(3, 4, 1, 2), Chunk(1, 7, 0, 3)):
                own = whole[chunk.row : chunk.row_stop, :, chunk.first : chunk.stop]
                np.testing.assert_array_equal(work.factors_of(chunk), own)

    def test_they_take_no_memory(self):
        shakes = records(tp.motions.CloughPenzien(duration=2.0, dt=0.02).sample(100))
        blocks = [tp.Block(0.3 + 1e-5 * i, 1.5, name=f"b{i}") for i in range(1000)]
        tracemalloc.start()
        found = scaling(np.linspace(0.5, 3.0, 40), shakes, "pga_normalised", blocks)
        held, _ = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert found.factors.shape == (1000, 40, 100)
        assert held < 2.5 * 8 * 1000 * 100  # (each block's measures, and no levels of them)


class TestProgressOfFits:
    def test_fits_count_curves(self, tmp_path):
        told = []
        flags = xr.Dataset(
            {"overturnings": (("block", "level"), [[0, 2, 5], [1, 4, 6]]), "runs": (("block", "level"), [[8] * 3] * 2)},
            coords={"level": [1.0, 2.0, 4.0]},
        )
        fit_curves(flags, CurveOptions(), progress=lambda done, total: told.append((done, total)))
        assert told == [(1, 2), (2, 2)]

    def test_they_are_shown_where_they_take_long(self, monkeypatch):
        shown = []
        display = Display(lambda *args: shown.append(args), "runs")
        moments = iter([0.0, 1.0, 3.0, 4.0, 100.0, 100.0, 100.0, 200.0])
        monkeypatch.setattr("toppling.studies.store.progress.time.monotonic", lambda: next(moments))
        for done in (1, 2, 3, 4):
            display.telling("curves", done, 4)
        assert shown == [("curves", 3, 4, ""), ("curves", 4, 4, "")]
        display.telling("rates", 1, 4)  # another stage
        display.watching(Watch(8, logging.getLogger("nowhere")))
        display.telling("rates", 4, 4)  # of the next study
        assert len(shown) == 2

    def test_runs_of_which_nothing_is_told_are_counted(self):
        """Slips are told as a stage of their own, before or after the runs of rocking; the log counts all."""
        shown = []
        display = Display(lambda *args: shown.append(args[:3]), "runs", aside=6)
        watch = Watch(14, logging.getLogger("nowhere"))
        display.watching(watch)
        for done, step in (
            (0, lambda: display.telling("slips", 0, 2)),
            (3, lambda: display.telling("slips", 1, 2)),
            (11, lambda: display.update(8, 8)),
            (14, lambda: display.telling("slips", 2, 2)),
        ):
            watch.runs = done
            step()
        display.finished()
        assert shown == [("runs", 0, 14), ("runs", 3, 14), ("runs", 11, 14), ("runs", 14, 14)]

    def test_how_many_there_will_be_is_told_by_those_that_there_were(self):
        shown = []
        display = Display(lambda *args: shown.append(args), "runs", aside=100)
        watch = Watch(1000, logging.getLogger("nowhere"), most=True)
        display.watching(watch)
        watch.runs = watch.kept = 50
        display.update(50, 60)
        watch.runs = 70
        display.telling("slips", 2, 10)
        display.telling("slips", 9, 10)
        display.finished()
        display.finished()
        assert [one[1:3] for one in shown] == [(50, 160), (70, 150), (70, 73), (70, 70)]
        assert shown[0][3] == "kept from before"  # (and no time that nobody knows)
        assert shown[1][3].endswith(" left")
        assert " left" not in shown[3][3]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A finished study of 15 blocks, which some always fall and some never, with a hazard."""
    folder = tmp_path_factory.mktemp("commands")
    lines = [f"thin{i},0.04,2.{i:02}" for i in range(2)] + [f"stout{i},3.{i:02},4" for i in range(13)]
    path = written(folder, "name,width_m,height_m\n" + "\n".join([*lines, *many(10).splitlines()[1:]]) + "\n")
    path.write_text(path.read_text() + TestSlabs.RISK.replace('[measures]\nalso = ["Sa(0.5)"]\n', ""))
    assert main(["run", str(path), "--out", str(folder / "out")]) == 0
    return folder


class TestCommands:
    @pytest.mark.slow
    def test_rates_stand_beside_the_curves(self, folder, capsys):
        assert main(["export", str(folder / "out"), "--format", "csv"]) == 0
        printed = capsys.readouterr().out
        assert "(all overturned): thin0" in printed  # (four of them: a line each)
        assert printed.count("(no overturning)") == 1  # (13 and more under two laws: one line)
        assert re.search(r"of 3\d: stout0.*\d\d", printed)
        separated = re.search(r"(\d+) of 50 curves are of separated data", printed)
        with xr.open_dataset(folder / "out" / "results.nc") as stored:
            found = stored.load()
        status = found["status"].values
        assert int(separated[1]) == (status == "separated").sum() > 0
        back = read_table(folder / "out" / "export" / "curves.csv")
        for name in ("rate", "rate_upper", "risk_probability", "risk_probability_lower"):
            own = found[name].transpose("block", "model").sel(block=back["block"], model=back["model"])
            np.testing.assert_array_equal(back[name].values, own.values)

    def test_guesses_are_said_to_be_guesses(self, folder, capsys):
        assert main(["export", str(folder / "out"), "--format", "pelicun"]) == 0
        entries = json.loads((folder / "out" / "export" / "fragility.json").read_text())
        with xr.open_dataset(folder / "out" / "results.nc") as stored:
            separated = int((stored["status"] == "separated").sum())
        assert sum("is a guess" in str(entry.get("Comments")) for entry in entries.values()) == separated

    def test_a_dry_run_says_whose_folder_it_is(self, folder, capsys):
        out = ["--out", str(folder / "out"), "--dry-run"]
        assert main(["run", str(folder / "study.toml"), *out]) == 0
        assert "finished" in capsys.readouterr().out
        other = folder / "other.toml"
        other.write_text((folder / "study.toml").read_text().replace("number = 3", "number = 4"))
        assert main(["run", str(other), *out]) == 0
        assert re.search(r"motions\.number was 3,\sis\s4", capsys.readouterr().out)


def test_refused(refusal):
    refusal()
