"""What happens to the sockets and the pseudo-terminal of thermbal-sim under the faults of its endpoint, seen from plain
sockets, and the control socket that brings and ends them."""
import os
import socket
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.environ["THERMBAL_SOURCE_DIR"], "tests", "peers"))
from sim_support import Simulator

READ_ONE = bytes([0, 1, 0, 0, 0, 6, 1, 4, 0, 0, 0, 1])


class Control:
    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(5)
        self.socket.connect(path)
        self.lines = self.socket.makefile("r", encoding="utf-8")

    def say(self, line):
        self.socket.sendall(line.encode() + b"\n")
        answer = self.lines.readline().strip()
        assert answer.startswith("ok"), answer
        time.sleep(0.02)  # the endpoint follows within its next look
        return answer


def connect(sim):
    made = socket.create_connection(("127.0.0.1", sim.port), timeout=0.3)
    made.settimeout(0.3)
    return made


def answer(connection):
    connection.sendall(READ_ONE)
    try:
        return connection.recv(100)
    except (TimeoutError, ConnectionResetError):
        return None


def is_refused(sim):
    try:
        connect(sim).close()
        return False
    except ConnectionRefusedError:
        return True


def a_refused_connection_is_refused_and_comes_back(sim, control):
    before = connect(sim)
    assert len(answer(before)) == 11
    control.say("fault refuse")
    assert not answer(before) and is_refused(sim)
    control.say("clear refuse")
    assert len(answer(connect(sim))) == 11


def a_half_open_connection_is_accepted_and_never_answered(sim, control):
    control.say("fault half-open")
    waiting = connect(sim)
    assert answer(waiting) is None
    control.say("clear")
    assert len(waiting.recv(100)) == 11, "what was asked before is answered in the end"


def one_client_keeps_all_others_out(sim, control):
    time.sleep(0.05)
    control.say("fault one-client=0.2")
    first = connect(sim)
    assert len(answer(first)) == 11
    assert not answer(connect(sim)), "a second client was served"
    assert len(answer(first)) == 11
    first.close()
    time.sleep(0.05)
    assert not answer(connect(sim)), "the place was free at once"
    time.sleep(0.3)
    assert len(answer(connect(sim))) == 11
    control.say("clear")


def an_unplugged_port_comes_back_under_another_name():
    with tempfile.TemporaryDirectory() as folder:
        link, path = f"{folder}/module", f"{folder}/control"
        with Simulator("--rtu", "--link", link, "--control", path) as sim:
            control = Control(path)
            first = os.readlink(link)
            assert first == sim.path
            control.say("fault unplug")
            assert not os.path.lexists(link) and not os.path.exists(first)
            control.say("clear")
            second = os.readlink(link)
            assert second != first and os.path.exists(second), (first, second)
            assert f"plugged rtu {second}" in sim.lines()


with tempfile.TemporaryDirectory() as scratch:
    with Simulator("--control", f"{scratch}/control", "--lockstep", "15") as simulator:
        line = Control(f"{scratch}/control")
        a_refused_connection_is_refused_and_comes_back(simulator, line)
        a_half_open_connection_is_accepted_and_never_answered(simulator, line)
        one_client_keeps_all_others_out(simulator, line)
    assert not os.path.exists(f"{scratch}/control")
an_unplugged_port_comes_back_under_another_name()
