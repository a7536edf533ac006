"""pymodbus, which is not ours, as the client of thermbal-sim over TCP: IPv4 and IPv6, several clients, units,
exceptions, writes, line faults."""
import csv
import os
import signal
import struct
import tempfile
import time

from sim_support import NOISE_FREE, Simulator, recorded, signed, skip, tenths

try:
    from pymodbus.client import ModbusTcpClient
    from pymodbus.exceptions import ModbusException
except ImportError:
    skip("python3-pymodbus is not installed")


def client(sim, host="127.0.0.1", timeout=3):
    made = ModbusTcpClient(host, port=sim.port, timeout=timeout)
    assert made.connect(), host
    return made


def words(reply):
    assert not reply.isError(), reply
    return [signed(word) for word in reply.registers]


def exception_code(reply):
    assert reply.isError(), reply
    return reply.exception_code


def agrees_with_the_plant_on_both_address_families(truth):
    with Simulator("--lockstep", "1800", *NOISE_FREE) as sim:
        assert len(sim.addresses) == 2, sim.addresses
        v4, v6 = client(sim), client(sim, "::1")
        assert words(v4.read_input_registers(0, 16, slave=1)) == tenths(truth, 0)
        assert words(v6.read_input_registers(0, 16, slave=1)) == tenths(truth, 1800)
        assert words(v4.read_holding_registers(0, 16, slave=1)) == tenths(truth, 3600)
        assert words(v6.read_input_registers(4, 1, slave=1)) == [tenths(truth, 3600)[4]]
        assert sim.stop(signal.SIGINT) == 0


def serves_many_clients_at_once(truth):
    with Simulator("--lockstep", "900", "--units", "8,8", *NOISE_FREE) as sim:
        clients = [client(sim) for _ in range(10)]
        for scan in range(4):
            first = words(clients[scan].read_input_registers(0, 8, slave=1))
            expected = tenths(truth, 900 * scan)
            assert first == expected[:8], (scan, first)
            for other in clients:
                assert words(other.read_input_registers(0, 8, slave=2)) == expected[8:]


def answers_exceptions_and_only_its_units():
    with Simulator("--units", "4,4,4,4", "--first-unit", "10") as sim:
        master = client(sim)
        for unit in (10, 11, 12, 13):
            assert len(words(master.read_input_registers(0, 4, slave=unit))) == 4
        assert exception_code(master.read_discrete_inputs(0, 4, slave=10)) == 1
        assert exception_code(master.read_input_registers(0, 5, slave=10)) == 2
        assert exception_code(master.read_input_registers(4, 1, slave=13)) == 2
        assert exception_code(master.read_input_registers(0, 0, slave=10)) == 3
        assert exception_code(master.read_input_registers(0, 126, slave=10)) == 3
        assert exception_code(master.read_input_registers(0, 4, slave=9)) == 11
    with Simulator("--foreign-unit", "silence") as sim:
        quiet = client(sim, timeout=1)  # pymodbus takes whole seconds
        reply = None
        try:
            reply = quiet.read_input_registers(0, 4, slave=2)
        except ModbusException:
            pass
        assert reply is None or reply.isError(), reply
        assert len(words(client(sim).read_input_registers(0, 16, slave=1))) == 16


def a_cleared_coil_stops_the_spindle():
    with Simulator("--lockstep", "1800", *NOISE_FREE) as sim:
        master = client(sim)
        master.read_input_registers(0, 16, slave=1)
        warm = words(master.read_input_registers(0, 16, slave=1))
        assert not master.write_coil(0, False, slave=1).isError()
        assert not master.write_registers(1002, [7, 8], slave=1).isError()
        assert words(master.read_holding_registers(1002, 2, slave=1)) == [7, 8]
        assert exception_code(master.write_register(5, 1, slave=1)) == 2
        cooled = words(master.read_input_registers(0, 16, slave=1))
        assert cooled[1] < warm[1] - 20, (warm, cooled)
        assert "wrote unit 1 coil 0 = 0 at 1800.000 s" in sim.lines()


def serves_other_profiles(truth):
    with Simulator("--profile", "float32", "--word-order", "cdab", "--lockstep", "3600", *NOISE_FREE) as sim:
        master = client(sim)
        master.read_input_registers(0, 32, slave=1)
        registers = master.read_input_registers(0, 32, slave=1).registers
        for k in range(16):
            value = struct.unpack(">f", struct.pack(">HH", registers[2 * k + 1], registers[2 * k]))[0]
            expected = truth[f"T{k + 1}"][truth["time_s"].index(3600)]
            assert abs(value - expected) < 1e-5, (k, value, expected)
    with Simulator("--profile", "mb8art", "--fault", "open:T3@0", "--fault", "short:T9@0") as sim:
        master = client(sim)
        assert words(master.read_input_registers(0, 8, slave=1))[2] == 30000
        assert words(master.read_input_registers(0, 8, slave=2))[0] == -30000
        assert exception_code(master.read_holding_registers(0, 8, slave=1)) == 2


def outcome(fault):
    """What pymodbus makes of a read while `fault` is on the line, then the first read afterwards."""
    with Simulator("--lockstep", "15", "--fault", fault + "@15-30") as sim:
        master = client(sim, timeout=1)
        clean = master.read_input_registers(0, 16, slave=1).registers
        try:
            faulty = master.read_input_registers(0, 16, slave=1)
            faulty = "error" if faulty.isError() else faulty.registers
        except ModbusException:
            faulty = "error"
        master.close()
        assert len(words(client(sim).read_input_registers(0, 16, slave=1))) == 16, fault
        return clean, faulty


def line_faults_reach_the_wire_and_end():
    for fault in ("silence", "exception=4", "hangup", "truncated", "late=2"):
        assert outcome(fault)[1] == "error", fault
    assert outcome("late=0.05")[1] != "error"


def scaled_time_is_the_shared_monotonic_clock():
    epoch = time.monotonic_ns()
    with tempfile.TemporaryDirectory() as folder:
        log = os.path.join(folder, "truth.csv")
        with Simulator("--time-scale", "1000", "--time-epoch-ns", str(epoch), "--log-truth", log) as sim:
            master = client(sim)
            bounds, sent = [], []
            for _ in range(5):
                before = (time.monotonic_ns() - epoch) * 1e-9 * 1000
                sent.append(master.read_input_registers(0, 16, slave=1).registers)
                bounds.append((before, (time.monotonic_ns() - epoch) * 1e-9 * 1000))
                time.sleep(0.02)
        with open(log, encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
    assert len(rows) == 5
    for row, (before, after), registers in zip(rows, bounds, sent):
        assert before <= float(row["time_s"]) <= after, (row, before, after)
        assert [int(word, 16) for word in row["words"].split()] == registers
        assert row["fault"] == "" and row["unit"] == "1" and row["function"] == "4"


def replays_a_recording():
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "recorded.csv")
        with open(path, "w", encoding="utf-8") as file:
            file.write("time_s,T1,T2\n0,18,20.5\n15,18.1,\n30,18.2,-3.4\n")
        with Simulator("--replay", path, "--lockstep", "15") as sim:
            master = client(sim)
            rows = [words(master.read_input_registers(0, 3, slave=1)) for _ in range(4)]
    assert rows == [[180, 205, 32767], [181, 32767, 32767], [182, -34, 32767], [182, -34, 32767]], rows


def survives_what_is_no_modbus():
    import socket
    with Simulator() as sim:
        for nonsense in (b"GET / HTTP/1.1\r\n\r\n", b"\x00" * 5, b"\xff" * 4000):
            with socket.create_connection(("127.0.0.1", sim.port), timeout=3) as raw:
                raw.sendall(nonsense)
        assert len(words(client(sim).read_input_registers(0, 16, slave=1))) == 16


noise_free = recorded("--duration-min", "120", *NOISE_FREE)
agrees_with_the_plant_on_both_address_families(noise_free)
serves_many_clients_at_once(noise_free)
answers_exceptions_and_only_its_units()
a_cleared_coil_stops_the_spindle()
serves_other_profiles(noise_free)
line_faults_reach_the_wire_and_end()
scaled_time_is_the_shared_monotonic_clock()
replays_a_recording()
survives_what_is_no_modbus()
print("pymodbus and thermbal-sim agree")
