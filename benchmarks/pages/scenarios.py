"""The page docs/scenarios.md: generators of an earthquake's motions beside a ground-motion model."""

from __future__ import annotations

import xarray as xr

from ... import motions
from ...motions import Generator, Scenario
from .page import some, template, write
from .tables import table

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


def cells(found: xr.Dataset, name: str) -> list[str]:
    """Return a variable of a comparison as cells of a row."""
    return [f"{value:.2f}" for value in found[name].sel(measure=list(SHOWN)).values]


def rows(name: str, found: xr.Dataset) -> list[tuple[str, ...]]:
    """Return the ratios of medians, and dispersions."""
    return [
        (f"{name}, median over {MODEL}", *cells(found, "ratio")),
        (f"{name}, dispersion", *cells(found, "dispersion")),
    ]


def head(at: Scenario) -> str:
    """Return the heading of a scenario."""
    return f"## M {at.magnitude:g}, {1e-3 * at.distance:g} km, {at.vs30:g} m/s\n"


def main() -> None:
    """Write the page."""
    parts = [template("scenarios").format(number=NUMBER, seed=SEED)]
    headings = ("", *({"pga": "PGA", "pgv": "PGV"}.get(measure, measure) for measure in SHOWN))
    for at in SCENARIOS:
        found = {name: compared(generator, at) for name, generator in generators(at).items()}
        lines = [row for name, one in found.items() for row in rows(name, one)]
        model = cells(found["site-based"], "model_dispersion")
        parts.append(f"{head(at)}\n{table(headings, [*lines, (f'{MODEL}, dispersion', *model)])}\n")
    write("scenarios", "\n\n".join(part.strip() for part in parts) + "\n")
