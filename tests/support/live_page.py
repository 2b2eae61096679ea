"""The live page in headless Chromium: the command as a process, and a browser that types, slides and reads."""

import base64
import contextlib
import json
import os
import subprocess
import sys
import time

import pytest
from browser import CHROMIUM, Browser

NAMES = """[
  ...document.querySelectorAll('input, select, button, summary, progress, [role="img"]')
].filter((element) => {
  const label = element.labels && element.labels.length ? element.labels[0].textContent : '';
  return !(label || element.getAttribute('aria-label') || element.textContent).trim();
}).map((element) => element.outerHTML)"""
IDS = (
    "(() => { const ids = [...document.querySelectorAll('[id]')].map((element) => element.id); "
    "return ids.length - new Set(ids).size; })()"
)
WIDTHS = (380, 768, 1440)
needs_chromium = [pytest.mark.slow, pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium or Chrome")]


@pytest.fixture(scope="module")
def browser():
    made = LivePage()
    yield made
    made.close()


class LivePage(Browser):
    """A browser with a page that stays open."""

    def visit(self, url, width=1440, *, dark=False, height=900):
        """Open a page at a width, in light or dark."""
        features = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
        self.ask("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        self.ask("Emulation.setEmulatedMedia", media="", features=features)
        self.events.clear()
        self.ask("Page.navigate", url=url)
        while not any(event.get("method") == "Page.loadEventFired" for event in self.events):
            self.events.append(self.message())

    def run(self, script):
        """Return the value of a script on the page."""
        got = self.ask("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in got, got
        return got["result"].get("value")

    def wait(self, script, seconds=120.0):
        """Wait until a script on the page gives something true, and return it."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            found = self.run(script)
            if found:
                return found
            time.sleep(0.05)
        raise AssertionError(f"not within {seconds} s: {script}")

    def complete(self, version):
        """Wait until the full answer of a version is shown."""
        return self.wait(f"Number(document.body.dataset.complete) >= {version}")

    def change(self, element, value):
        """Type a value into a field, or choose it, and leave the field; return when the page has answered."""
        before = self.run("document.body.dataset.version")
        self.put(element, value, "change")
        self.wait(
            f"document.body.dataset.version !== {json.dumps(before)} || !document.getElementById('message').hidden"
        )

    def put(self, element, value, *events):
        """Set a field, and tell the page."""
        told = "".join(f"field.dispatchEvent(new Event('{event}', {{bubbles: true}}));" for event in events)
        given = ("checked" if isinstance(value, bool) else "value") + f" = {json.dumps(value)}"
        self.run(
            f"(() => {{ const field = document.getElementById({json.dumps(element)}); field.focus(); "
            f"field.{given}; {told} }})()"
        )

    def check_fit(self, width, dark):
        """Assert that nothing is wider than the page, every control has a name, and the console is silent."""
        assert self.run("document.documentElement.scrollWidth") <= width
        assert self.run(NAMES) == []
        assert self.run(IDS) == 0
        colour = self.run("getComputedStyle(document.body).backgroundColor")
        assert colour == ("rgb(20, 24, 28)" if dark else "rgb(255, 255, 255)")
        assert self.complaints == []

    def reached(self, number):
        """Press the tab key so many times, and return what was reached."""
        self.run("document.activeElement.blur()")
        found = []
        for _ in range(number):
            self.press("Tab", "Tab", 9)
            found.append(self.run("document.activeElement.id || document.activeElement.textContent.trim()"))
        assert found[0] == "Skip to the answer"
        return found

    def press(self, key, code, number, modifiers=0):
        """Press a key."""
        about = {"key": key, "code": code, "windowsVirtualKeyCode": number, "modifiers": modifiers}
        text = {"text": key} if len(key) == 1 else {"text": "\r"} if key == "Enter" else {}
        self.ask("Input.dispatchKeyEvent", type="keyDown", **about, **text)
        self.ask("Input.dispatchKeyEvent", type="keyUp", **about)

    def picture(self):
        """Return a picture of the whole page."""
        shot = self.ask("Page.captureScreenshot", format="png", captureBeyondViewport=True)
        return base64.b64decode(shot["data"])

    @property
    def complaints(self):
        """What the console of the page shows."""
        kinds = ("Log.entryAdded", "Runtime.consoleAPICalled", "Runtime.exceptionThrown")
        return [event["params"] for event in self.events if event.get("method") in kinds]


@contextlib.contextmanager
def served(folder, *arguments):
    """Run `toppling app` in a folder until the block ends; gives the address of the page. No traceback may be shown."""
    process = subprocess.Popen(
        [sys.executable, "-m", "toppling", "app", *map(str, arguments), "--no-browser"],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )
    try:
        address = process.stdout.readline().strip()
        assert address.startswith("http://127.0.0.1:"), process.stderr.read()
        yield address
    finally:
        process.terminate()
        process.wait(20)
        shown = process.stderr.read()
        process.stdout.close()
        process.stderr.close()
    assert "Traceback" not in shown, shown
