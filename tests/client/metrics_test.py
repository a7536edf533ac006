"""thermbalctl metrics: judged by promtool, and against what the daemon said."""
import os
import pathlib
import shutil
import socket
import subprocess
import time
import unittest
import urllib.request

from fake_daemon import DaemonCase

PROGRAM = os.path.join(os.environ["THERMBAL_BIN_DIR"], "thermbalctl")


def run(*arguments):
    return subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, timeout=30)


def samples(text):
    """name{labels} -> value, of a text that promtool has accepted."""
    return {line.rsplit(" ", 1)[0]: float(line.rsplit(" ", 1)[1]) for line in text.splitlines() if not line.startswith("#")}


class Metrics(DaemonCase):
    def text(self):
        made = run("metrics", "--socket", self.socket)
        self.assertEqual((made.returncode, made.stderr), (0, ""))
        return made.stdout

    def check(self, text):
        if shutil.which("promtool") is None:
            self.skipTest("promtool is not installed (prometheus)")
        judged = subprocess.run(["promtool", "check", "metrics"], input=text, capture_output=True, text=True, timeout=30)
        self.assertEqual((judged.returncode, judged.stdout + judged.stderr), (0, ""), text)

    def test_promtool_has_nothing_to_say(self):
        self.check(self.text())

    def test_the_numbers_are_those_of_the_daemon(self):
        found = samples(self.text())
        channels = {channel["channel"]: channel for channel in self.daemon.channels()["channels"]}
        good = [channel for channel in channels.values() if channel["quality"] == "good"]
        temperatures = {key: value for key, value in found.items() if key.startswith("thermbal_channel_temperature_celsius")}
        self.assertEqual(len(temperatures), len(good))
        for key, value in temperatures.items():
            name = key.split('channel="')[1].split('"')[0]
            self.assertEqual(value, channels[name]["value_C"])
        self.assertEqual(found['thermbal_channel_quality{channel="T7",quality="open"}'], 1)
        self.assertEqual(found['thermbal_channel_declared{channel="T5"}'], 1)
        self.assertEqual(found['thermbal_channel_steady_state_celsius{channel="T5"}'], channels["T5"]["steady_state_C"])
        self.assertEqual(found['thermbal_channel_equilibrium_time_seconds{channel="T5"}'],
                         60 * channels["T5"]["equilibrium_time_min"])
        self.assertEqual(found['thermbal_test_state{state="running"}'], 1)
        self.assertEqual(found["thermbal_test_elapsed_seconds"], 62.25 * 60)
        self.assertEqual(found["thermbal_up"], 1)

    def test_hostile_names_stay_inside_their_label(self):
        status = dict(self.daemon.status(), machine='hall "3"\\\n} 1\nthermbal_up 7 {ä')
        self.daemon.status = lambda _=None: status
        text = self.text()
        self.check(text)
        self.assertEqual(samples(text)["thermbal_up"], 1)
        self.assertIn('machine="hall \\"3\\"\\\\\\n} 1\\nthermbal_up 7 {ä"', text)

    def test_without_a_daemon_it_is_down_and_said(self):
        made = run("metrics", "--socket", os.path.join(self.folder.name, "nobody"))
        self.assertEqual(made.returncode, 1)
        self.assertIn("thermbal_up 0\n", made.stdout)
        self.assertEqual(made.stderr.count("\n"), 1)
        self.check(made.stdout)

    def test_a_textfile_is_whole(self):
        file = pathlib.Path(self.folder.name, "thermbal.prom")
        made = run("metrics", "--socket", self.socket, "--textfile", str(file))
        self.assertEqual((made.returncode, made.stdout), (0, ""))
        self.check(file.read_text(encoding="utf-8"))
        self.assertEqual([name.name for name in pathlib.Path(self.folder.name).glob("thermbal.prom*")], [file.name])

    def test_an_endpoint_answers_on_the_loopback_only(self):
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        for address in (f"0.0.0.0:{port}", f"192.0.2.1:{port}", f"127.any.name:{port}", "127.0.0.1", "127.0.0.1:0", "127.0.0.1:99999999999", ":9"):
            made = run("metrics", "--socket", self.socket, "--listen", address)
            self.assertEqual(made.returncode, 2, address)
            self.assertIn(address, made.stderr)
        server = subprocess.Popen([PROGRAM, "metrics", "--socket", self.socket, "--listen", f"127.0.0.1:{port}"])
        self.addCleanup(server.wait)
        self.addCleanup(server.terminate)
        for _ in range(100):
            try:
                with urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics", timeout=5) as reply:
                    self.assertIn("version=0.0.4", reply.headers["Content-Type"])
                    self.check(reply.read().decode())
                second = run("metrics", "--socket", self.socket, "--listen", f"127.0.0.1:{port}")
                self.assertEqual((second.returncode, "something else" in second.stderr), (1, True), second.stderr)
                return
            except ConnectionError:
                time.sleep(0.05)
            except urllib.error.URLError:
                time.sleep(0.05)
        self.fail("the endpoint did not answer")


if __name__ == "__main__":
    unittest.main(verbosity=2)
