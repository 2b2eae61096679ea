"""The `toppling` command: arguments in, exit codes out.

0 done, 1 out of memory or a cluster that is gone, 2 wrong input, 129 hung up, 130 interrupted, 143 terminated; one
sentence on standard error.  Never a traceback for a user's mistake.

Each command imports what it needs by itself. The libraries of a study take two seconds to load; help, a version, a
list or a status do not need them.
"""

from __future__ import annotations

import logging
import os
import signal
import sys
import warnings
from contextlib import AbstractContextManager, nullcontext
from json import dumps
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import App, Group, Parameter
from cyclopts.exceptions import CycloptsError, MissingArgumentError

from ...core.doubts import noted
from ...core.limits import memory_limit
from ...core.units import DAMPING
from ...core.wording import counted, system_reason
from ..app.command import live_page
from ..single.command import simulate_one
from ..text.encoding import json_text, printable, write_anything
from ..text.error import StudyError, writing
from ..text.terminal import say, terminal
from .choices import ExportFormat, Starter

if TYPE_CHECKING:
    from distributed import Client
    from rich.console import Console
    from xarray import Dataset


EXIT_FAILED = 1
EXIT_INPUT = 2
EXIT_SIGNAL = 128  # and the number of the signal that ended it
Result = Annotated[Path, Parameter(help="Results file (results.nc) or its folder.")]
Verify = Annotated[bool, Parameter(negative="", help="Exit with code 2 if the results were edited.")]
LEAST_OF_ANY = 600_000  # kB of memory (ulimit -v): below, what any command loads may hang, or end it without a word
COMMANDS = ("new", "run", "status", "app", "simulate", "motions", "catalogue", "export", "report", "compare", "schema")

INTERRUPTED = {
    "run": "interrupted; the same command goes on",
    **dict.fromkeys(
        ("export", "report", "compare"),
        "interrupted: the results are unchanged; of other files, each is complete or unchanged",
    ),
    **dict.fromkeys(("new", "simulate", "motions"), "interrupted: each file is complete or unchanged"),
}
"""Sentences of an interrupt by command, where the interrupted work has none of its own."""


RUN = Group("Run", sort_key=1)
READ = Group("Results", sort_key=2)
INPUTS = Group("Inputs", sort_key=3)
"""Commands by task."""

app = App(
    name="toppling",
    help="How likely is a piece of furniture or equipment to overturn in an earthquake?",
    help_format="plaintext",
    group_commands=Group("Options", sort_key=4),
    result_action="return_value",
    suppress_keyboard_interrupt=False,
)


@app.command(group=RUN)
def run(
    study: Annotated[Path, Parameter(name="STUDY.toml")],
    /,
    *,
    out: Path | None = None,
    scheduler: str | None = None,
    fresh: Annotated[bool, Parameter(negative="")] = False,
    target: float | None = None,
    dry_run: Annotated[bool, Parameter(negative="")] = False,
    verbose: Annotated[bool, Parameter(negative="")] = False,
) -> None:
    """Run a study: print its answer, write results.nc and its figures.

    After an interruption the same command continues. Finished results of the same study are kept.

    Parameters
    ----------
    study
        Study file.
    out
        Folder for the results; default results/NAME.
    scheduler
        Address of a dask scheduler, tcp://host:port.
    fresh
        Recompute, and replace the contents of the folder.
    target
        Chance of falling that restraints must reach (0.001); finds their strength.
    dry_run
        Estimate runs, time, memory and disk; run nothing.
    verbose
        Print all tables and notes of the report.
    """
    from ...models.runs import compile_aside

    console = terminal()
    folder = out if out is not None else Path("results") / study.stem
    aside = os.path.isfile(study) and scheduler is None and not dry_run
    compiles = aside and compile_aside("from toppling.studies.command.ahead import compile_ahead as c; c()")
    with _announced(compiles):
        from ...fragility.runs.runners import thread_count
        from ..kinds.study import Study
        from ..store.folder import RESULT_NAME
        from ..store.progress import show_progress
        from .forecast import forecast
        from .status import status_of

        try:
            least = _least_limit(thread_count())  # (dask's configuration may give it wrongly)
        except ValueError as error:
            raise StudyError(str(error)) from None
        if 0 < memory_limit() < least:
            raise MemoryError
        plan = Study.from_toml(study, target)
    doubts = [doubt.sentence for doubt in plan.doubts if doubt.kind not in plan.accepted]
    printed = [note for note in plan.notes if dry_run or verbose or note in doubts]
    size = plan.words if dry_run or verbose else plan.size
    say(console, f"{plan.title}: {size}", *(f"note: {note}" for note in printed))
    if dry_run:
        say(console, *forecast(plan, folder))
        if folder.is_dir() and any(folder.iterdir()) and not fresh:
            try:
                plan.refuse_occupied(folder)
                say(console, f"in {folder}: {status_of(folder).lines(folder)[0]}")
            except StudyError as error:
                say(console, f"in {folder}: {error}")
        return
    client = None if scheduler is None else _connect(scheduler)
    if client is None:
        with _announced(compiles):
            plan.prepare()
    before = _stamp(folder)
    try:
        # (a total that depends on results is told with the first of them)
        with show_progress(console, "runs", None if plan.at_most else plan.all_runs, plan.aside) as display:
            results = plan.run(folder, client, resume=not fresh, progress=display.update, watching=display.watching)
            display.finished()
    finally:
        if client is not None:
            client.close()
    if display.watch is None and _stamp(folder) != before:
        say(console, "runs kept; what the changed keys decide (recommendations, title) is computed anew")
    elif display.watch is None:
        say(console, "results of this study were there already (--fresh computes them again)")
    elif display.watch.kept:
        say(console, f"went on from {display.watch.kept:,} runs that were kept")
    try:
        with noted():  # (rates are computed, and not given)
            _show(console, printed, results, folder, verbose)
    except KeyboardInterrupt as error:
        error.args = (f"interrupted: the results are written ({folder / RESULT_NAME}), not all of the figures",)
        raise


def _announced(compiles: bool) -> AbstractContextManager[None]:
    """Tell on standard error that the engine compiles, for as long as that is waited for."""
    if not compiles:
        return nullcontext()
    from ...core.machine_code import announced  # numba, which takes a second

    return announced("the engine")


def _stamp(folder: Path) -> tuple[int, int] | None:
    """Return what changes where results are written again; None where there are none."""
    from ..store.folder import RESULT_NAME

    try:
        stat = (folder / RESULT_NAME).stat()
    except OSError:
        return None
    return stat.st_ino, stat.st_mtime_ns


def _show(console: Console, printed: list[str], results: Dataset, folder: Path, verbose: bool) -> None:
    """Print a study's answer, or all its tables and notes, and write its figures; `printed`: notes that are printed."""
    from .. import show
    from ..facts.notes import notes_of
    from ..facts.say import notes_said
    from ..store.folder import RESULT_NAME
    from ..tables.registry import SHORT, TABLES, tables as tables_of
    from ..tables.terminal import rendered
    from .verdict import verdict

    tables = [*tables_of(results, TABLES if verbose else SHORT)]
    answer, validity, remedies = verdict(results, bool(tables))
    if not verbose:
        say(console, *answer)
    for table in tables:
        console.print(*rendered(table, console.width), sep="\n", end="")
    notes = [note for note in notes_said(notes_of(results)) if note not in printed]
    say(console, *remedies, *([f"note: {note}" for note in notes] if verbose else validity))
    more = f" ({counted(len(notes), 'further note')}; --verbose prints them)" if notes and not verbose else ""
    written = show.draw(results, folder)
    drawn = f" and {counted(len(written), 'figure')}" if written else ""
    say(console, f"report: toppling report {folder}{more}", f"written: {RESULT_NAME}{drawn} in {folder}")


@app.command(group=RUN)
def status(folder: Path, /, *, json: Annotated[bool, Parameter(negative="")] = False, verify: Verify = False) -> None:
    """Show whether a study is finished, running or interrupted.

    Parameters
    ----------
    folder
        Folder of the results (`--out` of `toppling run`).
    json
        Print JSON.
    """
    from .status import status_of

    state = status_of(folder, verify)
    if json:
        sys.stdout.write(json_text(state._asdict()) + "\n")
    else:
        say(terminal(), *state.lines(folder))


@app.command(group=RUN)
def new(kind: Starter, folder: Path, /) -> None:
    """Create a commented example study in a new folder.

    Parameters
    ----------
    kind
        bookcase (one piece and its kit), hazard (one piece, selected motions), inventory (a building and its hazard),
        records (two pieces under records), scenario (a building in one earthquake).
    folder
        New or empty folder.
    """
    from .starters import REPLACE, write_starter

    written = write_starter(kind, folder)
    study, results = quote(str(folder / written[0])), quote(str(folder / "results"))
    say(
        terminal(),
        f"written into {folder}: {', '.join(written)}",
        f"replace these invented inputs: {REPLACE[kind]}",
        f"next: toppling run {study} --out {results}",
    )


app.command(live_page, name="app", group=RUN)

app.command(simulate_one, name="simulate", group=INPUTS)


@app.command(name="motions", group=INPUTS)
def look_at_motions(
    inputs: Annotated[list[str], Parameter(negative_iterable="")],
    /,
    *,
    out: Path = Path("results/motions"),
    json_: Annotated[bool, Parameter(name="--json", negative="")] = False,
    damping: float = DAMPING,
    target: Path | None = None,
) -> None:
    """Show ground motions: intensity measures, histories, spectra and Husid plots.

    Parameters
    ----------
    inputs
        One study file (TOML), or record files (paths or patterns).
    out
        Folder for the figures.
    json_
        Print every measure of every motion as JSON.
    damping
        Damping ratio of the spectra.
    target
        CSV of a spectrum to compare with: period (s) or frequency (Hz), sa (unit).
    """
    from ...motions import TargetSpectrum, matching_report
    from ..single import motions as looked_at
    from ..tables.terminal import rendered

    shown = looked_at.read_motions(inputs)
    motions = shown.motions
    try:
        values = looked_at.measured(motions, damping)
        spectrum = None if target is None else TargetSpectrum.from_csv(target, damping)
    except ValueError as error:
        raise StudyError(str(error)) from None
    figures = looked_at.write_figures(motions, out, damping, spectrum)
    if json_:
        print(looked_at.measures_json(values, figures, shown))
        return
    console = terminal()
    tables = [looked_at.measures_table(values), *([looked_at.scenario_table(shown.ratios)] if shown.ratios else [])]
    for part in (part for table in tables for part in rendered(table, console.width)):
        console.print(part)
    say(console, *shown.read, *shown.lines)
    if spectrum is not None:
        misfit = matching_report(motions, spectrum).misfit_mean
        console.print(
            f"misfit to {spectrum.name}: {100 * float(misfit.mean()):.1f} % in the mean over periods and motions, "
            f"{100 * float(misfit.max()):.1f} % for the worst motion",
            highlight=False,
        )
    say(console, *(f"note: {doubt.sentence}" for doubt in shown.doubts))
    for figure in figures:
        console.print(f"figure: {figure}", highlight=False, markup=False, soft_wrap=True)


@app.command(name="catalogue", group=INPUTS)
def show_catalogue() -> None:
    """List the catalogue: sizes, slenderness, usual place, FEMA P-58 id, quality of the source."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    from ...models import catalogue
    from ...models.items import QUALITIES

    placed = (
        "wall: clear distance to a wall behind it as it is usually placed, unfixed (all of them judgement), where it "
        "does not stand free in the direction in which it tips; --placed, placed = true and catalogue.placed(name) "
        "take it\n"
    )
    table = Table(
        title="Contents: width (the smaller plan size) and height in m, slenderness α in rad",
        box=SIMPLE_HEAD,
        pad_edge=False,
        caption=placed + "quality: " + "; ".join(f"{letter} {meaning}" for letter, meaning in QUALITIES.items()),
        caption_justify="left",
    )
    table.add_column("name", no_wrap=True)
    for heading in ("width", "height", "α", "wall"):
        table.add_column(heading, justify="right")
    for heading in ("FEMA P-58", "quality"):
        table.add_column(heading)
    for name in catalogue:
        item = catalogue.item(name)
        block = item.block
        sizes = (f"{block.width:.3f}", f"{block.height:.3f}", f"{block.alpha:.3f}")
        wall = "free" if item.wall_gap is None else f"{1000.0 * item.wall_gap:.0f} mm"
        table.add_row(name, *sizes, wall, item.fema_p58 or "", item.quality)
    terminal().print(table)


@app.command(group=READ)
def export(
    result: Result,
    /,
    *,
    format_: Annotated[ExportFormat, Parameter(name="--format")],
    out: Path | None = None,
    model: str | None = None,
    with_modelling: Annotated[bool, Parameter(negative="")] = False,
    ids: str | None = None,
    verify: Verify = False,
) -> None:
    """Export curves or building contents to other programs.

    Parameters
    ----------
    format_
        pelicun (CSV and JSON), nrml (OpenQuake's XML), csv or xlsx (tables).
    out
        Folder for the files; default export in the folder of the results.
    model
        Label of one law, or the short name of a kind of laws; default all.
    with_modelling
        Include the study's modelling uncertainty in dispersions.
    ids
        Prefix of a building's ids for pelicun (NAME.001 …); default the names of its pieces.
    """
    from ..store.folder import result_file
    from .building_files import write_building_files
    from .export import PERFORMANCE, guessed_lines, kind_of, missing_lines, read_curves, write_curves
    from .piece_files import write_pieces

    result = result_file(result)
    folder = result.parent / "export" if out is None else out
    console = terminal()
    building = kind_of(result) == PERFORMANCE
    if ids is not None and not (building and format_ == "pelicun"):
        raise StudyError("--ids is of the pieces of a performance study, --format pelicun")
    if format_ == "xlsx" or (format_ in ("csv", "pelicun") and building):
        if with_modelling:
            raise StudyError("--with-modelling is of curves: rates and chances hold what their study says")
        if format_ == "pelicun":
            say(console, *write_building_files(result, folder, model, ids, verify))
            return
        with noted():
            written_file = write_pieces(result, folder, format_, model, verify)
        say(console, f"written: {written_file}")
        return
    curves = read_curves(result, model, verify, with_modelling)
    written = write_curves(curves, folder, format_)
    lines = [f"{counted(len(written.ids) - len(set(written.missing) & set(written.ids)), 'curve')} for {format_}"]
    lines += [*guessed_lines(curves), *missing_lines(written)]
    lines += [f"written: {path}" for path in written.paths]
    console.print("\n".join(lines), highlight=False, markup=False, soft_wrap=True)


@app.command(group=READ)
def report(
    result: Result,
    /,
    *,
    format_: Annotated[Literal["html", "md"] | None, Parameter(name="--format")] = None,
    out: Path | None = None,
    json: Annotated[bool, Parameter(negative="")] = False,
    verify: Verify = False,
) -> None:
    """Write the report of a study: answer, figures, actions, checks, appendix.

    Parameters
    ----------
    format_
        html (one file) or md (with PNGs); default by the file's ending, or html.
    out
        File or folder; default report.html in the folder of the results.
    json
        Print facts and tables as JSON; write no report.
    """
    from ..report.page import facts_json, write_report
    from ..store.folder import result_file

    if json:
        if format_ is not None or out is not None:
            raise StudyError("--json prints and writes no file: leave out --format and --out")
        with noted():
            sys.stdout.write(json_text(facts_json(result_file(result), verify), allow_nan=False) + "\n")
        return
    console = terminal()
    if format_ is None:
        format_ = "md" if out is not None and out.suffix == ".md" else "html"
    with console.status("drawing the figures"), noted():
        written = write_report(result_file(result), out, format_, verify)
    say(console, *(f"written: {path}" for path in written))


@app.command(group=READ)
def compare(
    a: Path,
    b: Path | None = None,
    /,
    *,
    laws: Annotated[tuple[str, str] | None, Parameter(negative_iterable="")] = None,
    out: Annotated[Path, Parameter(name=("--out", "--output"))] = Path("results/compare"),
    json: Annotated[bool, Parameter(negative="")] = False,
    verify: Verify = False,
) -> None:
    """Compare two results, or two laws of one: levels, rates and chances side by side.

    Shows which differences exceed the scatter between motions.

    Parameters
    ----------
    a
        First results: file, folder, or a study file with results in results/NAME.
    b
        Second results; not needed with --laws.
    laws
        A law of A and a law of B (label or short name), or two laws of A.
    out
        Folder for the page, comparison.csv and figures.
    json
        Print facts and tables as JSON.
    """
    from ..comparison.compare import compare as compared
    from ..comparison.ratios import REGISTER
    from ..facts.say import say as sentence_of
    from ..tables.terminal import rendered

    if b is None and laws is None:
        raise StudyError(f"{a}: name a second result to compare it with, or two of its laws with --laws")
    console = terminal(least=120)
    # (rates are computed, and not given)
    with console.status("fitting the curves again to resampled motions"), noted():
        comparison = compared(a, a if b is None else b, out, laws, verify)
    if json:
        sys.stdout.write(json_text(comparison.as_json, allow_nan=False) + "\n")
        return
    say(console, *comparison.head)
    for table in comparison.tables:
        console.print(*rendered(table, console.width), sep="\n", end="")
    say(console, *(sentence_of(fact, REGISTER) for fact in comparison.answer))
    say(console, *(f"note: {sentence_of(fact, REGISTER)}" for fact in comparison.notes))
    say(console, *(f"written: {path}" for path in comparison.written))


@app.command(group=INPUTS)
def schema(*, out: Path | None = None) -> None:
    """Print the JSON schema of study files: every key with its unit, default and meaning.

    Parameters
    ----------
    out
        File to write instead of printing.
    """
    from ...core.writing import write_bytes
    from ..file.json_schema import study_schema

    if out is None:
        sys.stdout.write(json_text(study_schema(), indent=2) + "\n")
        return
    with writing(out):
        write_bytes(out, (dumps(study_schema(), ensure_ascii=False, indent=2) + "\n").encode())


def _connect(address: str) -> Client:
    from distributed import Client

    if "://" not in address:
        raise StudyError(f"--scheduler {address!r}: must be an address such as tcp://10.0.0.1:8786")
    # the cluster's own log messages are replaced by one sentence of ours
    for name in [*logging.root.manager.loggerDict]:
        if name.partition(".")[0] in ("distributed", "asyncio", "tornado"):
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        return Client(address, timeout="10s", set_as_default=False)
    except (OSError, TimeoutError, ValueError, TypeError, ImportError) as error:
        raise StudyError(f"--scheduler {address}: cannot be reached ({error})") from None


def _show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    """Show a warning as a line of the command, without the place in the code that it came from."""
    print(f"toppling: {printable(str(message))}", file=sys.stderr)


def prepare_streams() -> None:
    """Prepare this process for the command: output that takes every text, and warnings as lines of the command."""
    write_anything()
    warnings.showwarning = _show_warning
    # (numba's on a value that it cannot read, followed by a traceback)
    warnings.filterwarnings("error", "Environment variable", RuntimeWarning)


def _least_limit(threads: int) -> int:
    """Return the limit on memory (ulimit -v, kB) below which libraries may end a study's process, or wait for ever.

    Measured of a study of 640 runs: LLVM and OpenBLAS abort or hang below 1.0 GB with 2 threads and 1.05 GB with 8.
    Each thread reserves some 72 MB (its heap and its stack).
    """
    return 1_150_000 + 72_000 * threads


def _out_of_memory() -> int:
    """Print that memory is not enough, and of what limit where there is one; return the exit code."""
    sentence = "not enough memory for this study; make it smaller"
    if limit := memory_limit():
        from dask.system import CPU_COUNT

        least = _least_limit(CPU_COUNT)
        does = f"allow at least {least}" if limit < least else "allow more, or make the study smaller"
        sentence = f"{limit} kB of memory (ulimit -v) are not enough; {does}"
    return _ended(sentence, EXIT_FAILED)


def _ended(sentence: str, code: int) -> int:
    """Print the sentence of an end and return its exit code."""
    print(f"toppling: {sentence}", file=sys.stderr)
    return code


def main(arguments: list[str] | None = None) -> int:
    """Entry point of the command; returns the exit code."""
    words = sys.argv[1:] if arguments is None else arguments
    try:
        for name, least in (("NUMBA_NUM_THREADS", 1), ("SOURCE_DATE_EPOCH", 0)):
            given = os.environ.get(name)
            if given is not None and not (given.strip().isdecimal() and int(given) >= least):
                raise RuntimeWarning(
                    f"Environment variable {name!r} must be a number of at least {least}, got {given!r}"
                )
        if words and words[0] in COMMANDS and 0 < memory_limit() < LEAST_OF_ANY:
            return _out_of_memory()
        app(arguments, exit_on_error=False, print_error=False)
        sys.stdout.flush()
    except CycloptsError as error:
        command = f"toppling {words[0]}" if words and words[0] in COMMANDS else "toppling"
        if isinstance(error, MissingArgumentError) and error.argument is not None and error.argument.required:
            needed = [argument.name for argument in app[words[0]].assemble_argument_collection() if argument.required]
            return _ended(f"usage: {command} {' '.join(needed)}", EXIT_INPUT)
        sentence = " ".join(str(error).split())
        return _ended(f"{printable(sentence)} (see {command} --help)", EXIT_INPUT)
    except OSError as error:
        if error.errno is None and memory_limit():  # (llvmlite's, of a library that there was no memory for)
            return _out_of_memory()
        return _ended(printable(_refused(error)), EXIT_INPUT)
    except RuntimeWarning as error:
        sentence = str(error).partition("\n")[0].rstrip(".")
        if not sentence.startswith("Environment variable"):
            raise
        return _ended(f"{printable(sentence)}; correct or unset it", EXIT_INPUT)
    except MemoryError:
        return _out_of_memory()
    except KeyboardInterrupt as error:
        # (`Interrupted` knows the number of its signal)
        code = EXIT_SIGNAL + int(getattr(error, "number", signal.SIGINT))
        return _ended(str(error) or INTERRUPTED.get(words[0] if words else "", "interrupted"), code)
    except (ValueError, RuntimeError) as error:
        return _code_of(error)
    return 0


def _refused(error: OSError) -> str:
    """Return the path that cannot be used, or the folder above it that may not be entered, or else the output."""
    path = error.filename
    if isinstance(error, PermissionError) and path is not None:
        path = next((folder for folder in reversed(Path(path).parents) if not os.access(folder, os.X_OK)), path)
    what = "output cannot be written" if path is None else f"{path}: cannot be used"
    return f"{what} ({system_reason(error)})"


def _code_of(error: ValueError | RuntimeError) -> int:
    """Print the sentence of an error of ours and return its exit code; another one is a fault here, and raised."""
    from ...fragility.runs.cluster import ClusterError
    from ...models.runs import EndlessRunError

    if isinstance(error, StudyError | EndlessRunError):
        return _ended(str(error), EXIT_INPUT)
    if isinstance(error, ClusterError):
        return _ended(f"{error}; what is finished is kept: run the same command again to go on", EXIT_FAILED)
    raise error
