#!/usr/bin/python3
"""How long a report takes to open, and whether all of it is drawn: load_time.py REPORT.html ..."""
import pathlib
import sys

import browser as chromium

if __name__ == "__main__":
    chromium.skip_without_chromium()
    with chromium.Browser() as browser:
        for name in sys.argv[1:]:
            path, times_ms = pathlib.Path(name).resolve(), []
            for _ in range(5):
                page = browser.page()
                page.size(1280, 900)
                page.goto(path.as_uri())
                times_ms.append(page.run("performance.getEntriesByType('navigation')[0].loadEventEnd"))
            page.draw_everything()
            plots = page.run("Object.keys(thermbalPlots.drawn).length")
            print(f"{name}: {path.stat().st_size / 1e6:.2f} MB, opens in {min(times_ms):.0f} to {max(times_ms):.0f} ms, "
                  f"{plots} plots, console: {page.troubles or 'nothing'}")
