"""The gallery: docs/motions.md and its figures, one section for each generator, pulse and source of floor motions.

`make gallery` runs it.  The code a section shows is the body of its function here, which made the figure.
"""

from __future__ import annotations

import inspect
import io
import sys
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from PIL import Image

from toppling import motions
from toppling.core.units import STANDARD_GRAVITY
from toppling.motions.arrays import records
from toppling.motions.intensity.cumulative import husid
from toppling.motions.intensity.peaks import velocity
from toppling.studies.plots.axes import COLOURS
from toppling.studies.single.motions import draw_spectra

HERE = Path(__file__).parent
SAMPLES = 3  # histories in a figure


class Section(NamedTuple):
    """A part of the page: its heading, what it is for, where its formula stands, and the function that makes it."""

    name: str
    purpose: str
    source: str
    make: Callable[[], xr.DataArray]

    @property
    def code(self) -> str:
        """The body of the function as a user would write it."""
        lines = inspect.getsource(self.make).splitlines()
        first = next(i for i, line in enumerate(lines) if line.startswith("def ")) + 1
        body = textwrap.dedent("\n".join(lines[first:])).replace("return ", "shaking = ")
        return f"from toppling import motions\n\n{body}"


SECTIONS: list[Section] = []


def section(name: str, purpose: str, source: str) -> Callable[[Callable[[], xr.DataArray]], Callable[[], xr.DataArray]]:
    """Put a function into the gallery."""

    def keep(make: Callable[[], xr.DataArray]) -> Callable[[], xr.DataArray]:
        SECTIONS.append(Section(name, purpose, source, make))
        return make

    return keep


@section(
    "kanai-tajimi",
    "Filtered white noise: the ground as one damped layer. For quick parameter studies of how frequency and strength "
    "matter; the long periods are crude.",
    "Tajimi (1960), A statistical method of determining the maximum response of a building structure "
    "during an earthquake, 2nd World Conference on Earthquake Engineering.",
)
def kanai_tajimi() -> xr.DataArray:
    envelope = motions.RiseStrongDecay(rise=3.0, strong_end=10.0, decay=0.3)
    generator = motions.KanaiTajimi(omega_g=15.7, xi_g=0.6, duration=20.0, envelope=envelope)
    return generator.sample(30, seed=1)


@section(
    "clough-penzien",
    "The same through a second, high-pass filter, so that velocity and displacement stay bounded: the one to start "
    "with, since velocity decides whether a block falls.",
    "Clough and Penzien (1993), Dynamics of Structures, 2nd ed., McGraw-Hill.",
)
def clough_penzien() -> xr.DataArray:
    envelope = motions.RiseStrongDecay(rise=3.0, strong_end=10.0, decay=0.3)
    generator = motions.CloughPenzien(omega_g=15.7, omega_f=0.785, duration=20.0, envelope=envelope)
    return generator.sample(30, seed=1)


@section(
    "evolutionary-kanai-tajimi",
    "A ground whose frequency drifts while it shakes, as soft soil does: long periods come late, when a block is "
    "already rocking.",
    "Fan and Ahmadi (1990), Nonstationary Kanai-Tajimi models for El Centro 1940 and Mexico City 1985 earthquakes, "
    "Probabilistic Engineering Mechanics 5, 171-181 (recalled).",
)
def evolutionary_kanai_tajimi() -> xr.DataArray:
    generator = motions.EvolutionaryKanaiTajimi(omega_g=(30.0, 6.0), xi_g=0.4, duration=25.0)
    return generator.sample(30, seed=1)


@section(
    "evolutionary-clough-penzien",
    "The drifting ground through the high-pass of Clough and Penzien: bounded velocity and displacement, and it can be "
    "fitted to a target (`fit`, `calibrate_pga`, `calibrate_arias`).",
    "Fan and Ahmadi (1990), and Clough and Penzien (1993), as above.",
)
def evolutionary_clough_penzien() -> xr.DataArray:
    generator = motions.EvolutionaryCloughPenzien(omega_g=(30.0, 6.0), xi_g=0.4, duration=25.0)
    return generator.sample(30, seed=1)


@section(
    "site-based",
    "Fully non-stationary motions with the strength, duration and frequencies that you say, or that a recorded motion "
    "has (`SiteBased.fit`): many more motions like one record.",
    "Rezaeian and Der Kiureghian (2008), A stochastic ground motion model with separable temporal and spectral "
    "nonstationarities, Earthquake Engineering and Structural Dynamics 37, 1565-1584.",
)
def site_based() -> xr.DataArray:
    generator = motions.SiteBased(arias=1.0, d5_95=12.0, t_mid=6.0, omega_mid=25.0, omega_slope=-0.6, zeta=0.25)
    return generator.sample(30, seed=1)


@section(
    "site-based-scenario",
    "Motions for a magnitude, distance, site and style of faulting; every motion draws its own strength, duration and "
    "frequencies, so the scatter is that of real earthquakes.",
    "Rezaeian and Der Kiureghian (2010), Simulation of synthetic ground motions for specified earthquake and site "
    "characteristics, Earthquake Engineering and Structural Dynamics 39, 1155-1180.",
)
def site_based_scenario() -> xr.DataArray:
    generator = motions.SiteBasedScenario(magnitude=7.0, distance=15e3, vs30=400.0, faulting="reverse")
    return generator.sample(30, seed=1)


@section(
    "near-fault",
    "Sites within some 30 km of the rupture, with the velocity pulse of rupture directivity: the shaking that "
    "overturns large, slender things.",
    "Dabaghi and Der Kiureghian (2017), Stochastic model for simulation of near-fault ground motions, Earthquake "
    "Engineering and Structural Dynamics 46, 963-984.",
)
def near_fault() -> xr.DataArray:
    generator = motions.NearFault(magnitude=7.0, distance=5e3, vs30=500.0, along=20e3, with_pulse="always")
    return generator.sample(30, seed=1)


@section(
    "seismological",
    "A point source, its path and the site by their physics: for regions without records, and for asking what stress "
    "drop, attenuation or soil would change.",
    "Boore (2003), Simulation of ground motion using the stochastic method, Pure and Applied Geophysics 160, 635-676; "
    "durations of Boore and Thompson (2014).",
)
def seismological() -> xr.DataArray:
    generator = motions.Seismological(magnitude=6.5, distance=20e3, stress_drop=8e6, kappa=0.04)
    return generator.sample(30, seed=1)


@section(
    "spectrum-compatible",
    "Motions whose response spectrum is a given one, a code's or a site's, with peak velocity and displacement kept "
    "near what that spectrum implies: matching alone would spoil them.",
    "Least change of acceleration that mends every oscillator peak, by time-reversed impulse responses, after "
    "Lilhanand and Tseng (1988), recalled.",
)
def spectrum_compatible() -> xr.DataArray:
    target = motions.TargetSpectrum.asce7_floor(s_ds=0.5, z_over_h=1.0).between(0.05, 4.0)
    generator = motions.SpectrumCompatible(target)
    return generator.sample(30, seed=1)


@section(
    "ac156",
    "Shake-table motions for qualifying equipment by ICC-ES AC156; `motions.ac156_acceptance` checks its rules. "
    "Nothing below 1.3 Hz is enforced, where the velocity that topples lives: it is matched here all the same.",
    "ICC-ES AC156 with ASCE 7-16, spectra as test laboratories publish them; the standards were not read.",
)
def ac156() -> xr.DataArray:
    generator = motions.AC156(s_ds=1.0, z_over_h=1.0)
    return generator.sample(30, seed=1)


@section(
    "rectangular",
    "Constant acceleration, then nothing: West's criterion and the simplest closed forms.",
    "Elementary; its length is π/ω, as the half-sine's.",
)
def rectangular() -> xr.DataArray:
    pulse = motions.RectangularPulse(amplitude=3.0, omega=6.0)
    return pulse.sample()


@section(
    "half-sine",
    "A push in one direction: Housner's classic overturning criterion.",
    "Housner (1963), The behavior of inverted pendulum structures during earthquakes, Bulletin of the Seismological "
    "Society of America 53, 403-417.",
)
def half_sine() -> xr.DataArray:
    pulse = motions.HalfSine(amplitude=3.0, omega=6.0)
    return pulse.sample()


@section(
    "one-cycle-sine",
    "A forward pulse of velocity: overturning spectra of blocks, without and with impact.",
    "Type A of Zhang and Makris (2001), Rocking response of free-standing blocks under cycloidal pulses, Journal of "
    "Engineering Mechanics 127, 473-483.",
)
def one_cycle_sine() -> xr.DataArray:
    pulse = motions.OneCycleSine(amplitude=3.0, omega=6.0)
    return pulse.sample()


@section(
    "one-cycle-cosine",
    "A forward-and-back pulse of velocity; the acceleration jumps at both ends.",
    "Type B of Zhang and Makris (2001), as above.",
)
def one_cycle_cosine() -> xr.DataArray:
    pulse = motions.OneCycleCosine(amplitude=3.0, omega=6.0)
    return pulse.sample()


@section(
    "ricker",
    "A smooth pulse of one dominant frequency that starts and ends at rest.",
    "Ricker (1943), Further developments in the wavelet theory of seismogram structure, Bulletin of the Seismological "
    "Society of America 33, 197-228.",
)
def ricker() -> xr.DataArray:
    pulse = motions.Ricker(amplitude=3.0, omega=6.0)
    return pulse.sample()


@section(
    "mavroeidis-papageorgiou",
    "The near-fault velocity pulse with a chosen amplitude, period, number of half cycles and phase.",
    "Mavroeidis and Papageorgiou (2003), A mathematical representation of near-fault ground motions, Bulletin of the "
    "Seismological Society of America 93, 1099-1131.",
)
def mavroeidis_papageorgiou() -> xr.DataArray:
    pulse = motions.MavroeidisPapageorgiou.of_velocity(velocity=0.8, period=2.0, gamma=2.5, nu=1.0)
    return pulse.sample()


@section(
    "floors",
    "What contents on upper floors feel: ground motions through an elastic building, which amplifies them at its own "
    "periods. Here one motion on the ground, at mid-height and on the roof of ten storeys; spectra of thirty.",
    "Miranda and Taghavi (2005), Approximate floor acceleration demands in multistory buildings. I: Formulation, "
    "Journal of Structural Engineering 131, 203-211; modes integrated exactly.",
)
def floors() -> xr.DataArray:
    building = motions.Building.flexural_shear(period=1.2, alpha0=8.0, storeys=10)
    ground = motions.SiteBased(arias=1.0, d5_95=12.0, t_mid=6.0).sample(30, seed=1)
    return building.floor_motions(ground, floors=[0, 5, 10])


def draw(shaking: xr.DataArray) -> Figure:
    """Three histories of acceleration and of velocity, and the spectra of all, one under the other."""
    figure = Figure(figsize=(4.6, 6.4), layout="constrained")
    above, middle, below = figure.subplots(3, 1, height_ratios=(1.0, 1.0, 1.35))
    shown = records(shaking)[:SAMPLES]
    histories = [one.acceleration / STANDARD_GRAVITY for one in shown]
    velocities = [velocity(one.acceleration, one.dt) for one in shown]
    # histories without their long quiet ends
    strong = [husid(one.acceleration, one.dt).searchsorted(0.999) * one.dt for one in shown]
    end = min(1.15 * max(strong), max(one.duration for one in shown))
    for ax, values, name in ((above, histories, "acceleration (g)"), (middle, velocities, "velocity (m/s)")):
        step = 1.6 * max(float(np.abs(one).max()) for one in values) if len(values) > 1 else 0.0
        for i, (record, one) in enumerate(zip(shown, values, strict=True)):
            time = np.arange(one.size) * record.dt
            ax.plot(time, one - i * step, lw=0.6 if len(values) > 1 else 1.6, color=COLOURS[i])
            if len(values) > 1:
                text = ("ground" if record.floor == "0" else f"floor {record.floor}") if record.floor else None
                ax.axhline(-i * step, lw=0.4, color="0.5", zorder=0)
                if text is not None and ax is above:
                    ax.text(end, -i * step + 0.3 * step, text, ha="right", fontsize=9, color=COLOURS[i])
        if len(values) > 1:  # one under the other: a bar says how large
            size = _round(step)
            ax.set_yticks([0.0, size], ["0", f"{size:g}"])
        ax.set_title(name, fontsize=10, loc="left")
        ax.set_xlim(0.0, end)
        ax.spines[["top", "right"]].set_visible(False)
    middle.set_xlabel("time (s)")
    draw_spectra(below, [shaking])
    if shaking.sizes["motion"] == 1:  # the section says which
        below.get_legend().remove()
    return figure


def _round(value: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above `value`."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(one for one in (1.0, 2.0, 5.0) if one * power <= value) * power)


def page(sections: list[Section]) -> str:
    """The page in Markdown."""
    parts = [
        "# Motions: a gallery\n\nEvery generator and pulse by the name that study files use, and floor motions: what "
        "it is for, where the formula stands, the code that made the figure, and the figure: acceleration and velocity "
        "of the first motions, one under the other to one scale, and spectra of all with their percentiles.\n\n`make "
        "gallery` makes this page, `toppling motions` the same figures of your own motions. Keys of study files: "
        "[study.md](study.md).\n"
    ]
    for one in sections:
        parts.append(
            f"## {one.name}\n\n{one.purpose}\n\n*Source:* {one.source}\n\n```python\n{one.code}\n```\n\n"
            f"![{one.name}: histories and spectra](motions/{one.name}.png)\n"
        )
    return "\n".join(parts)


def main(folder: Path = HERE, sections: list[Section] | None = None) -> None:
    """Write the page and its figures."""
    mpl.use("Agg")
    chosen = SECTIONS if sections is None else sections
    (folder / "motions").mkdir(parents=True, exist_ok=True)
    for one in chosen:
        picture = io.BytesIO()
        draw(one.make()).savefig(picture, dpi=120)
        # 64 colours are plenty for lines, and a third of the size
        Image.open(picture).convert("RGB").quantize(64).save(folder / "motions" / f"{one.name}.png", optimize=True)
    (folder / "motions.md").write_text(page(chosen), encoding="utf-8")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
