"""The page docs/scenarios.md: generators of an earthquake's motions beside a ground-motion model."""

from __future__ import annotations

from collections.abc import Sequence

import xarray as xr

from ... import motions
from ...motions import Generator, Scenario
from .page import some, template, write, write_csv
from .tables import body, span

NUMBER, SEED = some(200), 1
MODEL = "BSSA14"
SHOWN = ("pga", "pgv", "Sa(0.1)", "Sa(0.3)", "Sa(1.0)", "Sa(2.0)", "Sa(4.0)")
SCENARIOS = (
    Scenario(6.5, 20e3, 760.0),
    Scenario(7.0, 25e3, 760.0),
    Scenario(7.2, 8e3, 400.0),
    Scenario(7.5, 40e3, 400.0),
)


def generators(at: Scenario) -> dict[str, Generator]:
    """Return the generators of a scenario by name."""
    site = (at.magnitude, at.distance, at.vs30, at.faulting)
    return {
        "site-based": motions.SiteBasedScenario(*site),
        "seismological": motions.Seismological(at.magnitude, at.distance),
        "near-fault, always": motions.NearFault(*site, with_pulse="always"),
        "near-fault, never": motions.NearFault(*site, with_pulse="never"),
    }


def compared(generator: Generator, at: Scenario) -> xr.Dataset:
    """Return the motions of a generator over the model of a scenario."""
    return motions.over_model(generator.sample(NUMBER, seed=SEED), at, MODEL)


def cells(comparison: xr.Dataset, name: str) -> list[str]:
    """Return a variable of a comparison as cells of a row."""
    return [f"{value:.2f}" for value in comparison[name].sel(measure=list(SHOWN)).values]


def rows(at: Scenario, name: str, comparison: xr.Dataset) -> list[tuple[str, ...]]:
    """Return the ratios of medians, and dispersions."""
    return [(words(at), name, quantity, *cells(comparison, quantity)) for quantity in ("ratio", "dispersion")]


def words(at: Scenario) -> str:
    """Return a scenario in words."""
    return f"M {at.magnitude:g}, {1e-3 * at.distance:g} km, {at.vs30:g} m/s"


def main() -> None:
    """Write the page and its table of all measures."""
    comparisons = [{name: compared(generator, at) for name, generator in generators(at).items()} for at in SCENARIOS]
    lines = []
    for at, by_name in zip(SCENARIOS, comparisons, strict=True):
        lines += [row for name, comparison in by_name.items() for row in rows(at, name, comparison)]
        lines.append((words(at), MODEL, "dispersion", *cells(by_name["site-based"], "model_dispersion")))
    write_csv("scenarios", "ratios", ("scenario", "generator", "quantity", *SHOWN), lines)
    write("scenarios", page(lines))


def page(lines: Sequence[Sequence[str]]) -> str:
    """Return the page of the rows of its file."""
    pgv = {tuple(line[:3]): line[3 + SHOWN.index("pgv")] for line in lines}
    names = list(dict.fromkeys(line[1] for line in lines if line[1] != MODEL))
    scenarios = [words(at) for at in SCENARIOS]
    ratios = {name: [float(pgv[at, name, "ratio"]) for at in scenarios] for name in names}
    shown = [
        (name, *(f"{pgv[at, name, 'ratio']} ({pgv[at, name, 'dispersion']})" for at in scenarios)) for name in names
    ]
    most = max(max(float(cell), 1.0 / float(cell)) for line in lines if line[2] == "ratio" for cell in line[3:])
    return template("scenarios").format(
        number=NUMBER,
        seed=SEED,
        most=f"{most:.0f}",
        heads=" | ".join(scenarios),
        rule="---|" * len(scenarios),
        table=body(shown),
        model=pgv[scenarios[0], MODEL, "dispersion"],
        **{name.split(", ")[-1].replace("-", "_"): span(values) for name, values in ratios.items()},
    )
