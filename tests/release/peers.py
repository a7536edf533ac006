"""The exposure of the daemons that thermbald is held against, by systemd-analyze on the units of their Debian packages (from the
mirror that /etc/apt names; nothing is installed). telegraf and mbusd are no packages of Debian 12.

    tests/release/peers.py
"""
import pathlib
import re
import subprocess
import tempfile

PEERS = {"collectd": "collectd-core", "gpsd": "gpsd", "chrony": "chrony"}


def main():
    with tempfile.TemporaryDirectory(prefix="thermbal-") as folder:
        for unit, package in PEERS.items():
            subprocess.run(["apt-get", "download", "-qq", package], cwd=folder, check=True, capture_output=True)
            archive = next(pathlib.Path(folder).glob(f"{package}_*.deb"))
            subprocess.run(["dpkg-deb", "-x", archive, f"{folder}/{unit}"], check=True)
            file = next(pathlib.Path(folder, unit).rglob(f"systemd/system/{unit}.service"))
            said = subprocess.run(["systemd-analyze", "security", "--offline=yes", file], capture_output=True, text=True,
                                  check=False).stdout
            found = re.search(r"exposure level for \S+: (\S+ \w+)", said)
            print(f"{archive.stem}: {found.group(1) if found else said[-200:]}")


if __name__ == "__main__":
    main()
