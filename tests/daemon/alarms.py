"""A limit is passed: the test is aborted, the machine is stopped, and everybody is told why."""
import json
import pathlib
import sqlite3

from daemon_support import Daemon, Simulator, configuration, run, scratch


def aborted_by(alarm, expected):
    with scratch() as folder, Simulator("--lockstep", "15") as sim:
        out = pathlib.Path(folder) / "told.json"
        script = pathlib.Path(folder) / "stop"
        script.write_text(f'#!/bin/sh\nprintf \'{{"state":"%s","reason":"%s"}}\' "$THERMBAL_STATE" "$THERMBAL_REASON" > {out}\n')
        script.chmod(0o755)
        config = configuration(folder, {"transport": "tcp", "host": "127.0.0.1", "port": sim.port},
                               identification={"every_s": 3600.0}, stop={"action": "command", "command": [str(script)]})
        with open(config, "a", encoding="utf-8") as file:
            file.write("\n[[alarm]]\n" + alarm)
            file.write('\n[log]\nlevel = "error"\n')
        with Daemon(folder, config, "--lockstep", "--exit-when-ended") as daemon:
            assert daemon.wait_ended(90) == 0, daemon.log_text()
            assert "error: alarm" in daemon.log_text(), "whatever the log is kept to, it says this"
        with sqlite3.connect(f"file:{folder}/test.db?mode=ro", uri=True) as stored:
            state, reason = stored.execute("SELECT state, stop_reason FROM tests").fetchone()
            channel, message = stored.execute("SELECT channel, message FROM events WHERE kind = 'alarm'").fetchone()
            last = stored.execute("SELECT max(scan) FROM scans").fetchone()[0]
            beyond = [row[0] for row in stored.execute(
                "SELECT value_C FROM readings WHERE channel = ? ORDER BY scan DESC LIMIT 3", (channel,))]
        told = json.loads(out.read_text())
        assert state == "aborted" and told["state"] == "aborted", (state, told)
        assert reason == message == told["reason"], (reason, message, told)
        for text in expected:
            assert text in reason, reason
        print(f"     scan {last}: {reason}")
        return channel, beyond


def a_limit():
    channel, newest = aborted_by('name = "hot bearing"\nchannel = "T3"\nabove_C = 22.0\nscans = 2\n',
                                 ["alarm: T3", "above 22 C", "hot bearing", "2 good samples in a row"])
    assert channel == "T3"
    assert newest[0] > 22.0 and newest[1] > 22.0, newest


def a_rate():
    aborted_by("rate_C_per_min = 0.5\nrate_over_min = 2.0\n", ["C/min is more than 0.5 C/min", "alarm 1"])


if __name__ == "__main__":
    run([a_limit, a_rate])
