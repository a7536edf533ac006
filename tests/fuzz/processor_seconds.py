#!/usr/bin/env python3
"""Runs a libFuzzer program until it has used so many seconds of the processor: processor_seconds.py SECONDS PROGRAM [ARGUMENT ...]

SIGINT then ends it with its statistics and status 72 (libFuzzer's -interrupted_exitcode), which is a success here; it
has no limit of its own but of the time by the clock.
"""
import os
import signal
import subprocess
import sys
import time

INTERRUPTED = 72


def processor_s(pid):
    with open(f"/proc/{pid}/stat", encoding="utf-8") as stat:
        fields = stat.read().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def main(limit_s, command):
    program = subprocess.Popen(command)
    while program.poll() is None:
        if processor_s(program.pid) >= limit_s:
            program.send_signal(signal.SIGINT)
            return 0 if program.wait() == INTERRUPTED else 1
        time.sleep(1.0)
    return program.returncode or 1


if __name__ == "__main__":
    sys.exit(main(float(sys.argv[1]), sys.argv[2:]))
