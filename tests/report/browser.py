"""Headless Chromium over the DevTools protocol: what a page says on its console, what it fetches, how it looks."""
import base64
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "peers"))
from waiting import wait_until  # noqa: E402

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")


def skip_without_chromium():
    """Ends a test with the status that CTest shows as skipped where there is no browser to ask."""
    try:
        import websocket  # noqa: F401
    except ImportError:
        print("skipped: python3-websocket is not installed")
        sys.exit(77)
    if CHROMIUM is None:
        print("skipped: chromium is not installed")
        sys.exit(77)


class Page:
    def __init__(self, browser, session):
        self.browser, self.session = browser, session
        self.troubles = []  # errors on the console, exceptions, what could not be loaded
        self.fetched = []
        self.loads = 0
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.ask(f"{domain}.enable")

    def ask(self, method, **params):
        return self.browser.ask(method, params, self.session)

    def hear(self, method, params):
        if method == "Runtime.exceptionThrown":
            self.troubles.append(params["exceptionDetails"].get("exception", {}).get("description", "exception"))
        elif method == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert"):
            self.troubles.append(" ".join(str(one.get("value", one.get("description"))) for one in params["args"]))
        elif method == "Log.entryAdded" and params["entry"]["level"] in ("error", "warning"):
            self.troubles.append(params["entry"]["text"])
        elif method == "Network.requestWillBeSent":
            self.fetched.append(params["request"]["url"])
        elif method == "Page.loadEventFired":
            self.loads += 1

    def size(self, width, height, mobile=False, scale=1):
        self.ask("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=mobile)
        self.ask("Emulation.setTouchEmulationEnabled", enabled=mobile)

    def scheme(self, name, media=""):
        self.ask("Emulation.setEmulatedMedia", media=media, features=[{"name": "prefers-color-scheme", "value": name}])

    def goto(self, url, limit_s=60):
        loads = self.loads
        answer = self.ask("Page.navigate", url=url)
        if answer.get("errorText"):
            raise AssertionError(f"{url}: {answer['errorText']}")
        self.browser.until(lambda: self.loads > loads, limit_s, f"{url} to load")

    def run(self, script):
        """The value of a JavaScript expression; a promise is waited for."""
        answer = self.ask("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise AssertionError(f"{script}: {answer['exceptionDetails']}")
        return answer["result"].get("value")

    def until(self, script, limit_s=60):
        self.browser.until(lambda: self.run(f"!!({script})"), limit_s, script)

    def draw_everything(self):
        """Brings every figure into view, so that every plot is drawn."""
        self.run("""(async () => {
            for (const figure of document.querySelectorAll('figure[data-plot]')) {
                figure.scrollIntoView({block: 'center'});
                await new Promise(done => setTimeout(done, 0));
                await new Promise(done => requestAnimationFrame(done));
            }
            scrollTo(0, 0);
        })()""")

    def drag(self, from_x, from_y, to_x, to_y):
        for kind, x, y in (("mouseMoved", from_x, from_y), ("mousePressed", from_x, from_y), ("mouseMoved", (from_x + to_x) / 2, to_y),
                           ("mouseMoved", to_x, to_y), ("mouseReleased", to_x, to_y)):
            self.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="none" if kind == "mouseMoved" and x == from_x else "left",
                     buttons=0 if kind == "mouseReleased" else 1, clickCount=1)

    def double_click(self, x, y):
        for clicks in (1, 2):
            for kind in ("mousePressed", "mouseReleased"):
                self.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=clicks)

    def screenshot(self, path, whole=True):
        picture = self.ask("Page.captureScreenshot", format="png", captureBeyondViewport=whole,
                           **({"clip": self.whole_page()} if whole else {}))
        pathlib.Path(path).write_bytes(base64.b64decode(picture["data"]))

    def whole_page(self):
        size = self.ask("Page.getLayoutMetrics")["cssContentSize"]
        return {"x": 0, "y": 0, "width": size["width"], "height": size["height"], "scale": 1}

    def pdf(self, path):
        printed = self.ask("Page.printToPDF", printBackground=False, paperWidth=8.27, paperHeight=11.69, preferCSSPageSize=True)
        pathlib.Path(path).write_bytes(base64.b64decode(printed["data"]))


class Browser:
    def __enter__(self):
        import websocket
        self.folder = tempfile.mkdtemp(prefix="thermbal-chromium-")
        self.process = subprocess.Popen(
            [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run", "--hide-scrollbars",
             "--disable-background-networking", "--disable-component-update", "--remote-debugging-port=0",
             "--remote-allow-origins=*", f"--user-data-dir={self.folder}", "about:blank"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            port_file = pathlib.Path(self.folder, "DevToolsActivePort")
            wait_until(lambda: port_file.exists() and port_file.read_text().count("\n") >= 1, "chromium to start", 60)
            port, path = port_file.read_text().split("\n")[:2]
            self.socket = websocket.create_connection(f"ws://127.0.0.1:{port}{path}", timeout=60)
        except BaseException:
            self.__exit__()
            raise
        self.pages, self.answers, self.last_id = {}, {}, 0
        return self

    def __exit__(self, *_):
        self.process.terminate()
        try:
            self.process.wait(timeout=10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)

    def until(self, holds, limit_s, what):
        end = time.monotonic() + limit_s
        while not holds():
            if time.monotonic() > end:
                raise AssertionError(f"waited {limit_s} s for {what}")
            self.read(0.05)

    def read(self, limit_s):
        import websocket
        self.socket.settimeout(limit_s)
        try:
            message = json.loads(self.socket.recv())
        except websocket.WebSocketTimeoutException:
            return
        if "id" in message:
            self.answers[message["id"]] = message
        elif message.get("sessionId") in self.pages:
            self.pages[message["sessionId"]].hear(message["method"], message.get("params", {}))

    def ask(self, method, params, session=None, limit_s=120):
        self.last_id += 1
        request = {"id": self.last_id, "method": method, "params": params}
        if session:
            request["sessionId"] = session
        self.socket.send(json.dumps(request))
        wanted = self.last_id
        self.until(lambda: wanted in self.answers, limit_s, method)
        answer = self.answers.pop(wanted)
        if "error" in answer:
            raise AssertionError(f"{method}: {answer['error']}")
        return answer["result"]

    def page(self):
        target = self.ask("Target.createTarget", {"url": "about:blank"})["targetId"]
        session = self.ask("Target.attachToTarget", {"targetId": target, "flatten": True})["sessionId"]
        page = Page.__new__(Page)
        self.pages[session] = page
        page.__init__(self, session)
        return page
