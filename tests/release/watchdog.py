#!/usr/bin/python3
"""What systemd hears: READY before any module answers; the watchdog is fed while the lines and the store make progress, also
when no module answers, and is not fed while a line or the store hangs in the kernel, each by itself."""
import os
import pathlib
import socket
import subprocess
import sys
import time

sys.path.insert(0, os.path.join(os.environ["THERMBAL_SOURCE_DIR"], "tests", "daemon"))
from daemon_support import DAEMON, SOURCE, Simulator, configuration, free_port, run, scratch  # noqa: E402

HOLD = pathlib.Path(os.environ["THERMBAL_BIN_DIR"]).parent / "tests" / "libhold.so"
PERIOD_S = 0.5
# Three periods and 5 s (loop.cpp), and something for a busy host.
STANDSTILL_S = 3 * PERIOD_S + 5.0


class Watched:
    """A daemon as systemd runs it, with a watchdog of 1 s: it is due to tell every 0.5 s."""

    def __init__(self, folder, port):
        self.folder = pathlib.Path(folder)
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(f"{folder}/notify")
        config = configuration(folder, {"transport": "tcp", "host": "127.0.0.1", "port": port, "response_timeout_ms": 20,
                                        "connect_timeout_ms": 20}, test={"period_s": PERIOD_S})
        self.log = open(f"{folder}/log", "wb")
        self.process = subprocess.Popen(
            [DAEMON, "--config", config, "--profiles", str(SOURCE / "config/profiles")], stderr=self.log,
            env={**os.environ, "NOTIFY_SOCKET": f"{folder}/notify", "WATCHDOG_USEC": "1000000", "LD_PRELOAD": str(HOLD),
                 "THERMBAL_HOLD_STORE": f"{folder}/hold_store", "THERMBAL_HOLD_LINE": f"{folder}/hold_line"})

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for name in ("hold_store", "hold_line"):
            self.let_go(name)
        self.process.terminate()
        self.process.wait(timeout=30)
        self.socket.close()
        self.log.close()

    def hold(self, name):
        (self.folder / name).touch()

    def let_go(self, name):
        (self.folder / name).unlink(missing_ok=True)

    def heard(self, word, seconds):
        """Whether a message with the word comes within so many seconds."""
        give_up = time.monotonic() + seconds
        while (left := give_up - time.monotonic()) > 0:
            self.socket.settimeout(left)
            try:
                if word in self.socket.recv(4096).decode():
                    return True
            except TimeoutError:
                return False
        return False

    def log_text(self):
        return (self.folder / "log").read_text(encoding="utf-8", errors="replace")


def falls_silent(daemon, held):
    assert daemon.heard("WATCHDOG=1", 10), daemon.log_text()
    daemon.hold(held)
    daemon.heard("nothing", STANDSTILL_S + 1.0)  # listening, as systemd does: ten messages fill the socket
    assert not daemon.heard("WATCHDOG=1", 2.5), f"fed in spite of {held}"
    daemon.let_go(held)
    assert daemon.heard("WATCHDOG=1", 10), "not fed when the work went on: " + daemon.log_text()


def ready_and_fed_without_a_module():
    with scratch() as folder, Watched(folder, free_port()) as daemon:
        assert daemon.heard("READY=1", 10), daemon.log_text()
        for _ in range(int((STANDSTILL_S + 2.0) / 0.5)):
            assert daemon.heard("WATCHDOG=1", 5), daemon.log_text()


def silent_while_a_line_hangs():
    with scratch() as folder, Simulator() as sim, Watched(folder, sim.port) as daemon:
        falls_silent(daemon, "hold_line")
        assert "line module has made no progress" in daemon.log_text(), daemon.log_text()


def silent_while_the_store_hangs():
    with scratch() as folder, Simulator() as sim, Watched(folder, sim.port) as daemon:
        falls_silent(daemon, "hold_store")


if __name__ == "__main__":
    run([ready_and_fed_without_a_module, silent_while_a_line_hangs, silent_while_the_store_hangs])
