"""thermbalctl watch against a fake daemon: the lines of a pipe, and the real screen in tmux."""
import json
import os
import re
import shutil
import signal
import subprocess
import time
import unittest

from fake_daemon import DaemonCase, FakeDaemon

PROGRAM = os.path.join(os.environ["THERMBAL_BIN_DIR"], "thermbalctl")
ENVIRONMENT = {**os.environ, "LC_ALL": "C.UTF-8", "TERM": "xterm-256color"}


class Piped(DaemonCase):
    def start(self, *arguments):
        made = subprocess.Popen([PROGRAM, "watch", "--socket", self.socket, *arguments], stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, text=True, env=ENVIRONMENT)
        self.addCleanup(made.stdout.close)
        self.addCleanup(made.stderr.close)
        self.addCleanup(made.wait)
        self.addCleanup(made.kill)
        return made

    def test_one_line_a_scan_and_an_event(self):
        made = self.start()
        now = made.stdout.readline()
        self.assertTrue(now.startswith("62.25 min T1=18.09 T2="), now)
        self.assertIn(" T7=open ", now)
        self.assertIn(" T14=communication ", now)
        self.assertTrue(now.endswith(" running, 7 of 13 declared\n"), now)
        self.daemon.scan()
        self.assertTrue(made.stdout.readline().startswith("62.50 min T1="))
        self.daemon.happen("withdrawn", "T5: the declaration is withdrawn", "T5")
        self.assertEqual(made.stdout.readline(), "62.50 min withdrawn: T5: the declaration is withdrawn\n")

    def test_json_is_one_document_a_line(self):
        made = self.start("--json")
        self.assertEqual(json.loads(made.stdout.readline()), {"topic": "scan", "params": self.daemon.channels()})
        self.daemon.scan()
        line = json.loads(made.stdout.readline())
        self.assertEqual(line["topic"], "scan")
        self.assertEqual(line["params"], self.daemon.channels())

    def test_goes_on_when_the_daemon_restarts(self):
        made = self.start()
        made.stdout.readline()
        self.daemon.close()
        self.assertIn("reconnecting", made.stderr.readline())
        self.daemon = FakeDaemon(self.socket)
        self.assertIn("connected again", made.stderr.readline())
        self.assertTrue(made.stdout.readline().startswith("62.25 min "))
        self.daemon.scan()
        self.assertTrue(made.stdout.readline().startswith("62.50 min "))

    def test_ends_when_the_reader_has_gone(self):
        made = subprocess.Popen(f"{PROGRAM} watch --socket {self.socket} | head -n 1", shell=True, env=ENVIRONMENT,
                                stdout=subprocess.DEVNULL)
        self.assertEqual(made.wait(10), 0)


class Screen(DaemonCase):
    def setUp(self):
        super().setUp()
        self.tmux_socket = os.path.join(self.folder.name, "tmux")
        self.addCleanup(self.tmux, "kill-server", check=False)

    def tmux(self, *arguments, check=True):
        made = subprocess.run(["tmux", "-S", self.tmux_socket, "-f", "/dev/null", *arguments], capture_output=True,
                              text=True, timeout=20, env={**ENVIRONMENT, "PS1": "$ "})
        if check:
            self.assertEqual(made.returncode, 0, made.stderr)
        return made.stdout

    def start(self, columns, rows):
        self.tmux("new-session", "-d", "-x", str(columns), "-y", str(rows), "-s", "w", "sh")
        self.tmux("set", "-g", "status", "off")
        self.tmux("send-keys", "-t", "w", f"echo before; {PROGRAM} watch --socket {self.socket}; echo status=$?", "Enter")
        return self.screen_with("declared █")

    def screen(self):
        return self.tmux("capture-pane", "-p", "-t", "w").split("\n")

    def screen_with(self, wanted, gone=None):
        for _ in range(100):
            lines = self.screen()
            whole = "\n".join(lines)
            if wanted in whole and (gone is None or gone not in whole):
                return lines
            time.sleep(0.1)
        self.fail(f"not on the screen: {wanted!r}\n" + whole)

    def press(self, *keys):
        self.tmux("send-keys", "-t", "w", *keys)

    def test_the_whole_view_at_80x24(self):
        lines = self.start(80, 24)
        self.keep("80x24")
        self.assertRegex(lines[0], r'thermbal +test 12 "idle 5000 r/min" +VMC-3 +running +62\.25 min +250 scans')
        self.assertIn("7 of 13", lines[1])
        rows = {line.split()[0]: line for line in lines if re.match(r"T\d+ ", line)}
        self.assertEqual(list(rows), [f"T{c}" for c in range(1, 17)])
        self.assertRegex(rows["T5"], r"^T5 +\d+\.\d\d +\+\d+\.\d\d +\+\d+\.\d +[▁-█]+ +25 0\.038 +25\.50 25\.38\.\.25\.64 +58 min declared")
        self.assertRegex(rows["T7"], r"^T7 +open ")
        self.assertRegex(rows["T14"], r"^T14 no link ")
        self.assertIn("T5 settles at 26.74 C", "\n".join(lines))
        self.assertNotIn("\x1b", "\n".join(lines))

    def test_it_lives_and_gives_the_terminal_back(self):
        self.start(80, 24)
        self.daemon.scan()
        self.screen_with("62.50 min")
        self.daemon.happen("annotation", "the door was opened")
        self.screen_with("the door was opened")
        self.press("q")
        lines = self.screen_with("status=0")
        self.assertIn("before", "\n".join(lines))       # the screen as it was
        self.assertNotIn("declared", "\n".join(lines[2:]))
        self.press("echo seen", "Enter")                # the echo is back
        self.screen_with("echo seen")

    def test_a_signal_gives_the_terminal_back(self):
        self.start(80, 24)
        self.press("C-c")
        self.screen_with("status=130")

    def test_resize_and_pages(self):
        self.start(80, 24)
        self.tmux("resize-window", "-t", "w", "-x", "160", "-y", "40")
        lines = self.screen_with("front bearing")
        self.keep("160x40")
        self.assertIn("interval: 0.31 C wide", "\n".join(lines))
        self.press("Down", "Down", "Down", "Down", "Down")
        self.press("Enter")
        lines = self.screen_with("RMSE against n")
        self.keep("channel160x40")
        self.assertIn("90 % between 25.38 and 25.64 C", "\n".join(lines))
        self.tmux("resize-window", "-t", "w", "-x", "80", "-y", "24")
        self.screen_with("RMSE against n")
        time.sleep(0.3)
        self.keep("channel80x24")
        self.press("e")
        self.screen_with("annotation T13: door opened?[2J", gone="RMSE")
        self.press("?")
        self.screen_with("quit; the test goes on")
        self.keep("help80x24")
        self.press("Escape")
        self.screen_with("choose")

    def test_says_that_the_daemon_is_away_and_comes_back(self):
        self.start(80, 24)
        self.daemon.close()
        self.screen_with("these figures are old; reconnecting")
        self.keep("away")
        self.daemon = FakeDaemon(self.socket)
        self.screen_with("7 of 13", gone="reconnecting")

    def keep(self, name):
        """For a look at it: THERMBAL_SCREENS names a folder."""
        folder = os.environ.get("THERMBAL_SCREENS")
        if folder:
            with open(os.path.join(folder, name + ".txt"), "w", encoding="utf-8") as file:
                file.write(self.tmux("capture-pane", "-p", "-e", "-t", "w"))


if __name__ == "__main__":
    if shutil.which("tmux") is None:
        print("skipped: no tmux here")
        raise SystemExit(77)
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    unittest.main()
