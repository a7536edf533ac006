"""The offline commands on small recordings: what they refuse, and what becomes of an answer that nobody takes."""
import json
import os
import random
import shlex
import subprocess
import tempfile
import unittest
from pathlib import Path

from fake_daemon import DaemonCase

BIN = Path(os.environ["THERMBAL_BIN_DIR"])
SOURCE = Path(os.environ["THERMBAL_SOURCE_DIR"])
FULL = "standard output: No space left on device"


def run(program, *arguments, to=None):
    """`to`: what a shell makes of the standard output, ">/dev/full" or ">&-"."""
    words = [str(BIN / program), *map(str, arguments)]
    if to is not None:
        words = ["sh", "-c", f"exec {shlex.join(words)} {to}"]
    return subprocess.run(words, capture_output=True, text=True, timeout=60, stdin=subprocess.DEVNULL)


class Offline(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.short = self.file("short.csv", "time_s,T1,T2\n" + "".join(f"{15 * k},18,{18 + k}\n" for k in range(5)))

    def file(self, name, text):
        path = Path(self.folder.name) / name
        path.write_text(text, encoding="utf-8")
        return path

    def refused(self, made, says):
        self.assertEqual(made.returncode, 2, made.stderr)
        self.assertIn(says, made.stderr)
        self.assertEqual(made.stderr.count("\n"), 1, made.stderr)
        self.assertEqual(made.stdout, "")

    def test_an_answer_that_a_full_disk_does_not_take_is_a_failure(self):
        database = Path(self.folder.name) / "archive.db"
        model = SOURCE / "config/models/vertical_machining_centre.toml"
        still = self.file("still.csv", "time_s,T1,T2,spindle_rpm\n" + "".join(f"{15 * k},18,18,0\n" for k in range(30)))
        self.assertEqual(run("thermbalctl", "learn", self.settled(), "--archive", database).returncode, 0)
        commands = [("thermbalctl", "identify", self.short, "--modes-only"),
                    ("thermbalctl", "identify", self.short, "--modes-only", "--json"),
                    ("thermbalctl", "replay", self.short, "--modes-only"),
                    ("thermbalctl", "replay", self.short, "--modes-only", "--json"),
                    ("thermbalctl", "diagnose", still, "--model", model),
                    ("thermbalctl", "learn", self.settled(), "--archive", database),
                    ("thermbalctl", "verify", "--database", database),
                    ("thermbalctl", "verify", "--database", database, "--json"),
                    ("thermbalctl", "simulate", model, "--inputs", still, "--csv", "-"),
                    ("thermbalctl", "--help"),
                    ("thermbal-sim", "--plant"), ("thermbal-sim", "--truth"), ("thermbal-sim", "--port", "0"),
                    ("thermbald", "--check-config", SOURCE / "config/thermbald.toml", "--profiles",
                     SOURCE / "config/profiles")]
        for command in commands:
            with self.subTest(command=command):
                made = run(*command, to=">/dev/full")
                self.assertEqual(made.returncode, 1, made.stderr)
                self.assertIn(FULL, made.stderr)

    def test_an_error_that_nobody_takes_is_still_a_status(self):
        for to in ("2>/dev/full", "2>&-"):
            self.assertEqual(run("thermbalctl", "identify", "nothing.csv", to=to).returncode, 2)
            self.assertEqual(run("thermbal-sim", "--port", "x", to=to).returncode, 2)
            self.assertEqual(run("thermbald", "--check-config", "nothing.toml", to=to).returncode, 2)

    def test_the_last_scan_ends_a_window_however_long_the_steps_are(self):
        made = run("thermbalctl", "replay", self.short, "--modes-only", "--every-min", 60, "--json")
        answer = json.loads(made.stdout)
        self.assertEqual([(channel["channel"], channel["declared"]) for channel in answer["channels"]], [("T2", False)])
        self.assertIn("enough_samples: 1.0 min", answer["channels"][0]["reason"])
        self.assertEqual(answer["reason"], "waiting for T2")

    def test_the_room_is_not_identified(self):
        for command in ("identify", "replay"):
            self.refused(run("thermbalctl", command, self.short, "--channel", "T1"), "--channel T1: it measures the room")
        self.assertEqual(run("thermbalctl", "identify", self.short, "--channel", "T1", "--ambient", "none",
                             "--modes-only").returncode, 0)

    def test_the_room_alone_is_compared_with_no_model(self):
        model = SOURCE / "config/models/vertical_machining_centre.toml"
        rows = "".join(f"{15 * k},18,5000,\n" for k in range(60))
        for name, header in (("room.csv", "time_s,T1,spindle_rpm,note\n"), ("silent.csv", "time_s,T1,spindle_rpm,T2\n")):
            room = self.file(name, header + rows)
            for command in ("diagnose", "calibrate"):
                self.refused(run("thermbalctl", command, room, "--model", model), "so nothing can be compared")

    def settled(self):
        """Two channels over ten of their time constants."""
        rows = "".join(f"{60 * k},18,{28 - 10 * 0.9 ** k + 0.01 * (k % 3):.2f},{23 - 5 * 0.95 ** k + 0.01 * (k % 5):.2f}\n"
                       for k in range(200))
        return self.file("settled.csv", "time_s,T1,T2,T3\n" + rows)

    def test_only_a_recording_that_has_settled_teaches(self):
        settled = self.settled()
        early = self.file("early.csv", "".join(settled.read_text().splitlines(keepends=True)[:25]))
        archive = Path(self.folder.name) / "archive.db"
        made = run("thermbalctl", "learn", early, "--archive", archive)
        self.refused(made, "early.csv: ends at 23 min, where T")
        self.assertFalse(archive.exists(), "an archive of nothing")
        self.refused(run("thermbalctl", "learn", settled, "gone.csv", "--archive", archive), "gone.csv")
        self.assertFalse(archive.exists(), "half of it was learned")
        made = run("thermbalctl", "learn", early, settled, "--archive", archive, "--machine", "M")
        self.assertEqual(made.returncode, 0, made.stderr)
        self.assertIn("early.csv: ends at 23 min, where T", made.stderr)
        self.assertIn("199 min of M are in", made.stdout)
        self.assertNotIn("early.csv", made.stdout)

    def test_a_recording_that_was_measured_out_teaches_however_its_channels_wander(self):
        drawn, wander, rows = random.Random(3), [0.0, 0.0], ""
        for k in range(400):
            wander = [0.95 * off_C + drawn.gauss(0.0, 0.4) for off_C in wander]
            rows += f"{60 * k},18.0,{28 - 10 * 0.95 ** k + wander[0]:.1f},{23 - 5 * 0.97 ** k + wander[1]:.1f}\n"
        recording = self.file("wandering.csv", "time_s,T1,T2,T3\n" + rows)
        said = json.loads(run("thermbalctl", "identify", recording, "--modes-only", "--json").stdout)
        wide = [channel["channel"] for channel in said["channels"] for guard in channel["guards"]
                if guard["name"] == "interval_within_tolerance" and not guard["passed"]]
        self.assertTrue(wide, "no interval is wide: this recording tests nothing")
        made = run("thermbalctl", "learn", recording, "--archive", Path(self.folder.name) / "archive.db")
        self.assertEqual((made.returncode, made.stderr), (0, ""))


class Asked(DaemonCase):
    def test_an_answer_does_not_go_into_the_socket_where_standard_output_is_closed(self):
        made = run("thermbalctl", "status", "--socket", self.socket, to=">&-")
        self.assertEqual(made.returncode, 1, made.stderr)
        self.assertEqual(made.stderr, "thermbalctl: standard output: Bad file descriptor\n")


if __name__ == "__main__":
    unittest.main()
