"""The views for plots: against the tables themselves, in the Grafana dashboard's own queries, and the pandas example as it is printed."""
import contextlib
import datetime
import io
import json
import re
import sqlite3
import tempfile
import time

from broker_support import SOURCE, write_databases


def documented_example():
    text = (SOURCE / "daemon/store/README.md").read_text(encoding="utf-8")
    return re.search(r"```python\n(.*?)```", text, re.S).group(1)


def the_views_say_what_the_tables_say(database):
    one = database.execute("SELECT * FROM temperature WHERE channel = 'T2' AND scan = 4").fetchone()
    assert one["value_C"] == 21.4 and one["quality"] == "good" and one["place"] == "place 1"
    stored = database.execute("SELECT wall_ns FROM scans WHERE scan = 4").fetchone()[0]
    assert abs(one["time_epoch_s"] - stored / 1e9) < 1e-3
    said = datetime.datetime.strptime(one["time_iso"], "%Y-%m-%dT%H:%M:%S.%fZ").replace(tzinfo=datetime.timezone.utc)
    assert abs(said.timestamp() - stored / 1e9) < 2e-3, one["time_iso"]
    bad = database.execute("SELECT count(*) FROM temperature WHERE quality <> 'good' AND value_C IS NOT NULL").fetchone()[0]
    assert bad == 0
    rows = database.execute("SELECT count(*) FROM samples").fetchone()[0]
    assert database.execute("SELECT count(*) FROM temperature").fetchone()[0] == rows
    assert database.execute("SELECT sum(samples) FROM data_quality").fetchone()[0] == rows
    overview = database.execute("SELECT * FROM test_overview").fetchone()
    assert (overview["scans"], overview["channels"], overview["declared_channels"]) == (40, 16, 1)
    declared = database.execute("SELECT steady_state_C, stands FROM declared_steady_state ORDER BY declared_at_min").fetchall()
    assert [tuple(row) for row in declared] == [(26.5, 0), (26.75, 1)]
    assert database.execute("SELECT min(value) FROM known_input WHERE input = 'spindle_rpm'").fetchone()[0] == 5000
    assert database.execute("SELECT count(*) FROM event_log").fetchone()[0] == 2


def grafana_queries(node):
    if isinstance(node, dict):
        if isinstance(node.get("rawQueryText"), str):
            yield node["rawQueryText"]
        elif isinstance(node.get("query"), str) and "SELECT" in node["query"]:
            yield node["query"]
        for value in node.values():
            yield from grafana_queries(value)
    elif isinstance(node, list):
        for value in node:
            yield from grafana_queries(value)


def the_dashboard_asks_what_is_there(database):
    dashboard = json.loads((SOURCE / "daemon/store/grafana_dashboard.json").read_text(encoding="utf-8"))
    queries = list(grafana_queries(dashboard))
    assert len(queries) >= 6
    for query in queries:
        # What Grafana puts in: the variables of the dashboard and the range of time, in ms.
        query = query.replace("$test", "1").replace("$__from", "0").replace("$__to", str(int(time.time() * 1000) + 10**9))
        rows = database.execute(query).fetchall()
        assert rows, query


def the_pandas_example_runs(path):
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(documented_example().replace("/var/lib/thermbal/thermbal.db", path), {})  # noqa: S102: our own text
    assert "T16" in printed.getvalue() and "26.75" in printed.getvalue(), printed.getvalue()
    assert len(documented_example().strip().splitlines()) <= 10


def main():
    with tempfile.TemporaryDirectory(prefix="thermbal-views-") as folder:
        assert write_databases(folder, 1, 40, 1).wait(30) == 0
        with contextlib.closing(sqlite3.connect(f"file:{folder}/0.db?mode=ro", uri=True)) as database:
            database.row_factory = sqlite3.Row
            the_views_say_what_the_tables_say(database)
            the_dashboard_asks_what_is_there(database)
        try:
            import pandas  # noqa: F401
        except ImportError:
            print("python3-pandas is not installed: the example was not run")
            return
        the_pandas_example_runs(f"{folder}/0.db")
    print("ok")


if __name__ == "__main__":
    main()
