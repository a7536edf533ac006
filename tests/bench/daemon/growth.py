#!/usr/bin/python3
"""How the daemon grows with channels, scan period, length of the test and stored tests: thermbald and thermbal-sim over Modbus TCP
on loopback. Time runs so much faster that a scan is due each 200 ms; lateness is real milliseconds, CPU is user and system time. A
long test is one that was stored (stored_scans.py) and is taken up again.

  THERMBAL_BIN_DIR=build/bin THERMBAL_SOURCE_DIR=. tests/bench/daemon/growth.py [--only channels] [--json FILE]"""
import argparse
import contextlib
import dataclasses
import json
import pathlib
import resource
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent.parent / "daemon"))
from daemon_support import BIN, CTL, Daemon, Simulator, configuration, database, scratch  # noqa: E402
from stored_scans import copy_newest_test, lengthen_open_test  # noqa: E402

CHANNELS_A_UNIT = 16
LONGEST_EVERY_S = 3600.0
EVERY_S = 120.0
SCAN_S = 0.2   # real
REQUESTS = ("status", "channels", "samples", "predictions", "curve", "events", "health")
COMMANDS = (("status",), ("tests",), ("report", "--json"), ("export", "--csv", "-"))


@dataclasses.dataclass
class Case:
    group: str
    channels: int = 16
    period_s: float = 15.0
    stored_min: float = 0.0   # of the test that is taken up again
    stored_tests: int = 0

    def name(self):
        parts = [f"{self.channels} channels", f"{self.period_s:g} s"]
        if self.stored_min:
            parts.append(f"{self.stored_min:g} min" if self.stored_min < 1440 else f"{self.stored_min / 1440:g} days")
        if self.stored_tests:
            parts.append(f"{self.stored_tests} tests")
        return ", ".join(parts)

    def scale(self):
        """How much faster than time."""
        return self.period_s / SCAN_S


CASES = ([Case("channels", channels=count) for count in (16, 64, 256, 1024)]
         + [Case("period", period_s=period_s) for period_s in (5.0, 1.0)]
         + [Case("window", period_s=period_s, stored_min=minutes) for period_s in (15.0, 1.0)
            for minutes in (400.0, 7 * 1440.0)]
         + [Case("channels and window", channels=count, stored_min=400.0) for count in (256, 1024)]
         + [Case("tests", stored_tests=count) for count in (1, 100, 1000, 10000)])


def configured(case, folder, sim, every_s):
    units = case.channels // CHANNELS_A_UNIT
    # A line whose units are all silent has to be through with them within a period.
    timeout_ms = max(10, min(500, int(280.0 * case.period_s / units)))
    line = {"transport": "tcp", "host": "127.0.0.1", "port": sim.port, "response_timeout_ms": timeout_ms,
            "connect_timeout_ms": timeout_ms}
    return configuration(folder, line, units=[(k + 1, CHANNELS_A_UNIT) for k in range(units)],
                         test={"period_s": case.period_s, "keep_measuring": True},
                         identification={"every_s": every_s})


def scans_of(status):
    return status["test"]["scans"] if status["test"] else 0


def wait_for_scans(daemon, count, seconds):
    daemon.wait_for("status", lambda s: scans_of(s) >= count, f"{count} scans", seconds)


def median(values):
    return sorted(values)[len(values) // 2]


def request_cost(daemon, method, times=9):
    """Median wall time of a request, ms, and the bytes of its answer."""
    walls_ms, size = [], 0
    for _ in range(times):
        started = time.perf_counter()
        size = len(daemon.answer(method))
        walls_ms.append(1000 * (time.perf_counter() - started))
    return {"wall_ms": median(walls_ms), "bytes": size}


def command_cost(folder, command, times=3):
    """Median CPU and wall time of a client's command, the start of the process included, ms."""
    where = ["--socket", f"{folder}/daemon.sock"] + ([] if command[0] == "status" else ["--database", f"{folder}/test.db"])
    walls_ms, cpus_ms, most = [], [], 0
    for _ in range(times):
        before, started = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
        done = subprocess.run([CTL, *command, *where], stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=300)
        walls_ms.append(1000 * (time.perf_counter() - started))
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        cpus_ms.append(1000 * (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime))
        most = len(done.stdout)
        assert done.returncode == 0, (command, done.stderr)
    return {"wall_ms": median(walls_ms), "cpu_ms": median(cpus_ms), "bytes": most}


def database_bytes(folder):
    """With what is still in the write-ahead log."""
    with contextlib.closing(database(folder)) as opened:
        return opened.execute("PRAGMA page_count").fetchone()[0] * opened.execute("PRAGMA page_size").fetchone()[0]


def measured_scans(daemon, scale, count):
    """So many scans: lateness, CPU and bytes of each."""
    before, first, bytes_before = daemon.call("health"), scans_of(daemon.call("status")), database_bytes(daemon.folder)
    wait_for_scans(daemon, first + count, 600)
    after, scans = daemon.call("health"), scans_of(daemon.call("status")) - first
    late = after["lateness_ms"]
    return {"lateness_ms": {key: late[key] / scale for key in ("p50", "p99", "p999", "max")},
            "scans": scans, "late": after["scans"]["late"], "missed": after["scans"]["missed"],
            "commit_ms": after["commit_ms"]["p50"],
            "cpu_ms_a_scan": 1000 * (after["cpu_s"] - before["cpu_s"]) / scans,
            "database_bytes_a_scan": (database_bytes(daemon.folder) - bytes_before) / scans}


def wait_for_identification(daemon, seconds):
    """Gives up after a while: on a busy machine, identification is last."""
    deadline = time.monotonic() + seconds
    while daemon.call("health")["identification_s"]["count"] == 0 and time.monotonic() < deadline:
        time.sleep(0.1)


def oldest_identification_s(daemon):
    ages_s = [channel.get("identification_age_s") for channel in daemon.call("channels")["channels"]]
    ages_s = [age_s for age_s in ages_s if age_s is not None]
    return max(ages_s) if ages_s else None


def identifying(daemon, count, wait_s):
    """So many scans while identification runs every EVERY_S: what it costs and how old its oldest result gets."""
    before, first, oldest_s = daemon.call("health"), scans_of(daemon.call("status")), 0.0
    wait_for_identification(daemon, wait_s)
    while scans_of(daemon.call("status")) < first + count:
        oldest_s = max(oldest_s, oldest_identification_s(daemon) or 0.0)
        time.sleep(0.2)
    after, scans = daemon.call("health"), scans_of(daemon.call("status")) - first
    took = after["identification_s"]
    done = max(took["count"], 1)
    return {"identifications": took["count"], "cpu_s_an_identification": (after["cpu_s"] - before["cpu_s"]) / done,
            "identification_s": {"p50": took["p50"], "max": took["max"]},
            "oldest_identification_s": oldest_s,
            "cpu_ms_a_scan": 1000 * (after["cpu_s"] - before["cpu_s"]) / scans}


def begin(case, folder):
    """The database that a case starts from."""
    if case.stored_tests == 0 and case.stored_min == 0:
        return
    with simulator(case) as sim, running(case, folder, sim, LONGEST_EVERY_S) as daemon:
        wait_for_scans(daemon, 10, 60)
        if case.stored_tests:
            daemon.call("stop_test")
    if case.stored_tests:
        copy_newest_test(f"{folder}/test.db", case.stored_tests - 1, scans=5)
    else:
        lengthen_open_test(f"{folder}/test.db", BIN / "thermbal-sim", case.stored_min)


def simulator(case):
    """The module, its plant as far on as the stored test."""
    epoch_ns = time.clock_gettime_ns(time.CLOCK_MONOTONIC) - round(60e9 * case.stored_min / case.scale())
    units = ",".join(["16"] * (case.channels // CHANNELS_A_UNIT))
    return Simulator("--units", units, "--time-scale", str(case.scale()), "--time-epoch-ns", str(epoch_ns))


def running(case, folder, sim, every_s):
    return Daemon(folder, configured(case, folder, sim, every_s), "--time-scale", str(case.scale()))


def run(case, scans, identifying_scans, wait_s):
    result = {"case": case.name(), **dataclasses.asdict(case)}
    with scratch() as folder:
        begin(case, folder)
        with simulator(case) as sim:
            started = time.perf_counter()
            with running(case, folder, sim, LONGEST_EVERY_S) as daemon:
                daemon.wait_for("status", lambda s: s["test"], "an answer", 300)
                result["first_answer_s"] = time.perf_counter() - started
                if case.stored_min:
                    wait_for_identification(daemon, wait_s)
                result["scanning"] = measured_scans(daemon, case.scale(), scans)
                result["scanning"]["memory_bytes"] = daemon.memory_bytes()
            with running(case, folder, sim, EVERY_S) as daemon:
                daemon.wait_for("status", lambda s: s["test"], "an answer", 300)
                result["identifying"] = identifying(daemon, identifying_scans, wait_s)
                result["requests"] = {method: request_cost(daemon, method) for method in REQUESTS}
                result["commands"] = {" ".join(command): command_cost(folder, command) for command in COMMANDS}
                result["identifying"]["highest_memory_bytes"] = daemon.call("health")["max_rss_bytes"]
    return result


def row_of(result):
    late, scanning, identified = result["scanning"]["lateness_ms"], result["scanning"], result["identifying"]
    slowest = max(result["requests"], key=lambda method: result["requests"][method]["wall_ms"])
    commands = "/".join(f"{cost['cpu_ms']:.0f}" for cost in result["commands"].values())
    mib = 2.0 ** 20
    return [result["case"], f"{late['p50']:.2f} / {late['p999']:.2f} / {late['max']:.2f}",
            f"{scanning['late']} / {scanning['missed']}", f"{scanning['cpu_ms_a_scan']:.1f}",
            f"{scanning['database_bytes_a_scan'] / 1024:.1f}", f"{result['first_answer_s']:.2f}",
            f"{scanning['memory_bytes'] / mib:.0f} / {identified['highest_memory_bytes'] / mib:.0f}",
            f"{identified['cpu_s_an_identification']:.2f}" if identified["identifications"] else "-",
            f"{identified['oldest_identification_s']:.0f}", f"{result['requests'][slowest]['wall_ms']:.1f} ({slowest})", commands]


HEAD = ["case", "lateness p50 / p99.9 / max, ms", "late / missed", "CPU a scan, ms", "KiB a scan", "first answer, s",
        "memory scanning / highest, MiB", "CPU an identification, s", "oldest, s of test",
        "slowest request, ms", "/".join(command[0] for command in COMMANDS) + ", CPU ms"]


def print_row(cells):
    print("| " + " | ".join(cells) + " |", flush=True)


parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--only", choices=sorted({case.group for case in CASES}))
parser.add_argument("--scans", type=int, default=200)
parser.add_argument("--identifying-scans", type=int, default=30)
parser.add_argument("--wait-s", type=float, default=600.0, help="for the first identification, real")
parser.add_argument("--json", help="file for everything that was measured")
args = parser.parse_args()
print_row(HEAD)
print_row(["---"] * len(HEAD))
results = []
for one in CASES:
    if args.only in (None, one.group):
        results.append(run(one, args.scans, args.identifying_scans, args.wait_s))
        print_row(row_of(results[-1]))
        if args.json:
            pathlib.Path(args.json).write_text(json.dumps(results, indent=1), encoding="utf-8")
