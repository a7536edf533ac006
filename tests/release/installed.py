#!/usr/bin/python3
"""The packages in a clean Debian root that systemd booted: install, measure inside the sandbox, what the sandbox refuses,
an instance, an upgrade during a running test, remove, purge.

    tests/release/installed.py FOLDER_WITH_PACKAGES     (tests/release/packages.sh builds them and runs this)
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from container import Container, clean_root, need_what_it_takes  # noqa: E402

CONFIG = "/etc/thermbal/thermbald.toml"
# Runs in the daemon's own unit, in the daemon's place, and says what it could do.
PROBE = r"""#!/usr/bin/python3
import ctypes, json, os, socket
libc = ctypes.CDLL(None, use_errno=True)
def attempt(action):
    try:
        action()
        return "done"
    except OSError as refused:
        return os.strerror(refused.errno)
def call(name, *arguments):
    def action():
        if getattr(libc, name)(*arguments) < 0:
            raise OSError(ctypes.get_errno(), "")
    return action
def write(path):
    def action():
        with open(path, "w") as file:
            file.write("x")
    return action
def send(address, family=socket.AF_INET):
    def action():
        with socket.socket(family, socket.SOCK_DGRAM) as probe:
            probe.sendto(b"x", address)
    return action
def map_executable():
    import mmap
    mmap.mmap(-1, 4096, prot=mmap.PROT_WRITE | mmap.PROT_EXEC | mmap.PROT_READ)
status = dict(line.split(":\t", 1) for line in open("/proc/self/status").read().splitlines() if ":\t" in line)
found = {
    "write /etc": attempt(write("/etc/thermbal/x")), "write /usr": attempt(write("/usr/bin/x")),
    "write /home": attempt(write("/home/x")), "read /root": attempt(lambda: os.listdir("/root")),
    "write /sys": attempt(write("/sys/kernel/mm/x")), "read /proc/sys": attempt(lambda: os.listdir("/proc/sys")),
    "see another user's process": attempt(lambda: os.listdir("/proc/1")),
    "mount": attempt(call("mount", b"none", b"/mnt", b"tmpfs", 0, None)),
    "new namespace": attempt(call("unshare", 0x10000000)), "set the clock": attempt(lambda: __import__("time").clock_settime(0, 0)),
    "ptrace": attempt(call("ptrace", 0, 0, 0, 0)), "reboot": attempt(call("reboot", 0)),
    "executable memory": attempt(map_executable),
    "packet socket": attempt(lambda: socket.socket(socket.AF_PACKET, socket.SOCK_RAW).close()),
    "netlink socket": attempt(lambda: socket.socket(socket.AF_NETLINK, socket.SOCK_RAW).close()),
    "set-user-id file": attempt(lambda: (open("/var/lib/thermbal/s", "w").close(), os.chmod("/var/lib/thermbal/s", 0o4755))),
    "real-time priority": attempt(lambda: os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(5))),
    "public address": attempt(send(("192.0.2.1", 9))), "loopback": attempt(send(("127.0.0.1", 9))),
    "own state": attempt(write("/var/lib/thermbal/x")), "own temporary files": attempt(write("/tmp/x")),
    "capabilities": status["CapEff"], "bounding set": status["CapBnd"], "no new privileges": status["NoNewPrivs"],
    "system call filter": status["Seccomp"], "user": str(os.getuid()),
}
with open("/var/lib/thermbal/probe.json", "w") as file:
    json.dump(found, file)
"""
MUST_BE_REFUSED = ["write /etc", "write /usr", "write /home", "read /root", "write /sys", "read /proc/sys",
                   "see another user's process", "mount", "new namespace", "set the clock", "ptrace", "reboot",
                   "executable memory", "packet socket", "netlink socket", "set-user-id file", "real-time priority"]
MUST_WORK = ["loopback", "own state", "own temporary files"]
# What the kernel of a container may be unable to give (cgroup version 2 with BPF): reported, not judged.
DEPENDS_ON_THE_KERNEL = ["public address"]


def say(text):
    print(text, flush=True)


def ask(box, *words, socket=None):
    where = f"--socket {socket} " if socket else ""
    return json.loads(box.run(f"thermbalctl {' '.join(words)} {where}--json"))


def scans(box, socket=None):
    test = ask(box, "status", socket=socket)["test"]
    return test["scans"] if test else 0


def good_samples(box, database="/var/lib/thermbal/thermbal.db"):
    return int(box.run("python3 -c \"import sqlite3; print(sqlite3.connect('file:" + database + "?mode=ro', uri=True).execute("
                       "\\\"SELECT count(*) FROM samples WHERE quality = 'good'\\\").fetchone()[0])\""))


def write_config(box, path, replacements):
    text = box.run("cat /etc/thermbal/thermbald.toml")
    for old, new in replacements.items():
        assert old in text, old
        text = text.replace(old, new)
    write_file(box, path, text)


def write_file(box, path, text, mode="644"):
    with tempfile.NamedTemporaryFile("w", dir=box.upper / "root", delete=False) as file:
        file.write(text)
    box.run(f"install -m {mode} /root/{os.path.basename(file.name)} {path} && rm /root/{os.path.basename(file.name)}")


def installs(box):
    box.run("apt-get update -qq && apt-get install -y -qq --no-install-recommends /packages/thermbal_*.deb "
            "/packages/thermbal-sim_*.deb", seconds=900)
    assert box.run("systemctl is-active thermbald.socket thermbald.service").split() == ["active", "active"]
    assert box.run("systemctl is-enabled thermbald.socket thermbald.service").split() == ["enabled", "enabled"]
    assert box.run("stat -c '%U %a' /var/lib/thermbal").split() == ["thermbal", "750"]
    assert box.run("stat -c %a /run/thermbal/thermbald.sock").strip() == "666"
    assert ask(box, "status")["test"] is None
    say("ok   installed: the service is up before any module answers")


def measures_in_the_sandbox(box):
    box.run("systemd-run --unit=sim thermbal-sim --port 1502")
    box.run("systemctl restart thermbald")
    write_config(box, CONFIG, {"period_s = 15.0": "period_s = 2.0"})
    box.run("systemctl restart thermbald && thermbalctl start --name sandbox")
    box.wait_for(lambda: scans(box) >= 5, "five scans", 60)
    assert good_samples(box) >= 16 * 3, "few good samples"
    say(f"ok   measures over TCP inside the sandbox: {scans(box)} scans, {good_samples(box)} good samples")


def sandbox_refuses(box):
    write_file(box, "/usr/local/bin/probe", PROBE, "755")
    # The installed unit with another program in it.
    box.run("sed -e 's/^Type=.*/Type=oneshot/; s,^ExecStart=.*,ExecStart=/usr/local/bin/probe,; /^ExecStartPre=/d; /^Restart/d; "
            "/socket$/d; /^Wants=/d' /usr/lib/systemd/system/thermbald.service > /run/systemd/system/probe.service && "
            "systemctl daemon-reload && systemctl start probe")
    found = json.loads(box.run("cat /var/lib/thermbal/probe.json"))
    wrong = [f"{what}: {found[what]}" for what in MUST_BE_REFUSED if found[what] == "done"]
    wrong += [f"{what}: {found[what]}" for what in MUST_WORK if found[what] != "done"]
    wrong += [what for what, wanted in (("capabilities", "0" * 16), ("bounding set", "0" * 16), ("no new privileges", "1"),
                                        ("system call filter", "2")) if found[what] != wanted]
    assert not wrong, wrong
    say(f"ok   the sandbox refuses {len(MUST_BE_REFUSED)} things, allows {len(MUST_WORK)}; left to the kernel: "
        + ", ".join(f"{what}: {found[what]}" for what in DEPENDS_ON_THE_KERNEL))


def publishes_in_the_sandbox(box):
    box.run("apt-get install -y -qq --no-install-recommends mosquitto mosquitto-clients && systemctl start mosquitto", seconds=600)
    # No comment of the installed configuration is touched: the section is added.
    box.run(f"printf '\\n[mqtt]\\nhost = \"127.0.0.1\"\\nport = 1883\\n' >> {CONFIG} && systemctl start thermbal-mqtt")
    heard = json.loads(box.run("mosquitto_sub -h 127.0.0.1 -t 'thermbal/+/samples' -C 1 -W 60"))
    assert heard["samples"]["T1"]["quality"] == "good", heard
    assert box.run("systemctl is-active thermbal-mqtt").strip() == "active"
    say(f"ok   thermbal-mqtt in the same sandbox sends to a broker: scan {heard['scan']} came")


def runs_an_instance(box):
    write_config(box, "/etc/thermbal/line2.toml", {"/var/lib/thermbal/": "/var/lib/thermbal/line2/",
                                                   "/run/thermbal/": "/run/thermbal/line2/"})
    box.run("systemctl start thermbald@line2.service")
    there = "/run/thermbal/line2/thermbald.sock"
    box.run(f"thermbalctl start --name second --socket {there}")
    box.wait_for(lambda: scans(box, there) >= 3, "scans of the instance", 60)
    assert box.run("systemctl is-active thermbald thermbald@line2").split() == ["active", "active"]
    box.run("systemctl stop thermbald@line2.socket thermbald@line2.service")
    say("ok   thermbald@line2 beside it, with its own configuration, database and socket")


def survives_the_death_of_the_daemon(box):
    before = scans(box)
    box.run("systemctl kill --signal=KILL thermbald")
    box.wait_for(lambda: scans(box) > before + 2, "the test to go on", 60)
    say(f"ok   killed: the same test goes on from scan {before}")


def upgrades_during_a_test(box):
    before = ask(box, "status")["test"]
    # The same files as a newer version: dpkg goes through every step of an upgrade.
    box.run("dpkg-deb -R /packages/thermbal_*.deb /root/newer && sed -i 's/^Version: .*/&+1/' /root/newer/DEBIAN/control && "
            "dpkg-deb --root-owner-group -b /root/newer /root/newer.deb > /dev/null && dpkg -i --force-confold /root/newer.deb")
    after = box.wait_for(lambda: (lambda t: t if t and t["scans"] > before["scans"] + 2 else None)(ask(box, "status")["test"]),
                         "the test to go on", 60)
    assert after["id"] == before["id"] and ask(box, "status")["state"] == "running", (before, after)
    rows = box.run("python3 -c \"import sqlite3; print(*(r[0] for r in sqlite3.connect('file:/var/lib/thermbal/thermbal.db?"
                   f"mode=ro', uri=True).execute('SELECT scan FROM scans WHERE test_id = {after['id']} ORDER BY scan')))\"")
    numbers = list(map(int, rows.split()))
    assert numbers == list(range(len(numbers))), "a scan without a row"
    say(f"ok   upgraded at scan {before['scans']}: the same test goes on, every scan has its row")


def measures_serial_without_network(box):
    box.run("systemctl stop sim; systemd-run --unit=sim2 sh -c 'thermbal-sim --rtu --link /run/module & sleep 1; "
            "chmod 666 $(readlink -f /run/module); wait'")
    box.wait_for(lambda: box.run("readlink -f /run/module").startswith("/dev/pts"), "the simulated port", 20)
    box.run("install -D -m 644 /usr/share/thermbal/systemd/serial-only.conf "
            "/etc/systemd/system/thermbald.service.d/serial-only.conf")
    write_config(box, CONFIG, {'transport = "tcp"\nhost': 'transport = "rtu"\ndevice = "/run/module"\n# host',
                               "\nport = 1502": "\n# port = 1502",
                               "# response_timeout_ms = 500  # the slowest": "response_timeout_ms = 200  # the slowest"})
    box.run("systemctl daemon-reload && systemctl restart thermbald")
    before = good_samples(box)
    box.wait_for(lambda: good_samples(box) > before + 16, "samples over the serial line", 60)
    assert "inet " not in box.run("nsenter -n -t $(systemctl show -P MainPID thermbald) cat /proc/net/tcp | head -1")
    say(f"ok   measures over RTU with serial-only.conf, without any network: {good_samples(box) - before} more good samples")


def goes_away(box):
    box.run("apt-get remove -y -qq thermbal")
    assert box.attempt("systemctl is-active thermbald").stdout.strip() != "active"
    assert box.attempt("pgrep thermbald").returncode != 0
    kept = box.run("ls /var/lib/thermbal /etc/thermbal")
    assert "thermbal.db" in kept and "thermbald.toml" in kept, kept
    box.run("rm -f /etc/thermbal/line2.toml; apt-get purge -y -qq thermbal thermbal-sim")
    left = box.run("find / -xdev -path /proc -prune -o -name '*thermbal*' -print | grep -v '^/packages\\|^/root\\|/var/log\\|"
                   "^/etc/systemd/system/thermbald.service.d' || true")
    assert not left.strip(), left
    say("ok   removed: measurements and configuration stay; purged: nothing stays")


def main():
    need_what_it_takes()
    packages = pathlib.Path(sys.argv[1]).resolve()
    with Container(clean_root(), {packages: "/packages"}) as box:
        try:
            for step in (installs, measures_in_the_sandbox, sandbox_refuses, publishes_in_the_sandbox,
                         survives_the_death_of_the_daemon, runs_an_instance, upgrades_during_a_test, measures_serial_without_network, goes_away):
                step(box)
        except BaseException:
            say(box.attempt("systemctl --no-pager --failed; journalctl -n 60 --no-pager").stdout[-6000:])
            raise


if __name__ == "__main__":
    main()
