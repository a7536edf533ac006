#!/usr/bin/python3
"""thermbald while it identifies without a pause: how late scans start against their grid, CPU per scan, memory, how long an
identification takes. Time runs --scale times as fast, so that 400 min of test take minutes; lateness is real milliseconds.

  THERMBAL_BIN_DIR=build/bin THERMBAL_SOURCE_DIR=. tests/bench/daemon/under_load.py [--scans 2000] [--scale 60]
      [--channels 16] [--period-s 15] [--sweep always|needed|none]"""
import argparse
import pathlib
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent.parent / "daemon"))
from daemon_support import Daemon, Simulator, configuration, database, scratch  # noqa: E402

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--scans", type=int, default=2000)
parser.add_argument("--scale", type=float, default=60.0)
parser.add_argument("--channels", type=int, default=16, help="a multiple of 16: one unit each")
parser.add_argument("--period-s", type=float, default=15.0)
parser.add_argument("--sweep", choices=["always", "needed", "none"], default="always",
                    help="none: no identification at all")
args = parser.parse_args()
units = args.channels // 16


def row(name, value):
    print(f"{name:44} {value}", flush=True)


with scratch() as folder, Simulator("--time-scale", str(args.scale), "--units", ",".join(["16"] * units)) as sim:
    line = {"transport": "tcp", "host": "127.0.0.1", "port": sim.port}
    every_s = 3600.0 if args.sweep == "none" else args.period_s
    config = configuration(folder, line, units=[(k + 1, 16) for k in range(units)],
                           test={"period_s": args.period_s, "keep_measuring": True},
                           identification={"every_s": every_s, "sweep_always": args.sweep == "always"})
    with Daemon(folder, config, "--time-scale", str(args.scale)) as daemon:
        started = time.monotonic()
        daemon.wait_for("status", lambda s: s["test"] and s["test"]["scans"] > 2, "the first scans", 60)
        cpu_before, scans_before = daemon.call("health")["cpu_s"], daemon.call("status")["test"]["scans"]
        daemon.wait_for("status", lambda s: s["test"]["scans"] >= args.scans, f"{args.scans} scans",
                        60 + 2 * args.scans * args.period_s / args.scale)
        health, status = daemon.call("health"), daemon.call("status")
        memory = daemon.memory_bytes()
    scans = status["test"]["scans"] - scans_before
    late = health["lateness_ms"]
    row("scans, real period", f"{scans}, {1000 * args.period_s / args.scale:g} ms; {health['scans']}")
    row("lateness p50 / p99 / p99.9 / max, real ms",
        " / ".join(f"{late[key] / args.scale:.3f}" for key in ("p50", "p99", "p999", "max")))
    row("CPU per scan, ms", f"{1000 * (health['cpu_s'] - cpu_before) / scans:.3f}")
    row("memory now / highest, MiB", f"{memory / 2**20:.1f} / {health['max_rss_bytes'] / 2**20:.1f}")
    row("identifications, p50 / max, real s", f"{health['identification_s']['count']}, "
        f"{health['identification_s']['p50']:.2f} / {health['identification_s']['max']:.2f}")
    row("age of the identification, scans", f"{status['test'].get('identification_age_s')} s of test")
    line_of_daemon, commit = health["lines"][0], health["commit_ms"]
    row("line: timeouts / reconnects", f"{line_of_daemon['timeouts']} / {line_of_daemon['reconnects']}")
    row("commit p50 / p99.9 / max, ms", " / ".join(f"{commit[key]:.3f}" for key in ("p50", "p999", "max")))
    with database(folder) as stored:
        for kind, message in stored.execute("SELECT kind, message FROM events WHERE kind IN ('scans_late', 'scans_missed')"):
            row(kind, message)
    row("real time, s", f"{time.monotonic() - started:.0f}")
