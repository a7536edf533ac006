"""The main job against a plant whose truth is known: simulated module, real Modbus, the daemon, to the stop. What is
declared is true, and the recording gives the same declarations again, bit for bit."""
import json
import subprocess
import sys

from daemon_support import BIN, Daemon, Simulator, configuration, control, database, run, scratch


def truth(condition):
    done = subprocess.run([BIN / "thermbal-sim", "--truth", "--json", "--condition", condition], capture_output=True,
                          text=True, check=True, timeout=60)
    return {channel["channel"]: channel for channel in json.loads(done.stdout)["channels"]}


def rise_C(channel):
    return channel["steady_state_C"] - 18.0


def whole_test(transport, condition):
    real = truth(condition)
    flags = ["--rtu"] if transport == "rtu" else []
    with scratch() as folder, Simulator("--lockstep", "15", "--condition", condition, *flags) as sim:
        line = ({"transport": "rtu", "device": sim.path, "quiet_ms": 1} if transport == "rtu"
                else {"transport": "tcp", "host": "127.0.0.1", "port": sim.port})
        config = configuration(folder, line, test={"name": condition})
        with Daemon(folder, config, "--lockstep", "--exit-when-ended") as daemon:
            assert daemon.wait_ended(400) == 0, daemon.log_text()
        csv = f"{folder}/test.csv"
        control("export", "--database", f"{folder}/test.db", "--csv", csv)
        with database(folder) as stored:
            state, end_s = stored.execute("SELECT state, (SELECT max(time_s) FROM scans) FROM tests").fetchone()
            declared = [json.loads(row[0]) for row in
                        stored.execute("SELECT basis FROM declarations WHERE withdrawn = '' ORDER BY channel")]
        assert state == "stopped", state
        assert len(declared) >= 14, [d["channel"] for d in declared]
        print(f"     stopped at {end_s / 60:.1f} min")
        worst = 0.0
        for verdict in declared:
            plant = real[verdict["channel"]]
            error = verdict["steady_state_C"] - plant["steady_state_C"]
            worst = max(worst, abs(error))
            allowed = max(0.3, 0.05 * abs(rise_C(plant)))
            assert abs(error) <= allowed, f"{verdict['channel']} declared {error:+.2f} C off"
        print(f"     {len(declared)} declared, the worst {worst:.2f} C off")

        replayed = json.loads(control("replay", csv, "--json", "--every-min", "2", seconds=400))
        again = {channel["channel"]: channel for channel in replayed["channels"] if channel["declared"]}
        assert set(again) == {verdict["channel"] for verdict in declared}
        for verdict in declared:
            for key in ("declared_at_min", "n", "svr", "rmse_by_n_C", "steady_state_C", "steady_state_low_C",
                        "steady_state_high_C", "equilibrium_time_min"):
                assert again[verdict["channel"]][key] == verdict[key], (verdict["channel"], key)


def over_tcp():
    whole_test("tcp", "5000-idle")


def over_rtu():
    whole_test("rtu", "3000-cutting")


if __name__ == "__main__":
    run([over_rtu] if "rtu" in sys.argv[1:] else [over_tcp])
