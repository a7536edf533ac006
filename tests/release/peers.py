#!/usr/bin/python3
"""thermbald beside the daemons that it is held against, from the units and programs of their Debian packages (from the mirror
that /etc/apt names; nothing is installed): exposure, what systemd knows of their state, as whom they run, compiler hardening. Prints
the rows of a Markdown table. telegraf and mbusd are no packages of Debian 12: give the units of their sources
(scripts/telegraf.service; systemd-units/mbusd@.service.in with its paths filled in).

    THERMBAL_BIN_DIR=build/release/bin tests/release/peers.py [FURTHER.service ...]
"""
import argparse
import pathlib
import re
import subprocess
import tempfile

from hardening import BIN, findings

# unit: package, program
PEERS = {"chrony": ("chrony", "usr/sbin/chronyd"), "collectd": ("collectd-core", "usr/sbin/collectd"),
         "gpsd": ("gpsd", "usr/sbin/gpsd")}


def exposure(unit_file):
    said = subprocess.run(["systemd-analyze", "security", "--offline=yes", unit_file], capture_output=True, text=True,
                          check=False).stdout
    found = re.search(r"exposure level for \S+: (\S+ \w+)", said)
    assert found, said[-200:]
    return found.group(1)


def settings(unit_file):
    """key -> its last value."""
    return dict(re.findall(r"^(\w+)=(.*)$", unit_file.read_text(encoding="utf-8"), re.MULTILINE))


def row(name, unit_file, program):
    unit = settings(unit_file)
    lacks = [what for what, there in findings(program).items() if not there] if program else []
    hardening = "not judged: no program" if program is None else "lacks " + ", ".join(lacks) if lacks else "all"
    return [name, exposure(unit_file), unit.get("Type", "simple"),
            f"{unit['WatchdogSec']} s" if "WatchdogSec" in unit else "none",
            unit.get("User", "root"), unit.get("Restart", "no"), hardening]


def unpacked(package, folder):
    subprocess.run(["apt-get", "download", "-qq", package], cwd=folder, check=True, capture_output=True)
    archive = next(pathlib.Path(folder).glob(f"{package}_*.deb"))
    root = pathlib.Path(folder) / package
    subprocess.run(["dpkg-deb", "-x", archive, root], check=True)
    return archive.stem.removesuffix("_amd64"), root


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("units", nargs="*", metavar="FURTHER.service", type=pathlib.Path)
    arguments = parser.parse_args()
    rows = [row("thermbald", BIN.parent / "systemd/units/thermbald.service", BIN / "thermbald")]
    with tempfile.TemporaryDirectory(prefix="thermbal-") as folder:
        for unit, (package, program) in PEERS.items():
            name, root = unpacked(package, folder)
            unit_file = next(root.rglob(f"systemd/system/{unit}.service"))
            rows.append(row(name, unit_file, root / program))
    rows += [row(unit_file.stem, unit_file, None) for unit_file in arguments.units]
    for cells in [["", "exposure", "readiness", "watchdog", "starts as", "restart", "hardening"], ["---"] * 7, *rows]:
        print("| " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
