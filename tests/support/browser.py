"""Headless Chromium over its own pipe: what a page is at a width, what it asks for, and what it complains of."""

import base64
import fcntl
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
CHROMIUM = next((path for path in map(shutil.which, NAMES) if path), None)
AS_CHROMIUM_HAS_THEM = """
import os, sys
os.dup2(int(sys.argv[1]), 3)
os.dup2(int(sys.argv[2]), 4)
os.execv(sys.argv[3], sys.argv[3:])
"""
LOADED = ("Page.loadEventFired",)


class Seen(NamedTuple):
    """A page at a width: what a script says of it, its complaints, what it asked for, and its picture."""

    value: object
    complaints: list
    requests: list
    png: bytes


class Browser:
    """One browser for many pages; `close` it."""

    def __init__(self):
        self.folder = tempfile.mkdtemp(prefix="browser-")
        ends = [*os.pipe(), *os.pipe()]
        high = [fcntl.fcntl(end, fcntl.F_DUPFD, 60) for end in ends]
        for end in ends:
            os.close(end)
        reads, writes = high[0], high[3]

        sandbox = ["--no-sandbox"] if os.geteuid() == 0 else []
        self.process = subprocess.Popen(
            [
                *(sys.executable, "-c", AS_CHROMIUM_HAS_THEM, str(reads), str(writes)),
                CHROMIUM,
                *sandbox,
                "--headless=new",
                "--disable-gpu",
                "--disable-dev-shm-usage",
                "--disable-background-networking",
                "--hide-scrollbars",
                "--no-first-run",
                "--remote-debugging-pipe",
                f"--user-data-dir={self.folder}",
                "about:blank",
            ],
            pass_fds=(reads, writes),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(reads)
        os.close(writes)
        self.to, self.back = os.fdopen(high[1], "wb", buffering=0), os.fdopen(high[2], "rb", buffering=0)
        self.left, self.number, self.events = b"", 0, []
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        self.session = None
        self.session = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for name in ("Page", "Runtime", "Log", "Network"):
            self.ask(f"{name}.enable")

    def message(self):
        while b"\0" not in self.left:
            part = self.back.read(1 << 16)
            assert part, "the browser is gone"
            self.left += part
        one, _, self.left = self.left.partition(b"\0")
        return json.loads(one)

    def ask(self, method, **parameters):
        self.number += 1
        session = {"sessionId": self.session} if getattr(self, "session", None) else {}
        asked = {"id": self.number, "method": method, "params": parameters, **session}
        self.to.write(json.dumps(asked).encode() + b"\0")
        while True:
            got = self.message()
            if got.get("id") == self.number:
                assert "error" not in got, (method, got)
                return got["result"]
            self.events.append(got)

    def see(self, path, width, script, *, dark=False, picture=False, media=""):
        """A page at a width, in light or dark."""
        features = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
        self.ask("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=False)
        self.ask("Emulation.setEmulatedMedia", media=media, features=features)
        self.events.clear()
        url = Path(path).resolve().as_uri()
        self.ask("Page.navigate", url=url)
        while not any(one.get("method") in LOADED for one in self.events):
            self.events.append(self.message())
        got = self.ask("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in got, got
        png = b""
        if picture:
            shot = self.ask("Page.captureScreenshot", format="png", captureBeyondViewport=True)
            png = base64.b64decode(shot["data"])
        said = ("Log.entryAdded", "Runtime.consoleAPICalled", "Runtime.exceptionThrown")
        complaints = [one["params"] for one in self.events if one.get("method") in said]
        asked = [one["params"]["request"]["url"] for one in self.events if one["method"] == "Network.requestWillBeSent"]
        return Seen(got["result"].get("value"), complaints, [one for one in asked if one != url], png)

    def close(self):
        self.to.close()
        self.process.terminate()
        self.process.wait(20)
        self.back.close()
        shutil.rmtree(self.folder, ignore_errors=True)
