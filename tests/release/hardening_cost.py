#!/usr/bin/python3
"""What the hardening flags cost the SVR sweep: user CPU time of one identification with the whole sweep over n, by two builds of
thermbalctl in turns (-DTHERMBAL_HARDENING=OFF and ON), so that what else the machine does is in both.

    tests/release/hardening_cost.py PLAIN/thermbalctl HARDENED/thermbalctl [--times 7]
"""
import argparse
import pathlib
import resource
import statistics
import subprocess
import tempfile

from math import exp


def recording(path):
    """Two hours of 4 channels that rise with two time constants; the last digits stand in for noise."""
    with open(path, "w", encoding="utf-8") as file:
        file.write("time_s," + ",".join(f"T{channel}" for channel in range(1, 5)) + "\n")
        for scan in range(480):
            time_s = 15.0 * scan
            row = [20.0 + 0.05 * ((scan * 7919) % 11 - 5) / 5]
            row += [20 + 6 * (1 - exp(-time_s / (2000 + 700 * k))) + 3 * (1 - exp(-time_s / 9000))
                    + 0.05 * ((scan * (104729 + k)) % 13 - 6) / 6 for k in range(3)]
            file.write(f"{time_s}," + ",".join(f"{value:.2f}" for value in row) + "\n")


def cpu_s(program, path):
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run([program, "identify", path, "--json"], check=True, capture_output=True)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plain")
    parser.add_argument("hardened")
    parser.add_argument("--times", type=int, default=7)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="thermbal-") as folder:
        path = str(pathlib.Path(folder) / "rise.csv")
        recording(path)
        pairs = [(cpu_s(arguments.plain, path), cpu_s(arguments.hardened, path)) for _ in range(arguments.times)]
    ratios = sorted(hardened / plain for plain, hardened in pairs)
    print(f"user CPU, s: plain {min(p for p, _ in pairs):.3f}, hardened {min(h for _, h in pairs):.3f} (the least of {len(pairs)}); "
          f"ratio median {statistics.median(ratios):.3f}, {ratios[0]:.3f} to {ratios[-1]:.3f}")


if __name__ == "__main__":
    main()
