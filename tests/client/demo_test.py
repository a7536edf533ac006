"""thermbalctl demo: a whole test to the declaration without root, and nothing left behind, also after Ctrl-C."""
import os
import pathlib
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "peers"))
from waiting import wait_until  # noqa: E402

CTL = str(pathlib.Path(os.environ["THERMBAL_BIN_DIR"]) / "thermbalctl")


def start(scratch, *flags):
    return subprocess.Popen([CTL, "demo", *flags], env={**os.environ, "TMPDIR": scratch}, stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE, text=True)


def children_of(process):
    found = []
    for stat in pathlib.Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text(encoding="utf-8", errors="replace").rsplit(")", 1)[1].split()
        except OSError:
            continue
        if int(fields[1]) == process.pid:
            found.append(int(stat.parent.name))
    return found


def a_whole_test_to_its_declarations():
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch, "kept")
        demo = start(scratch, "--keep", str(folder))
        try:
            out, err = demo.communicate(timeout=280)
        finally:  # on a machine that is too slow nothing of it stays behind
            demo.send_signal(signal.SIGINT)
            demo.wait()
        assert demo.returncode == 0, (out, err)
        assert "stopped at" in out and "settles at" in out, out
        with sqlite3.connect(f"file:{folder}/thermbal.db?mode=ro", uri=True) as database:
            standing = database.execute("SELECT count(*) FROM declarations WHERE withdrawn = ''").fetchone()[0]
        assert standing >= 10 and f"{standing} channels declared" in out, out
        worst = float(out.rsplit("the worst ", 1)[1].split(" C")[0])
        assert worst < 0.3, out
        assert (folder / "recording.csv").read_text(encoding="utf-8").startswith("time_s,T1")
        assert sorted(os.listdir(scratch)) == ["kept"], os.listdir(scratch)


def ctrl_c_leaves_nothing():
    with tempfile.TemporaryDirectory() as scratch:
        demo = start(scratch)
        assert "simulated module" in demo.stdout.readline()
        wait_until(lambda: len(children_of(demo)) >= 2, "both programs of the demo", 30)
        programs = children_of(demo)
        assert len(programs) == 2, programs
        demo.send_signal(signal.SIGINT)
        _, err = demo.communicate(timeout=30)
        assert demo.returncode == 1 and "interrupted" in err, (demo.returncode, err)
        assert os.listdir(scratch) == [], os.listdir(scratch)
        for process in programs:
            assert not os.path.exists(f"/proc/{process}"), process


def wrong_usage_is_said():
    with tempfile.TemporaryDirectory() as scratch:
        demo = start(scratch, "--condition", "9000-flying")
        _, err = demo.communicate(timeout=30)
        assert demo.returncode == 2 and "9000-flying" in err and os.listdir(scratch) == [], err


if __name__ == "__main__":
    for test in (wrong_usage_is_said, ctrl_c_leaves_nothing, a_whole_test_to_its_declarations):
        began = time.monotonic()
        test()
        print(f"ok   {test.__name__} ({time.monotonic() - began:.1f} s)", flush=True)
