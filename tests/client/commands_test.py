"""thermbalctl against a fake daemon: text and JSON of every command, and what it says when something is wrong."""
import json
import os
import sqlite3
import subprocess
import time
import unittest

from fake_daemon import DaemonCase

PROGRAM = os.path.join(os.environ["THERMBAL_BIN_DIR"], "thermbalctl")
ENVIRONMENT = {**os.environ, "LC_ALL": "C.UTF-8", "TZ": "UTC"}
ENVIRONMENT.pop("THERMBAL_SOCKET", None)


def run(*arguments, environment=None):
    return subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, timeout=30, stdin=subprocess.DEVNULL,
                          env=environment or ENVIRONMENT)


class Commands(DaemonCase):
    def ask(self, *arguments, status=0):
        made = run(*arguments, "--socket", self.socket)
        self.assertEqual(made.returncode, status, made.stderr)
        return made

    def text(self, *arguments):
        made = self.ask(*arguments)
        self.assertEqual(made.stderr, "")
        self.assertNotIn("\x1b", made.stdout)
        return made.stdout

    def last_request(self):
        return self.daemon.requests[-1]

    def test_json_is_the_answer_of_the_daemon_and_nothing_else(self):
        expected = {("status",): self.daemon.status(), ("channels",): self.daemon.channels(),
                    ("predictions",): self.daemon.predictions(), ("health",): self.daemon.health(),
                    ("curve", "--channel", "T5"): self.daemon.curve({"channel": "T5"}),
                    ("samples", "--channel", "T7", "--from-scan", "8", "--limit", "3"):
                        self.daemon.samples({"channel": "T7", "from_scan": 8, "limit": 3}),
                    ("events", "--after", "1"): self.daemon.list_events({"after_id": 1}),
                    ("start",): {"test": 13, "state": "running"}, ("stop",): {"test": 12, "state": "stopped"}}
        for command, answer in expected.items():
            with self.subTest(command=command):
                self.assertEqual(json.loads(self.text(*command, "--json")), answer)

    def test_status(self):
        text = self.text("status")
        for part in ("running", '12 "idle 5000 r/min"', "62.25 min, 250 scans", "VMC-3", "3.2 s ago, 14 channels good",
                     "waiting for", "T7, T10, T11, T13, T14, T15"):
            self.assertIn(part, text)

    def test_channels_show_the_quality_instead_of_a_value_that_is_not_good(self):
        rows = {line.split()[0]: line for line in self.text("channels").splitlines()[2:]}
        self.assertEqual(len(rows), 16)
        self.assertIn(" open ", rows["T7"])
        self.assertIn(" communication ", rows["T14"])
        self.assertIn(" no rise", rows["T12"])
        self.assertIn("not required", rows["T16"])
        five = self.daemon.channels()["channels"][4]
        for figure in (f"{five['value_C']:.2f}", f"{five['rise_C']:+.2f}", f"{five['rate_C_per_h']:+.1f}",
                       f"{five['steady_state_low_C']:.2f} .. {five['steady_state_high_C']:.2f}", "declared"):
            self.assertIn(f" {figure}", rows["T5"])

    def test_samples(self):
        lines = self.text("samples", "--from-scan", "8", "--limit", "2").splitlines()
        self.assertEqual(lines[0].split(), ["scan", "min", "status"] + [f"T{c}" for c in range(1, 17)])
        self.assertEqual(len(lines), 3)
        first = lines[1].split()
        self.assertEqual(first[:3], ["8", "2.00", "ok"])
        self.assertEqual(first[9], "open")
        self.assertEqual(first[4], f"{self.daemon.samples({'from_scan': 8})['scans'][0]['samples']['T2']['value_C']:.2f}")

    def test_curve_marks_the_minimum(self):
        lines = self.text("curve", "--channel", "T5").splitlines()
        marked = [line for line in lines if "<-" in line]
        self.assertEqual(len(marked), 1)
        self.assertTrue(marked[0].startswith("25 "), marked)
        self.assertTrue(marked[0].endswith("minimum, chosen"), marked)
        self.assertEqual(len(lines), 2 + 35)
        length = {int(line.split()[0]): line.count("█") for line in lines[2:]}
        self.assertGreater(length[1], length[10])
        self.assertGreater(length[10], length[25])
        self.assertEqual(length[34], 0)

    def test_curve_is_ascii_where_the_locale_is(self):
        made = run("curve", "--channel", "T5", "--socket", self.socket, environment={**ENVIRONMENT, "LC_ALL": "C"})
        self.assertTrue(made.stdout.isascii())
        self.assertIn("###", made.stdout)

    def test_predictions_and_health(self):
        text = self.text("predictions")
        self.assertIn("interval: 0.31 C wide", text)
        self.assertIn("waiting for T7", text.splitlines()[-1])
        text = self.text("health")
        for part in ("65 min", "248 ok, 1 late, 2 missed", "1.2 MB, log 4.2 MB", "line left: 500 requests", "8.4 ms",
                     "no answer within 400 ms"):
            self.assertIn(part, text)

    def test_events_are_safe_to_print(self):
        text = self.text("events")
        self.assertIn("2023-11-14 22:13:20", text)
        self.assertIn("door opened?[2J for a moment", text)
        self.assertEqual(len(self.text("events", "--limit", "1").splitlines()), 2)

    def test_what_changes_something_sends_what_was_given(self):
        self.assertEqual(self.text("start", "--name", "warm-up", "--machine", "VMC-4"), "test 13 is running\n")
        self.assertEqual(self.last_request(), ("start_test", {"name": "warm-up", "machine": "VMC-4"}))
        self.assertEqual(self.text("stop", "--reason", "lunch", "--abort"), "test 12 is aborted\n")
        self.assertEqual(self.last_request(), ("stop_test", {"reason": "lunch", "abort": True}))
        self.text("stop")
        self.assertEqual(self.last_request(), ("stop_test", {}))
        self.text("annotate", "Tür geöffnet", "--channel", "T5")
        self.assertEqual(self.last_request(), ("annotate", {"message": "Tür geöffnet", "channel": "T5"}))

    def test_events_follow_from_the_first_to_those_that_happen(self):
        made = subprocess.Popen([PROGRAM, "events", "--follow", "--json", "--socket", self.socket],
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=ENVIRONMENT)
        self.assertEqual([json.loads(made.stdout.readline())["id"] for _ in range(3)], [1, 2, 3])
        self.daemon.happen("annotation", "one")
        self.daemon.happen("annotation", "two")
        self.assertEqual([json.loads(made.stdout.readline())["message"] for _ in range(2)], ["one", "two"])
        self.daemon.close()
        self.assertEqual(made.wait(10), 1)
        self.assertIn("closed the connection", made.stderr.read())
        made.stdout.close()
        made.stderr.close()

    def test_nobody_answers(self):
        for command in (["status"], ["watch"], ["stop", "--json"], ["events", "--follow"]):
            made = run(*command, "--socket", "/nonexistent/x.sock")
            self.assertEqual(made.returncode, 1)
            self.assertEqual(made.stdout, "")
            self.assertEqual(made.stderr, "thermbalctl: no thermbald answers on /nonexistent/x.sock: start it, or name "
                                          "its socket with --socket\n")

    def test_the_socket_may_come_from_the_environment(self):
        made = run("status", environment={**ENVIRONMENT, "THERMBAL_SOCKET": self.socket})
        self.assertEqual(made.returncode, 0, made.stderr)

    def test_a_refusal_is_said_in_the_daemons_words(self):
        self.daemon.refuse = {"stop_test": (-32001, "permission denied: root, the daemon's user\nor group thermbal")}
        made = self.ask("stop", status=1)
        self.assertEqual(made.stderr,
                         "thermbalctl: permission denied: root, the daemon's user or group thermbal\n")
        self.daemon.refuse = {"curve": (-32602, "channel: there is no T99")}
        self.assertEqual(self.ask("curve", "--channel", "T99", status=1).stderr, "thermbalctl: channel: there is no T99\n")

    def test_no_answer_in_time(self):
        self.daemon.silent = {"health"}
        began = time.monotonic()
        made = self.ask("health", status=1)
        self.assertLess(time.monotonic() - began, 20)
        self.assertIn('did not answer "health" within 10 s', made.stderr)

    def test_wrong_usage(self):
        for command in ([], ["nothing"], ["status", "--frobnicate"], ["annotate"], ["samples", "--limit", "0"],
                        ["samples", "--from-scan", "-1"], ["events", "--limit", "x"], ["export"], ["backup"],
                        ["verify", "--database", "/nonexistent.db"], ["export", "--csv", "-", "--test", "0"]):
            with self.subTest(command=command):
                made = run(*command)
                self.assertEqual(made.returncode, 2, made.stderr)
                self.assertEqual(made.stdout, "")
                self.assertEqual(made.stderr.count("\n"), 1, made.stderr)
                self.assertTrue(made.stderr.startswith("thermbalctl: "), made.stderr)

    def test_every_command_has_help(self):
        commands = ["watch", "status", "channels", "predictions", "curve", "samples", "events", "health", "start", "stop",
                    "annotate", "tests", "export", "verify", "backup", "ports", "identify", "replay"]
        overview = run("--help")
        self.assertEqual(overview.returncode, 0)
        for command in commands:
            self.assertRegex(overview.stdout, rf"(?m)^  {command} ")
            self.assertEqual(run(command, "--help").returncode, 0)

    def test_ports(self):
        made = run("ports", "--json")
        self.assertEqual(made.returncode, 0, made.stderr)
        for port in json.loads(made.stdout)["ports"]:
            self.assertEqual(set(port), {"path", "by_id_path", "usb", "serial_number", "description"})
        self.assertEqual(run("ports").returncode, 0)

    # ---- on a database, made by the store's own schema

    def test_a_file_that_is_no_database_is_refused(self):
        path = os.path.join(self.folder.name, "other.db")
        sqlite3.connect(path).executescript("CREATE TABLE other (x); INSERT INTO other VALUES (1);")
        for command in (["tests"], ["verify"], ["export", "--csv", "-"], ["backup", path + ".copy"]):
            made = run(*command, "--database", path)
            self.assertEqual(made.returncode, 2, made.stderr)
            self.assertIn(path, made.stderr)
            self.assertEqual(made.stderr.count("\n"), 1)

    def test_the_daemon_says_where_the_database_is(self):
        made = self.ask("tests", status=2)
        self.assertIn(self.socket + ".db", made.stderr)
        made = run("tests", "--socket", "/nonexistent/x.sock")
        self.assertEqual(made.returncode, 1)
        self.assertIn("--database", made.stderr)


if __name__ == "__main__":
    unittest.main()
