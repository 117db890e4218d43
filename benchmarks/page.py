"""Seconds that a browser takes to open the report of 10 000 elements and 50 increments, and to move its slider.

    python benchmarks/page.py

Processor time of the page's main thread, which paints in software where there is no screen: best and median of the
steps. Needs Chromium with chromedriver and selenium, as the tests of the page do. Lines: 3 s to open, 0.1 s a step.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "output"))
import test_page as page_tests  # the page that the tests look at


def main() -> None:
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = page_tests.BROWSER
    for argument in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--window-size=1200,900"):
        options.add_argument(argument)
    browser = webdriver.Chrome(options=options, service=Service(page_tests.DRIVER))

    def seconds() -> float:
        told = browser.execute_cdp_cmd("Performance.getMetrics", {})["metrics"]
        return next(m["value"] for m in told if m["name"] == "TaskDuration")

    try:
        with tempfile.TemporaryDirectory() as folder:
            path = page_tests.made_without_solver(Path(folder), [(100, 100)] * 50)
            browser.execute_cdp_cmd("Performance.enable", {"timeDomain": "threadTicks"})
            page = page_tests.opened(browser, path)
            print(f"{path.stat().st_size / 1e6:.2f} MB, {seconds():.2f} s to open")
            steps = []
            for frame in (3, 20, 21, 40, 10, 30, 49, 5, 25, 45):
                before = seconds()
                page_tests.choose(page, "slider", str(frame))
                steps.append(seconds() - before)
            print(f"a step of the slider: best {min(steps):.3f} s, median {statistics.median(steps):.3f} s")
    finally:
        browser.quit()


if __name__ == "__main__":
    main()
