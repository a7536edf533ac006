#!/usr/bin/python3
"""The exposure that systemd-analyze gives to every unit and variant here, and whether systemd understands the units.

    THERMBAL_BIN_DIR=build/release/bin THERMBAL_SOURCE_DIR=. tests/release/exposure.py
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

UNITS = pathlib.Path(os.environ["THERMBAL_BIN_DIR"]).parent / "systemd" / "units"
VARIANTS = pathlib.Path(os.environ["THERMBAL_SOURCE_DIR"]) / "systemd"
# unit, drop-in, the most that is allowed
BOUNDS = [("thermbald", None, 1.5), ("thermbald@", None, 1.5), ("thermbald", "tcp-only", 1.5),
          ("thermbald", "serial-only", 0.8), ("thermbald@", "serial-only", 0.8), ("thermbal-mqtt", None, 1.5)]
OTHERS_AT_MOST = 1.5


def exposure(unit, variant):
    with tempfile.TemporaryDirectory(prefix="thermbal-") as root:
        system = pathlib.Path(root) / "etc/systemd/system"
        system.mkdir(parents=True)
        shutil.copy(UNITS / f"{unit}.service", system)
        if variant:
            drop_ins = system / f"{unit}.service.d"
            drop_ins.mkdir()
            shutil.copy(VARIANTS / f"{variant}.conf", drop_ins)
        name = f"{unit}line2.service" if unit.endswith("@") else f"{unit}.service"
        done = subprocess.run(["systemd-analyze", "security", "--offline=yes", f"--root={root}", name],
                              capture_output=True, text=True, check=False)
    found = re.search(r"Overall exposure level for \S+: ([0-9.]+)", done.stdout)
    assert found, done.stdout[-500:] + done.stderr
    return float(found.group(1))


def complaints(unit):
    """What systemd does not understand in a unit: unknown keys, values that do not parse."""
    done = subprocess.run(["systemd-analyze", "verify", "--man=no", unit], capture_output=True, text=True, check=False)
    return [line for line in (done.stdout + done.stderr).splitlines()
            if re.search(r"Unknown|Failed to parse|Invalid|ignoring", line, re.IGNORECASE) and unit.name in line]


def main():
    if shutil.which("systemd-analyze") is None:
        print("skipped: systemd-analyze is not installed (systemd)")
        return 77
    failed = False
    known = {unit for unit, _, _ in BOUNDS}
    others = sorted(path.stem for path in UNITS.glob("*.service") if path.stem not in known)
    for unit, variant, most in [*BOUNDS, *((unit, None, OTHERS_AT_MOST) for unit in others)]:
        found = exposure(unit, variant)
        failed |= found > most
        print(f"{'BAD ' if found > most else 'ok  '} {unit} {variant or ''}: {found} (at most {most})")
    for path in sorted(UNITS.iterdir()):
        for line in complaints(path):
            print(f"BAD  {line}")
            failed = True
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
