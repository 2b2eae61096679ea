"""Names from files, made safe to display: no control characters; in figures no mathematics and no endless names."""

import unicodedata

import numpy as np
import xarray as xr

REPLACEMENT = "\ufffd"
# Marks that change the direction of the text that follows, beyond the name that holds them.
_TURNING = {*range(0x202A, 0x202F), *range(0x2066, 0x206A)}
LONGEST_LABEL = 60
"""Maximum length of a name in a figure: longer names are cut (tables contain them whole)."""
NAMED = ("block", "model", "place", "consequence", "floor", "motion_floor", "law")


def clean(text: str) -> str:
    """Return a text without control characters, lone surrogates and marks that turn its direction."""
    return "".join(
        REPLACEMENT
        if (unicodedata.category(character) in ("Cc", "Cs") and character not in "\n\t") or ord(character) in _TURNING
        else character
        for character in text
    )


def drawable(results: xr.Dataset) -> xr.Dataset:
    """Return results whose names any figure can draw: no mathematics, no control characters, short, all different."""
    changed = {}
    for name in NAMED:
        if name in results.coords and results[name].dtype.kind in "OUT":
            coordinate = results[name]
            labels = [str(label) for label in np.atleast_1d(coordinate.values).ravel().tolist()]
            if _all_plain(labels):
                continue
            short = {label: short_name(label) for label in dict.fromkeys(labels)}
            taken: dict[str, str] = {}
            for label, drawn_name in short.items():
                while drawn_name in taken:
                    drawn_name = f"{drawn_name} ({len(taken)})"  # noqa: PLW2901 - until it is a name of its own
                taken[drawn_name] = label
            back = {label: name for name, label in taken.items()}
            values = np.array([back[label] for label in labels], dtype=object).reshape(coordinate.shape)
            changed[name] = (coordinate.dims, values, coordinate.attrs)
    named = results.assign_coords(changed)
    title = results.attrs.get("title")
    return named if title is None else named.assign_attrs(title=clean(str(title))[:200].replace("$", r"\$"))


def _all_plain(labels: list[str]) -> bool:
    """Return True if any figure can draw names as they are, and they are all different."""
    together = "".join(labels)
    plain = together.isascii() and together.isprintable() and "$" not in together and "  " not in together
    return (
        plain
        and max(map(len, labels), default=0) <= LONGEST_LABEL
        and len(set(labels)) == len(labels)
        and not any(label[:1] == " " or label[-1:] == " " for label in labels)
    )


def short_name(label: str) -> str:
    """Return a name that any figure can draw: in one line, short, without mathematics."""
    plain = " ".join(clean(label).split())
    return (plain if len(plain) <= LONGEST_LABEL else f"{plain[: LONGEST_LABEL - 1]}…").replace("$", r"\$")
