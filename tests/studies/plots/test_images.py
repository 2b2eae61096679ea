"""Figures against images of them that people looked at: tests/studies/plots/images, 50 dots an inch, below 40 kB each.

``python test_images.py`` draws the images anew: look at each before it is committed.  An image says which
matplotlib and FreeType drew it; where these are others, letters and with them the layout differ by some pixels, so
that figures are compared without text then.
"""

from pathlib import Path

import matplotlib as mpl
import plot_cases as cases
import pytest
from matplotlib import ft2font
from matplotlib.figure import Figure
from matplotlib.testing.compare import compare_images
from matplotlib.text import Text
from PIL import Image

from toppling.studies import plot
from toppling.studies.plots.assessment import anchoring_figure, exceedance_figure
from toppling.studies.plots.fragility import fragility_figure

IMAGES = Path(__file__).parent / "images"
VERSIONS = f"matplotlib {mpl.__version__.rpartition('.')[0]}, FreeType {ft2font.__freetype_version__}"
# Root mean square of the differences of pixels, 0 to 255.  Drawing is deterministic with one version (0 between runs);
# another processor may round the edges of lines to another shade.  A visible change exceeds the tolerance, as the last
# test below shows.
TOLERANCE = 1.0
# Versions may also differ in how they snap lines to pixels.
TOLERANCE_OF_OTHERS = 8.0
LARGEST = 40_000


LAW = "energy-consistent e=e_R δ=0.05"

FIGURES = {
    "fragility": lambda: fragility_figure(cases.curves(("shelf",))),
    "cloud": lambda: plot.fragility(cases.cloud()).figure,
    "risk": lambda: plot.risk(cases.rates(), block="shelf").figure,
    "share": lambda: plot.risk(cases.rates(), block="shelf", quantity="share").figure,
    "levels": lambda: plot.inventory(cases.assessment()).figure,
    "exceedance": lambda: exceedance_figure(cases.assessment(2)),
    "anchoring": lambda: anchoring_figure(cases.ranking()),
    "measures": lambda: plot.measures(cases.measured(), model=LAW).figure,
    "uncertainty": lambda: plot.uncertainty(cases.uncertain()).figure,
    "variance": lambda: plot.uncertainty(cases.uncertain(), view="variance").figure,
    "sobol": lambda: plot.indices(cases.uncertain(), method="sobol", model=LAW).figure,
}


def save(figure: Figure, path: Path, text: bool = True) -> Path:
    """Save a small image of a figure, without its text where another font version would draw the text."""
    if not text:
        for one in figure.findobj(Text):
            one.set_visible(False)
    with mpl.rc_context({"svg.hashsalt": "toppling"}):
        figure.savefig(path, dpi=50, metadata={"Software": VERSIONS})
    return path


@pytest.fixture(autouse=True)
def _plain():
    # (the user's own matplotlib settings must not change the figure)
    with mpl.rc_context(mpl.rcParamsDefault | {"backend": "agg"}):
        yield


@pytest.mark.slow
@pytest.mark.parametrize("name", FIGURES)
def test_image(name, tmp_path):
    same = Image.open(IMAGES / f"{name}.png").info["Software"] == VERSIONS
    for text in (True, False) if same else (False,):
        baseline = IMAGES / f"{name}{'' if text else '_plain'}.png"
        drawn = save(FIGURES[name](), tmp_path / baseline.name, text)
        assert compare_images(str(baseline), str(drawn), TOLERANCE if same else TOLERANCE_OF_OTHERS) is None


def test_images_are_small_and_all_there():
    names = {f"{name}{end}.png" for name in FIGURES for end in ("", "_plain")}
    assert {path.name for path in IMAGES.iterdir()} == names
    assert max(path.stat().st_size for path in IMAGES.iterdir()) < LARGEST


def test_a_change_is_seen(tmp_path):
    """The tolerances detect that the median of the law with points is a tenth higher."""
    moved = cases.curves(("shelf",))
    moved["median"][0, 0] *= 1.1
    drawn = save(fragility_figure(moved), tmp_path / "moved.png", text=False)
    found = compare_images(str(IMAGES / "fragility_plain.png"), str(drawn), 0.0, in_decorator=True)
    assert found["rms"] > TOLERANCE_OF_OTHERS  # 14.9; 13.8 of a fiftieth


if __name__ == "__main__":
    IMAGES.mkdir(exist_ok=True)
    for label, make in FIGURES.items():
        save(make(), IMAGES / f"{label}.png")
        save(make(), IMAGES / f"{label}_plain.png", text=False)
