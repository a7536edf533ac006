"""What a module does that no error tells: it freezes, or its inputs are set to another kind of sensor. Three units of six
inputs on one line, as a 3 x 6 set-up has them."""
import pathlib
import socket
import socketserver
import struct
import threading

from daemon_support import SOURCE, Daemon, Simulator, configuration, control, database, run, scratch, wait_until

SCALE = "150"  # a scan each 100 ms


def tell(path, line):
    with socket.socket(socket.AF_UNIX) as connection:
        connection.settimeout(10)
        connection.connect(path)
        connection.sendall(line.encode() + b"\n")
        answer = connection.makefile().readline()
    assert answer.startswith("ok"), (line, answer)


def line_of(sim):
    return {"transport": "tcp", "host": "127.0.0.1", "port": sim.port}


def qualities(daemon, channels):
    answer = daemon.call("channels")["channels"]
    return {entry["quality"] for entry in answer if entry["channel"] in channels}


def six_input_profile(folder):
    text = (SOURCE / "config/profiles/generic-8x-int16.toml").read_text(encoding="utf-8").replace("inputs = 8", "inputs = 6")
    path = pathlib.Path(folder) / "six.toml"
    path.write_text(text, encoding="utf-8")
    return str(path)


def a_frozen_unit_of_three_is_noticed_and_comes_back():
    with scratch() as folder, Simulator("--units", "6,6,4", "--time-scale", SCALE, "--control", f"{folder}/sim.sock") as sim:
        config = configuration(folder, line_of(sim), units=((1, 6), (2, 6), (3, 4)), profile=six_input_profile(folder),
                               identification={"every_s": 3600.0})
        with Daemon(folder, config, "--time-scale", SCALE) as daemon:
            daemon.wait_for("status", lambda s: s["test"] and s["test"]["scans"] > 30, "scans to learn from")
            tell(f"{folder}/sim.sock", "fault frozen:2")
            wait_until(lambda: "frozen: unit u1" in daemon.log_text(), "the freeze to be noticed")
            wait_until(lambda: qualities(daemon, {"T7", "T12"}) == {"stuck"}, "stuck channels")
            assert "stuck" not in qualities(daemon, {"T1", "T6", "T13"})
            tell(f"{folder}/sim.sock", "clear frozen")
            wait_until(lambda: "thawed: unit u1" in daemon.log_text(), "the thaw")
            wait_until(lambda: qualities(daemon, {"T7", "T12"}) == {"good"}, "good channels")
        with database(folder) as stored:
            stuck = stored.execute("SELECT channel, raw, value_C FROM samples WHERE quality = 'stuck'").fetchall()
            assert {row["channel"] for row in stuck} == set(range(6, 12)), "only the frozen unit's"
            assert all(row["raw"] is not None and row["value_C"] is None for row in stuck)
        control("verify", "--database", f"{folder}/test.db")


def inputs_set_to_another_sensor_are_marked():
    with scratch() as folder, Simulator("--profile", "mb8art", "--units", "8", "--time-scale", SCALE) as sim:
        text = (SOURCE / "config/profiles/mb8art.toml").read_text(encoding="utf-8")
        other = pathlib.Path(folder) / "thermocouples.toml"
        other.write_text(text.replace("accepted = [0x0200]", "accepted = [0x0100]"), encoding="utf-8")
        for profile, quality in ((str(other), "communication"), ("mb8art", "good")):
            place = f"{folder}/{quality}"
            pathlib.Path(place).mkdir()
            config = configuration(place, line_of(sim), units=((1, 8),), profile=profile, identification={"every_s": 3600.0})
            with Daemon(place, config, "--time-scale", SCALE) as daemon:
                daemon.wait_for("status", lambda s: s["test"] and s["test"]["scans"] > 5, "scans")
                wait_until(lambda: qualities(daemon, {"T1", "T8"}) == {quality}, quality)  # noqa: B023
                wrong = daemon.call("health")["lines"][0]["units"][0]["wrong_types"]
                assert ("is set to type 512" in wrong) == (quality == "communication"), wrong


class SilentOnTypes(socketserver.StreamRequestHandler):
    """Answers every read of registers with 20.0 C, but says nothing at all to one of the type codes."""

    def handle(self):
        while header := self.rfile.read(7):
            transaction, _, length, unit = struct.unpack(">HHHB", header)
            function, first, count = struct.unpack(">BHH", self.rfile.read(length - 1))
            if first >= 100:
                continue
            body = struct.pack(">BBB", unit, function, 2 * count) + struct.pack(">H", 200) * count
            self.wfile.write(struct.pack(">HHH", transaction, 0, len(body)) + body)


def types_that_nobody_tells_are_said_once_and_trusted_late():
    with scratch() as folder, socketserver.ThreadingTCPServer(("127.0.0.1", 0), SilentOnTypes) as server:
        server.daemon_threads = True
        threading.Thread(target=server.serve_forever, daemon=True).start()
        line = {"transport": "tcp", "host": "127.0.0.1", "port": server.server_address[1], "response_timeout_ms": 100}
        config = configuration(folder, line, units=((1, 8),), profile="mb8art", test={"period_s": 3.0}, identification={"every_s": 3600.0})
        with Daemon(folder, config) as daemon:
            daemon.wait_for("status", lambda s: s["test"] and s["test"]["scans"] >= 6, "scans")
            said = daemon.log_text().count("its type codes cannot be read")
        server.shutdown()
        with database(folder) as stored:
            quality = [row[0] for row in stored.execute("SELECT quality FROM samples WHERE channel = 0 ORDER BY scan")]
        assert said == 1, said
        assert quality[:2] == ["communication"] * 2 and set(quality[2:]) == {"good"}, quality


if __name__ == "__main__":
    run([a_frozen_unit_of_three_is_noticed_and_comes_back, inputs_set_to_another_sensor_are_marked,
         types_that_nobody_tells_are_said_once_and_trusted_late])
