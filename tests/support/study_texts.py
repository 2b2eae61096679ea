"""Study files that several tests start from, whole or in parts to be put together."""

import toppling as tp

BLOCKS = """
[[blocks]]
name = "narrow"
width_m = 0.35
height_m = 1.6

[[blocks]]
name = "wide"
width_m = 0.6
height_m = 1.6
"""
CABINET = """
[[blocks]]
width_m = 0.4
height_m = 1.8
[[models]]
law = "housner"
e = 0.9
"""
"""One block under one law."""
IDA = """
[ida]
im = "pga"
levels = { from = 1.0, to = 12.0, number = 7, spacing = "log", unit = "m/s2" }
"""
HAZARD = """
[hazard]
k0 = 1e-4
k = 2.5
unit = "g"
"""
YEAR = """
[hazard]
levels = [0.05, 0.1, 0.3, 1.0, 2.0]
rates = [3e-2, 1e-2, 1e-3, 1e-4, 1e-5]
unit = "g"
"""
"""A site, by five levels."""


def study_in(folder, text, **tables):
    """The study of a text, in a folder with CSV files of these names."""
    for name, table in tables.items():
        (folder / f"{name}.csv").write_text(table, encoding="utf-8")
    (folder / "study.toml").write_text(text, encoding="utf-8")
    return tp.Study.from_toml(folder / "study.toml")


def study_of(folder, *parts, **tables):
    """The study of some parts, which have no title."""
    return study_in(folder, 'title = "A study"\n' + "".join(parts), **tables)


def changed(text, *changes):
    """A text with others in the place of what it holds."""
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text


def blocks(height=1.8, **widths):
    """Blocks of these names and widths."""
    return "".join(f'[[blocks]]\nname = "{name}"\nwidth_m = {widths[name]}\nheight_m = {height}\n' for name in widths)


def laws(*names):
    return "".join(f'[[models]]\nlaw = "{name}"\n' for name in names)


def tower(period_s, storeys):
    """A building of walls and frames; the table stays open."""
    return f'[building]\nkind = "flexural-shear"\nperiod_s = {period_s}\nstoreys = {storeys}\n'


def ida(*values, unit="g"):
    """Blocks at these levels of PGA; the table stays open."""
    return f'[ida]\nim = "pga"\nlevels = {{ values = [{", ".join(map(str, values))}], unit = "{unit}" }}\n'


def power_law(k0, k, unit="g"):
    """A hazard k0 x^-k; the table stays open."""
    return f'[hazard]\nk0 = {k0}\nk = {k}\nunit = "{unit}"\n'


def motions(number, duration_s=6, dt_s=0.02, seed=1):
    """Synthetic motions, short ones unless asked; the table stays open."""
    return f"""
[motions]
generator = "clough-penzien"
number = {number}
seed = {seed}
duration_s = {duration_s}
dt_s = {dt_s}
"""


def crate_study(title, number, duration, dt, levels):
    """A bookcase and a crate under two laws."""
    return f"""
title = "{title}"
[[blocks]]
catalogue = "bookcase-5-shelf"
[[blocks]]
width_m = 0.5
height_m = 1.2
name = "crate"
[[models]]
law = "discrete"
e = 0.9
[[models]]
law = "housner"
[motions]
generator = "clough-penzien"
number = {number}
duration_s = {duration}
dt_s = {dt}
envelope = {{ kind = "rise-strong-decay", rise_s = 1, strong_end_s = 4, decay_per_s = 0.5 }}
[ida]
im = "pga"
levels = {{ from = 0.1, to = 1.0, number = {levels}, unit = "g" }}
"""
