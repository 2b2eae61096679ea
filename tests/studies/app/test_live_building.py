"""A building full in headless Chromium: drop, mend, tick, budget, print; keyboard, three widths, light and dark."""

import base64
import json
import re
import subprocess
import sys

import pytest

pytest.importorskip("starlette", reason="needs the extra app")

from live_page import WIDTHS, browser, needs_chromium, served

from toppling.studies.app import state
from toppling.studies.app.building import start_content

__all__ = ["browser"]
pytestmark = needs_chromium
HASH = re.compile("[0-9a-f]{62,64}")
TABLE = """item,catalogue,floor,count,value,currency,consequence,anchored,anchoring_cost
<b>shelf</b>,bookcase-6-shelf,3,2x,400,EUR,injury,no,30
cabinet,file-vertical-4-drawer,1,4,300,EUR,,no,25
rack,server-rack-42u,2,1,9000,EUR,records,no,220
cylinder,gas-cylinder-large,0,3,250,EUR,release,yes,25
"""
DROP = """(() => {{
  const moved = new DataTransfer();
  moved.items.add(new File([{content}], {name}));
  document.dispatchEvent(new DragEvent('drop', {{dataTransfer: moved, bubbles: true, cancelable: true}}));
}})()"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("building")
    content = start_content()
    content["motions"] |= {"number": 8, "dt_s": 0.02}
    content["performance"]["levels"] = {"values": [0.2, 0.6, 1.5], "unit": "g"}
    content["performance"]["variability"] |= {"variants": 4}
    content["performance"]["inventory"] = "building.live.csv"
    (made / state.BUILDING_STATE).write_text(state.toml_of(content), encoding="utf-8")
    return made


@pytest.fixture(scope="module")
def address(folder):
    with served(folder) as root:
        yield f"{root}building"


def settled(page, version=0):
    """Wait until the runs of a page have ended."""
    page.wait(f"document.body.dataset.running === 'false' && Number(document.body.dataset.version) > {version}", 300)
    return int(page.run("document.body.dataset.version"))


def put(page, element, value):
    """Set a field, and wait until the runs that follow have ended."""
    before = int(page.run("document.body.dataset.version"))
    page.put(element, value, "input", "change")
    settled(page, before)


def plain(text):
    return text.replace("\xa0", " ").replace("\u202f", " ")


def text_of(page, element):
    return plain(page.run(f"document.getElementById({json.dumps(element)}).textContent"))


def command(*arguments):
    done = subprocess.run(
        [sys.executable, "-m", "toppling", *map(str, arguments)], check=True, capture_output=True, text=True
    )
    return done.stdout


@pytest.fixture(scope="module")
def page(browser, address):
    """The page with a dropped table that is mended."""
    browser.visit(address)
    browser.wait("document.body.dataset.version")
    browser.run(DROP.format(content=json.dumps(TABLE), name=json.dumps("table <i>.csv")))
    version = settled(browser)
    assert browser.run("document.getElementById('cell-0-3').getAttribute('aria-invalid')") == "true"
    assert text_of(browser, "wrong") == "line 2, column 'count': must be a whole number, got '2x'"
    put(browser, "cell-0-3", "2")
    assert browser.run("document.getElementById('wrong').hidden")
    assert browser.run("document.querySelectorAll('[aria-invalid]').length") == 0
    assert settled(browser) > version
    return browser


def test_the_page_and_the_commands_give_the_same_numbers(page, folder, address):
    """Ticks, the budget and the printed report, with both studies run by the command in processes of their own."""
    order = page.run("[...document.querySelectorAll('#ranking tbody th')].map((cell) => cell.textContent)")
    put(page, "budget", 60.0)
    put(page, "anchor-0", True)
    put(page, "floor-2", "0")
    assert text_of(page, "cost") == "60 EUR"
    rows = page.run(
        "[...document.querySelectorAll('#ranking tbody tr')].map((row) => "
        "[...row.children].filter((cell, i) => i !== 1 && i !== 2).map((cell) => cell.textContent))"
    )
    results = {}
    for name, file in (("before", "building.live.toml"), ("after", "building.live.after.toml")):
        out = folder / f"command {name}"
        command("run", folder / file, "--out", out)
        results[name] = json.loads(command("report", out, "--json"))
        shown = text_of(page, name)
        for fact in results[name]["answer"]:
            assert plain(fact["sentence"]) in shown
    out = {name: folder / f"command {name}" for name in results}
    compared = json.loads(command("compare", out["before"], out["after"], "--out", folder / "compared", "--json"))
    whole = next(table for table in compared["tables"] if table["title"] == "The whole building")
    shown = text_of(page, "result")
    for row in whole["rows"]:
        assert plain(str(row["a"])) in shown
        assert plain(str(row["b"])) in shown
    lines = {row[0]: [*map(plain, row)] for row in rows}
    assert [*lines] == order
    chances = {}
    for name, file in out.items():
        page_of = subprocess.run(
            [sys.executable, "-c", PIECES, str(file / "results.nc")], check=True, capture_output=True, text=True
        )
        chances[name] = json.loads(page_of.stdout)
    for item, chance in chances["before"].items():
        assert plain(chance) in lines[item]
    assert {item: cells[-1] for item, cells in lines.items()} == {
        item: plain(chance) for item, chance in chances["after"].items()
    }
    for name in results:
        command("report", out[name])
        page.visit(f"{address}/report/{name}")
        assert page.complaints == []
        printed = base64.b64decode(page.ask("Page.printToPDF")["data"])
        assert printed.startswith(b"%PDF")
        shown = page.run("document.body.innerText")
        page.visit((out[name] / "report.html").as_uri())
        of_command = page.run("document.body.innerText")
        # (apart from the place and the hash of the file, which was decided again for the budget)
        folders = f"building.live{'.after' * (name == 'after')}.results", f"command {name}"
        texts = [HASH.sub("", text.replace(part, "")) for text, part in zip((shown, of_command), folders, strict=True)]
        assert texts[0] == texts[1]


PIECES = """
import json, sys
from pathlib import Path
from toppling.studies.report.results_file import read_results
from toppling.studies.tables.pieces import pieces
with read_results(Path(sys.argv[1])) as results:
    table = pieces(results, 0)
print(json.dumps(dict(zip(table.column("item"), table.texts("chance")))))
"""


def test_the_state_outlives_the_process_and_opens_by_its_file(page, folder, browser):
    with served(folder, folder / state.BUILDING_STATE) as address:
        assert address.endswith("/building")
        browser.visit(address)
        settled(browser)
        assert browser.run("document.getElementById('anchor-0').checked") is True
        assert browser.run("document.getElementById('floor-2').value") == "0"
        assert browser.run("document.querySelectorAll('#ranking tbody tr').length") == 4


def test_by_keyboard_alone(page, browser, address):
    browser.visit(address)
    settled(browser)
    reached = browser.reached(120)
    for control in ("file", "cell-h-0", "cell-0-0", "budget", "sum", "anchor-0", "floor-1", "which"):
        assert control in reached, control
    browser.run("document.getElementById('anchor-1').focus()")
    before = int(browser.run("document.body.dataset.version"))
    browser.press(" ", "Space", 32)
    settled(browser, before)
    assert browser.run("document.getElementById('anchor-1').checked") is True
    assert browser.run("document.activeElement.id") == "anchor-1"


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("dark", [False, True])
def test_widths_names_and_policy(page, browser, address, width, dark):
    browser.visit(address, width, dark=dark)
    settled(browser)
    browser.check_fit(width, dark)
    assert browser.run("document.querySelector('b, i')") is None
