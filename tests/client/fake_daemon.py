"""A daemon that measures nothing: canned answers in the shape that thermbald gives them, over the same socket.

It knows nothing of the client and speaks JSON-RPC 2.0 as daemon/service/README.md describes it.
"""
import json
import math
import os
import socket
import tempfile
import threading
import unittest

PLACES = ["room, 1.5 m above the floor", "spindle motor", "front bearing", "rear bearing", "sleeve", "headstock left",
          "headstock right", "headstock top", "column, upper", "column, lower", "bed, front", "bed, rear",
          "Y ball screw nut", "coolant in", "coolant out", "Späne-Förderer"]


def warming(channel, minute):
    """Ambient plus a rise with one time constant each: figures of a plausible size."""
    rise, tau = (0.1, 30.0) if channel == 1 else (12.0 / (1 + 0.12 * channel), 25.0 + 3.0 * channel)
    return 18.0 + rise * (1.0 - math.exp(-minute / tau)), 18.0 + rise, tau


def channel_answer(channel, minute):
    value, steady, tau = warming(channel, minute)
    entry = {"channel": f"T{channel}", "place": PLACES[channel - 1], "role": "ambient" if channel == 1 else "structure",
             "required": channel not in (1, 16), "value_C": value, "raw": int(value * 10), "quality": "good",
             "rise_C": value - 18.0, "rate_C_per_h": (steady - value) / tau * 60.0,
             "recent_C": [warming(channel, minute * (i + 1) / 24)[0] for i in range(24)]}
    if channel == 1:
        return entry
    declared = channel <= 9
    entry |= {"state": "declared" if declared else "measuring", "n": 20 + channel % 7,
              "window_rmse_C": 0.018 + 0.004 * channel, "steady_state_C": steady,
              "steady_state_low_C": steady - 0.12, "steady_state_high_C": steady + 0.14,
              "equilibrium_time_min": 3 * tau, "time_left_min": max(0.0, 3 * tau - minute),
              "reason": "declared" if declared else "interval: 0.31 C wide, 0.20 C is asked for"}
    if channel == 7:
        entry |= {"value_C": None, "raw": 32767, "quality": "open", "state": "dead",
                  "reason": "dead: no good reading for 12 min"}
    if channel == 12:
        entry |= {"state": "barely_warming", "reason": "barely_warming: the whole rise is 0.1 C"}
    if channel == 14:
        entry |= {"value_C": None, "raw": None, "quality": "communication", "rate_C_per_h": None,
                  "recent_C": [None if i > 18 else 18 + i / 9 for i in range(24)]}
    return entry


class FakeDaemon:
    def __init__(self, path):
        self.path = path
        self.minute = 62.25
        self.state = "running"
        self.requests = []
        self.refuse = {}       # method -> (code, message)
        self.silent = set()    # methods that get no answer
        self.clients = []
        self.subscribed = []
        self.events = [
            {"id": 1, "test": 12, "wall_ns": 1_700_000_000_000_000_000, "time_s": 0.0, "kind": "started",
             "channel": None, "message": 'test 12 "idle 5000 r/min" of VMC-3'},
            {"id": 2, "test": 12, "wall_ns": 1_700_003_600_000_000_000, "time_s": 3600.0, "kind": "annotation",
             "channel": "T13", "message": "door opened\x1b[2J for a moment"},
            {"id": 3, "test": 12, "wall_ns": 1_700_003_735_000_000_000, "time_s": 3735.0, "kind": "declared",
             "channel": "T5", "message": "T5 settles at 26.74 C (26.61 to 26.88 C), 95 % of the rise at 131 min"}]
        self.lock = threading.RLock()
        self.listener = socket.socket(socket.AF_UNIX)
        self.listener.bind(path)
        self.listener.listen(16)
        threading.Thread(target=self.accept, daemon=True).start()

    # ---- answers

    def status(self, _=None):
        return {"state": self.state, "version": "0.1.0", "machine": "VMC-3", "database": self.path + ".db",
                "period_s": 15.0, "tolerance_C": 0.2, "keep_measuring": False, "last_scan_age_s": 3.2,
                "good_channels": 14,
                "test": {"id": 12, "name": "idle 5000 r/min", "time_min": self.minute, "scans": int(self.minute * 4) + 1,
                         "declared_channels": 7, "waiting": ["T7", "T10", "T11", "T13", "T14", "T15"],
                         "reason": "waiting for T7, T10, T11, T13, T14, T15", "identified_at_min": 62.0,
                         "identification_s": 0.84}}

    def channels(self, _=None):
        return {"time_min": self.minute, "channels": [channel_answer(c, self.minute) for c in range(1, 17)]}

    def verdict(self, channel):
        entry = channel_answer(channel, self.minute)
        declared = entry["state"] == "declared"
        return {key: entry[key] for key in ("channel", "state", "n", "window_rmse_C", "steady_state_C",
                                            "steady_state_low_C", "steady_state_high_C", "equilibrium_time_min",
                                            "reason")} | {
            "declared": declared, "declared_at_min": 62.25 if declared else None, "window_end_min": 62.0,
            "rmse_by_n_C": self.curve_of(channel), "svr": {"n": 20, "steady_state_C": entry["steady_state_C"] + 0.06,
                                                           "equilibrium_time_min": 129.0, "C": 64.0, "sigma": 4.0},
            "guards": []}

    @staticmethod
    def curve_of(channel):
        curve = [0.05 + 0.002 * (n - 20 - channel % 7) ** 2 for n in range(1, 36)]
        curve[33] = None
        return curve

    def predictions(self, _=None):
        return {"test_stopped_at_min": None, "stop": False, "reason": self.status()["test"]["reason"],
                "channels": [self.verdict(c) for c in range(2, 17)]}

    def curve(self, params):
        wanted = params.get("channel")
        return {"curves": [{"channel": f"T{c}", "n": 20 + c % 7, "window_end_min": 62.0, "rmse_by_n_C": self.curve_of(c)}
                           for c in range(2, 17) if wanted in (None, f"T{c}")]}

    def samples(self, params):
        first = params.get("from_scan", 0)
        names = [params["channel"]] if "channel" in params else [f"T{c}" for c in range(1, 17)]
        rows = []
        most = 20000 // 16  # one answer holds so many, whatever is asked for
        for scan in range(first, min(first + min(params.get("limit", 2000), most), int(self.minute * 4) + 1)):
            samples = {}
            for name in names:
                entry = channel_answer(int(name[1:]), scan / 4)
                samples[name] = {key: entry[key] for key in ("value_C", "raw", "quality")}
            rows.append({"scan": scan, "time_s": scan * 15.0, "wall_ns": 0, "status": "ok", "samples": samples})
        return {"test": 12, "scans": rows}

    def list_events(self, params):
        newer = [event for event in self.events if event["id"] > params.get("after_id", 0)]
        return {"events": newer[-params.get("limit", 200):]}

    def health(self, _=None):
        figures = {"count": 250, "p50": 1.5, "p99": 3.25, "p999": 4.0, "max": 4.5}
        return {"up_s": 3900.0, "scans": {"ok": 248, "late": 1, "missed": 2}, "lateness_ms": figures,
                "commit_ms": figures, "identification_s": figures, "unstored_scans": 0, "lost_scans": 0,
                "wal_bytes": 4152000, "database_bytes": 1234567, "cpu_s": 12.5, "max_rss_bytes": 31e6, "clients": 2,
                "lines": [{"line": "left", "requests": 500, "replies": 498, "exceptions": 0, "timeouts": 2,
                           "bad_frames": 0, "stray_bytes": 0, "connects": 1, "connect_failures": 0,
                           "units": [{"unit": "upper", "answering": True, "round_trip_ms": 8.4, "failures": 2,
                                      "last_error": "no answer within 400 ms"}]}]}

    def annotate(self, params):
        self.happen("annotation", params["message"], params.get("channel"))
        return {"test": 12}

    # ---- what tests do to it

    def happen(self, kind, message, channel=None):
        event = {"id": len(self.events) + 1, "test": 12, "wall_ns": 1_700_003_740_000_000_000,
                 "time_s": self.minute * 60, "kind": kind, "channel": channel, "message": message}
        self.events.append(event)
        self.publish("event", {key: event[key] for key in ("id", "kind", "time_s", "channel", "message")})

    def scan(self):
        self.minute += 0.25
        self.publish("scan", self.channels())

    def publish(self, topic, params):
        line = (json.dumps({"jsonrpc": "2.0", "method": topic, "params": params}) + "\n").encode()
        with self.lock:
            for connection in list(self.subscribed):
                try:
                    connection.sendall(line)
                except OSError:
                    self.subscribed.remove(connection)

    def close(self):
        """Ends it as a daemon that is gone: no listener, no connections, no file. May be called twice."""
        if self.listener.fileno() < 0:
            return
        os.unlink(self.path)
        self.listener.shutdown(socket.SHUT_RDWR)
        self.listener.close()
        with self.lock:
            for connection in self.clients:
                try:
                    connection.shutdown(socket.SHUT_RDWR)
                except OSError:
                    pass
                connection.close()

    # ---- the socket

    def accept(self):
        while True:
            try:
                connection, _ = self.listener.accept()
            except OSError:
                return
            with self.lock:
                self.clients.append(connection)
            threading.Thread(target=self.serve, args=(connection,), daemon=True).start()

    def serve(self, connection):
        methods = {"status": self.status, "channels": self.channels, "samples": self.samples, "curve": self.curve,
                   "predictions": self.predictions, "events": self.list_events, "health": self.health,
                   "start_test": lambda p: {"test": 13, "state": "running"},
                   "stop_test": lambda p: {"test": 12, "state": "aborted" if p.get("abort") else "stopped"},
                   "annotate": self.annotate, "subscribe": lambda p: {"topics": p.get("topics")}}
        try:
            for line in connection.makefile("rb"):
                request = json.loads(line)
                method, params = request["method"], request.get("params", {})
                self.requests.append((method, params))
                if method in self.silent:
                    continue
                reply = {"jsonrpc": "2.0", "id": request["id"]}
                if method in self.refuse:
                    code, message = self.refuse[method]
                    reply["error"] = {"code": code, "message": message}
                else:
                    reply["result"] = methods[method](params)
                with self.lock:
                    connection.sendall((json.dumps(reply) + "\n").encode())
                    if method == "subscribe":
                        self.subscribed.append(connection)
        except OSError:
            pass


class DaemonCase(unittest.TestCase):
    """A test with a fake daemon of its own: self.daemon, on self.socket, in self.folder."""

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.socket = os.path.join(self.folder.name, "thermbald.sock")
        self.daemon = FakeDaemon(self.socket)
        self.addCleanup(lambda: self.daemon.close())  # whichever it is by then
