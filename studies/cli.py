"""The `toppling` command: arguments in, exit codes out.

0 done, 1 out of memory, 2 wrong input (one sentence on standard error), 130 interrupted.  Never a traceback for a
user's mistake.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from itertools import product
from json import dumps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import xarray as xr
from cyclopts import App, Parameter
from cyclopts.exceptions import CycloptsError
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from ..models import catalogue
from ..models.catalogue import QUALITIES
from ..models.runs import prepare
from .progress import show_progress
from .store import RESULT_NAME
from .study import Study
from .tables import StudyError

if TYPE_CHECKING:
    from distributed import Client

EXIT_MEMORY = 1
EXIT_INPUT = 2
EXIT_INTERRUPTED = 130
FIGURE_NAME = "fragility.png"

app = App(
    name="toppling",
    help="How likely is this block to fall over in an earthquake?",
    help_format="plaintext",
    result_action="return_value",
    suppress_keyboard_interrupt=False,
)


@app.command
def run(
    study: Path,
    *,
    out: Annotated[Path | None, Parameter(help="Folder for the results; results/NAME where not given.")] = None,
    scheduler: Annotated[str | None, Parameter(help="Address of a dask scheduler, tcp://host:port.")] = None,
    fresh: Annotated[bool, Parameter(negative="", help="Compute again, and replace what that folder holds.")] = False,
) -> None:
    """Run a study: print its table, write results.nc and fragility.png.

    Finished results of the same study in that folder are kept, not computed again; docs/study.md lists every key.

    Parameters
    ----------
    study
        The study file (TOML).
    """
    console = _console()
    folder = out if out is not None else Path("results") / study.stem
    plan = Study.from_toml(study)
    console.print(
        f"{plan.title}: {plan.words}",
        highlight=False,
        markup=False,
        soft_wrap=True,
    )
    for note in plan.notes:
        console.print(f"note: {note}", highlight=False, markup=False, soft_wrap=True)
    client = None if scheduler is None else _connect(scheduler)
    if client is None:
        with console.status("loading the engine (compiled once after installation, some 20 s)"):
            prepare([plan.first])
    try:
        with show_progress(console, "runs", plan.work) as progress:
            results = plan.run(folder, client, resume=not fresh, progress=progress)
    finally:
        if client is not None:
            client.close()
    console.print(fragility_table(results))
    for hint in _hints(results):
        console.print(hint, highlight=False, markup=False, soft_wrap=True)
    for note in str(results.attrs.get("notes", "")).splitlines():
        if note not in plan.notes:  # said before
            console.print(f"note: {note}", highlight=False, markup=False, soft_wrap=True)
    figure = _draw(results, folder / FIGURE_NAME)
    console.print(f"results: {folder / RESULT_NAME}\nfigure:  {figure}", highlight=False, markup=False, soft_wrap=True)


@app.command(name="motions")
def look_at_motions(
    inputs: Annotated[list[str], Parameter(negative_iterable="")],
    /,
    *,
    out: Annotated[Path, Parameter(help="Folder for the figures.")] = Path("results/motions"),
    json_: Annotated[
        bool, Parameter(name="--json", negative="", help="Print every measure of every motion as JSON, no table.")
    ] = False,
    damping: Annotated[float, Parameter(help="Damping ratio of the spectra.")] = 0.05,
    target: Annotated[
        Path | None, Parameter(help="CSV of a spectrum to hold them against: period (s) or frequency (Hz), sa (unit).")
    ] = None,
) -> None:
    """Look at motions: print their measures, draw histories.png, spectra.png and husid.png.

    Parameters
    ----------
    inputs
        One study file (TOML), or record files: paths or patterns.
    """
    from ..motions import TargetSpectrum, matching_report  # noqa: PLC0415 - not for every command
    from .look import draw_motions, measured, measures_json, measures_table, read_motions  # noqa: PLC0415 - matplotlib

    motions = read_motions(inputs)
    try:
        values = measured(motions, damping)
        spectrum = None if target is None else TargetSpectrum.from_csv(target, damping)
    except ValueError as error:
        raise StudyError(str(error)) from None
    figures = draw_motions(motions, out, damping, spectrum)
    if json_:
        print(measures_json(values, figures))
        return
    console = _console()
    console.print(measures_table(values))
    if spectrum is not None:
        misfit = matching_report(motions, spectrum).misfit_mean
        console.print(
            f"misfit to {spectrum.name}: {100 * float(misfit.mean()):.1f} % in the mean over periods and motions, "
            f"{100 * float(misfit.max()):.1f} % for the worst motion",
            highlight=False,
        )
    for figure in figures:
        console.print(f"figure: {figure}", highlight=False, markup=False, soft_wrap=True)


@app.command(name="catalogue")
def show_catalogue() -> None:
    """List the catalogue of real contents: sizes, slenderness, FEMA P-58 id and quality of the source."""
    table = Table(
        title="Contents: width (the smaller plan size) and height in m, slenderness α in rad",
        box=SIMPLE_HEAD,
        pad_edge=False,
        caption="quality: " + "; ".join(f"{letter} {meaning}" for letter, meaning in QUALITIES.items()),
        caption_justify="left",
    )
    table.add_column("name", no_wrap=True)
    for heading in ("width", "height", "α"):
        table.add_column(heading, justify="right")
    for heading in ("FEMA P-58", "quality"):
        table.add_column(heading)
    for name in catalogue:
        item = catalogue.item(name)
        block = item.block
        sizes = (f"{block.width:.3f}", f"{block.height:.3f}", f"{block.alpha:.3f}")
        table.add_row(name, *sizes, item.fema_p58 or "", item.quality)
    _console().print(table)


@app.command
def bench(
    *,
    out: Annotated[Path, Parameter(help="Folder for performance.md and its figures.")] = Path("results/bench"),
    parts: Annotated[
        str, Parameter(help="What to measure, with commas: speed, skipping, scale, precision, flags.")
    ] = "speed,skipping,scale,precision,flags",
    full: Annotated[bool, Parameter(negative="", help="The slowest rivals as well.")] = False,
    json: Annotated[bool, Parameter(negative="", help="Print all figures as JSON instead of tables.")] = False,
) -> None:
    """Measure the engine beside other integrators, against a 40-digit truth; some 6 minutes (--full: some 25)."""
    from ..benchmarks import page, suite  # noqa: PLC0415 - compiled rivals and peers load only here

    try:
        chosen = suite.parts_of(parts)
    except ValueError as error:
        raise StudyError(f"--parts {parts}: {error}") from None
    out.mkdir(parents=True, exist_ok=True)
    log = Console(stderr=True)
    with log.status("") as status:
        tell = status.update if log.is_terminal else log.print
        results = suite.run(chosen, full, lambda part: tell(f"measuring: {part}"))
    written = page.write(results, out)
    if json:
        sys.stdout.write(dumps(results, ensure_ascii=False, allow_nan=False) + "\n")
        return
    console = _console(least=120)
    for table in page.summary(results):
        console.print(_plain_table(table.title, table.headings, table.rows))
    console.print("\n".join(f"written: {path}" for path in written), highlight=False, markup=False, soft_wrap=True)


def _plain_table(title: str, headings: Sequence[str], rows: Sequence[Sequence[str]]) -> Table:
    """Text in the first column, figures in the others."""
    table = Table(title=title, box=SIMPLE_HEAD, pad_edge=False, title_justify="left")
    for i, heading in enumerate(headings):
        table.add_column(heading, justify="right" if i else "left", overflow="fold", no_wrap=not i)
    for row in rows:
        table.add_row(*(escape(cell) for cell in row))
    return table


# What to do where there is no curve, by the status of the fit.
_ADVICE = {
    "no overturning": "nothing fell at any level: raise ida.levels.to",
    "all overturned": "everything fell at every level: lower ida.levels.from",
    "separated": "no two levels with both standing and fallen blocks: take more motions or closer levels",
    "one level": "one level gives no curve: take more levels",
    "not increasing": "falls do not grow with the level: look at the motions",
    "flat": "falls hardly grow with the level: take more motions or a wider range of levels",
    "not converged": "the likelihood has no clear maximum: take more motions",
}


def _hints(results: xr.Dataset) -> list[str]:
    """One line for each reason why a curve is missing."""
    found = dict.fromkeys(str(status) for status in results["status"].values.ravel())
    return [f"{status}: {_ADVICE[status]}" for status in found if status in _ADVICE]


def _console(least: int = 100) -> Console:
    """The terminal, or at least so many columns where the output goes elsewhere."""
    console = Console()
    return console if console.is_terminal else Console(width=max(least, console.width))


def fragility_table(results: xr.Dataset) -> Table:
    """Medians and dispersions of a study's curves, with intervals, for a terminal."""
    from .plots import display_unit, floor_name  # noqa: PLC0415 - matplotlib loads slowly and is not needed for an error message

    scale, unit = display_unit(results["level"])
    name = results["level"].attrs.get("long_name", "level")
    percent = f"{100.0 * float(results.attrs['confidence']):g} %"
    table = Table(
        title=f"Median {name}{f' ({unit})' if unit else ''} and dispersion β with {percent} intervals",
        box=SIMPLE_HEAD,
        pad_edge=False,
        title_justify="left",
    )
    for heading in ("law", "median", percent, "β", percent):
        table.add_column(heading, justify="left" if heading == "law" else "right", overflow="fold")
    floors = results["floor"].values.tolist() if "floor" in results.dims else [None]
    for i, (k, floor) in product(range(results.sizes["block"]), enumerate(floors)):
        where = "" if floor is None else f", {floor_name(floor)}"
        table.add_row(f"[bold]{escape(str(results['block'].values[i]) + where)}[/]")
        for j, model in enumerate(results["model"].values):
            one = results.isel(block=i, model=j)
            if floor is not None:
                one = one.isel(floor=k)
            if bool(one["converged"]):
                median, low, high = (one[f"median{end}"].item() / scale for end in ("", "_lower", "_upper"))
                beta, narrow, wide = (one[f"dispersion{end}"].item() for end in ("", "_lower", "_upper"))
                cells = (f"{median:.3f}", f"{low:.3f}–{high:.3f}", f"{beta:.3f}", f"{narrow:.3f}–{wide:.3f}")
            else:
                cells = ("", f"[italic]{one['status'].item()}[/]", "", "")
            table.add_row(f" {escape(str(model))}", *cells, end_section=j == results.sizes["model"] - 1)
    return table


def _draw(results: xr.Dataset, path: Path) -> Path:
    import matplotlib as mpl  # noqa: PLC0415 - loads slowly and is not needed for an error message

    mpl.use("Agg")
    from matplotlib import pyplot as plt  # noqa: PLC0415

    from .plots import fragility_figure  # noqa: PLC0415

    figure = fragility_figure(results)
    try:
        figure.savefig(path, dpi=150)
    except OSError as error:
        raise StudyError(f"{path}: cannot be written ({error.strerror or error})") from None
    finally:
        plt.close(figure)
    return path


def _connect(address: str) -> Client:
    from distributed import Client  # noqa: PLC0415 - the cluster code loads only where there is a cluster

    try:
        return Client(address, timeout="10s", set_as_default=False)
    except (OSError, TimeoutError, ValueError, ImportError) as error:
        raise StudyError(f"--scheduler {address}: cannot be reached ({error})") from None


def main(arguments: list[str] | None = None) -> int:
    """Entry point of the command; returns the exit code."""
    try:
        app(arguments, exit_on_error=False, print_error=False)
    except CycloptsError as error:
        sentence = " ".join(str(error).split())
        given = sys.argv[1:] if arguments is None else arguments
        command = (
            f"toppling {given[0]}" if given and given[0] in ("run", "motions", "catalogue", "bench") else "toppling"
        )
        print(f"toppling: {sentence} (see {command} --help)", file=sys.stderr)
        return EXIT_INPUT
    except StudyError as error:
        print(f"toppling: {error}", file=sys.stderr)
        return EXIT_INPUT
    except OSError as error:
        print(f"toppling: output cannot be written ({error.strerror or error})", file=sys.stderr)
        return EXIT_INPUT
    except MemoryError:
        print("toppling: not enough memory for this study; make it smaller", file=sys.stderr)
        return EXIT_MEMORY
    except KeyboardInterrupt:
        print("toppling: interrupted, no results written", file=sys.stderr)
        return EXIT_INTERRUPTED
    return 0


if __name__ == "__main__":
    sys.exit(main())
