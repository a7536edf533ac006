"""mbpoll (libmodbus inside) reads thermbal-sim over TCP and over RTU on a pseudo-terminal, and agrees with its plant."""
import os
import re
import shutil
import subprocess
import tempfile

from sim_support import NOISE_FREE, Simulator, recorded, signed, skip, tenths

if shutil.which("mbpoll") is None:
    skip("mbpoll is not installed")


def mbpoll(*arguments):
    done = subprocess.run(["mbpoll", "-0", "-1", "-o", "2", *arguments], capture_output=True, text=True, timeout=30)
    values = [signed(int(value)) for value in re.findall(r"^\[\d+\]:\s+(-?\d+)", done.stdout, re.M)]
    return values, done.stdout + done.stderr


def over_tcp(truth):
    with Simulator("--lockstep", "3600", "--condition", "3000-cutting", *NOISE_FREE) as sim:
        line = ["-m", "tcp", "-p", str(sim.port)]
        for scan in range(3):
            values, output = mbpoll(*line, "-t", "3", "-a", "1", "-r", "0", "-c", "16", "127.0.0.1")
            assert values == tenths(truth, 3600 * scan), output
        values, output = mbpoll(*line, "-t", "4", "-a", "1", "-r", "0", "-c", "17", "127.0.0.1")
        assert values == [] and "Illegal data address" in output, output


def over_rtu(truth):
    with tempfile.TemporaryDirectory() as folder:
        link = os.path.join(folder, "module")
        flags = ["--rtu", "--link", link, "--units", "8,8", "--lockstep", "3600", "--condition", "3000-cutting"]
        with Simulator(*flags, *NOISE_FREE) as sim:
            assert os.path.realpath(link) == sim.path
            line = ["-m", "rtu", "-b", "9600", "-P", "none"]
            for scan in range(3):
                first, output = mbpoll(*line, "-t", "3", "-a", "1", "-r", "0", "-c", "8", link)
                second, more = mbpoll(*line, "-t", "4", "-a", "2", "-r", "0", "-c", "8", link)
                assert first + second == tenths(truth, 3600 * scan), output + more
            values, output = mbpoll(*line, "-t", "3", "-a", "2", "-r", "7", "-c", "2", link)
            assert values == [] and "Illegal data address" in output, output
            values, output = mbpoll(*line, "-t", "3", "-a", "3", "-r", "0", "-c", "8", link)
            assert values == [] and "timed out" in output, output
            _, output = mbpoll(*line, "-t", "0", "-a", "1", "-r", "0", link, "0")
            assert "Written 1 references" in output, output
            assert "wrote unit 1 coil 0 = 0 at 7200.000 s" in sim.lines()
        assert not os.path.lexists(link)


def rtu_faults():
    for fault, complaint in (("wrong-crc", "CRC"), ("wrong-unit", ""), ("truncated", ""), ("silence", "timed out")):
        with Simulator("--rtu", "--lockstep", "15", "--fault", fault + "@0-15") as sim:
            line = ["-m", "rtu", "-P", "none", "-t", "3", "-a", "1", "-r", "0", "-c", "16", "-o", "0.5", sim.path]
            values, output = mbpoll(*line)
            assert values == [] and complaint in output, (fault, output)
            values, output = mbpoll(*line)
            assert len(values) == 16, (fault, output)


noise_free = recorded("--condition", "3000-cutting", "--duration-min", "150", *NOISE_FREE)
over_tcp(noise_free)
over_rtu(noise_free)
rtu_faults()
print("mbpoll and thermbal-sim agree")
