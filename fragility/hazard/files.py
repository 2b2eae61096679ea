"""Hazard curves from files: a plain table, OpenQuake's CSV, and the CSV and JSON of the US Geological Survey."""

from __future__ import annotations

import os
import re
from dataclasses import replace

from ...core.parameters import YEARS
from ...motions.intensity.measure import Measure
from ...motions.readers.lines import Lines, RecordError, as_key, is_blank, is_comment, lines_of
from .curve import HazardCurve
from .formats import MAP, OF_MEASURES, Asked, Site, one_measure, read_nshmp, read_openquake, read_plain, read_services
from .plausibility import point_off
from .reading import MOST_LEVELS, OFF_CURVE, HazardError, measure_label, row_words

COMPONENT = "Total"
"""Component of a USGS response with all sources."""


def read_hazard(
    path: str | os.PathLike[str],
    im: str | Measure | None = None,
    site: Site = None,
    *,
    units: str | None = None,
    years: float | None = None,
    component: str = COMPONENT,
) -> HazardCurve:
    r"""Read a hazard curve from a file, whose format is detected.

    Parameters
    ----------
    path : path
        One of the files below.
    im : str or Measure, optional
        The measure: selects one if the file has several, names it if the file does not, and else must agree with the
        file.
    site : int, str or (longitude, latitude), optional
        Site in a file with several: its number from 0, its name, or its place in degrees (within 0.01).
    units : str, optional
        Unit of the levels (``g``, ``cm/s`` …), only if a file does not state it.
    years : float, optional
        Time in years of which the values are probabilities, only if a file does not state it.
    component : str
        Component of a USGS JSON response.

    Returns
    -------
    HazardCurve
        In SI. Levels at the top whose rate is 0, and at the bottom whose probability is 1 (an infinite rate), cannot be
        drawn on a log-log plot. They are left out. `source` states their number, the unit of the levels and what the
        file gives for them: rates, return periods or probabilities.

    Raises
    ------
    HazardError
        A file that cannot be read or is of no known format. Several sites or measures without a choice. Rates that
        rise, or values that are no numbers. A unit, a measure or a time that is missing, not known or stated twice.

    Notes
    -----
    - **Plain table** (CSV; comma, semicolon or tab): the first line that is not blank and no comment (#) names the
      columns. They are the measure with its unit, then ``rate (1/yr)``, ``probability in 50 yr`` or ``return period
      (yr)``. Several columns of rates are realisations, each with its weight in its name: ``rate (1/yr) weight 0.3``.
      Times may be decades, centuries or kyr, rates per several years (``rate per 50 years``), probabilities in per cent
      (``probability in 50 yr (%)``). An unknown word or unit is an error.
    - **OpenQuake engine**, ``hazard_curve-….csv`` and ``quantile_curve-….csv`` of `oq export`: a comment with
      ``investigation_time`` and ``imt`` (in two layouts), then ``lon,lat,depth,poe-0.005,…``, one site per row. Older
      engines write several measures into one table (``PGA-0.1``, ``SA(0.1)-0.1``). Accelerations in g, PGV in cm/s, PGD
      in cm, Arias intensity in m/s, CAV in g s. Only means, quantiles and realisations are read.
    - **nshmp-haz** (USGS), ``curves.csv`` and ``total.csv``: ``name,lon,lat,0.001,…`` (the name may be missing), annual
      rates. The measure is the folder's (``PGA``, ``SA1P0``), else `im`, as `source` states. With the other value
      format of the program, Poisson probabilities, the file looks the same: give `years`. Accelerations in g, PGV in
      cm/s.
    - **USGS web services**, JSON: of the Unified Hazard Tool (``response`` is a list, with xvalues and yvalues) and of
      the later services (``response.hazardCurves``, with xs and ys).

    Probabilities p in T years are rates -ln(1 - p)/T, as of a Poisson process. OpenQuake's and nshmp-haz' layouts are
    from the expected outputs in their public repositories. The JSON is from the services' published code and from
    programs that read it.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder, "site.csv")
    ...     _ = path.write_text("pga (g),rate (1/yr)\n0.1,1e-2\n0.4,1e-3\n")
    ...     hazard = read_hazard(path)
    >>> hazard.im, hazard.rates, hazard.source
    ('pga', (0.01, 0.001), 'site.csv, table, annual rates, levels in g')
    """
    wanted = None if im is None else measure_label(im)
    time = None if years is None else YEARS.number("years", years)
    try:
        with Lines(path) as lines:
            first = next((line for line in lines.head if not is_blank(line) and not is_comment(line)), "")
            if first.lstrip().startswith(("{", "[")):
                if units is not None or time is not None:
                    raise HazardError(f"{lines.file}: USGS services state units and rates, so neither may be given")
                return read_services(lines, wanted, component)
            curve = _table(lines, Asked(wanted, site, units, time))
        comments = (text for line in lines_of(lines.file) if (text := line.strip()).startswith("#"))
        off = point_off(curve, comments)
        return replace(curve, source=f"{curve.source} ({OFF_CURVE} {off})") if off else curve
    except RecordError as error:
        message = str(error).replace("no record is", "no hazard file is").replace("not a record", "not a hazard file")
        raise HazardError(message) from None


def _table(lines: Lines, asked: Asked) -> HazardCurve:
    """Read any of the three kinds of CSV, distinguished by the line that names the columns."""
    for line in lines:
        if not is_blank(line) and not is_comment(line):
            break
    else:
        raise HazardError(f"{lines.file}: holds no line that names its columns")
    text = line.strip()
    separator = next((mark for mark in (";", "\t") if mark in text), ",")
    names = row_words(lines, text, separator)
    if len(names) > MOST_LEVELS:
        raise HazardError(f"{lines.file}: line {lines.number} has {len(names)} columns, at most {MOST_LEVELS} are read")
    lowered = [{"longitude": "lon", "latitude": "lat"}.get(name.lower(), name.lower()) for name in names]
    # comments may be anywhere
    comment = " ".join(as_key(line.strip()) for line in lines_of(lines.file) if is_comment(line))
    if "lon" in lowered and (re.match(r"\w*(?:hazard|quantile)_(?:map|uhs)", lines.file.name) or "~" in text):
        raise HazardError(f"{lines.file}: {MAP}")
    if "lon" in lowered and any(OF_MEASURES.fullmatch(name) and name[:4] != "poe-" for name in lowered):
        im, lowered = one_measure(lines, lowered, asked.im)
        comment, asked = f"{comment} imt='{im}'", asked._replace(im=im)
    if any(name.startswith("poe-") for name in lowered):
        return read_openquake(lines, comment, lowered, separator, asked)
    if "lon" in lowered and "lat" in lowered:
        return read_nshmp(lines, comment, lowered, separator, asked)
    return read_plain(lines, comment, names, separator, asked)
