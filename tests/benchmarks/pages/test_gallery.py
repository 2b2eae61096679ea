"""The gallery of motions: a section, a figure and code that runs for every generator and pulse."""

import numpy as np
import pytest

import toppling as tp
from toppling.benchmarks.pages import gallery
from toppling.benchmarks.pages.page import ROOT

CODE = gallery.sections()


def test_every_generator_and_pulse_has_its_section_and_figure():
    assert [*CODE] == [*tp.motions.GENERATORS, *tp.motions.PULSES, "floors"]
    text = (ROOT / "docs/motions.md").read_text(encoding="utf-8")
    for name in CODE:
        assert f"(motions/{name}.png)" in text
        picture = (ROOT / f"docs/motions/{name}.png").read_bytes()
        assert picture[:8] == b"\x89PNG\r\n\x1a\n"
        assert 5_000 < len(picture) < 120_000


@pytest.mark.parametrize("name", ["clough-penzien", "mavroeidis-papageorgiou", "floors"])
def test_the_code_on_the_page_runs(name):
    assert 3 <= len(CODE[name].splitlines()) <= 6
    shaking = gallery.shaking_of(CODE[name])
    assert {"motion", "time"} <= set(shaking.dims)
    assert np.isfinite(shaking).all()


def test_a_figure_is_drawn():
    assert len(gallery.draw(gallery.shaking_of(CODE["ricker"])).axes) == 3


def test_scale_bars_are_round():
    found = [gallery._round(size) for size in (0.9, 1.0, 1.9, 4.9, 7.0, 0.033)]
    np.testing.assert_allclose(found, [0.5, 1.0, 1.0, 2.0, 5.0, 0.02])
