"""A Debian root of its own, booted by systemd-nspawn: systemd as it will be there, nothing of this host but the kernel.
Needs root, debootstrap, systemd-container, and the package mirror that /etc/apt names. What is made goes away at the end; a
root that is made once can be kept for the next run (THERMBAL_CLEAN_ROOT=FOLDER)."""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "peers"))
from waiting import wait_until  # noqa: E402

INCLUDE = "systemd,systemd-sysv,dbus,procps,python3-minimal,libpython3-stdlib"
MISSING = 77


def need_what_it_takes():
    if os.geteuid() != 0:
        raise SystemExit("needs root: it makes a Debian root and boots it")
    for program, package in (("debootstrap", "debootstrap"), ("systemd-nspawn", "systemd-container")):
        if shutil.which(program) is None:
            raise SystemExit(f"needs {program}: apt-get install {package}")


def configured_mirror():
    listed = subprocess.run(["apt-get", "indextargets", "--format", "$(REPO_URI) $(CODENAME)", "Created-By: Packages"],
                            capture_output=True, text=True, check=True).stdout.split("\n")
    return next(line.split()[0] for line in listed if line.endswith(" bookworm"))


def clean_root():
    """A fresh root, not to be changed: containers lay what they write over it."""
    kept = os.environ.get("THERMBAL_CLEAN_ROOT")
    root = pathlib.Path(kept or tempfile.mkdtemp(prefix="thermbal-root-"))
    if not (root / "usr/bin/dpkg").exists():
        subprocess.run(["debootstrap", "--variant=minbase", f"--include={INCLUDE}", "bookworm", root, configured_mirror()],
                       check=True, stdout=subprocess.DEVNULL)
    return root


class Container:
    """`with Container(root, {host folder: folder inside}) as box: box.run("dpkg -i ...")`. Has the host's network, so that apt
    finds the mirror; leaves the root as it was."""

    def __init__(self, root, shared):
        self.work = tempfile.TemporaryDirectory(prefix="thermbal-box-")
        self.log = open(f"{self.work.name}/boot.log", "wb")
        self.upper = pathlib.Path(self.work.name) / "merged"
        for name in ("upper", "work", "merged"):
            (pathlib.Path(self.work.name) / name).mkdir()
        subprocess.run(["mount", "-t", "tmpfs", "tmpfs", self.work.name + "/upper"], check=True)
        for name in ("data", "work"):
            os.mkdir(f"{self.work.name}/upper/{name}")
        subprocess.run(["mount", "-t", "overlay", "overlay", "-o",
                        f"lowerdir={root},upperdir={self.work.name}/upper/data,workdir={self.work.name}/upper/work",
                        self.upper], check=True)
        binds = [f"--bind-ro={host}:{inside}" for host, inside in shared.items()]
        self.process = subprocess.Popen(
            ["systemd-nspawn", "--quiet", "--register=no", "--keep-unit", "--boot", "--resolv-conf=copy-host",
             "--timezone=off", "-D", self.upper, *binds], stdin=subprocess.DEVNULL, stdout=self.log, stderr=self.log)

    def __enter__(self):
        self.leader = self.wait_for(self.find_leader, "the container's init", 60)
        self.wait_for(lambda: self.run("systemctl is-system-running || true").strip() in ("running", "degraded"),
                      "the container to be up", 180)
        return self

    def __exit__(self, *_):
        self.process.terminate()
        try:
            self.process.wait(timeout=60)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.log.close()
        for folder in (self.upper, self.work.name + "/upper"):
            subprocess.run(["umount", "--lazy", folder], check=False)
        self.work.cleanup()

    def find_leader(self):
        """The process that is 1 inside."""
        found = [self.process.pid]
        while found:
            pid = found.pop()
            try:
                status = pathlib.Path(f"/proc/{pid}/status").read_text(encoding="ascii", errors="replace")
                ids = next(line for line in status.splitlines() if line.startswith("NSpid:")).split()[1:]
                if len(ids) > 1 and ids[-1] == "1":
                    return pid
                found += map(int, pathlib.Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii").split())
            except OSError:
                continue
        return None

    @staticmethod
    def wait_for(condition, what, seconds):
        def holds():
            try:
                return condition()
            except subprocess.CalledProcessError:
                return None
        return wait_until(holds, what, seconds, every_s=0.3)

    def attempt(self, command, seconds=300):
        return subprocess.run(["nsenter", "-t", str(self.leader), "-m", "-u", "-i", "-n", "-p", "-C", "--wd=/", "--",
                               "/usr/bin/env", "-i", "PATH=/usr/sbin:/usr/bin:/sbin:/bin", "LC_ALL=C.UTF-8",
                               "DEBIAN_FRONTEND=noninteractive", "sh", "-c", f"cd /; {command}"],
                              capture_output=True, text=True, timeout=seconds, check=False)

    def run(self, command, seconds=300):
        done = self.attempt(command, seconds)
        if done.returncode != 0:
            raise AssertionError(f"{command}: {done.returncode}\n{done.stdout[-3000:]}{done.stderr[-3000:]}")
        return done.stdout
