"""The live page in headless Chromium: typing, sliding, saving, by keyboard, at three widths, in light and dark."""

import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

pytest.importorskip("starlette", reason="needs the extra app")

from live_page import WIDTHS, browser, needs_chromium, served

from toppling.studies.app import piece_studies, state

__all__ = ["browser"]
pytestmark = needs_chromium


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("live")
    content = state.start_state()
    content["motions"] |= {"number": 10, "dt_s": 0.02}
    content["ida"]["levels"]["number"] = 8
    state.write_state(made / "piece.live.toml", piece_studies.contents_of(content))
    return made


@pytest.fixture(scope="module")
def address(folder):
    with served(folder) as found:
        yield found


@pytest.fixture
def page(browser, address):
    browser.visit(address)
    browser.complete(0)
    return browser


def numbers(page):
    """Every number of the answer, the curve's sentences and the restraints."""
    return page.run("['answer', 'levels', 'remedies'].map((id) => document.getElementById(id).innerText).join(' ')")


def test_the_page_and_the_command_give_the_same_numbers(page, folder):
    """Typed and slid values, saved as a study that the command runs in a process of its own."""
    page.change("blocks-0-width_m", "35")
    page.change("wall", "yes")
    page.run(
        "(() => { const slider = document.querySelector('[data-for=\"blocks-0-wall_gap_mm\"]'); slider.value = '1.5';"
        "slider.dispatchEvent(new Event('input', {bubbles: true})); })()"
    )
    page.wait("document.getElementById('blocks-0-wall_gap_mm').value === '1.5'")
    page.wait("Number(document.body.dataset.version) >= 3")
    page.wait("document.body.dataset.complete === document.body.dataset.version")
    page.run("document.getElementById('name').value = 'shelf one'; document.querySelector('#save button').click()")
    page.wait("document.getElementById('saved').textContent.includes('shelf one.toml')")
    content = tomllib.loads((folder / "shelf one.toml").read_text("utf-8"))
    assert content["blocks"][0] | {"name": ""} == {
        "name": "",
        "width_m": 0.35,
        "height_m": 1.8,
        "mass_kg": 100,
        "wall_gap_mm": 15.0,
    }
    code = (
        "import sys, toppling as tp\n"
        "from pathlib import Path\n"
        "from toppling.studies.app import state\n"
        "keys = {'piece': 'risk_probability', 'earthquake': 'probability', 'remedies': 'risk_probability'}\n"
        "files = {name: state.file_of(Path(sys.argv[1]), name) for name in keys}\n"
        "results = {name: tp.Study.from_toml(file).run() for name, file in files.items()}\n"
        "print(repr({name: float(results[name][key].values.ravel()[0]) for name, key in keys.items()}))\n"
    )
    file = folder / "shelf one.toml"
    ran = subprocess.run(
        [sys.executable, "-c", code, str(file)], capture_output=True, text=True, check=True, cwd=folder
    )
    from toppling.core.wording import about_percent

    said = eval(ran.stdout)
    shown = numbers(page).replace("\xa0", " ")
    for name, chance in said.items():
        assert about_percent(chance).replace("\xa0", " ") in shown, (name, chance)
    out = folder / "results"
    subprocess.run([sys.executable, "-m", "toppling", "run", file, "--out", out], check=True, capture_output=True)
    done = subprocess.run(
        [sys.executable, "-m", "toppling", "report", out, "--json"], check=True, capture_output=True, text=True
    )
    facts = json.loads(done.stdout)
    basis = page.run("document.getElementById('basis').textContent")
    assert facts["answer"]
    for fact in [*facts["answer"], *facts["inputs"], *facts["method"], *facts["footnotes"]]:
        assert fact["sentence"] in basis


def test_what_is_wrong_is_said_at_its_field(page):
    before = page.run("document.body.dataset.version")
    page.change("blocks-0-width_m", "abc")
    assert "width_m" in page.run("document.getElementById('message').textContent")
    assert page.run("document.getElementById('blocks-0-width_m').getAttribute('aria-invalid')") == "true"
    assert page.run("document.body.dataset.version") == before
    page.change("blocks-0-width_m", "41")
    page.wait("document.getElementById('message').hidden")
    assert page.run("document.querySelectorAll('[aria-invalid]').length") == 0


def test_units_and_the_scale_of_the_drawing(page):
    page.change("blocks-0-width_m", "40")
    page.put("length", "in", "change")
    page.wait("document.getElementById('blocks-0-width_m').value === '15.748'")
    assert float(page.run("document.querySelector('#scene .piece').getAttribute('width')")) == pytest.approx(40.0)
    page.put("length", "cm", "change")
    page.wait("document.getElementById('blocks-0-width_m').value === '40'")


def test_levels_film_and_target(page):
    last = page.run("document.getElementById('level').max")
    page.put("level", last, "input")
    shown = page.run("[...document.querySelectorAll('#levels p')].map((sentence) => sentence.hidden)")
    assert shown == [True] * int(last) + [False]
    page.run("document.getElementById('play').click()")
    page.wait("Number(document.getElementById('film').dataset.frame) > 5")
    said = page.run("document.getElementById('film-said').textContent")
    assert re.search(r"the piece (falls|does not fall)", said)
    corners = page.run("document.querySelector('#film .piece').getAttribute('points').split(' ').length")
    assert corners == 8
    page.put("target", "99", "change")
    page.wait("document.getElementById('best').textContent.includes('needs no restraint')")


def test_by_keyboard_alone(page):
    """Tab reaches every control, in order, with a name; Enter and arrows work."""
    reached = page.reached(60)
    for control in ("item", "blocks-0-width_m", "wall", "floor", "level", "motion", "play", "target", "name", "which"):
        assert control in reached, control
    order = [reached.index(control) for control in ("item", "blocks-0-width_m", "wall", "level", "play", "name")]
    assert order == sorted(order)
    page.run("document.getElementById('level').focus()")
    before = page.run("document.getElementById('level').value")
    page.press("ArrowLeft", "ArrowLeft", 37)
    assert int(page.run("document.getElementById('level').value")) == int(before) - 1
    page.run("document.querySelector('#basis summary').focus()")
    page.press("Enter", "Enter", 13)
    assert page.run("document.querySelector('#basis details').open") is True
    page.run("document.querySelector('#earthquake .rests').focus()")
    page.press("Enter", "Enter", 13)
    page.wait("document.querySelector('#basis-earthquake').open")
    page.run("document.querySelector('#basis-earthquake .show').focus()")
    page.press("Enter", "Enter", 13)
    page.wait("document.getElementById('text').textContent.includes('one earthquake')")


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("dark", [False, True])
def test_widths_names_and_policy(browser, address, width, dark):
    browser.visit(address, width, dark=dark)
    browser.complete(0)
    browser.check_fit(width, dark)
    assert browser.run("[...document.querySelectorAll('h1, h2, h3')].map((h) => h.tagName)")[:2] == ["H1", "H2"]
    asked = [
        event["params"]["request"]["url"] for event in browser.events if event["method"] == "Network.requestWillBeSent"
    ]
    assert asked
    assert all(url.startswith(address) for url in asked)


VIOLATIONS = (
    "; axe.run({resultTypes: ['violations']}).then((found) => found.violations.map("
    "(broken) => [broken.id, broken.nodes.map((node) => node.target.join(' ')).slice(0, 3)]))"
)


@pytest.mark.skipif("AXE_CORE" not in os.environ, reason="AXE_CORE is not the path of axe.min.js (npm: axe-core)")
@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("dark", [False, True])
def test_axe_finds_nothing(browser, address, width, dark):
    """With the full answer, everything unfolded, a film, a message and the text of a study; and while ranges follow."""
    axe = Path(os.environ["AXE_CORE"]).read_text(encoding="utf-8")
    browser.visit(address, width, dark=dark)
    browser.complete(0)
    browser.run("document.querySelectorAll('details').forEach((details) => { details.open = true; })")
    browser.run("document.getElementById('play').click(); document.querySelector('#basis .show').click()")
    browser.wait("document.getElementById('film').dataset.frame && !document.getElementById('text').hidden")
    browser.change("blocks-0-width_m", "abc")
    assert browser.run(axe + VIOLATIONS) == []
    browser.change("blocks-0-width_m", "37")
    browser.wait("document.getElementById('message').hidden && document.querySelector('.older') !== null")
    assert browser.run(axe + VIOLATIONS) == []
    browser.change("blocks-0-width_m", "35")
    browser.complete(int(browser.run("document.body.dataset.version")))


OUT_OF_SIGHT = """(async () => {
  const missing = [], brief = document.getElementById('brief'), answer = document.querySelector('#answer table');
  for (const field of document.querySelectorAll('#form input, #form select')) {
    field.scrollIntoView({block: 'center'});
    await new Promise((done) => setTimeout(done, 60));
    const table = answer.getBoundingClientRect(), line = brief.getBoundingClientRect();
    const near = table.top < innerHeight && table.bottom > 0;
    const below = brief.checkVisibility({visibilityProperty: true}) && line.top >= 0 && line.bottom <= innerHeight + 1;
    if (field.checkVisibility() && !near && !below) missing.push(field.id || field.name);
  }
  return missing;
})()"""


@pytest.mark.parametrize("width", WIDTHS)
def test_the_answer_is_in_sight_of_what_is_moved(browser, address, width):
    """Each field of the form is shown with the answer, or with its short form at the lower edge."""
    browser.visit(address, width)
    browser.complete(0)
    assert browser.run(OUT_OF_SIGHT) == []
    chance = browser.run("document.querySelector('#years .number').textContent")
    assert browser.run("document.getElementById('brief').textContent").startswith(f"{chance} in 50 years, ranges")


def test_a_dropped_hazard_file(page):
    """Through the file field, as by the keyboard; a wrong file changes nothing."""
    before = page.run("document.querySelector('#years .number').textContent")
    for name, text in (("wrong.csv", "a,b\n1,2\n"), ("site.csv", "pga (g),rate (1/yr)\n0.05,4e-2\n0.8,2e-4\n")):
        version = page.run("document.body.dataset.version")
        script = (
            f"(() => {{ const files = new DataTransfer(); "
            f"files.items.add(new File([{json.dumps(text)}], {json.dumps(name)}));"
            "const field = document.getElementById('hazard-file'); field.files = files.files;"
            "field.dispatchEvent(new Event('change', {bubbles: true})); })()"
        )
        page.run(script)
        if name == "wrong.csv":
            page.wait("document.getElementById('message').textContent.includes('wrong.csv')")
            assert page.run("document.body.dataset.version") == version
            continue
        page.wait(f"document.body.dataset.version !== {json.dumps(version)}")
    page.complete(int(page.run("document.body.dataset.version")))
    assert page.run("document.getElementById('hazard').selectedOptions[0].textContent").startswith("hazard-")
    assert page.run("document.querySelector('#years .number').textContent") != before
    page.change("hazard", "points")
    page.complete(int(page.run("document.body.dataset.version")))
    assert page.run("document.querySelector('#years .number').textContent") == before


def test_the_state_outlives_the_process(folder, browser):
    """What was changed is there after the process was killed."""
    with served(folder) as first:
        browser.visit(first)
        browser.wait("document.body.dataset.version")
        browser.change("blocks-0-height_m", "165")
    with served(folder) as second:
        browser.visit(second)
        assert browser.run("document.getElementById('blocks-0-height_m').value") == "165"
