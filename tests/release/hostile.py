#!/usr/bin/python3
"""Whether clients can move a scan: 10 000 malformed requests, 500 clients and a subscriber that never reads, against a daemon
that measures. Quiet and hostile stretches of the same run take turns, so that what else the machine does is in both.

    THERMBAL_BIN_DIR=build/release/bin THERMBAL_SOURCE_DIR=. tests/release/hostile.py [--rounds 4] [--scans 100]

The daemon and the module run at nice -19 where that is allowed, the clients at nice 10. Prints how late scans begin (against
their place in the grid) in both kinds of stretches; ends with 1 when a median or a 90 % differs by 1 ms, or a scan is missed.
"""
import argparse
import contextlib
import json
import os
import random
import socket
import statistics
import subprocess
import sys
import time

sys.path.insert(0, os.path.join(os.environ["THERMBAL_SOURCE_DIR"], "tests", "daemon"))
from daemon_support import Daemon, Simulator, configuration, database, scratch  # noqa: E402

PERIOD_S = 0.2
REQUESTS = 10_000
CLIENTS = 500


def malformed(rng):
    kind = rng.randrange(5)
    if kind == 0:
        return bytes(rng.randrange(256) for _ in range(rng.randrange(200))).replace(b"\n", b"") + b"\n"
    if kind == 1:
        return b"[" * rng.randrange(1, 5000) + b"\n"
    if kind == 2:
        return json.dumps({"jsonrpc": "2.0", "id": 1, "method": "samples", "params": {"from_scan": "x" * rng.randrange(2000)}}
                          ).encode() + b"\n"
    if kind == 3:
        return b'{"jsonrpc":"2.0","id":1,"method":"' + b"a" * rng.randrange(1000) + b'"}\n'
    return b'{"jsonrpc":"2.0","id":' + b"9" * rng.randrange(300) + b',"method":"status"\n'


def attack(path, seed, seconds):
    """The requests over a few connections, spread over the stretch as fast as they are taken; 500 connections beside them."""
    rng = random.Random(seed)
    end = time.monotonic() + seconds
    figures = {"requests": 0, "answers": 0, "clients": 0, "refused": 0}
    with contextlib.ExitStack() as stack:
        def connect():
            client = stack.enter_context(socket.socket(socket.AF_UNIX))
            client.settimeout(5)
            client.connect(path)
            return client
        deaf = connect()
        deaf.sendall(b'{"jsonrpc":"2.0","id":1,"method":"subscribe"}\n')
        askers, crowd = [connect() for _ in range(10)], []
        while figures["requests"] < REQUESTS or (figures["clients"] < CLIENTS and time.monotonic() < end):
            if figures["clients"] < CLIENTS:
                crowd.append(connect())
                figures["clients"] += 1
            if figures["requests"] < REQUESTS:
                asker = askers[figures["requests"] // 20 % len(askers)]
                try:
                    asker.sendall(b"".join(malformed(rng) for _ in range(20)))
                    figures["requests"] += 20
                    asker.setblocking(False)
                    with contextlib.suppress(BlockingIOError):
                        figures["answers"] += asker.recv(1 << 20).count(b"\n")
                    asker.settimeout(5)
                except (ConnectionError, TimeoutError):
                    askers[askers.index(asker)] = connect()
        time.sleep(max(0.5, end - time.monotonic()))
        for client in crowd:
            client.setblocking(False)
            with contextlib.suppress(BlockingIOError, ConnectionError):
                figures["refused"] += b"too many" in client.recv(4096)
    return figures


def lateness_ms(folder, first, last):
    with database(folder) as stored:
        rows = stored.execute("SELECT status, scheduled_ns, started_ns FROM scans WHERE scan BETWEEN ? AND ?",
                              (first, last)).fetchall()
    return ([(row["started_ns"] - row["scheduled_ns"]) * 1e-6 for row in rows if row["started_ns"] is not None],
            sum(row["status"] == "missed" for row in rows))


def summary(name, late, missed):
    ordered = sorted(late)
    figures = {"scans": len(ordered), "median": statistics.median(ordered), "p90": ordered[len(ordered) * 9 // 10],
               "p99": ordered[len(ordered) * 99 // 100], "most": ordered[-1], "missed": missed}
    print(f"{name:8} " + ", ".join(f"{key} {value:.3f}" if isinstance(value, float) else f"{key} {value}"
                                   for key, value in figures.items()), flush=True)
    return figures


def favour(process):
    subprocess.run(["renice", "-n", "-19", "-p", *os.listdir(f"/proc/{process.pid}/task")], capture_output=True, check=False)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=4)
    parser.add_argument("--scans", type=int, default=100, help="of one stretch")
    parser.add_argument("--attack", nargs=3, metavar=("SOCKET", "SEED", "SECONDS"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.attack:
        os.nice(10)
        print(json.dumps(attack(arguments.attack[0], int(arguments.attack[1]), float(arguments.attack[2]))))
        return 0
    with scratch() as folder, Simulator() as sim:
        line = {"transport": "tcp", "host": "127.0.0.1", "port": sim.port, "response_timeout_ms": 20, "connect_timeout_ms": 20}
        config = configuration(folder, line, test={"period_s": PERIOD_S}, identification={"every_s": 3600.0})
        with Daemon(folder, config) as daemon:
            daemon.wait_for("status", lambda s: s["test"] and s["test"]["scans"] > 10, "scans")
            favour(daemon.process)
            favour(sim.process)
            stretches = {"quiet": ([], 0), "hostile": ([], 0)}
            for number in range(2 * arguments.rounds):
                kind = ("quiet", "hostile")[number % 2]
                first, told = daemon.call("status")["test"]["scans"], ""
                seconds = arguments.scans * PERIOD_S
                if kind == "hostile":
                    told = subprocess.run([sys.executable, __file__, "--attack", f"{folder}/daemon.sock", str(number), str(seconds)],
                                          capture_output=True, text=True, check=True).stdout.strip()
                else:
                    time.sleep(seconds)
                last = daemon.call("status")["test"]["scans"] - 1
                late, missed = lateness_ms(folder, first, last)
                stretches[kind] = (stretches[kind][0] + late, stretches[kind][1] + missed)
                print(f"  {kind} {number}: {len(late)} scans {told}", flush=True)
    quiet, hostile = (summary(kind, *stretches[kind]) for kind in ("quiet", "hostile"))
    moved = {key: hostile[key] - quiet[key] for key in ("median", "p90", "p99", "most")}
    print("moved by, ms: " + ", ".join(f"{key} {value:+.3f}" for key, value in moved.items()))
    return 1 if moved["median"] >= 1.0 or moved["p90"] >= 1.0 or hostile["missed"] > quiet["missed"] else 0


if __name__ == "__main__":
    sys.exit(main())
