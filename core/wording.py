"""Wording of numbers in tables, sentences and figures: digits, intervals, percentages, periods, sizes and money.

All formats of numbers are defined here, so that the same quantity looks alike in every place. Formats that differ on
purpose have a name each, and their docstrings state the difference. The reason of a system error is worded here, too.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from os import getcwd
from os.path import islink
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr

UNKNOWN = "not known"
MOST_DIGITS = 6
"""Maximum number of digits of a ratio whose interval is close to 1."""


def three_digits(value: float) -> str:
    """A number to three digits with its closing zeros, so that the ends of an interval look equally precise.

    >>> three_digits(0.35), three_digits(1234.5), three_digits(2.0e-7)
    ('0.350', '1,230', '2.00e-07')
    """
    if math.isinf(value):
        return "∞"
    if value == 0.0 or math.isnan(value):
        return "0" if value == 0.0 else "not known"
    return _rounded(value, 3) if 1e-4 <= abs(value) < 1e9 else f"{value:.2e}"


def short_digits(value: float) -> str:
    """A number to three digits without closing zeros, for numbers without a partner.

    >>> short_digits(0.35), short_digits(1234.5), short_digits(2.0e-7)
    ('0.35', '1,230', '2.00e-07')
    """
    text = three_digits(value)
    return text.rstrip("0").rstrip(".") if "." in text and "e" not in text else text


def two_digits(value: float) -> str:
    """A number to two digits, for tables that people decide by.

    >>> two_digits(0.3456), two_digits(1234.5), two_digits(9.96)
    ('0.35', '1,200', '10')
    """
    return _rounded(value, 2)


def _rounded(value: float, digits: int) -> str:
    """A number to `digits` digits with its closing zeros."""
    if value == 0.0 or not math.isfinite(value):
        return short_digits(value)
    # (rounded first: 0.996 is 1.0)
    places = digits - 1 - math.floor(math.log10(abs(float(f"{value:.{digits - 1}e}"))))
    return f"{round(value, places):,.{max(places, 0)}f}"


def estimate_text(value: float, low: float, high: float) -> str:
    """A number with its interval in brackets to two digits, or three if two would give it the same text as an end.

    >>> estimate_text(0.345, 0.328, 0.362), estimate_text(1.08, 1.04, 1.12), estimate_text(2.0, 1.6, 2.0)
    ('0.34 (0.33–0.36)', '1.08 (1.04–1.12)', '2.0 (1.6–2.0)')
    """
    write: Callable[[float], str] = two_digits
    if any(write(value) == write(end) and value != end for end in (low, high)):
        write = three_digits
    return f"{write(value)} ({interval_text(low, high, write)})"


def ratio_text(value: float, low: float, high: float, digits: int = 2) -> str:
    """A ratio with its interval in brackets, to as many digits as show that an interval does not contain 1.

    An interval that lies above or below 1 is written with more than `digits` digits, up to six, if fewer would round an
    end of it to 1. Without an interval (NaN) the ratio is alone.

    >>> ratio_text(0.95, 0.88, 1.2), ratio_text(0.946, 0.881, 0.996), ratio_text(1.06, 1.02, 1.11)
    ('0.95 (0.88–1.2)', '0.946 (0.881–0.996)', '1.06 (1.02–1.11)')
    >>> ratio_text(0.5, math.nan, math.nan)
    '0.50'
    """
    if math.isnan(low) or math.isnan(high):
        return _rounded(value, digits)
    near = high if high < 1.0 else low if low > 1.0 else math.nan
    while digits < MOST_DIGITS and float(f"{near:.{digits - 1}e}") == 1.0:
        digits += 1
    return f"{_rounded(value, digits)} ({interval_text(low, high, lambda end: _rounded(end, digits))})"


def given_number(value: float) -> str:
    """A number that a user gives, such as a price or a budget, with all of its digits.

    >>> given_number(1234.0), given_number(0.35), given_number(1250000.5)
    ('1,234', '0.35', '1,250,000.5')
    """
    return f"{value:,.12g}"


def interval_text(low: float, high: float, write: Callable[[float], str] = three_digits) -> str:
    """The ends of an interval, each formatted by `write`; an interval with an open end is described in words.

    >>> interval_text(2.1, 3.0), interval_text(2.1, math.inf), interval_text(math.nan, 3.0)
    ('2.10–3.00', 'above 2.10', 'no interval')
    >>> interval_text(math.inf, math.inf)
    'no interval'
    """
    if math.isnan(low) or math.isnan(high):
        return "no interval"
    if math.isinf(high):
        return "not known" if low <= 0.0 else "no interval" if math.isinf(low) else f"above {write(low)}"
    return f"below {write(high)}" if math.isinf(low) else f"{write(low)}–{write(high)}"


def percent(share: float) -> str:
    """A share in per cent, at most three digits, with a no-break space."""
    return f"{100.0 * share:.3g}\u00a0%"


def given_percent(share: float) -> str:
    """A share that a user gives (a confidence, a quantile) in per cent, with all of its digits.

    >>> given_percent(0.95), given_percent(0.025)
    ('95 %', '2.5 %')
    """
    return f"{100.0 * share:g} %"


def whole_percent(share: float) -> str:
    """A share in whole per cent.

    >>> whole_percent(0.256), whole_percent(-0.001)
    ('26 %', '0 %')
    """
    text = f"{100.0 * share:.0f}"
    return "0 %" if text == "-0" else f"{text} %"


def two_digit_percent(share: float) -> str:
    """A share of runs in per cent to two digits, as notes and checks write it.

    >>> two_digit_percent(0.00432), two_digit_percent(0.996)
    ('0.43 %', '100 %')
    """
    return f"{100.0 * share:.2g} %" if share < 0.995 else f"{100.0 * share:.0f} %"


def about_percent(share: float) -> str:
    r"""A probability in per cent to two digits with closing zeros, for sentences in plain words; its space is no break.

    >>> about_percent(0.0123), about_percent(0.04), about_percent(0.996), about_percent(2e-8)
    ('1.2\xa0%', '4.0\xa0%', '100\xa0%', 'below 0.0001\xa0%')
    """
    if 0.0 < share < 1e-6:
        return "below 0.0001\u00a0%"
    return f"{two_digits(100.0 * share) if share < 0.995 else '100'}\u00a0%"


def chance_text(share: float) -> str:
    """A probability in per cent to three digits with its closing zeros, with a no-break space."""
    return f"{three_digits(100.0 * share)}\u00a0%"


def chances_between(low: float, high: float, write: Callable[[float], str] = chance_text) -> str:
    r"""The ends of a probability's interval in per cent.

    >>> chances_between(0.0199, 0.0268)
    '1.99–2.68\xa0%'
    >>> chances_between(1e-8, 2e-7, about_percent), chances_between(1e-8, 0.02, about_percent)
    ('below 0.0001\xa0%', 'up to 2.0\xa0%')
    """
    ends = [write(end) for end in (low, high)]
    if ends[0].startswith("below "):
        return ends[0] if ends[0] == ends[1] else f"up to {ends[1]}"
    return interval_text(low, high, write).replace("\u00a0%–", "–")


def confidence_text(results: xr.Dataset) -> str:
    """The confidence of a study's intervals in per cent."""
    return given_percent(float(results.attrs["confidence"]))


def part_text(done: int, total: int) -> str:
    """The part of all runs that is done, in whole per cent."""
    return f"{100.0 * done / max(total, 1):.0f} %"


def in_years(rate: float) -> str:
    """The mean number of years between two events of an annual rate, to three digits.

    >>> in_years(1.0 / 2137.0), in_years(0.3), in_years(0.0)
    ('2,140', '3.33', '∞')
    """
    return about_years(rate, three_digits)


def about_years(rate: float, write: Callable[[float], str] = two_digits) -> str:
    """The mean number of years between two events of an annual rate, as an approximate number.

    >>> about_years(1.0 / 2137.0), about_years(0.0)
    ('2,100', '∞')
    """
    return UNKNOWN if math.isnan(rate) else write(1.0 / rate) if rate > 0.0 else "∞"


def listed_name(name: str) -> str:
    """A name for a list: in quotation marks if it contains a comma or a semicolon.

    >>> listed_name("rack"), listed_name("20 mm from the wall, with a kit")
    ('rack', '“20 mm from the wall, with a kit”')
    """
    return f"“{name}”" if "," in name or ";" in name else name


def counted(n: int, noun: str) -> str:
    """A number of things.

    >>> counted(1, "block"), counted(12_000, "run"), counted(2, "branch")
    ('1 block', '12,000 runs', '2 branches')
    """
    return f"{n:,} {noun}{'' if n == 1 else 'es' if noun.endswith('ch') else 's'}"


def years_text(years: float) -> str:
    """A number of years.

    >>> years_text(1.0), years_text(50.0)
    ('1 year', '50 years')
    """
    return f"{years:g} year{'' if years == 1.0 else 's'}"


def with_article(noun: str) -> str:
    """A noun or number after its indefinite article; Sa(T) is spoken as a word that begins with a vowel.

    >>> with_article("bench"), with_article("adhesive"), with_article("Sa(1 s)")
    ('a bench', 'an adhesive', 'an Sa(1 s)')
    >>> with_article("8 %"), with_article("11 %"), with_article("1.1 %"), with_article("81 %")
    ('an 8 %', 'an 11 %', 'a 1.1 %', 'an 81 %')
    """
    spoken = re.match(r"[aeiou]|sa\(|8|1[18](?!\d)", noun.lower())
    return f"{'a' if spoken is None else 'an'} {noun}"


def size_text(size: float) -> str:
    """A number of bytes with its decimal unit, from kB to EB."""
    for unit, scale in (("EB", 1e18), ("PB", 1e15), ("TB", 1e12), ("GB", 1e9), ("MB", 1e6)):
        if size >= scale:
            return f"{size / scale:,.1f} {unit}"
    return f"{max(size / 1e3, 1.0):.0f} kB"


def time_text(seconds: float) -> str:
    """A duration for people: 12 s, 3 min, 4.5 h, 2 d."""
    for size, unit in ((86_400.0, "d"), (3_600.0, "h"), (60.0, "min")):
        if seconds >= 2.0 * size:
            return f"{seconds / size:.{int(seconds < 10.0 * size)}f} {unit}"
    return f"{seconds:.0f} s" if seconds >= 1.0 else "less than 1 s"


def currency_of(results: xr.Dataset) -> str:
    """The currency of an assessment's losses and costs, '' if the inventory states none."""
    return str(results.attrs.get("currency", ""))


@contextmanager
def system_errors(error: type[Exception], what: str) -> Iterator[None]:
    """Raise `error` if the system rejects something in the block: `what` it is, and the system's words for it."""
    try:
        yield
    except OSError as refused:
        raise error(f"{what} ({system_reason(refused)})") from None


def system_reason(error: BaseException) -> str:
    """Return the operating system's words for an error, or the error's own message if it has none."""
    if isinstance(error, FileExistsError) and error.filename is not None and islink(error.filename):
        return "it is a link that leads nowhere"
    if isinstance(error, FileNotFoundError):
        try:
            getcwd()
        except OSError:
            return "the working folder is gone: change to another one"
    return str(getattr(error, "strerror", None) or error)
