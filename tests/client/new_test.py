"""thermbalctl new: with flags, with a probe of a simulated module, and with a person at a terminal (a pty)."""
import os
import pathlib
import pty
import select
import subprocess
import sys
import tempfile
import time
import tomllib
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "peers"))
from sim_support import Simulator  # noqa: E402

BIN = pathlib.Path(os.environ["THERMBAL_BIN_DIR"])
CTL = str(BIN / "thermbalctl")


def run(folder, *arguments):
    return subprocess.run([CTL, "new", *arguments], cwd=folder, capture_output=True, text=True, timeout=60,
                          stdin=subprocess.DEVNULL)


def accepted(folder, name="thermbald.toml"):
    """What the daemon says of the file: it has the last word."""
    done = subprocess.run([str(BIN / "thermbald"), "--check-config", name], cwd=folder, capture_output=True, text=True,
                          timeout=30)
    assert done.returncode == 0, done.stderr
    return tomllib.loads(done.stdout)


class New(unittest.TestCase):
    def setUp(self):
        self.scratch = tempfile.TemporaryDirectory()
        self.addCleanup(self.scratch.cleanup)
        self.folder = pathlib.Path(self.scratch.name)

    def test_flags_become_a_configuration_that_the_daemon_accepts(self):
        made = run(self.folder, "--tcp", "192.0.2.7:1502", "--profile", "generic-16x-int16", "--machine", 'VMC "850"',
                   "--place", "T2=front bearing", "--place", 'T3=a "b" \\ c', "--ambient", "T4", "--channels", "5")
        self.assertEqual(made.returncode, 0, made.stderr)
        config = accepted(self.folder)
        self.assertEqual(config["test"]["machine"], 'VMC "850"')
        self.assertEqual((config["line"][0]["host"], config["line"][0]["port"]), ("192.0.2.7", 1502))
        self.assertEqual([channel["name"] for channel in config["channel"]], ["T1", "T2", "T3", "T4", "T5"])
        self.assertEqual([channel["role"] for channel in config["channel"]].index("ambient"), 3)
        self.assertEqual(config["channel"][2]["place"], 'a "b" \\ c')
        self.assertGreater((self.folder / "thermbald.toml").read_text(encoding="utf-8").count("# "), 8)

    def test_an_ambient_that_is_no_channel_is_refused(self):
        for name in ("T9", "t1", "room"):
            made = run(self.folder, "--tcp", "h", "--profile", "mb8art", "--channels", "3", "--ambient", name, "--out", "e.toml")
            self.assertEqual((made.returncode, f'"{name}"; accepted: T1 to T3' in made.stderr), (2, True), made.stderr)

    def test_a_serial_line_with_two_modules(self):
        made = run(self.folder, "--rtu", "/dev/ttyUSB0", "--baud", "19200", "--parity", "E", "--unit", "3", "--unit", "7",
                   "--profile", "generic-8x-int16", "--ambient", "none", "--out", "two.toml")
        self.assertEqual(made.returncode, 0, made.stderr)
        config = accepted(self.folder, "two.toml")
        self.assertEqual((config["line"][0]["baud"], config["line"][0]["parity"]), (19200, "even"))
        self.assertEqual([unit["unit_id"] for unit in config["unit"]], [3, 7])
        self.assertEqual(len(config["channel"]), 16)
        self.assertEqual(config["channel"][15]["input"], 8)

    def test_nothing_is_overwritten_unless_it_is_asked_for(self):
        file = self.folder / "thermbald.toml"
        file.write_text("precious", encoding="utf-8")
        flags = ("--tcp", "192.0.2.7", "--profile", "generic-16x-int16")
        made = run(self.folder, *flags)
        self.assertEqual((made.returncode, file.read_text(encoding="utf-8")), (2, "precious"))
        self.assertIn("--force", made.stderr)
        self.assertEqual(run(self.folder, *flags, "--force").returncode, 0)
        accepted(self.folder)

    def test_what_is_missing_or_wrong_is_said(self):
        for flags, part in (((), "--tcp HOST"), (("--tcp", "h"), "--profile NAME"),
                            (("--tcp", "h", "--profile", "none-such"), "none-such"),
                            (("--tcp", "h:x", "--profile", "generic-16x-int16"), "HOST:PORT"),
                            (("--tcp", "h", "--rtu", "/dev/x"), "--rtu"),
                            (("--tcp", "h", "--profile", "generic-16x-int16", "--place", "T99=x"), "T99=x")):
            made = run(self.folder, *flags)
            self.assertEqual(made.returncode, 2, flags)
            self.assertIn(part, made.stderr)
        self.assertFalse(list(self.folder.iterdir()))

    def test_a_probe_finds_the_module(self):
        with Simulator("--port", "0") as simulator:
            made = run(self.folder, "--tcp", f"127.0.0.1:{simulator.port}", "--probe", "--unit", "1")
        self.assertEqual(made.returncode, 0, made.stderr)
        config = accepted(self.folder)
        self.assertEqual(config["unit"][0]["profile"], "generic-16x-int16")
        self.assertEqual(len(config["channel"]), 16)

    def test_a_person_is_asked(self):
        answers = [("Name of the machine", "VMC"), ("connected", "carrier pigeon"), ("accepted: tcp", "tcp"),
                   ("Address", "192.0.2.9"), ("Look at the module", "n"), ("Which profile", ""),
                   ("measures the room", "T2"), ("Where is T1", "spindle nose"), ("Where is T2", ""), ("Where is T3", "bed")]
        process, terminal = pty.fork()
        if process == 0:
            os.chdir(self.folder)
            os.execv(CTL, [CTL, "new", "--channels", "3"])
        seen = ""
        for question, answer in answers:
            give_up = time.monotonic() + 30
            while question not in seen:
                self.assertLess(time.monotonic(), give_up, seen)
                if select.select([terminal], [], [], 1)[0]:
                    seen += os.read(terminal, 4096).decode()
            seen = seen.split(question, 1)[1]
            os.write(terminal, answer.encode() + b"\n")
        _, status = os.waitpid(process, 0)
        os.close(terminal)
        self.assertEqual(os.waitstatus_to_exitcode(status), 0)
        config = accepted(self.folder)
        self.assertEqual([(channel["place"], channel["role"]) for channel in config["channel"]],
                         [("spindle nose", "structure"), ("air at the machine", "ambient"), ("bed", "structure")])


if __name__ == "__main__":
    unittest.main(verbosity=2)
