"""What thermbal-sim says on wrong usage, and with which exit status: 0 done, 1 failed, 2 wrong usage."""
import json
import os
import socket
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.environ["THERMBAL_SOURCE_DIR"], "tests", "peers"))
from sim_support import PROGRAM


def run(*flags):
    done = subprocess.run([PROGRAM, *flags], capture_output=True, text=True, timeout=60)
    return done.returncode, done.stdout, done.stderr


def refused(expected, *flags, status=2):
    code, out, err = run(*flags)
    assert code == status, (flags, code, err)
    assert out == "" and err.count("\n") == 1 and expected in err, (flags, out, err)


for flags in (["--help"], ["--version"], ["--truth"]):
    code, out, err = run(*flags)
    assert code == 0 and out and not err, (flags, code, err)

code, out, _ = run("--truth", "--json", "--condition", "3000-idle", "--room-C", "20")
truth = json.loads(out)
assert truth["spindle_rpm"] == 3000 and truth["room_C"] == 20 and len(truth["channels"]) == 16

refused("5000-idle, 3000-idle, 3000-cutting", "--condition", "8000-idle")
refused("--nonsense", "--nonsense")
refused("loopback", "--bind", "0.0.0.0")
refused("loopback", "--bind", "192.168.1.4")
refused("'9'", "--units", "9,7", "--profile", "mb8art")
refused("17 channels", "--units", "9,8")
refused("18 channels", "--units", "16,9,9")
refused("'x'", "--units", "8,x")
refused("'0'", "--units", "0")
refused("247", "--units", "8,8", "--first-unit", "247")
refused("'modbus'", "--profile", "modbus")
refused("'abdc'", "--word-order", "abdc")
refused("'gone@0'", "--fault", "gone@0")
refused("RTU only", "--fault", "wrong-crc@0")
refused("there are: 1", "--fault", "late:2@0")
refused("65536", "--port", "65536")
refused("would never end", "--fault", "refuse@0-60", "--lockstep", "15")
refused("/nonexistent/s.toml", "--scenario", "/nonexistent/s.toml")
refused("--control", "--control", "/nonexistent/control")
refused("--lockstep", "--lockstep", "15", "--time-scale", "100")
refused("exclude", "--truth", "--plant")
refused("--rtu", "--link", "module")
refused("/nonexistent/recorded.csv", "--replay", "/nonexistent/recorded.csv")
refused("/nonexistent/out.csv", "--csv", "/nonexistent/out.csv", status=1)
refused("/nonexistent/log.csv", "--log-truth", "/nonexistent/log.csv", status=1)

with tempfile.TemporaryDirectory() as folder:
    path = os.path.join(folder, "module")
    with open(path, "w", encoding="utf-8") as file:
        file.write("mine")
    refused("no symbolic link", "--rtu", "--link", path)
    with open(path, encoding="utf-8") as file:
        assert file.read() == "mine"

with socket.create_server(("127.0.0.1", 0)) as taken:
    port = taken.getsockname()[1]
    refused(str(port), "--port", str(port), status=1)
