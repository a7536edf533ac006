"""thermbalctl dashboard and samples on a long test: no scan of it is left out, though one answer of the daemon holds only so many."""
import http.client
import json
import os
import re
import subprocess
import unittest

from fake_daemon import DaemonCase

PROGRAM = os.path.join(os.environ["THERMBAL_BIN_DIR"], "thermbalctl")


class LongTest(DaemonCase):
    def setUp(self):
        super().setUp()
        self.daemon.minute = 700.0  # 2801 scans of 16 channels

    def course(self):
        """The x values of the whole course that a page gets first."""
        process = subprocess.Popen([PROGRAM, "dashboard", "--socket", self.socket, "--listen", "127.0.0.1:0"],
                                   stdout=subprocess.PIPE, text=True)
        try:
            port = int(re.search(r":(\d+)/$", process.stdout.readline().strip())[1])
            connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
            connection.request("GET", "/live")
            answer = connection.getresponse()
            for line in answer:
                message = json.loads(line[6:]) if line.startswith(b"data: ") else {}
                if "history" in message:
                    connection.close()
                    return message["history"]["x"]
        finally:
            process.terminate()
            process.wait(timeout=20)
            process.stdout.close()

    def test_the_course_of_the_dashboard_has_no_holes(self):
        x = self.course()
        self.assertEqual((x[0], x[-1]), (0.0, 700.0))
        self.assertLess(max(later - earlier for earlier, later in zip(x, x[1:])), 5.0)

    def test_samples_go_on_behind_the_first_answer(self):
        done = subprocess.run([PROGRAM, "samples", "--socket", self.socket, "--json", "--from-scan", "100", "--limit", "2600"],
                              capture_output=True, text=True, timeout=30)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual([scan["scan"] for scan in json.loads(done.stdout)["scans"]], list(range(100, 2700)))


if __name__ == "__main__":
    unittest.main()
