"""The steps of docs/tutorials/owner.md on the live page; run as a program, it draws the tutorial's pictures."""

import base64
import json
import sys
import tempfile
from pathlib import Path

from live_page import LivePage, served

from toppling.studies.command.cli import main as command

PICTURES = Path(__file__).resolve().parents[2] / "docs/tutorials"
WIDTH, HEIGHT = 1180, 700
SET = """(() => {{ const field = document.getElementById({name}); field.focus();
  if (field.type === 'checkbox') field.checked = {value}; else field.value = {value};
  for (const kind of ['input', 'change']) field.dispatchEvent(new Event(kind, {{bubbles: true}})); }})()"""


def put(page, name, value):
    """Set a field of a building's page, and wait until the runs that follow have ended."""
    before = page.run("document.body.dataset.version")
    page.run(SET.format(name=json.dumps(name), value=json.dumps(value)))
    settled(page, before)


def settled(page, before=0):
    """Wait until the runs after a version of a building's page have ended."""
    page.wait(f"document.body.dataset.running === 'false' && Number(document.body.dataset.version) > {before}", 300)


def seen(page, *names):
    """Return the texts of parts of the page."""
    return "\n".join(page.run(f"document.getElementById('{name}').innerText") for name in names)


def picture(page, name):
    """Return a picture of the page from a part on."""
    top = page.run(f"document.getElementById('{name}').getBoundingClientRect().top + scrollY - 12")
    clip = {"x": 0, "y": top, "width": WIDTH, "height": HEIGHT, "scale": 1}
    shot = page.ask("Page.captureScreenshot", format="png", captureBeyondViewport=True, clip=clip)
    return base64.b64decode(shot["data"])


def walk(folder):
    """Yield the name of each step, the text that the page then shows, and its picture."""
    page = LivePage()
    try:
        with served(folder) as address:
            page.visit(address, WIDTH)
            page.complete(0)
            page.change("wall", "yes")
            page.change("blocks-0-wall_gap_mm", "2")
            page.wait("document.body.dataset.complete === document.body.dataset.version")
            page.wait("document.querySelectorAll('#remedies tbody tr').length === 3")
            yield "piece", seen(page, "answer", "remedies"), picture(page, "form")
        assert command(["new", "inventory", str(folder / "office")]) == 0
        with served(folder, folder / "office/study.toml") as address:
            page.visit(address, WIDTH)
            settled(page)
            yield "building", seen(page, "result"), b""
            put(page, "budget", 200)
            yield "budget", seen(page, "chosen"), b""
            before = page.run("document.body.dataset.version")
            page.run("document.querySelector('[data-path=take]').click()")
            settled(page, before)
            yield "after", seen(page, "result"), picture(page, "result")
    finally:
        page.close()


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as made:
        for step, text, png in walk(Path(made)):
            print(f"## {step}\n{text}", file=sys.stderr)
            if png:
                (PICTURES / f"owner_{step}.png").write_bytes(png)
