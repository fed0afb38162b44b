"""A headless Chromium driven through its own protocol: one WebSocket, no driver, nothing downloaded."""

import base64
import contextlib
import json
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

from websockets.sync.client import connect

FLAGS = [
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-extensions"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage"),
    *("--hide-scrollbars", "--remote-debugging-port=0"),
]


def executable():
    return shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


class Browser:
    def __init__(self, width=1100, height=720):
        # Helper processes may write to the profile while it is being removed.
        self.profile = tempfile.TemporaryDirectory(prefix="pleinair-chromium-", ignore_cleanup_errors=True)
        command = [executable(), *FLAGS, f"--window-size={width},{height}", f"--user-data-dir={self.profile.name}"]
        self.process = subprocess.Popen([*command, "about:blank"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.socket, self.stack = None, contextlib.ExitStack()
        try:
            port = Path(self.profile.name, "DevToolsActivePort")
            self.wait(lambda: port.exists() and port.read_text().count("\n") == 1, 30, "Chromium did not start")
            number, path = port.read_text().split()
            address = f"ws://127.0.0.1:{number}{path}"
            self.socket = self.stack.enter_context(connect(address, max_size=None, proxy=None, compression=None))
            self.count, self.session = 0, None
            pages = self.call("Target.getTargets")["targetInfos"]
            target = next(p["targetId"] for p in pages if p["type"] == "page")
            self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
            size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
            self.call("Emulation.setDeviceMetricsOverride", **size)
        except BaseException:
            self.close()
            raise

    @staticmethod
    def wait(ready, seconds, complaint):
        end = time.monotonic() + seconds
        while not (found := ready()):
            if time.monotonic() > end:
                raise TimeoutError(complaint)
            time.sleep(0.01)
        return found

    def call(self, method, **parameters):
        self.count += 1
        message = {"id": self.count, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        self.socket.send(json.dumps(message))
        while True:
            answer = json.loads(self.socket.recv(timeout=60))
            if answer.get("id") == self.count:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]

    def open(self, address):
        self.call("Page.navigate", url=address)

    def run(self, script):
        """Evaluate an expression, waiting for promises."""
        answer = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in answer:
            raise RuntimeError(answer["exceptionDetails"].get("exception", {}).get("description", str(answer)))
        return answer["result"].get("value")

    def until(self, script, seconds=20):
        try:
            return self.wait(lambda: self.run(script), seconds, "")
        except TimeoutError:
            raise TimeoutError(f"never true: {script}; errors of the page: {self.run('window.errors')}") from None

    def key(self, name, code, text=""):
        where = {"key": name, "code": name, "windowsVirtualKeyCode": code, "nativeVirtualKeyCode": code}
        self.call("Input.dispatchKeyEvent", type="keyDown" if text else "rawKeyDown", text=text, **where)
        self.call("Input.dispatchKeyEvent", type="keyUp", **where)

    def mouse(self, kind, x, y, **rest):
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", **rest)

    def screenshot(self, path):
        data = self.call("Page.captureScreenshot", format="png")["data"]
        Path(path).write_bytes(base64.b64decode(data))

    def close(self):
        # Whatever state it is in, it must end.
        with contextlib.suppress(Exception):
            if self.socket is not None:
                self.session = None
                self.call("Browser.close")
                self.process.wait(10)
        self.stack.close()
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait(10)
        self.profile.cleanup()
