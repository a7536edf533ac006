"""A real mosquitto on the loopback, a subscriber, and databases to send: for broker_test.py and tests/bench/mqtt."""
import json
import os
import pathlib
import shutil
import signal
import socket
import sqlite3
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "peers"))
from waiting import wait_until  # noqa: E402

BIN = pathlib.Path(os.environ["THERMBAL_BIN_DIR"])
SOURCE = pathlib.Path(os.environ["THERMBAL_SOURCE_DIR"])
PUBLISHER = str(BIN / "thermbal-mqtt")
WRITER = str(BIN.parent / "tests" / "scan_writer")
# Debian puts the broker where only root's path leads.
BROKER = shutil.which("mosquitto", path=os.environ.get("PATH", "") + ":/usr/sbin")


def skip_without_mosquitto():
    if BROKER is None or shutil.which("mosquitto_sub") is None:
        print("skipped: mosquitto or mosquitto-clients is not installed")
        sys.exit(77)


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Broker:
    """mosquitto that keeps its messages over a kill, as far as it can: written at every change, or with many machines each
    second, as a plant's broker would. `extra` are further lines of its configuration."""

    def __init__(self, folder, extra="", written="at every change"):
        self.folder = pathlib.Path(folder)
        self.port = free_port()
        self.config = self.folder / "mosquitto.conf"
        user = "user root\n" if os.geteuid() == 0 else ""
        self.config.write_text(
            f"listener {self.port} 127.0.0.1\n{user}persistence true\npersistence_location {self.folder}/\n"
            f"autosave_interval 1\nautosave_on_changes {'true' if written == 'at every change' else 'false'}\n"
            f"max_queued_messages 0\n"
            f"{extra or 'allow_anonymous true'}\n", encoding="utf-8")
        self.process = None
        self.start()

    def start(self):
        with open(self.folder / "mosquitto.log", "ab") as log:
            self.process = subprocess.Popen([BROKER, "-c", str(self.config)], stdout=log, stderr=log)
        wait_until(self.listens, f"mosquitto listens: {self.log()}", 20)

    def listens(self):
        with socket.socket() as probe:
            return probe.connect_ex(("127.0.0.1", self.port)) == 0

    def kill(self):
        self.process.kill()
        self.process.wait()

    def log(self):
        return (self.folder / "mosquitto.log").read_text(encoding="utf-8", errors="replace")[-2000:]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.kill()


class Subscriber:
    """mosquitto_sub with a session of its own that outlives connections; messages() are (retained, topic, payload)."""

    def __init__(self, folder, port, topic="#", name="subscriber", flags=()):
        self.path = pathlib.Path(folder) / f"{name}.txt"
        self.file = open(self.path, "ab")
        self.process = subprocess.Popen(
            ["mosquitto_sub", "-h", "127.0.0.1", "-p", str(port), "-q", "1", "-c", "-i", name, "-t", topic,
             "-F", "%r\t%t\t%p", *flags], stdout=self.file, stderr=subprocess.DEVNULL)

    def messages(self):
        found = []
        # A line that is only half there yet comes with the next look.
        for line in self.path.read_bytes().decode("utf-8").split("\n")[:-1]:
            retained, topic, payload = line.split("\t", 2)
            found.append((retained == "1", topic, json.loads(payload) if payload else None))
        return found

    def stop(self):
        self.process.terminate()
        self.process.wait()
        self.file.close()


def configuration(folder, port, *, machine="VMC 850", mqtt=None, database="0.db"):
    settings = {"host": "127.0.0.1", "port": port, "settle_s": 2.0, **(mqtt or {})}
    text = f"""
[test]
machine = {json.dumps(machine)}
[store]
path = "{folder}/{database}"
[service]
socket = "{folder}/daemon.sock"
[mqtt]
""" + "".join(f"{key} = {json.dumps(value)}\n" for key, value in settings.items()) + """
[[line]]
transport = "tcp"
host = "127.0.0.1"
[[unit]]
profile = "generic-16x-int16"
[[channel]]
name = "T1"
input = 1
"""
    path = pathlib.Path(folder) / f"{database}.toml"
    path.write_text(text, encoding="utf-8")
    return str(path)


class Publisher:
    def __init__(self, folder, config, *flags, name="publisher", environment=None):
        self.log_path = pathlib.Path(folder) / f"{name}.log"
        with open(self.log_path, "ab") as log:
            self.process = subprocess.Popen(
                [PUBLISHER, "--config", config, "--profiles", str(SOURCE / "config/profiles"),
                 "--position-file", f"{folder}/{name}.json", *flags], stdout=log, stderr=log,
                env={**os.environ, **(environment or {})})

    def kill(self):
        self.process.kill()
        self.process.wait()

    def stop(self):
        self.process.send_signal(signal.SIGTERM)
        return self.process.wait(timeout=15)

    def log(self):
        return self.log_path.read_text(encoding="utf-8", errors="replace")


def write_databases(folder, databases, scans, every_ms):
    """Starts the writer; returns it when the databases are there."""
    writer = subprocess.Popen([WRITER, str(folder), str(databases), str(scans), str(every_ms)],
                              stdout=subprocess.PIPE, text=True)
    assert writer.stdout.readline() == "ready\n"
    return writer


def stored_samples(path):
    """(database, test, scan) -> {channel: (value_C, quality)} as it stands in the file, read without our programs."""
    with sqlite3.connect(f"file:{path}?mode=ro", uri=True) as connection:
        database = connection.execute("SELECT database_id FROM identity").fetchone()[0]
        scans = {}
        for test, scan, channel, value_C, quality in connection.execute(
                "SELECT test_id, scan, channel, value_C, quality FROM readings"):
            scans.setdefault((database, test, scan), {})[channel] = (value_C, quality)
    connection.close()
    return scans


def received_samples(messages):
    """The same from messages, the last one of each scan."""
    scans = {}
    for _, topic, payload in messages:
        if topic.endswith("/samples"):
            scans[payload["database"], payload["test"], payload["scan"]] = {
                channel: (sample["value_C"], sample["quality"]) for channel, sample in payload["samples"].items()}
    return scans
