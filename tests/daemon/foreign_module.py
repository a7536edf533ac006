"""thermbald against a module that is not ours: a pymodbus server with 16 registers, over TCP and over RTU on a socat
pair of pseudo-terminals. Every stored word is the server's word, every fault code is marked and is no number."""
import math
import os
import signal
import subprocess
import sys
import time

from daemon_support import Daemon, configuration, database, free_port, need, run, scratch, skip, wait_until

try:
    import pymodbus  # noqa: F401
except ImportError:
    skip("python3-pymodbus is not installed")

SERVER = """
import sys
from pymodbus.datastore import ModbusSequentialDataBlock, ModbusServerContext, ModbusSlaveContext
from pymodbus.server import StartSerialServer, StartTcpServer
from pymodbus.transaction import ModbusRtuFramer
block = ModbusSequentialDataBlock(0, [int(word) for word in sys.argv[3].split(",")])
context = ModbusServerContext(slaves={7: ModbusSlaveContext(hr=block, ir=block, co=block, zero_mode=True)}, single=False)
if sys.argv[1] == "tcp":
    StartTcpServer(context=context, address=("127.0.0.1", int(sys.argv[2])))
else:
    StartSerialServer(context=context, framer=ModbusRtuFramer, port=sys.argv[2], baudrate=19200, timeout=0.005)
"""
WORDS = [180, 267, 65536 - 5, 0x7FFF, 0x8000, 0, 1, 8500, 8501, 65536 - 2000, 65536 - 2001, 274, 248, 183, 212, 299]


def expected(word):
    number = word - 65536 if word >= 32768 else word
    named = {32767: "open", -32768: "short"}
    if number in named:
        return named[number], None
    if number > 8500:
        return "over_range", None
    if number < -2000:
        return "under_range", None
    return "good", number / 10


def serve(kind, where):
    return subprocess.Popen([sys.executable, "-c", SERVER, kind, where, ",".join(map(str, WORDS))],
                            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def every_word_is_the_servers(folder, line):
    config = configuration(folder, line, units=((7, 16),))
    with Daemon(folder, config, "--time-scale", "60") as daemon:
        def some_answered(answer):
            return sum(channel["quality"] == "good" for channel in answer["channels"]) == 12
        daemon.wait_for("channels", some_answered, "twelve good channels")
        done = daemon.call("status")["test"]["scans"]
        daemon.wait_for("status", lambda s: s["test"]["scans"] >= done + 10, "ten scans more")
    with database(folder) as stored:
        rows = stored.execute("SELECT channel, raw, value_C, quality FROM samples WHERE quality NOT IN ('communication', 'gap')").fetchall()
    assert len(rows) >= 160, len(rows)
    for row in rows:
        word = WORDS[row["channel"]]
        quality, value = expected(word)
        assert row["raw"] == word and row["quality"] == quality, dict(row)
        if value is None:
            assert row["value_C"] is None, dict(row)
        else:
            assert math.isclose(row["value_C"], value, abs_tol=1e-9), dict(row)


def over_tcp():
    port = free_port()
    server = serve("tcp", str(port))
    try:
        with scratch() as folder:
            every_word_is_the_servers(folder, {"transport": "tcp", "host": "localhost", "port": port})
    finally:
        server.send_signal(signal.SIGKILL)
        server.wait()


def over_rtu():
    need("socat", "socat")
    with scratch() as folder:
        ours, theirs = f"{folder}/ours", f"{folder}/theirs"
        pair = subprocess.Popen(["socat", f"pty,raw,echo=0,link={ours}", f"pty,raw,echo=0,link={theirs}"])
        try:
            wait_until(lambda: os.path.exists(ours) and os.path.exists(theirs), "the pair of pseudo-terminals")
            server = serve("rtu", theirs)
            try:
                time.sleep(0.5)
                every_word_is_the_servers(folder, {"transport": "rtu", "device": os.path.realpath(ours), "baud": 19200})
            finally:
                server.send_signal(signal.SIGKILL)
                server.wait()
        finally:
            pair.terminate()
            pair.wait()


if __name__ == "__main__":
    run([over_tcp, over_rtu])
