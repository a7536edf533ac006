"""The demonstration behind tests/demo.sh: starts thermbal-sim and thermbald, shows the test while it runs, and prints
where each channel will settle beside where the plant really settles."""
import argparse
import json
import pathlib
import shutil
import socket
import subprocess
import sys
import tempfile
import time


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bin", type=pathlib.Path)
    parser.add_argument("profiles", type=pathlib.Path)
    parser.add_argument("--rtu", action="store_true", help="Modbus RTU on a pseudo-terminal instead of TCP")
    parser.add_argument("--condition", default="5000-idle", choices=["5000-idle", "3000-idle", "3000-cutting"])
    parser.add_argument("--keep", type=pathlib.Path, help="keep configuration, database and recording in this folder")
    return parser.parse_args()


def truth(options):
    done = subprocess.run([options.bin / "thermbal-sim", "--truth", "--json", "--condition", options.condition],
                          check=True, capture_output=True, text=True)
    return {channel["channel"]: channel for channel in json.loads(done.stdout)["channels"]}


def write_configuration(folder, options, where, real):
    line = (f'transport = "rtu"\ndevice = "{where}"\nbaud = 19200\nquiet_ms = 1' if options.rtu
            else f'transport = "tcp"\nhost = "127.0.0.1"\nport = {where}')
    channels = "".join(
        f'\n[[channel]]\nname = "{name}"\nunit = "module"\ninput = {number}\nplace = "{entry["node"].replace("_", " ")}"\n'
        f'role = "{"ambient" if number == 1 else "structure"}"\n'
        for number, (name, entry) in enumerate(real.items(), 1))
    path = folder / "thermbald.toml"
    path.write_text(f"""[test]
name = "{options.condition}"
machine = "simulated spindle head"
start = "auto"

[store]
path = "{folder}/thermbal.db"

[service]
socket = "{folder}/thermbald.sock"

[log]
level = "warning"

[identification]
sweep_always = false      # faster than time: the sweep over n only where nothing else speaks against a declaration

[stop]                    # clearing coil 0 stops the simulated spindle
action = "write_coil"
line = "module"
unit_id = 1
address = 0
value = 0

[[line]]
name = "module"
{line}

[[unit]]
name = "module"
line = "module"
unit_id = 1
profile = "generic-16x-int16"
{channels}""", encoding="utf-8")
    return path


def events_as_they_come(path, daemon):
    """The daemon's event notifications, until it ends."""
    connection = socket.socket(socket.AF_UNIX)
    for _ in range(500):
        try:
            connection.connect(str(path))
            break
        except OSError:
            if daemon.poll() is not None:
                return
            time.sleep(0.02)
    connection.sendall(b'{"jsonrpc":"2.0","id":1,"method":"subscribe","params":{"topics":["event","scan"]}}\n')
    for line in connection.makefile(encoding="utf-8"):
        message = json.loads(line)
        if "method" in message:
            yield message["method"], message["params"]


def show(options, folder, daemon):
    shown_min = -15.0
    for topic, params in events_as_they_come(folder / "thermbald.sock", daemon):
        if topic == "event" and params["kind"] in ("declared", "withdrawn", "all_declared", "stopped", "line_trouble"):
            print(f"{(params['time_s'] or 0) / 60:7.1f} min  {params['message']}", flush=True)
        elif topic == "scan" and params["time_min"] is not None and params["time_min"] >= shown_min + 15.0:
            shown_min = params["time_min"]
            values = "  ".join(f"{channel['channel']} {channel['value_C']:.1f}" if channel["value_C"] is not None
                               else f"{channel['channel']} {channel['quality']}" for channel in params["channels"][:8])
            print(f"{shown_min:7.1f} min  {values} ... C", flush=True)


def report(options, folder, real):
    done = subprocess.run([options.bin / "thermbalctl", "export", "--database", folder / "thermbal.db", "--csv",
                           folder / "recording.csv"], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(done.stderr)
    import sqlite3
    with sqlite3.connect(f"file:{folder}/thermbal.db?mode=ro", uri=True) as stored:
        state, reason = stored.execute("SELECT state, stop_reason FROM tests").fetchone()
        end_min = stored.execute("SELECT max(time_s) FROM scans").fetchone()[0] / 60
        verdicts = {row[0]: json.loads(row[1]) for row in stored.execute(
            "SELECT c.name, i.verdict FROM identifications i JOIN channels c ON c.test_id = i.test_id AND "
            "c.position = i.channel GROUP BY c.position HAVING window_end_scan = max(window_end_scan)")}
    print(f"\n{'':4} {'place':22} {'declared':>9} {'settles at':>11} {'90 % interval':>18} {'really':>8} {'off':>6}"
          f" {'95 % at':>8} {'really':>8}")
    worst = 0.0
    for name, plant in real.items():
        verdict = verdicts.get(name)
        if verdict is None:
            continue
        line = f"{name:4} {plant['node'].replace('_', ' '):22} "
        if not verdict["declared"]:
            print(line + f"{verdict['state']:>9}  {verdict['reason']}")
            continue
        off = verdict["steady_state_C"] - plant["steady_state_C"]
        worst = max(worst, abs(off))
        print(line + f"{verdict['declared_at_min']:5.0f} min {verdict['steady_state_C']:9.2f} C "
              f"{verdict['steady_state_low_C']:8.2f} ..{verdict['steady_state_high_C']:6.2f} C "
              f"{plant['steady_state_C']:6.2f} C {off:+6.2f} {verdict['equilibrium_time_min']:4.0f} min "
              f"{plant['equilibrium_time_min']:4.0f} min")
    declared = sum(verdict["declared"] for verdict in verdicts.values())
    print(f"\n{state} at {end_min:.0f} min: {reason}\n{declared} channels declared, the worst {worst:.2f} C off. "
          f"A test run to its end takes 400 min.")
    return state == "stopped" and declared > 0


def write_report(options, folder):
    """The test as one HTML file, beside the programs; with --keep in that folder."""
    page = (folder if options.keep else options.bin.parent) / "report.html"
    done = subprocess.run([options.bin / "thermbalctl", "report", "--database", folder / "thermbal.db", "--out", page],
                          capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(done.stderr)
    print(f"the report, for any browser: {page.resolve()}")


def main():
    options = arguments()
    real = truth(options)
    folder = options.keep or pathlib.Path(tempfile.mkdtemp(prefix="thermbal-demo-"))
    folder.mkdir(parents=True, exist_ok=True)
    sim_flags = ["--lockstep", "15", "--condition", options.condition] + (["--rtu"] if options.rtu else [])
    sim = subprocess.Popen([options.bin / "thermbal-sim", *sim_flags], stdout=subprocess.PIPE, text=True)
    try:
        ready = sim.stdout.readline().split()
        where = ready[2] if options.rtu else ready[2].rsplit(":", 1)[1]
        print(f"simulated module: Modbus {'RTU on ' + where if options.rtu else 'TCP on 127.0.0.1:' + where}, "
              f"{options.condition}, a scan each 15 s of simulated time", flush=True)
        config = write_configuration(folder, options, where, real)
        daemon = subprocess.Popen([options.bin / "thermbald", "--config", config, "--profiles", options.profiles,
                                   "--lockstep", "--exit-when-ended"])
        show(options, folder, daemon)
        if daemon.wait(timeout=60) != 0:
            sys.exit(f"thermbald ended with status {daemon.returncode}")
        good = report(options, folder, real)
        write_report(options, folder)
    finally:
        sim.terminate()
        sim.wait()
    if options.keep:
        print(f"configuration, database and recording: {folder}")
    else:
        shutil.rmtree(folder)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
