"""Page of the benchmark: question and answer first; every sentence with a figure is made from the results."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from ..core.writing import write_bytes
from . import figures
from .measure import ENGINE, Row
from .mixing import LEVELS, MOTION_TARGET, RATIO_TARGET, RUNS
from .precision import SHOWN, TIMED
from .problems import DT, DURATION, LAWS
from .scenes import TARGET
from .sliding.cost import TARGET as SLIDING_TARGET
from .sliding.newmark import QUIET
from .speed import EXACT_GEOMETRY
from .suite import PARTS
from .tables import (
    EXACT_NS,
    EXACT_TARGET,
    RIGHT,
    SHARE_TARGET,
    SHARED,
    TARGETS,
    Table,
    absences,
    error,
    errors_table,
    flags_table,
    fraction,
    laws_of,
    mixing_table,
    newmark_table,
    next_right,
    percent,
    precision_table,
    scale_table,
    scenes_table,
    share_table,
    short,
    skipping_table,
    sliding_table,
    span,
    speed_table,
)
from .whole.tables import (
    by_threads_answer,
    by_threads_table,
    first_use_answer,
    first_use_table,
    making_answer,
    making_table,
    studies_answer,
    studies_table,
    threads_table,
)

FREE_CORES = 1.9
"""Number of cores, of two, below which other programs used the machine during the measurement."""
PAGE, WORK_PRECISION, COST = "performance.md", "work_precision.png", "cost.png"


def write(results: Row, folder: Path) -> list[Path]:
    """Write the page and the figures of the measured parts; return their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    written = [folder / PAGE]
    if "precision" in results:
        laws = [law for law in SHOWN if any(row["law"] == law for row in results["precision"]["found"])]
        if laws:
            written.append(folder / WORK_PRECISION)
            figures.save(figures.work_precision(results["precision"]["found"], laws), written[-1])
    if "scale" in results and any("failed" not in point for point in results["scale"]["points"]):
        written.append(folder / COST)
        figures.save(figures.cost_curve(results["scale"]["points"]), written[-1])
    names = {path.name for path in written}
    write_bytes(written[0], text(results, names).encode())
    return written


def text(results: Row, pictures: Iterable[str] = ()) -> str:
    """Return the page as Markdown."""
    pictures = set(pictures)
    machine = results["machine"]
    versions = ", ".join(f"{name} {machine[name]}" for name in ("python", "numpy", "numba", "dask", "toppling"))
    parts = [part for part in PARTS if part in results]
    answer = [line for part in parts for line in _ANSWERS[part](results[part])]
    blocks = [
        "# How fast, and how right?",
        "*What does an exact integration of rocking blocks cost, and what do the usual integrators get wrong?*",
        "\n".join(f"- {line}" for line in answer),
        f"Everything here is written by `{results['command']}`, on one {machine['processor']} with vectors of "
        f"{machine['vectors']} bits ({machine['system']}), {versions}. Another machine gives other times, and other "
        "ratios (the engine works in vectors, whose width matters to it); errors and flags stay. CPU time of one "
        f"thread, median of repeats taken in turns, in one process, unless a line says otherwise. Laws: {SHARED}.",
    ]
    for part in parts:
        blocks += _SECTIONS[part](results, pictures)
    return "\n\n".join(blocks) + "\n"


def markdown(table: Table, title: bool = False) -> str:
    """Return a table in Markdown, with figures aligned to the right."""
    lines = [f"**{table.title}**\n"] if title else []
    lines.append("| " + " | ".join(table.headings) + " |")
    lines.append("|---|" + "---:|" * (len(table.headings) - 1))
    lines += ["| " + " | ".join(row) + " |" for row in table.rows]
    return "\n".join(lines)


def summary(results: Row) -> list[Table]:
    """Return the tables for a terminal: all tables except those of single integrators."""
    tables = []
    if "speed" in results:
        tables.append(speed_table(results["speed"]["rows"]))
    if "mixing" in results:
        tables.append(mixing_table(results["mixing"]))
    if "scenes" in results:
        tables.append(scenes_table(results["scenes"]))
    if "sliding" in results:
        tables.append(sliding_table(results["sliding"]["cost"]))
        if results["sliding"]["newmark"]["rows"]:
            tables.append(newmark_table(results["sliding"]["newmark"]["rows"]))
    if "skipping" in results:
        tables.append(skipping_table(results["skipping"]))
    if "scale" in results:
        scale = results["scale"]
        tables += [share_table(scale["share"]), scale_table(scale["points"]), by_threads_table(scale["threads"])]
    if "motions" in results:
        tables.append(making_table(results["motions"]))
    if "start" in results:
        tables.append(first_use_table(results["start"]))
    if "studies" in results:
        tables += [studies_table(results["studies"]), threads_table(results["studies"])]
    if "precision" in results:
        tables.append(precision_table(results["precision"]["found"]))
    if "flags" in results:
        tables += [flags_table(law, results["flags"]) for law in laws_of(results["flags"])]
    return tables


def _names(items: Sequence[str]) -> str:
    return ", ".join(items) if items else "none"


# ---------------------------------------------------------------------------------------------------------------------
# answers: one or two sentences a part, from its numbers


def _speed_answer(speed: Row) -> list[str]:
    rows = speed["rows"]
    kinds = {
        "elastic rest": [row for row in rows if not row["rigid"]],
        "rigid rest": [row for row in rows if row["rigid"] and row["law"] != EXACT_GEOMETRY],
        "exact geometry": [row for row in rows if row["law"] == EXACT_GEOMETRY],
    }
    costs = ", ".join(
        f"{span(r['engine'] for r in some)} ns with {kind} (RK4: {span(r['yardstick'] for r in some)})"
        for kind, some in kinds.items()
        if some
    )
    lines = [
        f"**Speed.** A sample of one run costs, without skipping: {costs}. RK4 takes one step a sample, rest or not."
    ]
    for case, target in TARGETS.items():
        here = [row for row in rows if row["case"] == case and row["law"] != EXACT_GEOMETRY]
        if here:
            missed = [f"{short(row['law'])} ({row['share']:.3f})" for row in here if row["share"] > target]
            verdict = f"**missed** by {_names(missed)}" if missed else "met by all"
            line = (
                f"Target in case {case}, {fraction(target)} of the cost of one RK4 step a sample: met by "
                f"{len(here) - len(missed)} of {len(here)} laws" + (f"; {verdict}." if missed else ".")
            )
            rigid = [row for row in here if row["rigid"]]
            if rigid:
                line += (
                    f" Against an RK4 that takes no steps where a rigid block rests the rigid laws are at "
                    f"{span((row['share_passing'] for row in rigid), 3)}."
                )
            lines.append(line)
    exact = {row["case"]: row["engine"] for row in rows if row["law"] == EXACT_GEOMETRY}
    if exact:
        each = ", ".join(f"{cost:.1f} ns in case {case}" for case, cost in exact.items())
        verdict = "met" if max(exact.values()) <= EXACT_NS else "**missed**"
        lines.append(f"Exact geometry: {each} (target {EXACT_NS:g} ns: {verdict}).")
    ratios = speed["exact_over_linear"]
    if ratios:
        each = ", ".join(f"{ratio:.1f} in case {case}" for case, ratio in ratios.items())
        verdict = "met" if max(ratios.values()) <= EXACT_TARGET else "**missed**"
        lines.append(f"Exact geometry over linear geometry, cost: {each} (target {EXACT_TARGET:g}: {verdict}).")
    return lines


def _mixing_answer(rows: list[Row]) -> list[str]:
    dear = [f"{short(row['law'])} ({row['ratio']:.2f})" for row in rows if row["ratio"] > RATIO_TARGET]
    slow = [f"{short(row['law'])} ({row['levels']:.0f})" for row in rows if row["levels"] > MOTION_TARGET]
    return [
        f"**Few runs of each motion.** In a batch of {RUNS} motions a run costs "
        f"{span((row['ratio'] for row in rows), 2)} times as much as in a batch of one motion "
        f"(target {RATIO_TARGET:g}: {'**missed** by ' + _names(dear) if dear else 'met'}). "
        f"A motion at {len(LEVELS)} levels costs {span((row['levels'] for row in rows), 0)} µs "
        f"(target {MOTION_TARGET:g}: {'**missed** by ' + _names(slow) if slow else 'met'}), motion by motion "
        f"{span((row['alone'] for row in rows), 0)} µs."
    ]


def _scenes_answer(rows: list[Row]) -> list[str]:
    held = [row for row in rows if row["scene"].startswith(("wall", "strap"))]
    over = [f"{row['scene']} under {short(row['law'])} ({row['ratio']:.2f})" for row in held if row["ratio"] > TARGET]
    verdict = f"**missed** by {_names(over)}" if over else "met"
    return [
        f"**Scenes.** A run with a wall or a strap costs {span((row['ratio'] for row in held), 2)} times as much as "
        f"one of the free block (target {TARGET:g}: {verdict})."
    ]


def _sliding_answer(sliding: Row) -> list[str]:
    moving = [row for row in sliding["cost"] if row["slips"] > 0.0]
    over = [f"{row['case']} ({row['whole']:.1f})" for row in moving if row["whole"] > SLIDING_TARGET]
    verdict = f"**missed** by {_names(over)}" if over else "met"
    return [
        f"**Sliding.** A sample of a run costs {span(row['whole'] for row in moving)} ns without skipping "
        f"(target {SLIDING_TARGET:g}: {verdict})."
    ]


def _skipping_answer(rows: list[Row]) -> list[str]:
    return [
        f"**Skipping** makes a typical IDA {span(row['peaks'] for row in rows)} times faster where peaks are wanted, "
        f"{span(row['flags'] for row in rows)} times where flags are enough."
    ]


def _scale_answer(scale: Row) -> list[str]:
    share, first = scale["share"], scale["first"]
    of_wall = {name: share[name]["of_wall"] for name in ("peaks", "flags")}
    verdict = "met" if min(of_wall.values()) >= SHARE_TARGET else "**missed**"
    if verdict != "met" and share["cores"] < FREE_CORES:
        verdict = (
            f"**not met, and not decided here**: other programs left two equal tasks {share['cores']:.2f} of 2 cores"
        )
    of_cpu = span(100.0 * share[name]["of_cpu"] for name in ("peaks", "flags"))
    lines = [
        f"**An analysis of {share['runs']:,} runs** with two threads spends {percent(of_wall['peaks'])} of its wall "
        f"time × threads in the engine with peaks, {percent(of_wall['flags'])} with flags alone "
        f"(target {percent(SHARE_TARGET)}: {verdict}). Of the CPU time that it used, {of_cpu} % were the engine's."
    ]
    done = [point for point in scale["points"] if "failed" not in point]
    if done:
        most = done[-1]
        lines.append(
            f"{most['runs']:,} runs take {most['wall']:.1f} s and {most['memory'] / 1e9:.2f} GB, of which "
            f"{most['memory_before'] / 1e9:.2f} GB are the packages and the motions."
        )
    lines += [f"{point['runs']:,} runs failed: {point['failed']}." for point in scale["points"] if "failed" in point]
    lines += by_threads_answer(scale["threads"])
    lines.append(
        f"A second process waits {first['loading']:.1f} s for the import and {first['first']:.1f} s for its first "
        f"analysis of {first['runs']:,} runs (the next: {first['second']:.2f} s): nothing is compiled again."
    )
    return lines


def _precision_answer(precision: Row) -> list[str]:
    rows = precision["found"]
    ours = [row for row in rows if row["name"] == ENGINE]
    diverges = [short(row["law"]) for row in ours if row["trajectory_max"] is None]
    worst = max(
        (row for row in ours if row["trajectory_max"] is not None), key=lambda row: float(row["trajectory_max"])
    )
    wrong, flags = sum(row["wrong_flags"] for row in ours), sum(row["flags"] for row in ours)
    lines = [
        f"**Precision.** Against a truth of 40 digits the engine has {wrong} wrong overturned flags of {flags}; its "
        f"largest error of a rotation is {error(worst['trajectory_max'])} α ({short(worst['law'])}, where a change of "
        f"the record by 1e-13 moves the truth by {error(worst['twin'])} α)."
    ]
    if diverges:
        lines.append(f"**It diverges** for {_names(diverges)}.")
    pairs = [(row, next_right(row["law"], rows)) for row in ours]
    factors = {short(row["law"]): rival["cost"] / row["cost"] for row, rival in pairs if rival is not None}
    if factors:
        slower = [f"{law} ({factor:.1f})" for law, factor in factors.items() if factor < 1.0]
        lines.append(
            f"The cheapest rival that is right (every rotation within {error(RIGHT)} α, no wrong flag) "
            f"costs {span(factors.values())} times as much, law by law"
            + (f"; it is cheaper than the engine for {_names(slower)}." if slower else ".")
        )
    alone = [short(row["law"]) for row, rival in pairs if rival is None]
    if alone:
        lines.append(f"No rival here is right by that measure for {_names(alone)}.")
    return lines


def _flags_answer(rows: list[Row]) -> list[str]:
    parts = []
    for name in dict.fromkeys(row["name"] for row in rows):
        here = [row["wrong"] / row["runs"] for row in rows if row["name"] == name]
        parts.append(f"{name} {span((100.0 * share for share in here), digits=2)} %")
    changes = [row for row in rows if row["median_largest"] is not None]
    line = f"**Wrong verdicts** among {rows[0]['runs']:,} runs of a usual study, over the laws: {'; '.join(parts)}."
    if not changes:
        return [line]
    mean = max(changes, key=lambda row: abs(float(row["median_mean"])))
    most = max(changes, key=lambda row: abs(float(row["median_largest"])))
    return [
        line,
        f"They move the median of a fragility curve by {percent(mean['median_mean'], signed=True)} on average over the "
        f"blocks in the worst case ({mean['name']}, {short(mean['law'])}), and that of a single block by up to "
        f"{percent(most['median_largest'], signed=True)} ({most['name']}, {short(most['law'])}).",
    ]


_ANSWERS: dict[str, Callable[[Any], list[str]]] = {
    "speed": _speed_answer,
    "mixing": _mixing_answer,
    "scenes": _scenes_answer,
    "sliding": _sliding_answer,
    "skipping": _skipping_answer,
    "scale": _scale_answer,
    "motions": making_answer,
    "start": first_use_answer,
    "studies": studies_answer,
    "precision": _precision_answer,
    "flags": _flags_answer,
}


# ---------------------------------------------------------------------------------------------------------------------
# sections: what is measured, tables, limits


def _speed_section(results: Row, _: set[str]) -> list[str]:
    return [
        "## Speed",
        f"One core, one process, one record of {DURATION:g} s at {DT:g} s (filtered white noise, peak 1 g). Case K: "
        "one slender block (α = 0.2 rad, R = 0.38 m) under 1,024 scale factors, rocking hard. Case B: 25 blocks (five "
        "slendernesses by five sizes) under 40 factors each. The engine leaves nothing out here (`skip=False`); RK4 "
        "takes one plain step a sample, in compiled code, and locates no event. ✓: within the target, "
        + ", ".join(f"{fraction(target)} in {case}" for case, target in TARGETS.items())
        + ". Exact geometry has 115 impacts a run in case K, each of them a root that is found by itself; on "
        "processors of one kind this page has shown 5.9 to 6.4 ns there.",
        markdown(speed_table(results["speed"]["rows"])),
        "\\* A rigid block that rests does not move: the engine passes over that time, one step a sample of RK4 is "
        "a step there, too. *Passing over rest*: the ratio to an RK4 that takes no steps there.",
    ]


def _mixing_section(results: Row, _: set[str]) -> list[str]:
    levels = ", ".join(f"{level:g}" for level in LEVELS)
    return [
        "## Few runs of each motion",
        f"The block of case K under simulated motions of {DURATION:g} s at {DT:g} s: {RUNS} runs of one motion in a "
        f"batch, and {RUNS} runs of as many motions. Then all motions at {len(LEVELS)} levels each ({levels} times "
        "g tan α), in mixed batches and motion by motion. What lies before the first uplift is skipped; the results "
        "are the same to the last bit. A motion of which few runs are wanted has costs of its own *before the "
        "run*, which many runs of one motion share: its samples are copied and read once, and an elastic block's "
        "response is followed to its first uplift. They alone take more than the three tenths of a linear run that the "
        "target leaves. In the lanes each run then reads a record of its own, where runs of one motion read the same.",
        markdown(mixing_table(results["mixing"])),
    ]


def _scenes_section(results: Row, _: set[str]) -> list[str]:
    return [
        "## Scenes",
        "The blocks, factors and record of case B, without skipping, all scenes of a law in turns. Straps are "
        "horizontal at nine tenths of the height, with 20 kN/m, and break at half the block's weight; the mass off the "
        "middle is off by a tenth of the half-width. A block that a wall stops sooner has fewer impacts, hence ratios "
        "below 1. –: the law refuses this scene for some of the blocks.",
        markdown(scenes_table(results["scenes"])),
    ]


def _sliding_section(results: Row, _: set[str]) -> list[str]:
    sliding = results["sliding"]
    blocks = [
        "## Sliding",
        "Blocks with a lognormal coefficient of friction (median 0.3, dispersion 0.3, kinetic 0.85 times that) under "
        f"one record of {DURATION:g} s at {DT:g} s, in lanes. The instants at which a block begins to slide or stops "
        "are found in closed form, and cost more than the samples between them. With skips: what lies before the first "
        "and after the last slip is left out.",
        markdown(sliding_table(sliding["cost"])),
    ]
    compared = sliding["newmark"]
    if compared["missing"]:
        return [*blocks, f"Newmark's block is not compared with another program: {compared['missing']}."]
    ours, theirs = compared["costs"]
    return [
        *blocks,
        "**Newmark's block**, which slides one way, with pyslammer's `RigidAnalysis`: "
        f"{compared['motions']} simulated motions and {QUIET:g} s of quiet after them, by the acceleration k_y that "
        "starts the block over the record's peak. pyslammer steps with the samples of its record: a slide begins and "
        "ends at a sample, and the velocity follows the trapezoidal rule. Its difference becomes smaller when the same "
        "motion, straight between the samples of the record, is sampled 4 and 16 times as finely; the engine's result "
        "does not depend on that. What remains at small slips: below 1e-5 m/s pyslammer has no friction, so that a "
        "block which gets there creeps on, by up to 0.01 mm in a second. A run takes the engine "
        f"{1e6 * ours:,.0f} µs from Python, pyslammer {1e3 * theirs:,.1f} ms.",
        markdown(newmark_table(compared["rows"])),
    ]


def _skipping_section(results: Row, _: set[str]) -> list[str]:
    return [
        "## Skipping",
        "A typical IDA: the 25 blocks of case B, 5 simulated motions, 20 levels of peak acceleration from 0.1 to 2.0 "
        "times each block's g tan α, below which a rigid block does not uplift. Skipping leaves out what is known "
        "before the first uplift and, where flags alone are wanted, what follows once the rest of the record cannot "
        "overturn the block. Left out: share of all samples that skipping leaves out. Those after overturning are "
        "never computed, with or without it.",
        markdown(skipping_table(results["skipping"])),
    ]


def _scale_section(results: Row, pictures: set[str]) -> list[str]:
    scale = results["scale"]
    blocks = [
        "## An analysis, end to end",
        "`tp.ida` with 25 blocks, 4 laws (discrete, Giannini–Masiani, energy-consistent, Housner linear), 10 levels "
        "from 0.1 to 1 g and as many motions as needed, skipping on, two threads. Wall time, each point in a process "
        "of its own; other programs on the machine count here. The engine's time is the CPU time of its calls in all "
        "threads; what it lacks of wall time × threads is labelling, waiting for the last chunk, and what other "
        "programs took: two equal tasks side by side, each a thread that waits for nothing, got "
        f"{scale['share']['cores']:.2f} cores here.",
        markdown(share_table(scale["share"])),
        markdown(scale_table(scale["points"])),
        "The largest of them on one thread and on two, imports and motions apart. What the calling thread does on two "
        "threads is what nobody else can do meanwhile: to plan, to label and to collect. Measures of the motions are "
        "taken beside the runs.",
        markdown(by_threads_table(scale["threads"])),
    ]
    if COST in pictures:
        blocks.append(f"![Wall time and memory against the number of runs]({COST})")
    return blocks


def _motions_section(results: Row, _: set[str]) -> list[str]:
    return [
        "## Motions",
        "Motions at the generators' usual steps, made 32 at a time, and the usual measures of 32 motions. Site-based "
        "and near-fault motions are exact sums over the responses to all pulses of noise that still live, whose "
        "frequency drifts: shorter ways (expansions about a few frequencies) are approximate, and would change every "
        "motion of a seed. More than half of the time of the measures is that of the response spectrum.",
        markdown(making_table(results["motions"])),
    ]


def _start_section(results: Row, _: set[str]) -> list[str]:
    return [
        "## Starting up",
        "CPU time of whole processes, median of repeats in turns: commands that compute nothing, and a first "
        "simulation when everything is compiled, whose target is that of importing numba and xarray and 0.15 s. The "
        "row before it shows what cannot be had for less: numba sets its compiler up before it loads the first stored "
        "function, however small, and xarray loads dask, where it is installed, with its first labelled axis.",
        markdown(first_use_table(results["start"])),
    ]


def _studies_section(results: Row, _: set[str]) -> list[str]:
    return [
        "## Whole studies",
        "Studies in `benchmarks/studies`, which never change: the office study (3 blocks, 6 laws, 20 levels, 200 "
        "motions) from an empty cache, again, and its report; the large study has ten times as many motions and "
        "linear geometry. CPU time holds all threads, imports, motions, files and figures. The serial part is "
        "2 T₂ - T₁ of the wall times on two threads and on one, by Amdahl's law. Runs are a few seconds of either "
        "study; imports, motions, checks of every motion, figures and files are the rest and do not divide among "
        "threads, which is why a study of this size gains little from many cores. Since a4baf48 the engine compiles "
        "more than it did (exact geometry in vectors, lanes over motions, walls and restraints), a report draws each "
        "figure for a desktop and for a telephone, and the large study has no exact geometry, where the engine gained "
        "most.",
        markdown(studies_table(results["studies"])),
        markdown(threads_table(results["studies"])),
    ]


def _precision_section(results: Row, pictures: set[str]) -> list[str]:
    found = results["precision"]["found"]
    laws = [law.label for law in LAWS if any(row["law"] == law.label for row in found)]
    blocks = [
        "## Work and precision",
        "Errors: 16 runs a law (two blocks, eight scale factors) against a solution in 60-digit arithmetic, kept to "
        "40 digits (`benchmarks/truth.nc`). *Trajectory*: largest difference of rotation over a run, over α; the "
        "largest of the runs that stand in truth (6 or 8: it overturned), and the median of those that stand and "
        "rock. *Peak*: the same of the peak rotation. "
        f"Time: ns per sample and run on the slender block under {TIMED.size} factors, rotations not kept; dear "
        'integrators on the runs of the truth themselves. Rocking multiplies errors: the column "1e-13 moves the truth '
        'by" says how far the truth itself moves if the record is multiplied by 1 + 1e-13; an error below that is '
        "smaller than what such a change of the record does.",
        markdown(precision_table(found)),
        f"A rival is called right where every rotation is within {error(RIGHT)} α and no flag is wrong.",
    ]
    if WORK_PRECISION in pictures:
        blocks += [
            f"![Error against cost for four laws]({WORK_PRECISION})",
            "*Largest error of the trajectory against cost; left and below is better. Dashed: an error as large as α. "
            "Errors below 1e-16 are drawn there.*",
        ]
    left_out = absences(results["precision"]["left_out"])
    if left_out:
        more = "" if results["full"] else " (`--full` allows more time)"
        blocks += [f"Left out{more}:", "\n".join(f"- {line}" for line in left_out)]
    blocks.append("### Every integrator, law by law")
    blocks += [markdown(errors_table(law, found), title=True) for law in laws]
    return blocks


def _flags_section(results: Row, _: set[str]) -> list[str]:
    rows = results["flags"]
    shares = ", ".join(
        f"{percent(share)} under {short(law)}"
        for law, share in dict.fromkeys((row["law"], row["overturned"]) for row in rows)
    )
    return [
        "## Wrong verdicts",
        f"A usual study: {rows[0]['runs']:,} runs a law (25 blocks of case B, 40 levels of peak acceleration that grow "
        f"with each block's g tan α √R, 10 simulated motions), of which overturn: {shares}. Each integrator's "
        "overturned flags against the engine's (which `python -m toppling.benchmarks --parts precision` compares with "
        "the truth); lognormal curves are fitted per block to both, and the relative changes of median and dispersion "
        "β are given over the blocks.",
        *(markdown(flags_table(law, rows), title=True) for law in laws_of(rows)),
        "Wrong flags of both kinds cancel in a curve: a curve that hardly moves does not make single verdicts right.",
    ]


_SECTIONS: dict[str, Callable[[Row, set[str]], list[str]]] = {
    "speed": _speed_section,
    "mixing": _mixing_section,
    "scenes": _scenes_section,
    "sliding": _sliding_section,
    "skipping": _skipping_section,
    "scale": _scale_section,
    "motions": _motions_section,
    "start": _start_section,
    "studies": _studies_section,
    "precision": _precision_section,
    "flags": _flags_section,
}
