"""Drives a headless Chromium over its DevTools protocol, for tests of the page."""

from __future__ import annotations

import asyncio
import base64
import json
import os
import shutil
import subprocess
import tempfile
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tornado.websocket import WebSocketClientConnection, websocket_connect

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
PATIENCE = 60.0  # s, for one answer


def chromium() -> str | None:
    """Path of an installed Chromium; None without."""
    return next((path for path in map(shutil.which, NAMES) if path), None)


class Tab:
    """One open page. `errors` holds uncaught exceptions and messages of the console's error level.

    `requests` holds the addresses that the page asked for.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, socket: WebSocketClientConnection) -> None:
        self._loop, self._socket, self._count = loop, socket, 0
        self.errors: list[str] = []
        self.requests: list[str] = []
        self._loaded = False
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Send one command and wait for its answer."""
        self._count += 1
        message = {"id": self._count, "method": method, "params": parameters}

        async def exchange() -> dict[str, Any]:
            await self._socket.write_message(json.dumps(message))
            while True:
                text = await asyncio.wait_for(self._socket.read_message(), PATIENCE)
                assert text is not None, "the browser has gone"
                answer = json.loads(text)
                if answer.get("id") == message["id"]:
                    assert "error" not in answer, answer
                    return answer["result"]
                self._note(answer.get("method", ""), answer.get("params", {}))

        return self._loop.run_until_complete(exchange())

    def _note(self, method: str, what: dict[str, Any]) -> None:
        if method == "Runtime.exceptionThrown":
            self.errors.append(json.dumps(what["exceptionDetails"])[:2000])
        elif method == "Runtime.consoleAPICalled" and what["type"] in ("error", "assert"):
            self.errors.append(json.dumps(what["args"])[:2000])
        elif method == "Log.entryAdded" and what["entry"]["level"] == "error":
            self.errors.append(what["entry"]["text"])
        elif method == "Network.requestWillBeSent":
            self.requests.append(what["request"]["url"])
        elif method == "Page.loadEventFired":
            self._loaded = True

    def run(self, script: str) -> Any:
        """Value of a JavaScript expression."""
        found = self.call(
            "Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True
        )
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def open(self, file: Path, width: int, height: int = 900) -> None:
        """Load a page at a width in CSS pixels, and wait until it stands."""
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height,
                  deviceScaleFactor=1, mobile=width < 600)  # fmt: skip
        self._loaded = False
        self.call("Page.navigate", url=file.resolve().as_uri())
        end = time.monotonic() + PATIENCE
        # asking reads the messages that came before the answer, among them that the page is there
        while not (self.run("document.readyState") == "complete" and self._loaded):
            assert time.monotonic() < end, "the page does not load"
            time.sleep(0.02)
        self.frames()

    def frames(self, count: int = 3) -> None:
        """Let the page draw."""
        self.run(
            f"new Promise(done => {{ let n = {count};"
            " const step = () => n-- > 0 ? requestAnimationFrame(step) : done(1); step(); })"
        )

    def drag(self, selector: str, start: float, end: float) -> None:
        """Drag across an element, from one fraction of its width to another."""
        box = self.run(
            f"(() => {{ const e = document.querySelector({json.dumps(selector)});"
            " e.scrollIntoView({block: 'center'}); const r = e.getBoundingClientRect();"
            " return [r.left, r.top, r.width, r.height]; })()"
        )
        y = box[1] + 0.5 * box[3]
        x0, x1 = (box[0] + part * box[2] for part in (start, end))
        for kind, x in (
            ("mouseMoved", x0), ("mousePressed", x0), ("mouseMoved", 0.5 * (x0 + x1)),
            ("mouseMoved", x1), ("mouseReleased", x1),
        ):  # fmt: skip
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left",
                      buttons=int(kind != "mouseReleased" and x != x0), clickCount=1)  # fmt: skip
        self.frames()

    def screenshot(self, file: Path) -> None:
        """Save the whole page as PNG."""
        data = self.call("Page.captureScreenshot", captureBeyondViewport=True)["data"]
        file.write_bytes(base64.b64decode(data))

    def pdf(self) -> bytes:
        """The page as it prints."""
        answer = self.call("Page.printToPDF", preferCSSPageSize=True, printBackground=True)
        return base64.b64decode(answer["data"])


@contextmanager
def browser(path: str) -> Iterator[Tab]:
    """A fresh Chromium with one tab."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        command = [path, "--headless", "--disable-gpu", "--no-first-run", "--disable-extensions",
                   "--remote-debugging-port=0", f"--user-data-dir={profile}"]  # fmt: skip
        if hasattr(os, "geteuid") and os.geteuid() == 0:
            command.append("--no-sandbox")
        process = subprocess.Popen(
            [*command, "about:blank"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        loop = asyncio.new_event_loop()
        try:
            address = _address(Path(profile) / "DevToolsActivePort")
            socket = loop.run_until_complete(_connected(address))
            yield Tab(loop, socket)
            socket.close()
        finally:
            process.terminate()
            process.wait(20)
            loop.run_until_complete(asyncio.sleep(0))
            loop.close()


async def _connected(address: str) -> WebSocketClientConnection:
    return await websocket_connect(address, max_message_size=100_000_000)


def _address(file: Path) -> str:
    """Where the tab listens."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        if file.exists() and file.read_text().strip():
            port = file.read_text().split()[0]
            with urllib.request.urlopen(f"http://127.0.0.1:{port}/json/list") as answer:
                pages = [t for t in json.load(answer) if t["type"] == "page"]
            if pages:
                return str(pages[0]["webSocketDebuggerUrl"])
        time.sleep(0.05)
    raise AssertionError("Chromium does not start")
