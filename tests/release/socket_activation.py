#!/usr/bin/python3
"""A socket that systemd opened: the daemon answers on it, leaves it there, and a client that connects while no daemon runs
is answered by the next one."""
import json
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys

sys.path.insert(0, os.path.join(os.environ["THERMBAL_SOURCE_DIR"], "tests", "daemon"))
from daemon_support import DAEMON, SOURCE, configuration, free_port, run, scratch, skip, wait_until  # noqa: E402


def ask(path):
    with socket.socket(socket.AF_UNIX) as client:
        client.settimeout(30)
        client.connect(path)
        client.sendall(b'{"jsonrpc":"2.0","id":1,"method":"status"}\n')
        return json.loads(client.makefile().readline())


def answers_on_a_socket_of_systemd():
    if shutil.which("systemd-socket-activate") is None:
        skip("systemd-socket-activate is not installed (systemd)")
    with scratch() as folder:
        config = configuration(folder, {"transport": "tcp", "host": "127.0.0.1", "port": free_port(),
                                        "response_timeout_ms": 20, "connect_timeout_ms": 20})
        path = f"{folder}/passed.sock"
        with open(f"{folder}/log", "wb") as log:
            activator = subprocess.Popen(
                ["systemd-socket-activate", "-l", path, DAEMON, "--config", config, "--profiles",
                 str(SOURCE / "config/profiles")], stderr=log)
        try:
            wait_until(lambda: pathlib.Path(path).exists(), "the socket", 10)
            # The connection is there before the daemon is.
            assert "result" in ask(path)
            assert not pathlib.Path(f"{folder}/daemon.sock").exists(), "it opened a second socket"
            # systemd-socket-activate becomes the daemon.
            activator.send_signal(signal.SIGTERM)
            assert activator.wait(timeout=30) == 0
            assert pathlib.Path(path).exists(), "the daemon removed a socket that is systemd's"
        finally:
            if activator.poll() is None:
                activator.kill()
                activator.wait()


if __name__ == "__main__":
    run([answers_on_a_socket_of_systemd])
