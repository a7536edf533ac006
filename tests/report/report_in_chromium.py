#!/usr/bin/python3
"""The report as a person's browser shows it: nothing on the console, nothing fetched, every plot drawn with the values of
--json (and those with the values that were stored), zoom, phone, paper, no script, and names that would like to be code."""
import csv
import io
import json
import os
import pathlib
import sqlite3
import subprocess
import sys
import tempfile
import unittest

import browser as chromium

CTL = os.path.join(os.environ["THERMBAL_BIN_DIR"], "thermbalctl")
WRITE_DATABASE = sys.argv.pop(1)
LARGEST_BYTES = 3_000_000


def made(*command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, timeout=200)
    if done.returncode != 0:
        raise AssertionError(f"{command}: {done.stderr}")
    return done.stdout


class Report(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()) if hasattr(cls, "enterClassContext")
                                  else tempfile.mkdtemp())
        cls.browser = chromium.Browser().__enter__()
        cls.addClassCleanup(cls.browser.__exit__)
        cls.plain, cls.document = cls.report("plain", 481, 6)
        cls.hostile, cls.hostile_document = cls.report("hostile", 361, 5, "hostile")

    @classmethod
    def report(cls, name, scans, channels, *more):
        database, page = cls.folder / f"{name}.db", cls.folder / f"{name}.html"
        made(WRITE_DATABASE, database, scans, channels, *more)
        document = json.loads(made(CTL, "report", "1", "--database", database, "--out", page, "--json"))
        return page, document

    def opened(self, path, width=1280, height=900, mobile=False):
        page = self.browser.page()
        page.size(width, height, mobile)
        page.goto(path.as_uri())
        return page

    def test_every_plot_is_drawn_and_nothing_is_said_or_fetched(self):
        page = self.opened(self.plain)
        page.draw_everything()
        page.until("document.querySelectorAll('figure[data-plot]').length === Object.keys(thermbalPlots.drawn).length")
        self.assertEqual(page.run("document.querySelectorAll('figure[data-plot]').length"), 1 + 4 * 3 + 2)
        blank = page.run("""[...document.querySelectorAll('figure canvas')].filter(canvas =>
            !new Uint32Array(canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data.buffer).some(pixel => pixel))
            .length""")
        figures = page.run("document.querySelectorAll('figure[data-plot]').length")
        self.assertLessEqual(blank, figures, "of its two canvases only the one for the mouse may be blank")
        self.assertEqual(page.troubles, [])
        self.assertEqual([url for url in page.fetched if not url.startswith("file:")], [])
        self.assertEqual(len(page.fetched), 1)

    def test_the_plots_show_the_values_of_the_json_and_these_those_of_the_database(self):
        page = self.opened(self.plain)
        page.draw_everything()
        shown = page.run("""Object.fromEntries(Object.entries(thermbalPlots.drawn).map(([id, graph]) => [id, {
            columns: graph.thermbal.plot.lines.map(line => line.column), table: graph.thermbal.plot.table,
            rows: Array.from({length: graph.numRows()}, (_, row) => Array.from({length: graph.numColumns()}, (_, c) => graph.getValue(row, c)))}]))""")
        for name, plot in shown.items():
            table = self.document["tables"][plot["table"]]
            at = {x: i for i, x in enumerate(table["x"])}
            for row in plot["rows"]:
                for column, value in zip(plot["columns"], row[1:]):
                    self.assertEqual(table["columns"][column][at[row[0]]], value, f"{name} {column} at {row[0]}")
        stored = list(csv.DictReader(io.StringIO(made(CTL, "export", "--database", self.folder / "plain.db", "--csv", "-"))))
        course = self.document["tables"]["course"]
        by_minute = dict(zip(course["x"], range(len(course["x"]))))
        for row in stored:
            i = by_minute[float(row["time_s"]) / 60.0]
            for channel in ("T1", "T2", "T4", "T6"):
                value = course["columns"][channel][i]
                self.assertEqual("" if value is None else value, "" if row[channel] == "" else float(row[channel]))
        with sqlite3.connect(f"file:{self.folder / 'plain.db'}?mode=ro", uri=True) as database:
            rows = database.execute("SELECT c.name, d.steady_state_C, d.rmse_by_n_C FROM declarations d JOIN channels c "
                                    "ON c.test_id = d.test_id AND c.position = d.channel").fetchall()
        self.assertEqual(len(rows), 4)
        for name, steady_state_C, rmse in rows:
            channel = next(one for one in self.document["channels"] if one["channel"] == name)
            self.assertEqual(channel["steady_state_C"], steady_state_C)
            self.assertEqual(self.document["tables"]["rmse"]["columns"][name], json.loads(rmse))

    def test_the_expected_course_ends_where_it_was_declared(self):
        course = self.document["tables"]["course"]
        for channel in self.document["channels"]:
            if channel["channel"] == "T1" or not channel["declared"]:
                continue
            ends_C = course["columns"][channel["channel"] + " expected"][-1]
            # At the plot's right end the slowest channel is past 95 % of its rise: 5 % of 12 C are left at most.
            self.assertLess(abs(ends_C - channel["steady_state_C"]), 0.6)
            # On the window itself it is within the noise (0.05 C) and the rounding to 0.1 C of the samples.
            seen = [value for x, value in zip(course["x"], course["columns"][channel["channel"] + " error"])
                    if value is not None and 2.0 < x <= channel["window_end_min"]]
            self.assertLess(sum(value * value for value in seen) / len(seen), 0.08 ** 2)

    def test_zoom_and_back(self):
        page = self.opened(self.plain)
        page.draw_everything()
        box = page.run("""(() => { const f = document.querySelector('#overview'); f.scrollIntoView({block: 'center'});
            const box = f.querySelector('.live').getBoundingClientRect(), area = thermbalPlots.drawn.overview.getArea();
            return {x: box.x + area.x, y: box.y + area.y, w: area.w, h: area.h}; })()""")
        before = page.run("thermbalPlots.drawn.overview.xAxisRange()")
        page.drag(box["x"] + 0.25 * box["w"], box["y"] + 0.5 * box["h"], box["x"] + 0.75 * box["w"], box["y"] + 0.5 * box["h"])
        zoomed = page.run("thermbalPlots.drawn.overview.xAxisRange()")
        span = before[1] - before[0]
        self.assertAlmostEqual(zoomed[0], before[0] + 0.25 * span, delta=0.02 * span)
        self.assertAlmostEqual(zoomed[1], before[0] + 0.75 * span, delta=0.02 * span)
        page.double_click(box["x"] + 0.5 * box["w"], box["y"] + 0.5 * box["h"])
        self.assertEqual(page.run("thermbalPlots.drawn.overview.xAxisRange()"), before)
        self.assertEqual(page.troubles, [])

    def test_names_are_names(self):
        page = self.opened(self.hostile)
        page.draw_everything()
        page.until("Object.keys(thermbalPlots.drawn).length === document.querySelectorAll('figure[data-plot]').length")
        page.run("document.querySelectorAll('figure .live').forEach(f => f.dispatchEvent(new MouseEvent('mousemove', {bubbles: true})))")
        self.assertEqual(page.troubles, [])
        self.assertIsNone(page.run("window.attacked ?? null"))
        self.assertEqual(page.run("document.querySelectorAll('main script, main img, main b[onmouseover]').length"), 0)
        names = page.run("[...document.querySelectorAll('td:first-child b')].map(b => b.textContent)")
        self.assertIn("T3</script><script>window.attacked=1</script>", names)
        self.assertIn("</script><script>window.attacked=1</script>", self.hostile_document["name"])

    def test_a_phone_sees_it_without_scrolling_sideways(self):
        for path in (self.plain, self.hostile):
            page = self.opened(path, 390, 844, mobile=True)
            self.assertLessEqual(page.run("document.documentElement.scrollWidth"), 390)

    def test_without_a_script_and_on_paper_there_are_pictures(self):
        page = self.browser.page()
        page.ask("Emulation.setScriptExecutionDisabled", value=True)
        page.size(1280, 900)
        page.goto(self.plain.as_uri())
        page.ask("Emulation.setScriptExecutionDisabled", value=False)
        visible = "[...document.querySelectorAll('figure[data-plot] svg')].filter(svg => svg.getBoundingClientRect().height > 80).length"
        self.assertEqual(page.run(visible), page.run("document.querySelectorAll('figure[data-plot]').length"))
        printed = self.opened(self.plain)
        printed.draw_everything()
        printed.scheme("light", media="print")
        self.assertEqual(printed.run(visible), printed.run("document.querySelectorAll('figure[data-plot]').length"))
        self.assertEqual(printed.run("[...document.querySelectorAll('canvas')].filter(c => c.getBoundingClientRect().height > 0).length"), 0)

    def test_of_a_week_it_is_small_and_shows_every_spike(self):
        path, document = self.report("week", 7 * 24 * 240 + 1, 16)
        self.assertLess(path.stat().st_size, LARGEST_BYTES)
        with sqlite3.connect(f"file:{self.folder / 'week.db'}?mode=ro", uri=True) as database:
            lowest, highest = database.execute("SELECT min(value_C), max(value_C) FROM samples JOIN channels c ON c.test_id = samples.test_id "
                                               "AND c.position = samples.channel WHERE c.name = 'T5'").fetchone()
        values = [value for value in document["tables"]["course"]["columns"]["T5"] if value is not None]
        self.assertEqual((min(values), max(values)), (lowest, highest))
        page = self.opened(path)
        page.draw_everything()
        page.until("Object.keys(thermbalPlots.drawn).length === document.querySelectorAll('figure[data-plot]').length")
        self.assertEqual(page.troubles, [])


if __name__ == "__main__":
    chromium.skip_without_chromium()
    unittest.main()
