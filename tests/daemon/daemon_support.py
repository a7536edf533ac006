"""Starts thermbald beside a module and talks to it as any client would. Nothing here is shared with the programs."""
import json
import os
import pathlib
import shutil
import signal
import socket
import sqlite3
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "peers"))
from sim_support import Simulator, skip  # noqa: E402,F401  (re-exported)
from waiting import wait_until  # noqa: E402

BIN = pathlib.Path(os.environ["THERMBAL_BIN_DIR"])
SOURCE = pathlib.Path(os.environ["THERMBAL_SOURCE_DIR"])
DAEMON = str(BIN / "thermbald")
CTL = str(BIN / "thermbalctl")


def toml(value):
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {toml(of_key)}" for key, of_key in value.items()) + " }"
    return json.dumps(value)  # strings, numbers, booleans and lists read the same in TOML


def configuration(folder, line, *, units=((1, 16),), profile="generic-16x-int16", required=None, test=None,
                  identification=None, stop=None):
    """A configuration file with one line, its units of so many inputs, and T1 ... T16 on them in order."""
    tables = [("[test]", {"start": "auto", **(test or {})}),
              ("[store]", {"path": f"{folder}/test.db"}),
              ("[service]", {"socket": f"{folder}/daemon.sock"}),
              ("[identification]", {"sweep_always": False, **(identification or {})}),
              ("[stop]", stop or {}),
              ("[[line]]", {"name": "module", **line})]
    channel = 0
    for number, (unit_id, inputs) in enumerate(units):
        tables.append(("[[unit]]", {"name": f"u{number}", "line": "module", "unit_id": unit_id, "profile": profile}))
        for number_on_unit in range(inputs):
            channel += 1
            entry = {"name": f"T{channel}", "unit": f"u{number}", "input": number_on_unit + 1,
                     "role": "ambient" if channel == 1 else "structure"}
            if required is not None:
                entry["required"] = entry["name"] in required
            tables.append(("[[channel]]", entry))
    text = "\n".join(head + "\n" + "".join(f"{key} = {toml(value)}\n" for key, value in body.items())
                     for head, body in tables)
    path = pathlib.Path(folder) / "thermbald.toml"
    path.write_text(text, encoding="utf-8")
    return str(path)


class Daemon:
    """`with Daemon(folder, config, "--lockstep") as daemon:`"""

    def __init__(self, folder, config, *flags):
        self.folder = folder
        self.log_path = pathlib.Path(folder) / "daemon.log"
        self.log = open(self.log_path, "ab")
        self.process = subprocess.Popen(
            [DAEMON, "--config", config, "--profiles", str(SOURCE / "config/profiles"), *flags],
            stdin=subprocess.DEVNULL, stdout=self.log, stderr=self.log)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            try:
                self.process.wait(timeout=30)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        self.log.close()

    def answer(self, method, **params):
        """The line that the daemon answers with."""
        with socket.socket(socket.AF_UNIX) as connection:
            connection.settimeout(30)
            connection.connect(f"{self.folder}/daemon.sock")
            request = {"jsonrpc": "2.0", "id": 1, "method": method, "params": params}
            connection.sendall(json.dumps(request).encode() + b"\n")
            return connection.makefile().readline()

    def call(self, method, **params):
        reply = json.loads(self.answer(method, **params))
        if "error" in reply:
            raise RuntimeError(reply["error"]["message"])
        return reply["result"]

    def try_call(self, method, **params):
        try:
            return self.call(method, **params)
        except (OSError, ValueError):
            return None

    def wait_for(self, method, condition, what, seconds=60):
        def asked():
            if self.process.poll() is not None:
                raise AssertionError(f"the daemon ended with {self.process.returncode}:\n{self.log_text()}")
            answer = self.try_call(method)
            return answer if answer is not None and condition(answer) else None
        return wait_until(asked, what, seconds)

    def wait_ended(self, seconds):
        try:
            return self.process.wait(timeout=seconds)
        except subprocess.TimeoutExpired as late:
            raise AssertionError(f"the daemon still runs after {seconds} s:\n{self.log_text()}") from late

    def log_text(self):
        return self.log_path.read_text(encoding="utf-8", errors="replace")[-4000:]

    def memory_bytes(self):
        with open(f"/proc/{self.process.pid}/statm", encoding="ascii") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGESIZE")

    def descriptors(self):
        return len(os.listdir(f"/proc/{self.process.pid}/fd"))


def database(folder):
    connection = sqlite3.connect(f"file:{folder}/test.db?mode=ro", uri=True)
    connection.row_factory = sqlite3.Row
    return connection


def scratch():
    return tempfile.TemporaryDirectory(prefix="thermbal-")


def control(*arguments, seconds=120):
    done = subprocess.run([CTL, *arguments], capture_output=True, text=True, timeout=seconds)
    assert done.returncode == 0, (arguments, done.returncode, done.stderr)
    return done.stdout


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def need(program, package):
    if shutil.which(program) is None:
        skip(f"{program} is not installed ({package})")


def run(tests):
    for test in tests:
        started = time.monotonic()
        test()
        print(f"ok   {test.__name__} ({time.monotonic() - started:.1f} s)", flush=True)
