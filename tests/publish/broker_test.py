"""thermbal-mqtt against a real mosquitto: what stands in the database arrives, whatever dies in between."""
import json
import os
import pathlib
import sqlite3
import subprocess
import tempfile
import time

from broker_support import (Broker, Publisher, Subscriber, SOURCE, configuration, received_samples,
                            skip_without_mosquitto, stored_samples, wait_until, write_databases)


def scratch():
    return tempfile.TemporaryDirectory(prefix="thermbal-mqtt-")


def of_topic(messages, topic):
    return [payload for _, name, payload in messages if name == topic]


def everything_arrives():
    """A whole test with holes, an open sensor, a withdrawn declaration and readings that turn out to be stuck."""
    with scratch() as folder, Broker(folder) as broker:
        subscriber = Subscriber(folder, broker.port)
        assert write_databases(folder, 1, 120, 1).wait(30) == 0
        done = Publisher(folder, configuration(folder, broker.port), "--once")
        assert done.process.wait(30) == 0, done.log()
        stored = stored_samples(f"{folder}/0.db")
        wait_until(lambda: len(received_samples(subscriber.messages())) == len(stored), "all scans arrive", 30)
        subscriber.stop()
        messages = subscriber.messages()
        assert received_samples(messages) == stored
        assert {quality for scan in stored.values() for _, quality in scan.values()} == {"good", "open", "gap", "stuck"}

        declarations = of_topic(messages, "thermbal/VMC 850/declarations/T2")
        assert [(one["steady_state_C"], one["withdrawn"]) for one in declarations][-1] == (26.75, None)
        assert (26.5, "contradicted") in [(one["steady_state_C"], one["withdrawn"]) for one in declarations]
        events = of_topic(messages, "thermbal/VMC 850/events")
        assert [event["message"] for event in events] == [f"scan {k}" for k in range(0, 120, 20)]
        test = of_topic(messages, "thermbal/VMC 850/test")[-1]
        assert test["state"] == "stopped" and test["ended_at"].endswith("Z")
        assert test["channels"][1]["declaration"]["steady_state_C"] == 26.75
        assert [one["online"] for one in of_topic(messages, "thermbal/VMC 850/status")] == [True, False]

        # What has been acknowledged is not sent again; what is retained is told to whoever comes later.
        late = Subscriber(folder, broker.port, name="late")
        again = Publisher(folder, configuration(folder, broker.port), "--once")
        assert again.process.wait(30) == 0, again.log()
        wait_until(lambda: of_topic(late.messages(), "thermbal/VMC 850/test"), "the retained test", 30)
        time.sleep(0.3)
        late.stop()
        assert not received_samples(late.messages())
        assert any(retained for retained, _, _ in late.messages())


def nothing_is_lost_when_both_die():
    """The broker is killed twice and the publisher once while scans keep coming; every scan arrives as it is stored."""
    with scratch() as folder, Broker(folder) as broker:
        subscriber = Subscriber(folder, broker.port)
        config = configuration(folder, broker.port)
        writer = write_databases(folder, 1, 400, 15)
        publisher = Publisher(folder, config)
        wait_until(lambda: len(received_samples(subscriber.messages())) > 20, "the first scans arrive", 30)
        for death in range(2):
            broker.kill()
            time.sleep(0.4)
            if death == 0:
                publisher.kill()
                publisher = Publisher(folder, config)
            broker.start()
            wait_until(lambda: "connected" in publisher.log(), "connected again", 30)
            time.sleep(0.8)
        assert writer.wait(60) == 0
        stored = stored_samples(f"{folder}/0.db")
        wait_until(lambda: received_samples(subscriber.messages()) == stored, "every scan, as it is stored", 40)
        subscriber.stop()
        assert publisher.stop() == 0, publisher.log()
        assert of_topic(subscriber.messages(), "thermbal/VMC 850/status")


def cpu_s(process):
    fields = pathlib.Path(f"/proc/{process.pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def a_database_that_cannot_be_read_is_waited_for():
    """Another program altered a table: said once, asked a few times a second, and sent when it is as it was."""
    with scratch() as folder, Broker(folder) as broker:
        subscriber = Subscriber(folder, broker.port)
        assert write_databases(folder, 1, 40, 1).wait(30) == 0
        other = sqlite3.connect(f"{folder}/0.db", isolation_level=None)
        other.execute("ALTER TABLE samples RENAME TO mine")
        publisher = Publisher(folder, configuration(folder, broker.port))
        wait_until(lambda: "no such table" in publisher.log(), "it says why", 30)
        before_s = cpu_s(publisher.process)
        time.sleep(1.0)
        spent_s = cpu_s(publisher.process) - before_s
        assert spent_s < 0.2, f"{spent_s} s of processor time in 1 s of waiting"
        assert publisher.log().count("no such table") == 1, publisher.log()
        other.execute("ALTER TABLE mine RENAME TO samples")
        other.close()
        stored = stored_samples(f"{folder}/0.db")
        wait_until(lambda: received_samples(subscriber.messages()) == stored, "every scan", 30)
        subscriber.stop()
        assert publisher.stop() == 0, publisher.log()


def a_dead_publisher_is_told():
    with scratch() as folder, Broker(folder) as broker:
        subscriber = Subscriber(folder, broker.port, topic="thermbal/+/status")
        assert write_databases(folder, 1, 4, 1).wait(30) == 0
        publisher = Publisher(folder, configuration(folder, broker.port))
        wait_until(lambda: any(one["online"] for _, _, one in subscriber.messages()), "online", 30)
        publisher.kill()
        wait_until(lambda: not subscriber.messages()[-1][2]["online"], "the last will", 30)
        assert subscriber.messages()[0][2]["daemon"] == "away"
        subscriber.stop()


def a_hostile_name_is_one_level():
    with scratch() as folder, Broker(folder) as broker:
        subscriber = Subscriber(folder, broker.port)
        assert write_databases(folder, 1, 4, 1).wait(30) == 0
        config = configuration(folder, broker.port, machine="hall/3 +#\t\"x")
        assert Publisher(folder, config, "--once").process.wait(30) == 0
        topics = {topic for _, topic, _ in wait_until(subscriber.messages, "messages", 30)}
        subscriber.stop()
        assert all(topic.startswith('thermbal/hall%2F3 %2B%23%09"x/') for topic in topics), topics


def openssl(folder, *arguments):
    subprocess.run(["openssl", *arguments], cwd=folder, check=True, capture_output=True)


def make_certificates(folder):
    curve = ["-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2"]
    openssl(folder, "req", "-x509", *curve, "-keyout", "ca.key", "-out", "ca.pem", "-subj", "/CN=test authority")
    for name in ("broker", "client"):
        openssl(folder, "req", *curve[:-2], "-keyout", f"{name}.key", "-out", f"{name}.csr", "-subj", f"/CN={name}",
                "-addext", "subjectAltName=IP:127.0.0.1")
        pathlib.Path(folder, "extension").write_text("subjectAltName=IP:127.0.0.1\n", encoding="ascii")
        openssl(folder, "x509", "-req", "-in", f"{name}.csr", "-CA", "ca.pem", "-CAkey", "ca.key", "-CAcreateserial",
                "-days", "2", "-extfile", "extension", "-out", f"{name}.pem")


def tls_certificate_and_password():
    """A broker that wants all three; without the password, or with another authority, nothing passes and it is said."""
    with scratch() as folder:
        make_certificates(folder)
        subprocess.run(["mosquitto_passwd", "-b", "-c", f"{folder}/passwords", "thermbal", "s3cret-phrase"], check=True)
        files = {"ca_file": f"{folder}/ca.pem", "certificate_file": f"{folder}/client.pem", "key_file": f"{folder}/client.key"}
        pathlib.Path(folder, "broker-password").write_text("s3cret-phrase\n", encoding="ascii")
        assert write_databases(folder, 1, 20, 1).wait(30) == 0
        with Broker(folder, extra=f"cafile {folder}/ca.pem\ncertfile {folder}/broker.pem\nkeyfile {folder}/broker.key\n"
                                  f"require_certificate true\nallow_anonymous false\npassword_file {folder}/passwords\n") \
                as broker:
            subscriber = Subscriber(folder, broker.port, flags=[
                "--cafile", files["ca_file"], "--cert", files["certificate_file"], "--key", files["key_file"],
                "-u", "thermbal", "-P", "s3cret-phrase"])
            for name, mqtt in (("anonymous", files),
                               ("wrong", {**files, "ca_file": f"{folder}/client.pem", "username": "thermbal",
                                          "password_file": "credential:broker-password"})):
                refused = Publisher(folder, configuration(folder, broker.port, mqtt=mqtt), name=name,
                                    environment={"CREDENTIALS_DIRECTORY": folder})
                wait_until(lambda: "warning" in refused.log() or refused.process.poll() is not None, "it says why", 30)
                refused.kill()
            granted = Publisher(
                folder, configuration(folder, broker.port, mqtt={
                    **files, "username": "thermbal", "password_file": "credential:broker-password"}), "--once",
                name="granted", environment={"CREDENTIALS_DIRECTORY": folder})
            assert granted.process.wait(30) == 0, granted.log()
            stored = stored_samples(f"{folder}/0.db")
            wait_until(lambda: received_samples(subscriber.messages()) == stored, "all scans over TLS", 30)
            subscriber.stop()
        for log in pathlib.Path(folder).glob("*.log"):
            assert "s3cret" not in log.read_text(encoding="utf-8", errors="replace"), log


def wrong_usage_is_said():
    with scratch() as folder:
        config = configuration(folder, 1883, mqtt={"password_file": "/nonexistent/file", "username": "u"})
        for found in (config, str(SOURCE / "config/thermbald.toml")):
            done = subprocess.run([os.environ["THERMBAL_BIN_DIR"] + "/thermbal-mqtt", "--config", found, "--profiles",
                                   str(SOURCE / "config/profiles")], capture_output=True, text=True, timeout=20)
            assert done.returncode == 2 and done.stderr.count("\n") == 1, done
        assert "[mqtt]" in done.stderr


def main():
    skip_without_mosquitto()
    for test in (everything_arrives, nothing_is_lost_when_both_die, a_database_that_cannot_be_read_is_waited_for,
                 a_dead_publisher_is_told, a_hostile_name_is_one_level, tls_certificate_and_password, wrong_usage_is_said):
        started = time.monotonic()
        test()
        print(f"ok   {test.__name__} ({time.monotonic() - started:.1f} s)", flush=True)


if __name__ == "__main__":
    main()
