#!/usr/bin/python3
"""The soak study: every fault on TCP and on RTU over a pseudo-terminal, so many times each at random moments, and a
random mixture of all of them for so many accelerated hours. Prints a Markdown table and what it took.

    THERMBAL_BIN_DIR=build/release/bin tests/faults/soak.py [--times 1000] [--hours 24] [--jobs 6] [--json rows.json]
"""
import argparse
import concurrent.futures
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

SOAK = pathlib.Path(os.environ["THERMBAL_BIN_DIR"]).resolve().parent / "tests" / "fault_soak"
SCANS_AN_HOUR = 240
COLUMNS = [("fault", "fault"), ("line", "transport"), ("units", "units"), ("injections", "injections"), ("scans", "scans"),
           ("good values", "good_values"), ("wrong", "wrong_values"), ("hangs", "hangs"), ("late", "late_scans"),
           ("clean scans", "clean_scans"), ("not good", "late_recoveries"), ("host stalls", "host_stalls"),
           ("other unit lost", "lost_of_other_unit"), ("longest scan, ms", "longest_scan_ms"), ("bound, ms", "bound_ms")]
MUST_BE_ZERO = ("wrong_values", "hangs", "late_scans", "late_recoveries")


def faults_of(transport):
    listed = subprocess.run([SOAK, "--list", "--transport", transport], capture_output=True, text=True, check=True)
    return listed.stdout.split()


def row(transport, fault, arguments, flags):
    with tempfile.TemporaryDirectory(prefix="thermbal-soak-", dir=arguments.scratch) as folder:
        done = subprocess.run([SOAK, "--transport", transport, "--fault", fault, "--folder", folder,
                               "--units", str(arguments.units),
                               "--seed", str(arguments.seed), "--response-timeout-ms", str(arguments.timeout_ms),
                               *(["--unconfirmed"] if arguments.unconfirmed else []), *flags],
                              capture_output=True, text=True, timeout=arguments.limit_s, check=False)
    sys.stderr.write(done.stderr)
    if not done.stdout:
        raise SystemExit(f"soak.py: {fault} on {transport} ended with {done.returncode}: {done.stderr}")
    return json.loads(done.stdout)


def rows_of(arguments):
    work = [(transport, fault, ["--times", str(arguments.times)])
            for transport in arguments.transports for fault in arguments.faults or faults_of(transport)]
    if arguments.hours > 0:
        scans = str(round(arguments.hours * SCANS_AN_HOUR))
        work += [(transport, "mixture", ["--scans", scans]) for transport in arguments.transports]
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        started = [pool.submit(row, transport, fault, arguments, flags) for transport, fault, flags in work]
        rows = []
        for done in concurrent.futures.as_completed(started):
            rows.append(done.result())
            if arguments.json:
                pathlib.Path(arguments.json).write_text(json.dumps(rows, indent=1), encoding="utf-8")
        return [one.result() for one in started]


def table(rows):
    lines = ["| " + " | ".join(head for head, _ in COLUMNS) + " |", "|" + "---|" * len(COLUMNS)]
    for one in rows:
        lines.append("| " + " | ".join(str(one[key]) for _, key in COLUMNS) + " |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--times", type=int, default=1000, help="injections of each fault")
    parser.add_argument("--hours", type=float, default=24.0, help="accelerated hours of the random mixture")
    parser.add_argument("--jobs", type=int, default=6, help="rows at a time: most of a row is waiting for timeouts")
    parser.add_argument("--timeout-ms", type=float, default=50.0, help="response timeout of the link")
    parser.add_argument("--unconfirmed", action="store_true", help="RTU without LinkOptions::confirm_reads")
    parser.add_argument("--units", type=int, default=2, help="on the line; 1 to 4")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--transports", nargs="*", default=["tcp", "rtu"])
    parser.add_argument("--faults", nargs="*", help="only these")
    parser.add_argument("--limit-s", type=float, default=7200.0, help="a row that takes longer hangs")
    parser.add_argument("--scratch", help="where the databases are written, e.g. /dev/shm")
    parser.add_argument("--json", help="write the rows to this file, each as soon as it is done")
    parser.add_argument("--values-only", action="store_true",
                        help="fail for wrong values and hangs only: on a busy host it is the host that is late")
    arguments = parser.parse_args()
    started = time.monotonic()
    rows = rows_of(arguments)
    print(table(rows))
    total = {key: sum(one[key] for one in rows) for key in ("injections", "scans", "good_values", *MUST_BE_ZERO)}
    frozen = max((one["longest_unnoticed_scans"] for one in rows), default=0)
    print(f"\n{total['injections']} injections, {total['scans']} scans, {total['good_values']} good values checked: "
          f"{total['wrong_values']} wrong, {total['hangs']} hangs, {total['late_scans']} late scans, "
          f"{total['late_recoveries']} recoveries later than the first scan; a frozen module is noticed after at most "
          f"{frozen} repeated scans; {time.monotonic() - started:.0f} s")
    return 1 if any(total[key] for key in (MUST_BE_ZERO[:2] if arguments.values_only else MUST_BE_ZERO)) else 0


if __name__ == "__main__":
    sys.exit(main())
