"""The links against a party that is not ours: a pymodbus server with 16 registers, over TCP and over RTU on a socat pair."""
import math
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time

SERVER = """
import sys
from pymodbus.datastore import ModbusSequentialDataBlock, ModbusServerContext, ModbusSlaveContext
from pymodbus.server import StartSerialServer, StartTcpServer
from pymodbus.transaction import ModbusRtuFramer
registers = [int(word) for word in sys.argv[3].split(",")]
block = ModbusSequentialDataBlock(0, registers)
slave = ModbusSlaveContext(hr=block, ir=block, zero_mode=True)
context = ModbusServerContext(slaves={7: slave}, single=False)
if sys.argv[1] == "tcp":
    StartTcpServer(context=context, address=("127.0.0.1", int(sys.argv[2])))
else:
    StartSerialServer(context=context, framer=ModbusRtuFramer, port=sys.argv[2], baudrate=19200, timeout=0.005)
"""

REGISTERS = [180, 267, 65536 - 5, 0x7FFF, 0x8000, 0, 1, 8500, 8501, 65536 - 2000, 65536 - 2001, 274, 248, 183, 212, 299]


def expected(word):
    number = word - 65536 if word >= 32768 else word
    if number == 32767:
        return math.nan, "open"
    if number == -32768:
        return math.nan, "short"
    if number > 8500:
        return math.nan, "over_range"
    if number < -2000:
        return math.nan, "under_range"
    return number / 10, "good"


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def read_until_up(program, arguments, server):
    deadline = time.monotonic() + 20
    while True:
        done = subprocess.run([program, *arguments], capture_output=True, text=True, timeout=20)
        if done.returncode == 0 or time.monotonic() > deadline or server.poll() is not None:
            return done
        time.sleep(0.2)


def check(program, arguments, server, what):
    done = read_until_up(program, arguments, server)
    if done.returncode != 0:
        raise SystemExit(f"{what}: {done.stderr}")
    lines = done.stdout.split("\n")[:-1]
    assert len(lines) == len(REGISTERS), lines
    for word, line in zip(REGISTERS, lines):
        raw, value, quality = line.split()
        want_value, want_quality = expected(word)
        same = math.isnan(float(value)) if math.isnan(want_value) else abs(float(value) - want_value) < 1e-9
        assert int(raw) == word and quality == want_quality and same, f"{what}: {line} for register {word}"
    foreign = subprocess.run([program, *arguments[:3], "8"], capture_output=True, text=True, timeout=20)
    assert foreign.returncode == 1, f"{what}: a unit that is not there gave {foreign.stdout}"
    print(f"{what}: 16 registers, every value and quality as pymodbus holds it; absent unit: {foreign.stderr.strip()}")


def serve(kind, where):
    words = ",".join(str(word) for word in REGISTERS)
    return subprocess.Popen([sys.executable, "-c", SERVER, kind, where, words], stderr=subprocess.DEVNULL)


def main():
    program = sys.argv[1]
    try:
        import pymodbus  # noqa: F401
    except ImportError:
        print("skipped: python3-pymodbus is not installed")
        return 77
    port = str(free_port())
    server = serve("tcp", port)
    try:
        check(program, ["tcp", "127.0.0.1", port, "7"], server, "tcp")
        check(program, ["tcp", "localhost", port, "7"], server, "tcp by name")
    finally:
        server.kill()
        server.wait()
    if shutil.which("socat") is None:
        print("skipped: socat is not installed, RTU was not tried")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        near, far = os.path.join(folder, "near"), os.path.join(folder, "far")
        pair = subprocess.Popen(["socat", f"pty,raw,echo=0,link={near}", f"pty,raw,echo=0,link={far}"])
        deadline = time.monotonic() + 10
        while not (os.path.exists(near) and os.path.exists(far)):
            assert time.monotonic() < deadline, "socat made no pair"
            time.sleep(0.05)
        server = serve("rtu", far)
        try:
            check(program, ["rtu", near, "19200", "7"], server, "rtu")
        finally:
            server.kill()
            server.wait()
            pair.kill()
            pair.wait()
    return 0


sys.exit(main())
