#!/usr/bin/python3
"""A hundred daemons' databases, a thermbal-mqtt for each, one broker that is killed (SIGKILL) and started again ten times: does
every sample arrive, as it is stored? `hundred_daemons.py [--daemons N] [--scans N] [--every-ms MS] [--kills N]`

Prints what was stored, what arrived, what came twice, and how long the last scan took. THERMBAL_BIN_DIR and
THERMBAL_SOURCE_DIR as for the tests.
"""
import argparse
import pathlib
import resource
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "publish"))
from broker_support import (Broker, Publisher, Subscriber, configuration, received_samples,  # noqa: E402
                            skip_without_mosquitto, stored_samples, write_databases)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--daemons", type=int, default=100)
    parser.add_argument("--scans", type=int, default=160, help="of each daemon")
    parser.add_argument("--every-ms", type=int, default=1500, help="between two scans of one daemon (in a real test 15000)")
    parser.add_argument("--kills", type=int, default=10)
    parser.add_argument("--settle-s", type=float, default=5.0)
    parser.add_argument("--patience-s", type=float, default=600.0, help="after the last scan is written")
    parser.add_argument("--down-s", type=float, default=3.0, help="how long the broker is away")
    return parser.parse_args()


def count_lines(path):
    with open(path, "rb") as file:
        return sum(chunk.count(b"\n") for chunk in iter(lambda: file.read(1 << 20), b""))


def kill_the_broker(broker, options, seconds):
    pause_s = seconds / (options.kills + 1)
    for death in range(options.kills):
        time.sleep(max(0.5, pause_s - options.down_s))
        broker.kill()
        time.sleep(options.down_s)
        broker.start()
        print(f"broker killed and started again: {death + 1} of {options.kills}", flush=True)


def wait_for_the_rest(subscriber, publishers, wanted, seconds):
    """Until as many different scans have arrived as are stored; publishers wait up to 60 s before they connect again."""
    give_up = time.monotonic() + seconds
    while time.monotonic() < give_up:
        if count_lines(subscriber.path) >= wanted and len(received_samples(subscriber.messages())) >= wanted:
            return
        for publisher in publishers:
            assert publisher.process.poll() is None, publisher.log()
        time.sleep(3)


def main():
    skip_without_mosquitto()
    most = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
    options = arguments()
    with tempfile.TemporaryDirectory(prefix="thermbal-hundred-") as folder, Broker(folder, written="each second") as broker:
        subscriber = Subscriber(folder, broker.port, topic="+/+/samples")
        writer = write_databases(folder, options.daemons, options.scans, options.every_ms)
        publishers = [Publisher(folder, configuration(folder, broker.port, machine=f"machine {k}", database=f"{k}.db",
                                                      mqtt={"settle_s": options.settle_s, "client_id": f"publisher{k}"}),
                                name=f"publisher{k}") for k in range(options.daemons)]
        kill_the_broker(broker, options, options.scans * options.every_ms / 1000)
        assert writer.wait(600) == 0
        written = time.monotonic()
        stored = {}
        for k in range(options.daemons):
            stored.update(stored_samples(f"{folder}/{k}.db"))
        wait_for_the_rest(subscriber, publishers, len(stored), options.patience_s)
        time.sleep(5)  # revisions of the end
        took_s = time.monotonic() - written
        subscriber.stop()
        for publisher in publishers:
            publisher.process.terminate()
        for publisher in publishers:
            publisher.process.wait(30)
        messages = subscriber.messages()
        received = received_samples(messages)
        lost = [key for key in stored if key not in received]
        wrong = [key for key in stored if key in received and received[key] != stored[key]]
        print(f"{options.daemons} daemons, {options.kills} kills: {len(stored)} scans, {16 * len(stored)} samples stored; "
              f"{len(messages)} messages, {len(received)} different scans; lost {len(lost)}, other than stored {len(wrong)}; "
              f"all there {took_s:.0f} s after the last was written")
        return 1 if lost or wrong else 0


if __name__ == "__main__":
    sys.exit(main())
