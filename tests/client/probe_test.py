"""thermbalctl probe against modules whose register maps are known: thermbal-sim and a pymodbus server. What it proposes
has to pass thermbald --check-config, and the values it shows have to be those of the module."""
import json
import pathlib
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "daemon"))
from daemon_support import CTL, DAEMON, SOURCE, Simulator, free_port, run, skip, wait_until  # noqa: E402

PROFILES = str(SOURCE / "config/profiles")


def probe(*arguments, status=0, seconds=90):
    done = subprocess.run([CTL, "probe", *arguments, "--profiles", PROFILES, "--json"], capture_output=True, text=True,
                          timeout=seconds)
    assert done.returncode == status, (arguments, done.returncode, done.stderr)
    return json.loads(done.stdout)


def is_accepted(result):
    with tempfile.TemporaryDirectory() as folder:
        config = pathlib.Path(folder) / "thermbald.toml"
        config.write_text(result["config_toml"], encoding="utf-8")
        if result["profile_name"]:
            (pathlib.Path(folder) / f"{result['profile_name']}.toml").write_text(result["profile_toml"], encoding="utf-8")
        done = subprocess.run([DAEMON, "--config", str(config), "--check-config", "--profiles", folder, "--profiles", PROFILES],
                              capture_output=True, text=True, timeout=30)
        assert done.returncode == 0, (done.stderr, result["config_toml"])
        return done.stdout


def best(unit):
    reading = unit["readings"][0]
    return reading["function"], reading["first_register"], reading["type"], reading["byte_order"], reading["scale"]


def a_module_of_two_units_is_recognised_by_its_types():
    with Simulator("--profile", "mb8art", "--units", "8,8", "--time-scale", "1") as sim:
        result = probe("tcp", f"127.0.0.1:{sim.port}", "--units", "1-4")
    units = {unit["unit_id"]: unit for unit in result["units"]}
    assert sorted(units) == [1, 2], sorted(units)
    for unit in units.values():
        assert unit["profiles"][0]["profile"] == "mb8art" and unit["profiles"][0]["types_confirmed"], unit["profiles"]
        assert best(unit)[:3] == (4, 0, "int16"), best(unit)
        assert all(10 < value < 40 for value in unit["readings"][0]["values_C"][:8]), unit["readings"][0]
    explained = is_accepted(result)
    assert explained.count("[[channel]]") == 16 and explained.count("[[unit]]") == 2, explained


def floats_with_swapped_words_are_read_rightly():
    for order in ("cdab", "dcba"):
        with Simulator("--profile", "float32", "--word-order", order) as sim:
            result = probe("tcp", "127.0.0.1", "--port", str(sim.port), "--units", "1")
        unit = result["units"][0]
        assert best(unit)[2:] == ("float32", order, 1.0), unit["readings"][:3]
        assert unit["readings"][0]["inputs"] == 16
        assert "float32" in result["profile_toml"]
        assert is_accepted(result).count("[[channel]]") == 16


def units_of_unequal_size_as_three_by_six_has_them():
    with Simulator("--units", "6,6,4") as sim:
        result = probe("tcp", "127.0.0.1", "--port", str(sim.port), "--units", "1-4")
    assert [unit["unit_id"] for unit in result["units"]] == [1, 2, 3], result["units"]
    explained = is_accepted(result)
    assert explained.count("[[channel]]") == 16 and explained.count("[[unit]]") == 3, explained


def over_a_serial_line():
    with Simulator("--rtu", "--units", "4,4,4,4") as sim, tempfile.TemporaryDirectory() as folder:
        device = pathlib.Path(folder) / 'the "left" port'
        device.symlink_to(sim.path)
        result = probe("rtu", str(device), "--baud", "9600", "--parity", "N", "--units", "1-5", "--timeout-ms", "100")
    assert [unit["unit_id"] for unit in result["units"]] == [1, 2, 3, 4]
    assert is_accepted(result).count("[[channel]]") == 16


SERVER = """
import sys
from pymodbus.datastore import ModbusSequentialDataBlock, ModbusServerContext, ModbusSlaveContext
from pymodbus.server import StartTcpServer
words = [10793, 10895, 10971, 10782, 11023, 10804]   # hundredths of an ohm: 20.4 to 26.3 C
nothing = ModbusSequentialDataBlock(200, [0])
context = ModbusServerContext(slaves={7: ModbusSlaveContext(hr=nothing, ir=ModbusSequentialDataBlock(0, words), zero_mode=True)},
                              single=False)
StartTcpServer(context=context, address=("127.0.0.1", int(sys.argv[1])))
"""


def resistances_of_a_foreign_module_are_shown_as_temperatures():
    try:
        import pymodbus  # noqa: F401
    except ImportError:
        skip("python3-pymodbus is not installed")
    port = free_port()
    server = subprocess.Popen([sys.executable, "-c", SERVER, str(port)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        def answered():
            done = subprocess.run([CTL, "probe", "tcp", "127.0.0.1", "--port", str(port), "--units", "7", "--json"],
                                  capture_output=True, text=True, timeout=60)
            return json.loads(done.stdout) if done.returncode == 0 else None
        result = wait_until(answered, "an answer of the server", 30)
    finally:
        server.kill()
        server.wait()
    readings = result["units"][0]["readings"]
    ohms = [reading for reading in readings if reading["is_resistance"] and reading["scale"] == 0.01]
    assert ohms and ohms[0]["inputs"] == 6, readings
    assert abs(ohms[0]["values_C"][0] - 20.36) < 0.02, ohms[0]["values_C"]
    assert ohms[0] is readings[0], "resistance explains these words best"


def nobody_there_ends_in_time_and_says_so():
    started = time.monotonic()
    result = subprocess.run([CTL, "probe", "tcp", "127.0.0.1", "--port", str(free_port())], capture_output=True, text=True,
                            timeout=30)
    assert result.returncode == 1 and "cannot connect" in result.stderr, result.stderr
    with Simulator("--fault", "silence@0") as sim:
        silent = subprocess.run([CTL, "probe", "tcp", "127.0.0.1", "--port", str(sim.port), "--limit-s", "2"],
                                capture_output=True, text=True, timeout=30)
    assert silent.returncode == 1, silent.stdout
    assert time.monotonic() - started < 20


def a_port_that_is_none_is_refused():
    for where in ("127.0.0.1:", "127.0.0.1:modbus", "127.0.0.1:123456"):
        result = subprocess.run([CTL, "probe", "tcp", where], capture_output=True, text=True, timeout=10)
        assert result.returncode == 2 and "accepted" in result.stderr, (where, result.returncode, result.stderr)


if __name__ == "__main__":
    run([a_module_of_two_units_is_recognised_by_its_types, floats_with_swapped_words_are_read_rightly,
         units_of_unequal_size_as_three_by_six_has_them, over_a_serial_line,
         resistances_of_a_foreign_module_are_shown_as_temperatures, nobody_there_ends_in_time_and_says_so,
         a_port_that_is_none_is_refused])
