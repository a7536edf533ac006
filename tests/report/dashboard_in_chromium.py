"""thermbalctl dashboard on a running test (simulated module, real daemon, faster than time): what it shows in a browser is
what the daemon has stored, as it comes; who may not read it does not."""
import http.client
import os
import pathlib
import re
import socket
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "daemon"))
import browser as chromium  # noqa: E402
from daemon_support import CTL, Daemon, Simulator, configuration, database  # noqa: E402


class Dashboard:
    def __init__(self, daemon_socket, *flags):
        self.process = subprocess.Popen([CTL, "dashboard", "--socket", daemon_socket, *flags], stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, text=True)
        self.url = self.process.stdout.readline().strip()
        self.port = int(re.search(r":(\d+)/$", self.url)[1])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.status = self.process.wait(timeout=20)
        self.process.stdout.close()
        self.process.stderr.close()

    def ask(self, path="/", method="GET", **headers):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=20)
        connection.putrequest(method, path, skip_host="host" in headers)
        for name, value in headers.items():
            connection.putheader(name, value)
        connection.endheaders()
        answer = connection.getresponse()
        return connection, answer

    def status_of(self, path="/", **headers):
        connection, answer = self.ask(path, **headers)
        connection.close()
        return answer.status


class DashboardTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="thermbal-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name
        cls.socket = f"{cls.folder}/daemon.sock"
        sim = Simulator("--lockstep", "15").__enter__()
        cls.addClassCleanup(sim.__exit__, None, None, None)
        config = configuration(cls.folder, {"transport": "tcp", "host": "127.0.0.1", "port": sim.port},
                               test={"name": "</script><b>live", "keep_measuring": True})
        daemon = Daemon(cls.folder, config, "--lockstep").__enter__()
        cls.addClassCleanup(daemon.__exit__)
        cls.daemon = daemon
        daemon.wait_for("status", lambda status: status["test"] and status["test"]["scans"] > 20, "some scans")
        cls.dashboard = Dashboard(cls.socket, "--listen", "127.0.0.1:0", "--most-readers", "3").__enter__()
        cls.addClassCleanup(cls.dashboard.__exit__)

    def test_it_shows_the_running_test_as_it_comes(self):
        with chromium.Browser() as browser:
            page = browser.page()
            page.size(1280, 900)
            page.goto(self.dashboard.url)
            page.until("document.querySelectorAll('#channels tr').length === 16 && thermbalPlots.drawn.overview")
            rows = page.run("thermbalPlots.drawn.overview.numRows()")
            page.until(f"thermbalPlots.drawn.overview.numRows() > {rows}", 120)
            low, high = page.run("thermbalPlots.drawn.overview.yAxisRange()")
            lowest, highest = page.run("""(() => { const all = Object.values(thermbalPlots.drawn.overview.thermbal.table.columns).flat()
                .filter(value => value !== null); return [Math.min(...all), Math.max(...all)]; })()""")
            self.assertTrue(low <= lowest and highest <= high, "what has come since is in view")
            page.run("document.querySelector('#channels tr:nth-child(5)').click()")
            page.until("!document.getElementById('channel').hidden && thermbalPlots.drawn.course")
            self.assertIn("</script><b>live", page.run("document.getElementById('who').textContent"))
            shown = page.run("""(() => { const graph = thermbalPlots.drawn.overview;
                return {names: graph.thermbal.plot.lines.map(line => line.column), rows: Array.from({length: graph.numRows()},
                    (_, row) => Array.from({length: graph.numColumns()}, (_, c) => graph.getValue(row, c)))}; })()""")
            with database(self.folder) as stored:
                values = {(name, round(time_s, 6)): value for name, time_s, value in stored.execute(
                    "SELECT c.name, s.time_s, v.value_C FROM samples v JOIN channels c ON c.test_id = v.test_id AND c.position = v.channel "
                    "JOIN scans s ON s.test_id = v.test_id AND s.scan = v.scan")}
            self.assertGreater(len(shown["rows"]), rows)
            for time_min, *row in shown["rows"]:
                for name, value in zip(shown["names"], row):
                    self.assertEqual(values[name, round(60.0 * time_min, 6)], value)
            folder = os.environ.get("THERMBAL_SCREENS")
            if folder:
                page.until("/known|No test/.test(document.getElementById('headline').textContent)")
                page.screenshot(os.path.join(folder, "dashboard.png"))
                page.size(390, 844, True, 2)
                page.screenshot(os.path.join(folder, "dashboard_phone.png"))
            self.assertEqual(page.troubles, [])
            self.assertEqual([url for url in page.fetched if not url.startswith((self.dashboard.url, "data:"))], [])

    def test_only_what_is_asked_for_here_and_under_its_own_name_is_answered(self):
        for path, method, headers, status in (("/", "GET", {}, 200), ("/", "GET", {"host": "evil.example"}, 421),
                                              ("/live", "GET", {"host": "evil.example:80"}, 421), ("/", "POST", {}, 405),
                                              ("/", "GET", {"host": f"localhost:{self.dashboard.port}"}, 200),
                                              ("/../etc/passwd", "GET", {}, 404), ("/", "DELETE", {}, 405)):
            connection, answer = self.dashboard.ask(path, method, **headers)
            self.assertEqual(answer.status, status, (path, method, headers))
            policy = answer.getheader("Content-Security-Policy")
            connection.close()
            if status == 200:
                self.assertIn("default-src 'none'", policy)
                self.assertIn("script-src 'self'; style-src 'self';", policy)
                self.assertNotIn("http", policy)

    def test_readers_are_bounded_and_a_silent_one_locks_nobody_out(self):
        silent = [socket.create_connection(("127.0.0.1", self.dashboard.port)) for _ in range(3)]
        readers = [self.reader() for _ in range(3)]
        connection, answer = self.dashboard.ask("/live")
        self.assertEqual(answer.status, 503)
        connection.close()
        self.assertEqual(self.dashboard.status_of("/page.css"), 200)
        for connection, _ in readers:
            connection.close()
        for one in silent:
            one.close()
        self.reader()[0].close()

    def reader(self):
        """One who is let in: who has gone before, from this test or another, is noticed at the next message."""
        for _ in range(100):
            connection, answer = self.dashboard.ask("/live")
            if answer.status == 200:
                return connection, answer
            connection.close()
            time.sleep(0.2)
        self.fail("no reader is let in")

    def test_beyond_this_machine_only_when_meant_and_with_a_token(self):
        token = pathlib.Path(self.folder, "token")
        token.write_text("short\n")
        token.chmod(0o600)
        for flags, message in ((["--listen", "0.0.0.0:0"], "--beyond-this-machine"),
                               (["--listen", "0.0.0.0:0", "--beyond-this-machine"], "--token-file"),
                               (["--listen", "127.0.0.1"], "ADDRESS:PORT"), (["--listen", "name.example:80"], "ADDRESS:PORT"),
                               (["--token-file", str(token)], "at least 16")):
            done = subprocess.run([CTL, "dashboard", "--socket", self.socket, *flags], capture_output=True, text=True, timeout=20)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(message, done.stderr)
        token.write_text("0123456789abcdef0123\n")
        token.chmod(0o644)
        done = subprocess.run([CTL, "dashboard", "--socket", self.socket, "--token-file", str(token)], capture_output=True, text=True, timeout=20)
        self.assertIn("everybody can read it", done.stderr)
        token.chmod(0o600)
        with Dashboard(self.socket, "--listen", "127.0.0.1:0", "--token-file", str(token)) as guarded:
            self.assertEqual(guarded.status_of("/"), 401)
            self.assertEqual(guarded.status_of("/live", cookie="thermbal_token=0123456789abcdef0124"), 401)
            self.assertEqual(guarded.status_of("/", authorization="Bearer 0123456789abcdef0123"), 200)
            connection, answer = guarded.ask("/?token=0123456789abcdef0123")
            connection.close()
            self.assertEqual(answer.status, 302)
            cookie = answer.getheader("Set-Cookie")
            self.assertIn("HttpOnly", cookie)
            self.assertEqual(guarded.status_of("/page.css", cookie=cookie.split(";")[0]), 200)
        self.assertEqual(guarded.status, 0)


if __name__ == "__main__":
    chromium.skip_without_chromium()
    unittest.main()
