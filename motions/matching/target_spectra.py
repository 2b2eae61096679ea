"""Target response spectra for motions: from numbers, from a table, and from American codes."""

import math
import os
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import numpy as np

from ...core import checks
from ...core.doubts import Doubt, warn
from ...core.elementary import Array, exp, geomspace, log
from ...core.parameters import SHARE, Parameter
from ...core.units import DAMPING, STANDARD_GRAVITY
from ..intensity.spectra import damping_of, period_of, spectrum_doubts
from ..plausibility import unusual
from ..readers.lines import Lines, RecordError, is_blank, is_comment, plain
from ..readers.units import agreed, quantities, unit_factor, unit_of, units_in

S_DS = Parameter("g", above=0.0, at_most=10.0)
EDITIONS = ASCE_16, ASCE_22 = "7-16", "7-22"
AC156_FREQUENCIES = (0.1, 1.3, 8.3, 33.3)  # Hz
LARGEST_SA = 1e3  # m/s²
SMALLEST_SA = 1e-9
SHORT = 0.3
"""A period, s, on the plateau of most spectra."""
CEILING = 1.6  # of S_DS: the maximum flexible acceleration
AMPLIFIED = Parameter(at_least=1.0, at_most=10.0)
RESPONSE_REDUCTION = 1.3  # R_mu of an unknown building; 1 at or below grade


@dataclass(frozen=True)
class TargetSpectrum:
    """Spectrum of pseudo-acceleration, linear between its points on log-log axes.

    Parameters
    ----------
    periods : sequence of float, shape (point,)
        Periods, s, 1e-3 to 1e3, at least two, increasing.
    sa : sequence of float, shape (point,)
        Pseudo-acceleration at each, m/s², > 0.
    damping : float
        Damping ratio of the oscillators, 0.005 to 0.5.
    name : str
        Name of the spectrum in labels.

    Examples
    --------
    >>> target = TargetSpectrum((0.1, 1.0), (1.0, 10.0))
    >>> round(float(target.at(0.316227766)), 6)
    3.162278
    """

    periods: tuple[float, ...] = field(repr=False)
    sa: tuple[float, ...] = field(repr=False)
    damping: float = DAMPING
    name: str = "spectrum"

    def __post_init__(self) -> None:
        axis = checks.finite_array("periods", self.periods, unit="s")
        values = checks.finite_array("sa", self.sa, unit="m/s²")
        if axis.size != values.size or axis.size < 2:
            raise ValueError(f"a spectrum needs two or more points, got {axis.size} periods and {values.size} of sa")
        for value in axis:
            period_of("periods", float(value))
        if not np.all(np.diff(axis) > 0.0):
            raise ValueError("periods of a spectrum must increase, each once")
        for value in values:
            checks.number("sa", float(value), at_least=SMALLEST_SA, at_most=LARGEST_SA, unit="m/s²")
        checks.number("damping", damping_of(self.damping), at_least=0.005, at_most=0.5)
        # (a target is a table, whose warnings reading a study keeps)
        warn(doubt._replace(kind="table") for doubt in spectrum_doubts(self.name, float(axis[0]), self.damping))
        if axis[0] <= SHORT <= axis[-1]:  # (a part at long periods has no plateau)
            warn(unusual({"peak of a target spectrum": values.max() / STANDARD_GRAVITY}, "table"))
        object.__setattr__(self, "periods", tuple(axis.tolist()))
        object.__setattr__(self, "sa", tuple(values.tolist()))

    def at(self, periods: Any) -> Array:
        """Return the pseudo-acceleration (m/s²) at `periods` (s, any shape); ValueError outside the spectrum."""
        axis = np.asarray(periods, dtype=np.float64)
        low, high = self.periods[0], self.periods[-1]
        # a point of a grid may lie beyond the end by rounding
        if not np.all((axis >= low * (1.0 - 1e-9)) & (axis <= high * (1.0 + 1e-9))):
            raise ValueError(f"periods must lie within those of the spectrum, {low:g} to {high:g} s")
        return exp(np.interp(log(axis), log(self.periods), log(self.sa)))

    def between(self, shortest: float, longest: float) -> Self:
        """Return the part from period `shortest` to `longest` (s), both within the spectrum."""
        first, last = period_of("shortest", shortest), period_of("longest", longest)
        if not first < last:
            raise ValueError(f"shortest must be below longest, got {first:g} and {last:g} s")
        axis = np.array([first, *(t for t in self.periods if first < t < last), last])
        return type(self)(tuple(axis.tolist()), tuple(self.at(axis).tolist()), self.damping, self.name)

    def scaled(self, factor: float) -> Self:
        """Return the spectrum times `factor` > 0."""
        size = checks.number("factor", factor, above=0.0)
        return type(self)(self.periods, tuple(size * value for value in self.sa), self.damping, self.name)

    def grid(self, per_octave: int = 8) -> Array:
        """Return periods that are evenly spaced over octaves, both ends included, s, increasing."""
        count = checks.count("per_octave", per_octave, at_least=1)
        octaves = math.log2(self.periods[-1] / self.periods[0])
        return geomspace(self.periods[0], self.periods[-1], max(2, math.ceil(octaves * count - 1e-9) + 1))

    @classmethod
    def from_csv(cls, path: str | os.PathLike[str], damping: float = DAMPING) -> Self:
        """Read a spectrum from a table of two columns, separated by commas, semicolons, tabs or blanks.

        One heading line is required and must name both columns with their units: ``period (s)`` or ``frequency (Hz)``,
        and ``sa (g)``, ``sa (m/s2)``, ``sa (cm/s2)``.  Rows may be in either order.  A zero period is an error, because
        it has no place on a logarithmic axis.  Comments (#) above must not name another damping or quantity.

        Raises
        ------
        RecordError
            A file that cannot be read, no heading, a missing or unknown unit, a row that is not two numbers, values out
            of range.
        """
        with Lines(path) as read:
            file = read.file
            every = [(read.number, line.strip()) for line in read if not is_blank(line)]
        lines = [(number, line) for number, line in every if not is_comment(line)]
        comments = [(number, line) for number, line in every if is_comment(line)]
        heading = _HEADING.fullmatch(lines[0][1]) if lines else None
        if heading is None:
            shown = lines[0][1][:40] if lines else ""
            raise RecordError(
                f"{file}: its first line must name two columns with units, as 'period (s), sa (g)' or "
                f"'frequency (Hz), sa (m/s2)', got {shown!r}"
            )
        factor = unit_factor(heading["unit"])
        if factor is None:
            raise RecordError(f"{file}: unit of sa must be g, gal, cm/s2 or m/s2, got {heading['unit']!r}")
        agreed(
            file,
            [
                unit_of(heading["unit"], lines[0][0]),
                *(unit for at, text in comments for unit in units_in(text, at)),
            ],
        )
        doubt_spectrum(file, every, damping)
        for number, text in comments:
            if _OTHER_SPECTRUM.search(text) and "acceleration" not in quantities(text):
                raise RecordError(f"{file}: line {number} says {plain(text, 60)!r}: no spectrum of acceleration")
            if other_damping(text, damping):
                raise RecordError(
                    f"{file}: line {number} says {plain(text, 60)!r}, the spectrum is matched with a damping of "
                    f"{damping:g}: give damping, or a spectrum of it"
                )
        axis_is_frequency = heading["axis"].lower().startswith("f")
        if heading["axis_unit"].lower() != ("hz" if axis_is_frequency else "s"):
            raise RecordError(f"{file}: unit of a period must be s and of a frequency Hz, got {heading['axis_unit']!r}")
        rows: list[tuple[float, float]] = []
        for number, line in lines[1:]:
            try:
                x, y = (float(word) for word in re.split(r"[,;\s]+", line.strip(",; \t")))
            except ValueError:
                raise RecordError(f"{file}: line {number} must be two numbers, got {line[:30]!r}") from None
            if not (math.isfinite(x) and x > 0.0 and math.isfinite(y) and y > 0.0):
                raise RecordError(f"{file}: line {number} must hold finite numbers > 0, got {line[:30]!r}")
            rows.append((1.0 / x if axis_is_frequency else x, y * factor))
        rows.sort()
        try:
            return cls(tuple(x for x, _ in rows), tuple(y for _, y in rows), damping, file.name)
        except ValueError as error:
            raise RecordError(f"{file}: {error}") from None

    @classmethod
    def ac156(
        cls,
        s_ds: float,
        z_over_h: float = 0.0,
        edition: str = ASCE_16,
        h_f: float | None = None,
        r_mu: float | None = None,
        vertical: bool = False,
    ) -> Self:
        """Return the required response spectrum of ICC-ES AC156 for shake-table tests of nonstructural components.

        Parameters
        ----------
        s_ds : float
            Design spectral acceleration S_DS at short periods, in g as ASCE 7 writes it, above 0 to 10.
        z_over_h : float
            Height of attachment over mean roof height, 0 to 1.
        edition : {"7-16", "7-22"}
            ASCE 7 edition that the criteria refer to.
        h_f, r_mu : float, optional
            Amplification with height and reduction by the building's ductility, >= 1, for 7-22 only; 1 + 2.5 z/h and
            1.3 (1 at z/h = 0) if not given.
        vertical : bool
            True for the vertical spectrum, which does not depend on height.

        Notes
        -----
        5 % damping.  Constant A_FLX from 1.3 to 8.3 Hz, log-log linear to A_RIG at 33.3 Hz and to A_FLX/10 at 0.1 Hz.
        7-16: A_FLX = S_DS (1 + 2 z/h) <= 1.6 S_DS, A_RIG = 0.4 S_DS (1 + 2 z/h).
        7-22: A_FLX = S_DS H_f/R_mu <= 1.6 S_DS, A_RIG = 0.4 S_DS H_f/R_mu <= 1.6 S_DS.
        Vertical: 0.67 S_DS and 0.27 S_DS.

        References
        ----------
        ICC Evaluation Service. AC156: Acceptance criteria for seismic certification by shake-table testing of
        nonstructural components.  Formulas as test-laboratory software states them; the document itself was not read.
        R_mu = 1 at grade is ASCE 7-22's, by the same software.

        Examples
        --------
        >>> target = TargetSpectrum.ac156(s_ds=1.0, z_over_h=0.0)
        >>> [round(float(a) / 9.80665, 6) for a in target.at([1 / 33.3, 1 / 8.3, 1 / 1.3, 10.0])]
        [0.4, 1.0, 1.0, 0.1]
        """
        design = S_DS.number("s_ds", s_ds)
        height = SHARE.number("z_over_h", z_over_h)
        checks.choice("edition", edition, EDITIONS)
        if edition == ASCE_16 and not (h_f is None and r_mu is None):
            raise ValueError(f"h_f and r_mu belong to edition {ASCE_22!r}, got one with {ASCE_16!r}")
        if vertical:
            flexible, rigid = 0.67 * design, 0.27 * design
        else:
            ratio = 1.0 + 2.0 * height if edition == ASCE_16 else _amplification(height, h_f, r_mu)
            flexible = min(CEILING * design, design * ratio)
            rigid = min(CEILING * design, 0.4 * design * ratio)
        text = ", vertical" if vertical else f", z/h {height:g}"
        sa = tuple(STANDARD_GRAVITY * value for value in (rigid, flexible, flexible, 0.1 * flexible))
        periods = tuple(1.0 / f for f in reversed(AC156_FREQUENCIES))
        return cls(periods, sa, DAMPING, f"AC156 with ASCE {edition}, S_DS {design:g} g{text}")

    @classmethod
    def asce7_floor(
        cls, s_ds: float, z_over_h: float, t_a: float | None = None, r_mu: float | None = None, h_f: float | None = None
    ) -> Self:
        """Return a floor spectrum from the peak floor acceleration of ASCE 7-22, section 13.3.

        The standard gives this peak, 0.4 S_DS H_f/R_mu, and a force F_p whose component factor C_AR is one number for a
        component, not a spectrum over periods. The *shape* is therefore AC156's: A_RIG is the peak floor acceleration
        and A_FLX is 2.5 times A_RIG, at most 1.6 S_DS.

        Parameters
        ----------
        s_ds, z_over_h : float
            As in `ac156`.
        t_a : float, optional
            Approximate fundamental period of the building, s, > 0; if not given, H_f = 1 + 2.5 z/h.
        r_mu : float, optional
            Reduction by the building's ductility, max(1.3, sqrt(1.1 R/(I_e Omega_0))); 1.3 if not given, 1 at grade.
        h_f : float, optional
            H_f itself, instead of `t_a`.

        Notes
        -----
        H_f = 1 + a1 (z/h) + a2 (z/h)^10, a1 = min(1/T_a, 2.5), a2 = max(1 - (0.4/T_a)², 0).

        References
        ----------
        ASCE/SEI 7-22 (2022). Minimum design loads and associated criteria for buildings and other structures, section
        13.3; formulas from code-checking software, the standard itself was not read.

        Examples
        --------
        >>> roof = TargetSpectrum.asce7_floor(s_ds=1.0, z_over_h=1.0, t_a=0.4)
        >>> round(roof.sa[0] / 9.80665, 6)
        1.076923
        """
        height = SHARE.number("z_over_h", z_over_h)
        if t_a is not None:
            if h_f is not None:
                raise ValueError("either t_a or h_f may be given, got both")
            period = checks.number("t_a", t_a, above=0.0, at_most=100.0, unit="s")
            h_f = 1.0 + min(1.0 / period, 2.5) * height + max(1.0 - (0.4 / period) ** 2, 0.0) * height**10
        spectrum = cls.ac156(s_ds, height, ASCE_22, h_f, r_mu)
        text = f"ASCE 7-22 floor, S_DS {s_ds:g} g, z/h {height:g}" + (f", T_a {t_a:g} s" if t_a is not None else "")
        return cls(spectrum.periods, spectrum.sa, spectrum.damping, text)


_UNLIKE_GROUND = re.compile(
    r"(?i)\bverti[ck]al\w*(?!\W*(?:no|excluded))\b|(?<!not )\bnorm(?:ali[sz][ée]|iert)\w*|\bp?s[ae] ?/ ?(?:pga|a_?g)"
    r"|\bsve\b|\bdimensionless|\binelastic|\bbehaviou?r factor|\breduced by|\bq ?= ?[1-9]|\blog_?10|\bcomponent\W+z\b"
    r"|\bbase[- ]?10\b|\bdecadic|(?:to|must|should) be (?:multipli|scal)ed\b[^#;,]{0,20}|\beta\W{0,3}0?\.\d+"
)
_OTHER_SPECTRUM = re.compile(r"displacement|velocity|\bp?s_?[dv]\b", re.IGNORECASE)
_DAMPING = re.compile(
    r"(?i)(?:damp|dämpf|amorti|smorz)\w*(?: ratio)?\s*(?:of|is|[:=])?\s*(?P<before>\d+(?:\.\d+)?|\.\d+)"
    r"(?![\d.]|\s*(?:s|hz)\b)\s*(?P<per_cent>%|per ?cent)?"
    r"|(?P<after>\d+(?:\.\d+)?)\s*(?:%|per ?cent)[- ]?(?:of critical |critical )?(?:damp|(?:ge)?dämpf|amorti|smorz)"
)
# a unit is written in brackets, period (s), or after an underscore, period_s
_UNIT = r"\s*[\[(_]\s*(?P<{}>[^\])\s,;\"]+)\s*[\])]?\"?"
_HEADING = re.compile(
    r"(?i)\"?(?P<axis>period|frequency|t|f)" + _UNIT.format("axis_unit") + r"[\s,;]+"
    r"\"?(?:(?:p?sa|se)(?:\(t\))?|acceleration|spectral[ _]acceleration)" + _UNIT.format("unit") + r"[\s,;]*"
)


def doubt_spectrum(file: Path, lines: Iterable[tuple[int, str]], damping: float = DAMPING, also: str = "(?!)") -> None:
    """Warn of comments among numbered lines about a spectrum that is vertical, normalised, reduced or in log10.

    And of comments with words of the pattern `also`.
    """
    for number, text in lines:
        if not text.lstrip().startswith("#"):
            continue
        match = _UNLIKE_GROUND.search(text) or re.search(also, text, re.IGNORECASE)
        if remark := match[0] if match else other_damping(text, damping):
            warn([Doubt.of("target_comment", file=file, line=number, remark=remark)])


def other_damping(text: str, damping: float) -> str:
    """Return the words of a text that name another damping ratio, '' if none do."""
    for match in _DAMPING.finditer(text):
        value = float(match["before"] or match["after"])
        value /= 100.0 if match["per_cent"] or match["after"] or value >= 1.0 else 1.0
        if not math.isclose(value, damping, rel_tol=1e-3):
            return match[0].strip()
    return ""


def _amplification(height: float, h_f: float | None, r_mu: float | None) -> float:
    """Return H_f/R_mu of ASCE 7-22."""
    amplified = 1.0 + 2.5 * height if h_f is None else AMPLIFIED.number("h_f", h_f)
    if r_mu is None:
        return amplified / (RESPONSE_REDUCTION if height > 0.0 else 1.0)
    return amplified / AMPLIFIED.number("r_mu", r_mu)
