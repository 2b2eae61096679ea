"""The page docs/scenarios.md: generators of an earthquake's motions beside a ground-motion model.

`make scenarios` writes it (some minutes), with the text of docs/scenarios.md.in.
"""

from __future__ import annotations

from pathlib import Path

import xarray as xr

from toppling import motions
from toppling.motions import Generator, Scenario

HERE = Path(__file__).resolve().parent
NUMBER, SEED = 200, 1
MODEL = "BSSA14"
SHOWN = ("pga", "pgv", "Sa(0.1)", "Sa(0.3)", "Sa(1.0)", "Sa(2.0)", "Sa(4.0)")
SCENARIOS = (
    Scenario(6.5, 20e3, 760.0),
    Scenario(7.0, 25e3, 760.0),
    Scenario(7.2, 8e3, 400.0),
    Scenario(7.5, 40e3, 400.0),
)


def generators(at: Scenario) -> dict[str, Generator]:
    """The generators of a scenario by name."""
    found: dict[str, Generator] = {
        "site-based": motions.SiteBasedScenario(at.magnitude, at.distance, at.vs30, at.faulting),
        "seismological": motions.Seismological(at.magnitude, at.distance),
    }
    for pulse in ("always", "never"):
        found[f"near-fault, {pulse}"] = motions.NearFault(
            at.magnitude, at.distance, at.vs30, at.faulting, with_pulse=pulse
        )
    return found


def compared(generator: Generator, at: Scenario, number: int = NUMBER) -> xr.Dataset:
    """The motions of a generator over the model of a scenario."""
    return motions.over_model(generator.sample(number, seed=SEED), at, MODEL)


def rows(name: str, found: xr.Dataset) -> str:
    """Two lines of a table: ratios of medians, and dispersions."""
    of = found.sel(measure=list(SHOWN))
    ratios = " | ".join(f"{float(one):.2f}" for one in of["ratio"])
    spread = " | ".join(f"{float(one):.2f}" for one in of["dispersion"])
    return f"| {name}, median over {MODEL} | {ratios} |\n| {name}, dispersion | {spread} |\n"


def page(number: int = NUMBER) -> str:
    """The text of the page."""
    text = (HERE / "scenarios.md.in").read_text(encoding="utf-8").format(number=number, seed=SEED)
    for at in SCENARIOS:
        text += f"## M {at.magnitude:g}, {1e-3 * at.distance:g} km, {at.vs30:g} m/s\n\n"
        headings = ({"pga": "PGA", "pgv": "PGV"}.get(one, one) for one in SHOWN)
        text += f"| | {' | '.join(headings)} |\n|---{'|---' * len(SHOWN)}|\n"
        spread = None
        for name, generator in generators(at).items():
            found = compared(generator, at, number)
            text += rows(name, found)
            spread = found.sel(measure=list(SHOWN))["model_dispersion"]
        text += f"| {MODEL}, dispersion | {' | '.join(f'{float(one):.2f}' for one in spread)} |\n\n"
    return text.rstrip() + "\n"


if __name__ == "__main__":
    (HERE / "scenarios.md").write_text(page(), encoding="utf-8")
