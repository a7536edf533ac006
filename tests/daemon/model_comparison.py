"""A test that names a simulation model: compared at each scan, told when the two part, and diagnosed later from what is
stored alone. The machines are computed here (explicit Euler, one second) or by thermbal-sim; neither shares code with the
product's network."""
import json
import pathlib
import random
import signal
import subprocess

from daemon_support import CTL, Daemon, Simulator, configuration, control, database, run, scratch

END_MIN = 120
MODEL = """[model]
name = "three parts"
ambient_C = "T1"
relative_sigma = {sigma}

[[node]]
name = "bearing"
heat_capacity_J_per_K = 3000.0
[[node]]
name = "housing"
heat_capacity_J_per_K = 12000.0
[[node]]
name = "bed"
heat_capacity_J_per_K = 40000.0

[[link]]
between = ["bearing", "housing"]
conductance_W_per_K = 12.0
[[link]]
between = ["housing", "bed"]
conductance_W_per_K = 10.0
[[link]]
between = ["housing", "ambient"]
conductance_W_per_K = 4.0
[[link]]
between = ["bed", "ambient"]
conductance_W_per_K = 7.0

[[source]]
node = "bearing"
power_W = 120.0
proportional_to = "spindle_rpm"
reference = 5000.0

[[sensor]]
channel = "T2"
node = "bearing"
noise_C = 0.05
[[sensor]]
channel = "T3"
node = "housing"
noise_C = 0.05
[[sensor]]
channel = "T4"
node = "bed"
noise_C = 0.05
"""


def machine_csv(folder, hidden_W, from_min=60.0):
    """The machine of the model with numbers 5 to 10 % off, and heat in the housing that the model lacks."""
    numbers = random.Random(7)
    bearing = housing = bed = room = 20.0
    rows = ["time_s,T1,T2,T3,T4"]
    for second in range(END_MIN * 60 + 600):
        if second % 15 == 0:
            readings = [round(value + numbers.gauss(0.0, 0.05), 1) for value in (room, bearing, housing, bed)]
            rows.append(f"{second}," + ",".join(str(reading) for reading in readings))
        into_housing, into_bed = 11.0 * (bearing - housing), 10.5 * (housing - bed)
        extra_W = hidden_W if second >= from_min * 60 else 0.0
        bearing += (128.0 - into_housing) / 3150.0
        housing += (into_housing - into_bed - 4.3 * (housing - room) + extra_W) / 11300.0
        bed += (into_bed - 6.6 * (bed - room)) / 42000.0
    path = pathlib.Path(folder) / "machine.csv"
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return str(path)


def model_file(folder, sigma=0.2, text=MODEL):
    path = pathlib.Path(folder) / "model.toml"
    path.write_text(text.replace("{sigma}", str(sigma)), encoding="utf-8")
    return str(path)


def configured(folder, sim, *, units=((1, 4),), **test):
    return configuration(folder, {"transport": "tcp", "host": "127.0.0.1", "port": sim.port}, units=units,
                         identification={"every_s": 3600.0, "workers": 1},
                         test={"max_duration_min": float(END_MIN), "inputs": {"spindle_rpm": 5000.0}, **test})


def events_of(folder, kind):
    with database(folder) as stored:
        return [dict(row) for row in
                stored.execute("SELECT channel, time_s, message FROM events WHERE kind = ? ORDER BY id", (kind,))]


def a_machine_that_the_model_can_be_raises_nothing():
    with scratch() as folder, Simulator("--lockstep", "15", "--replay", machine_csv(folder, 0.0)) as sim:
        model = model_file(folder)
        with Daemon(folder, configured(folder, sim, model=model), "--lockstep", "--exit-when-ended") as daemon:
            assert daemon.wait_ended(200) == 0, daemon.log_text()
        for kind in ("model_disagrees", "model_failed"):
            assert events_of(folder, kind) == [], events_of(folder, kind)
        with database(folder) as stored:
            kept = stored.execute("SELECT model_toml, model_file FROM tests").fetchone()
            inputs = stored.execute("SELECT count(*), min(value), max(value) FROM inputs").fetchone()
        assert tuple(kept) == (pathlib.Path(model).read_text(encoding="utf-8"), model), "not kept as it was given"
        assert inputs[0] >= END_MIN * 4 and tuple(inputs)[1:] == (5000.0, 5000.0), tuple(inputs)


def residual_is_measured_less_simulated(folder, status):
    """Against `thermbalctl simulate` on what is stored: the same model, driven by the same inputs."""
    control("export", "--database", f"{folder}/test.db", "--csv", f"{folder}/so_far.csv")
    control("simulate", f"{folder}/model.toml", "--inputs", f"{folder}/so_far.csv", "--csv", f"{folder}/simulated.csv")
    def at_s(name, time_s):
        lines = pathlib.Path(folder, name).read_text(encoding="utf-8").splitlines()
        rows = [dict(zip(lines[0].split(","), line.split(","))) for line in lines[1:]]
        return min(rows, key=lambda row: abs(float(row["time_s"]) - time_s))
    compared = status["test"]["model"]
    time_s = compared["compared_at_min"] * 60.0
    measured, simulated = at_s("so_far.csv", time_s), at_s("simulated.csv", time_s)
    assert [entry["channel"] for entry in compared["channels"]] == ["T2", "T3", "T4"], compared
    for entry in compared["channels"]:
        expected_C = float(measured[entry["channel"]]) - float(simulated[entry["channel"]])
        assert abs(entry["residual_C"] - expected_C) < 0.01, (entry, expected_C)


def a_hidden_heat_is_told_once_and_survives_a_kill():
    with scratch() as folder, Simulator("--lockstep", "15", "--replay", machine_csv(folder, 60.0)) as sim:
        model = model_file(folder)
        config = configured(folder, sim, model=model)
        with Daemon(folder, config, "--lockstep") as daemon:
            daemon.wait_for("status", lambda s: s["test"] and s["test"]["model"]["state"] == "disagrees", "the event", 120)
            daemon.process.send_signal(signal.SIGKILL)
            daemon.process.wait()
        told = events_of(folder, "model_disagrees")
        assert told and told[0]["time_s"] > 60.0 * 60.0, told
        assert told[0]["channel"] in told[0]["message"] and "three parts" in told[0]["message"], told
        pathlib.Path(model).unlink()  # the test keeps its own
        with Daemon(folder, configured(folder, sim), "--lockstep", "--exit-when-ended") as daemon:
            assert daemon.wait_ended(200) == 0, daemon.log_text()
        changes = {}
        with database(folder) as stored:
            for kind, channel in stored.execute("SELECT kind, channel FROM events WHERE kind LIKE 'model_%' ORDER BY id"):
                assert kind in ("model_disagrees", "model_agrees"), kind
                assert changes.get(channel) != kind, f"{channel}: {kind} twice in a row"
                changes[channel] = kind
        assert changes[told[0]["channel"]] == "model_disagrees", changes
        done = json.loads(control("diagnose", "--test", "1", "--database", f"{folder}/test.db", "--json"))
        assert done["verdict"] != "agrees", done["reason"]
        assert done["gap"]["after_rmse_C"] < 0.7 * done["gap"]["before_rmse_C"], done["gap"]


def another_machine_disagrees():
    """thermbal-sim's own plant, 21 bodies, against three parts that are known to 5 %."""
    with scratch() as folder, Simulator("--lockstep", "15") as sim:
        config = configured(folder, sim, units=((1, 16),), model=model_file(folder, sigma=0.05), max_duration_min=40.0)
        with Daemon(folder, config, "--lockstep") as daemon:
            status = daemon.wait_for("status", lambda s: s["test"] and s["test"]["model"]["checked_at_min"], "a check")
            model_file(folder, sigma=0.05)
            assert status["test"]["inputs"] == {"spindle_rpm": 5000.0}, status
            status = daemon.wait_for("status", lambda s: s["state"] == "aborted", "the end", 120)
            assert status["test"]["model"]["state"] == "disagrees", status["test"]["model"]
            residual_is_measured_less_simulated(folder, status)
            channels = {entry["channel"]: entry for entry in daemon.call("channels")["channels"]}
            assert channels["T2"]["residual_C"] == status["test"]["model"]["channels"][0]["residual_C"]
            assert "residual_C" not in channels["T9"]
        assert events_of(folder, "model_disagrees")


def a_bad_model_is_refused_with_its_place():
    faster = ["--time-scale", "300"]  # nobody's lockstep waits for the person who starts a test
    with scratch() as folder, Simulator(*faster, "--replay", machine_csv(folder, 0.0)) as sim:
        config = configured(folder, sim, start="manual")
        cases = [(MODEL.replace("heat_capacity_J_per_K = 3000.0", "heat_capacity_J_per_K = -1"), "model.toml:8:"),
                 (MODEL.replace('channel = "T2"', 'chanel = "T2"'), "did you mean"),
                 (MODEL.replace('"spindle_rpm"', '"table_rpm"'), 'found "table_rpm"; the test has no such input'),
                 (MODEL.replace('ambient_C = "T1"', 'ambient_C = "T9"'), "model.toml:3:"),
                 (MODEL.replace('channel = "T', 'channel = "T2'), "no [[sensor]] is a channel of the test"),
                 ("[model\n", "model.toml:1:")]
        with Daemon(folder, config, *faster) as daemon:
            daemon.wait_for("status", lambda status: True, "an answer")
            for text, expected in cases:
                model = model_file(folder, text=text)
                done = subprocess.run([CTL, "start", "--model", model, "--socket", f"{folder}/daemon.sock"],
                                      capture_output=True, text=True, timeout=60)
                assert done.returncode == 1 and expected in done.stderr, (expected, done)
            assert daemon.call("status")["test"] is None
            for wrong in ({"T1": 3.0}, {"spindle_rpm": "fast"}, [5000.0]):
                try:
                    daemon.call("start_test", inputs=wrong)
                except RuntimeError as refused:
                    assert "inputs" in str(refused), refused
                else:
                    raise AssertionError(f"taken: {wrong}")
            said = control("start", "--model", model_file(folder), "--input", "spindle_rpm=4000", "--socket",
                           f"{folder}/daemon.sock")
            assert said == 'test 1 is running, compared with model "three parts"\n', said
            status = daemon.wait_for("status", lambda s: s["test"]["model"]["compared_at_min"], "a comparison")
            assert status["test"]["inputs"] == {"spindle_rpm": 4000.0}, status["test"]["inputs"]
        with Daemon(folder, configured(folder, sim, model=model_file(folder, text="[model\n")), *faster) as daemon:
            assert daemon.wait_ended(20) == 2 and "model.toml:1:" in daemon.log_text(), daemon.log_text()


def an_input_changes_while_the_test_runs():
    with scratch() as folder, Simulator("--lockstep", "15", "--replay", machine_csv(folder, 0.0)) as sim:
        with Daemon(folder, configured(folder, sim, model=model_file(folder)), "--lockstep") as daemon:
            daemon.wait_for("status", lambda s: s["test"] and s["test"]["scans"] > 120, "scans")
            assert control("inputs", "spindle_rpm=3000", "--socket", f"{folder}/daemon.sock") == "noted\n"
            daemon.wait_for("status", lambda s: s["state"] == "aborted", "the end", 120)
        with database(folder) as stored:
            values = [row[0] for row in stored.execute("SELECT value FROM inputs ORDER BY scan")]
        assert sorted(values, reverse=True) == values and set(values) == {5000.0, 3000.0}, set(values)
        assert events_of(folder, "model_disagrees"), "the machine went on at 5000"


if __name__ == "__main__":
    run([a_machine_that_the_model_can_be_raises_nothing, a_hidden_heat_is_told_once_and_survives_a_kill,
         another_machine_disagrees, a_bad_model_is_refused_with_its_place, an_input_changes_while_the_test_runs])
