"""The forecast of runs of sliding blocks: their number is that which is run."""

import pytest
from study_texts import study_in

from toppling.fragility.analyses import sliding
from toppling.studies.buildings import slide_runs
from toppling.studies.command.forecast import forecast

MODELS = '[[models]]\nlaw = "housner"\n'
MOTIONS = '[motions]\ngenerator = "clough-penzien"\nnumber = 5\nduration_s = 6\ndt_s = 0.02\n{more}'
PAIR = 'component = "pair"\n'
FRICTION = "[friction]\nstatic = {static}\n{more}"
BLOCKS = "".join(f"[[blocks]]\nwidth_m = {b}\nheight_m = {h}\ndepth_m = 1.0\n" for b, h in ((0.6, 1.2), (0.3, 1.8)))
IDA = '[ida]\nim = "{im}"\nlevels = {{ values = [0.2, 0.5], unit = "g" }}\n'
FIT = "[fit]\nreplicates = 100\n"
PERFORMANCE = (
    '[performance]\ninventory = "pieces.csv"\nim = "{im}"\nreplicates = 100\n'
    'levels = {{ values = [0.2, 0.5], unit = "g" }}\n'
)
PIECES = (
    "item,width_m,height_m,depth_m,floor,friction,contact\n"
    "a,0.6,1.2,1.0,0,,vinyl\nb,0.7,1.4,1.0,0,,vinyl\nc,0.3,1.8,1.0,0,0.3,\n"
)


@pytest.fixture
def run(monkeypatch):
    """The number of sliding runs that were asked for, and their engine."""
    asked = []
    real = sliding.slips_of

    def noted(sliders, motions, factors, *arguments):
        asked.append(len(sliders) * factors.size)
        return real(sliders, motions, factors, *arguments)

    for module in (sliding, slide_runs):
        monkeypatch.setattr(module, "slips_of", noted)
    return asked


@pytest.mark.parametrize("pair", [False, True])
@pytest.mark.parametrize("dispersion", ["", "dispersion = 0.3\n"])
def test_blocks(tmp_path, run, pair, dispersion):
    im = "RotD50(pga)" if pair else "pga"
    text = MODELS + MOTIONS.format(more=PAIR * pair) + BLOCKS + IDA.format(im=im) + FIT
    study = study_in(tmp_path, 'title = "t"\n' + text + FRICTION.format(static=0.3, more=dispersion))
    slides, lines = study.slide_runs, forecast(study)
    study.run()
    assert slides == sum(run) > 0
    assert f", and {slides:,} of sliding blocks" in lines[0]
    samples = next(iter(study.arrays)).sizes["time"]
    assert study.seconds_of_slides == pytest.approx(slides * samples * (6e-7 if pair else 4e-9))


@pytest.mark.parametrize("pair", [False, True])
def test_inventories(tmp_path, run, pair):
    im = "RotD50(pga)" if pair else "pga"
    (tmp_path / "pieces.csv").write_text(PIECES)
    text = MODELS + MOTIONS.format(more=PAIR * pair) + PERFORMANCE.format(im=im)
    study = study_in(tmp_path, 'title = "t"\n' + text)
    slides = study.slide_runs
    study.run()
    assert slides == sum(run) > 0


def test_none(tmp_path):
    text = MODELS + MOTIONS.format(more="") + BLOCKS + IDA.format(im="pga") + FIT
    study = study_in(tmp_path, 'title = "t"\n' + text)
    assert study.slide_runs == 0
    assert "sliding" not in forecast(study)[0]
