"""The benchmark: its truth, the engine against that truth, the parts on a tiny configuration, the page and command."""

import json
import math
import re
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest
import scipy.signal

from toppling.benchmarks import figures, flags, page, precision, scale, scenes, speed, tables
from toppling.benchmarks.__main__ import PARTS, main, parts_of
from toppling.benchmarks.kernels.rivals import EXACT, REST_SPEED
from toppling.benchmarks.measure import answers, errors, machine, seconds, true_record, truth_data, truth_of
from toppling.benchmarks.problems import CASES, DT, HARD, LAWS, TRUTH_BLOCKS, TRUTH_FACTORS, problem, record
from toppling.benchmarks.rivals.fixed_steps import located_runge_kutta, newmark, runge_kutta
from toppling.benchmarks.sliding import SHAKING, newmark as one_way, sliding_cost
from toppling.benchmarks.whole import bound, making, speed_up, spent
from toppling.core.units import STANDARD_GRAVITY
from toppling.motions.simulated import filters

FEW = (LAWS[0], LAWS[7])
ROUNDING = 1e-12


@dataclass(frozen=True)
class Missing:
    """A rival whose package is not there."""

    name: str = "absent 1e-6"

    def available(self):
        return "absent: No module named 'absent'"


class TestTruth:
    @staticmethod
    def of_scipy(numerator, denominator, dt):
        b, a, _ = scipy.signal.cont2discrete((np.array(numerator), np.array(denominator)), dt, method="foh")
        return np.ravel(b), np.ravel(a)

    def test_is_that_of_these_problems(self, monkeypatch):
        data = truth_data()
        assert list(data["law"].values) == [law.label for law in LAWS]
        assert list(data["block"].values) == list(TRUTH_BLOCKS)
        assert list(data["factor"].values) == list(TRUTH_FACTORS)
        # (scipy gave the coefficients of its filters, which are as far from exact ones as ours: 1e-16 to 5e-16)
        np.testing.assert_allclose(record(), data["record"].values, rtol=0.0, atol=2e-12 * STANDARD_GRAVITY)
        monkeypatch.setattr(filters, "discrete", self.of_scipy)
        np.testing.assert_allclose(record(), data["record"].values, rtol=0.0, atol=1e-12 * STANDARD_GRAVITY)
        np.testing.assert_allclose(np.diff(data["time"].values), DT)

    def test_peaks_are_the_forty_digits(self):
        data = truth_data()
        for text, number in zip(data["peak"].values.ravel(), data["peak_rotation"].values.ravel(), strict=True):
            assert len(text.partition("e")[0].replace(".", "").lstrip("-")) == 40
            assert float(text) == number

    def test_is_consistent(self):
        data = truth_data()
        fallen = data["overturned"].values.astype(bool)
        np.testing.assert_array_equal(data["peak_rotation"].values == math.pi / 2.0, fallen)
        assert 0.05 < fallen.mean() < 0.5
        highest = np.abs(data["rotation"].values).max(axis=-1)
        assert np.all(highest <= data["peak_rotation"].values * (1.0 + 1e-14))


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.label)
def test_the_engine_is_right(law):
    """All flags, and peaks and rotations as near as rounding and the motion's own sensitivity let them be.

    (One run of Housner's linear geometry is at its threshold but for rounding; its true peak of 3e-49 rad is 0 here.)
    """
    truth = truth_of(law)
    found = answers(law, None, true_record())
    for b in range(len(TRUTH_BLOCKS)):
        np.testing.assert_array_equal(found[b].overturned, truth.overturned[b])
        assert np.all(np.abs(found[b].peak - truth.peak[b]) <= np.maximum(ROUNDING, 100.0 * truth.twin[b]))
        apart = np.abs(found[b].rotation - truth.rotation[b]).max(axis=-1)
        assert np.all(apart <= np.maximum(ROUNDING, 100.0 * truth.rotation_twin[b]))


def test_errors_see_what_is_wrong():
    law = LAWS[2]
    found = answers(law, None, true_record())
    right = errors(law, found)
    stands = ~truth_of(law).overturned
    assert right["wrong_flags"] == 0
    assert right["flags"] == 16
    b, j = np.argwhere(stands)[-1]
    found[b].rotation[j, 7] += 0.01
    found[b].overturned[j] = True
    wrong = errors(law, found)
    alpha = list(TRUTH_BLOCKS.values())[b].alpha
    assert wrong["wrong_flags"] == 1
    assert wrong["trajectory_max"] == pytest.approx(0.01 / alpha, rel=1e-6)
    assert wrong["peak_max"] == right["peak_max"]
    found[b].rotation[j, 7] = np.nan
    assert errors(law, found)["trajectory_max"] is None


@pytest.mark.parametrize("law", [LAWS[2], LAWS[9]], ids=lambda law: law.label)
def test_runge_kutta_in_vectors(law):
    """Its runs are those of the textbook's step, one run at a time, with the sine and cosine of libm."""
    _, kind, q2, alpha, edge, zone, c, e, gain, rigid = problem(HARD, law)
    shaking, factors = record()[:1200], np.linspace(0.05, 0.3, 11)
    found = runge_kutta(1).run(problem(HARD, law), shaking, DT, factors, 1)

    def acceleration(theta, omega, u):
        if kind == EXACT:
            x = math.copysign(alpha, theta) - theta
            return -q2 * (math.sin(x) + u / STANDARD_GRAVITY * math.cos(x))
        if abs(theta) <= edge:
            return -zone * theta - c * omega - gain * u
        return q2 * (theta - math.copysign(alpha, theta)) - c * omega - gain * u

    for factor, rotation in zip(factors, found.rotation, strict=True):
        theta = omega = 0.0
        for i, (u, after) in enumerate(pairwise(factor * shaking)):
            before = theta
            if rigid and theta == omega == 0.0:
                if abs(after) <= STANDARD_GRAVITY * math.tan(alpha):
                    continue
                theta = -math.copysign(1e-300, after)
            half = 0.5 * (u + after)
            a1 = acceleration(theta, omega, u)
            a2 = acceleration(theta + 0.5 * DT * omega, v2 := omega + 0.5 * DT * a1, half)
            a3 = acceleration(theta + 0.5 * DT * v2, v3 := omega + 0.5 * DT * a2, half)
            a4 = acceleration(theta + DT * v3, v4 := omega + DT * a3, after)
            theta += DT / 6.0 * (omega + 2.0 * v2 + 2.0 * v3 + v4)
            omega += DT / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
            if rigid and before * theta < 0.0:
                omega *= e
                if abs(omega) < REST_SPEED:
                    theta = omega = 0.0
            if abs(theta) >= math.pi / 2.0:
                break
            assert rotation[i + 1] == pytest.approx(theta, abs=1e-9)


def test_times_are_medians_of_each_task():
    calls = []
    ours, theirs = seconds([lambda: calls.append(0), lambda: sum(range(300_000))], 3)
    assert 0.0 < ours < theirs < 1.0


def test_the_engine_costs_less_than_five_steps_a_sample():
    """Plain RK4 with dt/5 costs some ten times as much: a margin that noise does not eat."""
    from functools import partial

    from toppling.benchmarks.measure import oscillators
    from toppling.benchmarks.problems import problem
    from toppling.models.runs import run_many

    factors, law = np.linspace(0.05, 0.45, 64), LAWS[2]
    engine = partial(run_many, oscillators(law, [HARD]), factors[None, :], record(), DT, skip=False)
    rival = partial(runge_kutta(5).run, problem(HARD, law), record(), DT, factors, 0)
    ours, theirs = seconds([engine, rival], 3)
    assert ours < theirs


@pytest.fixture(scope="module")
def results():
    """Every part on a tiny configuration."""
    cases = {name: (blocks[:2], factors[-8:]) for name, (blocks, factors) in CASES.items()}
    rivals = (runge_kutta(1), located_runge_kutta(5), Missing())
    blocks = CASES["B"][0][:2]
    return {
        "command": "python -m toppling.benchmarks",
        "machine": machine(),
        "speed": speed.speed((*FEW, LAWS[9]), cases, repeats=1),
        "scenes": scenes.scenes(case=(blocks, CASES["B"][1][-8:]), repeats=1),
        "sliding": {"cost": sliding_cost(8, repeats=1), "newmark": one_way(2, (1, 4))},
        "scale": scale.scale(sizes=(1_000,)),
        "motions": making(repeats=1),
        "start": [
            {"what": "toppling --help", "cpu": 0.1, "target": 0.3},
            {"what": "imports", "cpu": 0.7, "target": None},
            {"what": "simulate", "cpu": 1.0, "target": 0.85},
        ],
        "studies": {
            "first": 48.0,
            "again": 6.0,
            "compiling": 42.0,
            "report": 5.0,
            "large_cpu": 17.0,
            "libraries": 1.5,
            "report_libraries": 1.0,
            "large_runs": 720_000,
            **speed_up(20.0, 11.0),
        },
        "precision": precision.precision(FEW, rivals, timed=np.linspace(0.1, 0.4, 4)),
        "flags": flags.flags(FEW, (runge_kutta(1), newmark(1)), blocks, number=3, levels=12),
    }


class TestParts:
    @pytest.mark.slow
    def test_speed(self, results):
        rows = results["speed"]
        assert [(row["law"], row["case"]) for row in rows] == [(a.label, c) for a in (*FEW, LAWS[9]) for c in "KB"]
        assert all(row["share"] == pytest.approx(row["engine"] / row["yardstick"]) for row in rows)
        found = speed.exact_over_linear(rows)
        assert set(found) == {"K", "B"}
        cost = {(row["law"], row["case"]): row["engine"] for row in rows}
        for case, ratio in found.items():
            exact, linear = (cost[law.label, case] for law in (LAWS[9], FEW[1]))
            assert ratio == pytest.approx(exact / linear)

    def test_exact_geometry_costs_more(self):
        """Of batches that fill the lanes: a few runs cost the linear engine nearly as much (1.2 to 2 times less)."""
        cases = {name: (blocks[:2], factors) for name, (blocks, factors) in CASES.items()}
        rows = speed.speed((FEW[1], LAWS[9]), cases, repeats=3)
        assert all(ratio > 1.0 for ratio in speed.exact_over_linear(rows).values())  # (2.1 to 3.3)

    @pytest.mark.slow
    def test_scenes(self, results):
        rows = results["scenes"]
        assert all(row["cost"] > 0.0 for row in rows)
        assert {row["ratio"] for row in rows if row["scene"] == scenes.FREE} == {1.0}
        known = {
            law: [row["scene"] for row in rows if row["law"] == law]
            for law in dict.fromkeys(row["law"] for row in rows)
        }
        linear, exact, _ = known.values()
        assert linear == list(scenes.SCENES)
        assert exact == [name for name in linear if "strap" not in name]
        (table,) = tables.TABLES["scenes"](rows)
        assert table.column("0") == linear
        assert table.cells(table.rows[linear.index("strap")])[3:5] == ["–", "–"]

    @pytest.mark.slow
    def test_sliding(self, results):
        rows = results["sliding"]["cost"]
        assert [row["case"] for row in rows] == list(SHAKING)
        assert all(row["whole"] > 0.0 < row["skipping"] for row in rows)
        assert rows[0]["slips"] == 0.0
        assert all(row["slips"] > 0.1 for row in rows[1:])

    def test_newmark_is_that_of_pyslammer(self):
        """Its results come to the engine's where it gets more samples of the same motion, but for its creep."""
        pytest.importorskip("pyslammer")
        rows = one_way(3, (1, 16))["rows"]
        for coarse, fine in zip(rows[::2], rows[1::2], strict=True):
            creep = 1e-5 * 23.0 / coarse["slip"]
            assert coarse["largest"] < 0.01 + creep
            assert fine["median"] < 0.1 * coarse["median"] + creep

    @pytest.mark.slow
    def test_scale(self, results):
        assert [point["runs"] for point in results["scale"]["points"]] == [1_000]
        for point in results["scale"]["points"]:
            assert point["wall"] > 0.0
            assert 5e7 < point["memory_before"] <= point["memory"] < 5e9
        threads = results["scale"]["threads"]
        assert threads["runs"] == 1_000
        assert [row["threads"] for row in threads["rows"]] == [1, 2]
        for row in threads["rows"]:
            assert 0.0 < row["engine"] <= 1.05 * row["cpu"]
            assert 0.0 < row["alone"] <= 1.05 * row["cpu"]
        assert 1.0 <= threads["bound"] <= 16.0

    def test_bounds_of_many_cores_are_on_the_page(self, results):
        """Of 100 s, 1 is the calling thread's alone and 5 are not the engine's: 13.9 and 9.1 times on 16 cores."""
        threads = {
            **results["scale"]["threads"], "runs": 10_000_000, "speed_up": 1.89, "serial": 0.01,
            "bound": bound(1.0, 100.0), "bound_outside": bound(5.0, 100.0),
        }  # fmt: skip
        text = page.text({**results, "scale": {**results["scale"], "threads": threads}})
        assert re.search(r"10,000,000 runs\) \| 1\.89 \| at least 1\.9 \| \*\*missed", text)
        assert re.search(r"16 cores .* \| 13\.9 \| at least 12 \| met", text)
        assert re.search(r"13\.9 .*9\.1", text)

    def test_the_serial_part_is_that_of_amdahl(self):
        """Of 20 s, 2 are serial: two threads take 11, sixteen 3.125."""
        found = speed_up(20.0, 2.0 + 18.0 / 2.0)
        assert found["serial"] == pytest.approx(2.0, rel=1e-14)
        assert found["bound"] == pytest.approx(20.0 / (2.0 + 18.0 / 16.0), rel=1e-14)
        assert speed_up(20.0, 9.0)["serial"] == 0.0
        assert speed_up(20.0, 21.0)["bound"] == 1.0

    def test_missed_targets_of_whole_commands(self, results):
        text = page.text(results)
        assert "| simulate, s of CPU time | 1.00 | at most 0.85 | **missed** |" in text
        assert re.search(r"compiling.* \| 42\.0 \| at most 33\.6 \| \*\*missed", text)
        assert "6.4 times faster" in text

    def test_time_of_a_process(self, tmp_path):
        work = spent(["-c", "import os; sum(range(10 ** 7)); open(os.environ['NAME'], 'w')"], tmp_path, {"NAME": "x"})
        assert (tmp_path / "x").is_file()
        assert 0.02 < work.cpu < 20.0
        assert work.wall > 0.02
        with pytest.raises(RuntimeError, match="ended with 3: nothing to do"):
            spent(["-c", "import sys; print('nothing to do', file=sys.stderr); sys.exit(3)"], tmp_path)

    def test_kernel_clock_counts_and_goes_away(self):
        from toppling.models import runs as engine

        kernel = engine.run_batch
        with scale.kernel_times() as taken:
            answers(LAWS[0], None, record())
        assert sum(taken) > 0.0
        assert engine.run_batch is kernel

    def test_precision(self, results):
        found = results["precision"]["rows"]
        engine = [row for row in found if row["name"] == "toppling"]
        assert [row["law"] for row in engine] == [law.label for law in FEW]
        for row in engine:
            assert row["wrong_flags"] == 0
            assert row["trajectory_max"] <= 1e-9
        plain = [row for row in found if row["name"] == "RK4 dt"]
        assert all(row["trajectory_max"] > 1e-3 for row in plain)

    def test_a_rival_that_is_missing_is_named(self, results):
        assert [*results["precision"]["missing"]] == ["absent 1e-6"]
        assert "absent 1e-6, absent:" in page.text(results)

    def test_flags(self, results):
        for row in results["flags"]:
            assert row["runs"] == 2 * 3 * 12
            assert 0.1 < row["overturned"] < 0.9
            assert 0 <= row["falsely_overturned"] <= row["wrong"] <= row["runs"]

    def test_levels_reach_from_standing_to_fallen(self):
        levels = flags.levels_of(HARD)
        assert levels.size == 40
        assert np.all(np.diff(levels) > 0.0)


class TestPage:
    def test_holds_everything(self, results, tmp_path):
        paths = page.write(json.loads(json.dumps(results, allow_nan=False)), tmp_path)
        parts = {*tables.TABLES, *(("sliding_2",) if results["sliding"]["newmark"]["rows"] else ())}
        files = {f"{name}.csv" for name in (*parts, "scale_2", "studies_2", "integrators")}
        assert {path.name for path in paths} == {*files, "performance.md"}
        assert {path.name for path in (tmp_path / "performance").iterdir()} == {*files, "work_precision.png"}
        text = (tmp_path / "performance.md").read_text(encoding="utf-8")
        machine = results["machine"]
        words = ("`python -m toppling.benchmarks`", machine["processor"], machine["numba"])
        assert all(word in text for word in words)
        linked = set(re.findall(r"\]\(performance/(\w+\.\w+)\)", text))
        assert files - {"sliding_2.csv"} < linked
        data = (tmp_path / "performance/integrators.csv").read_text(encoding="utf-8").splitlines()
        assert len(data) == 1 + len(results["precision"]["rows"])
        assert data[1].startswith(f"{tables.short(FEW[0].label)},toppling,")

    @staticmethod
    def target(results, what):
        (row,) = (target.row for target in page.targets(results) if target.what.startswith(what))
        return row[1:]

    def test_targets_of_scenes(self, results):
        rows = [dict(row, ratio=1.0 if row["scene"] != "strap" else 1.77) for row in results["scenes"]]
        changed = {**results, "scenes": rows}
        assert self.target(changed, "run with a wall") == ("1.00–1.77", "at most 1.5", "**missed**")
        changed = {**results, "scenes": [dict(row, ratio=0.5) for row in rows]}
        assert self.target(changed, "run with a wall") == ("0.50", "at most 1.5", "met")

    def test_sliding_on_the_page(self, results):
        rows = [dict(row, whole=1.25, slips=1.0) for row in results["sliding"]["cost"]]
        compared = {"missing": "pyslammer: not here", "rows": [], "motions": 2}
        changed = {**results, "sliding": {"cost": rows, "newmark": compared}}
        assert self.target(changed, "sample of a sliding") == ("1.2", "at most 2", "met")
        assert "pyslammer: not here" in page.text(changed)
        rows[3]["whole"] = 3.0
        assert self.target(changed, "sample of a sliding") == ("1.2–3.0", "at most 2", "**missed**")
        found = [
            {"ratio": 0.1, "steps": steps, "median": 0.01 / steps, "largest": 0.1 / steps, "slip": 0.25}
            for steps in (1, 4)
        ]
        compared = {"missing": "", "rows": found, "motions": 2, "costs": [2e-5, 4e-3]}
        changed = {**results, "sliding": {"cost": rows, "newmark": compared}}
        assert re.search(r"up to 1\.0 %.* 0\.2 %.* 20 µs.* 4\.0 ms", page.text(changed))
        (table,) = (table for table in page.summary(changed) if "pyslammer" in table.title)
        assert table.cells(table.rows[0]) == ["0.1", "0.25", "1.0 %", "10.0 %", "0.2 %", "2.5 %"]

    def test_targets_of_exact_geometry(self, results):
        costs = {LAWS[7].label: 1.0, LAWS[9].label: 12.3}
        rows = [dict(row, engine=costs.get(row["law"], 2.0)) for row in results["speed"]]
        changed = {**results, "speed": rows}
        assert self.target(changed, "exact over linear") == ("12.3", "at most 10", "**missed**")
        changed = {**results, "speed": [dict(row, engine=2.0) for row in rows]}
        assert self.target(changed, "exact over linear")[2] == "met"

    def test_wrong_flags_by_integrator(self, results):
        """Shares of two laws, and changes of the law with the larger one."""
        rows = [
            {**results["flags"][0], "law": law, "name": "RK4 dt", "runs": 100, "wrong": wrong}
            | {"median_mean": mean, "median_largest": 0.2, "dispersion_mean": 0.0, "dispersion_largest": -0.3}
            for law, wrong, mean in (("a", 2, 0.01), ("b", 10, -0.05))
        ]
        text = page.text({**results, "flags": rows})
        assert "| RK4 dt | 2.00–10.00 | −5.0 % | +20.0 % | 0 % | −30.0 % |" in text

    def test_of_one_part(self, results, tmp_path):
        one = {name: results[name] for name in ("command", "machine", "motions")}
        assert [path.name for path in page.write(one, tmp_path)] == ["motions.csv"]

    def test_short_names_tell_laws_apart(self):
        assert len({tables.short(law.label) for law in LAWS}) == len(LAWS)
        assert tables.short(LAWS[9].label) == "housner geometry=exact"

    def test_figures_name_every_integrator(self, results):
        figure = figures.work_precision(results["precision"]["rows"])
        (legend,) = figure.legends
        assert [entry.get_text() for entry in legend.get_texts()] == ["toppling", "RK4", "RK4 with events"]

    @pytest.mark.parametrize(
        ("value", "shown"), [(0.0, "0"), (None, "diverges"), (3.4e-13, "3e-13"), (7.85, "8"), (0.012, "1e-2")]
    )
    def test_errors_are_short(self, value, shown):
        assert tables.error(value) == shown


class TestCommand:
    def test_writes_and_prints(self, tmp_path, capsys, monkeypatch, results):
        monkeypatch.setitem(PARTS, "motions", lambda: results["motions"])
        main(["--parts", "motions", "--out", str(tmp_path / "new")])
        printed = capsys.readouterr().out
        assert "Motions, CPU time" in printed
        assert (tmp_path / "new/performance/motions.csv").is_file()

    def test_json(self, tmp_path, capsys, monkeypatch, results):
        monkeypatch.setitem(PARTS, "flags", lambda: results["flags"])
        main(["--parts", "flags", "--json", "--out", str(tmp_path)])
        printed = json.loads(capsys.readouterr().out)
        assert printed["command"].endswith("toppling.benchmarks --parts flags")
        assert printed["flags"] == json.loads(json.dumps(results["flags"]))

    @pytest.mark.parametrize(
        ("wrong", "said"),
        [
            (["--parts", "nonsense"], "speed, scenes, sliding, scale, motions, start, studies"),
            (["--parts", "speed,nonsense"], "'nonsense' is no part"),
            (["--parts", ","], "names no part"),
        ],
    )
    def test_wrong_input(self, wrong, said, tmp_path, capsys):
        with pytest.raises(SystemExit, match="2"):
            main([*wrong, "--out", str(tmp_path)])
        assert said in capsys.readouterr().err

    def test_parts_run_in_one_order(self):
        assert parts_of("flags, speed,flags") == ["speed", "flags"]
