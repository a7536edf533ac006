"""Starts thermbal-sim for a test and ends it again; nothing of the module's protocol is in here."""
import csv
import os
import signal
import subprocess
import sys
import tempfile

PROGRAM = os.path.join(os.environ["THERMBAL_BIN_DIR"], "thermbal-sim")
NOISE_FREE = ["--noise-C", "0", "--round-C", "0"]


def skip(reason):
    print("skipped:", reason)
    sys.exit(77)


class Simulator:
    """`with Simulator("--lockstep", "15") as sim:` gives sim.port, or sim.path with --rtu; sim.lines() after the end."""

    def __init__(self, *flags):
        self.process = subprocess.Popen([PROGRAM, *flags], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        ready = self.process.stdout.readline().split()
        if not ready or ready[0] != "ready":
            raise RuntimeError("thermbal-sim did not start: " + self.process.communicate(timeout=10)[1])
        self.addresses = ready[2:]
        self.path = ready[2] if ready[1] == "rtu" else None
        self.port = int(ready[2].rsplit(":", 1)[1]) if ready[1] == "tcp" else None
        self.output = None

    def __enter__(self):
        return self

    def stop(self, number=signal.SIGTERM):
        if self.output is None:
            self.process.send_signal(number)
            self.output = self.process.communicate(timeout=10)[0]
        return self.process.returncode

    def lines(self):
        self.stop()
        return self.output.splitlines()

    def __exit__(self, *_):
        self.stop()


def recorded(*flags):
    """Rows of `thermbal-sim --csv` as {column: [values]}."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "warm_up.csv")
        subprocess.run([PROGRAM, "--csv", path, *flags], check=True, timeout=60)
        with open(path, encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    return {name: [float(row[name]) for row in rows] for name in rows[0]}


def tenths(columns, time_s):
    """T1 ... T16 of a noise-free recording at a time, as the tenths of a degree that a module sends."""
    row = columns["time_s"].index(time_s)
    return [round(columns[f"T{k}"][row] * 10) for k in range(1, 17)]


def signed(word):
    return word - 65536 if word >= 32768 else word
