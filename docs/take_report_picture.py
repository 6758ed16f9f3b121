"""Takes the picture of a report for docs/grading.md, in chromium: docs/take_report_picture.py REPORT OUT.png."""

import shutil
import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

SIZE = {"width": 1280, "height": 1010}  # px
MOMENT = 4.2  # s


def main(report: str, picture: str) -> None:
    """Open a flight of the first script that did not go well, and take the picture in the middle of it."""
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"))
        page = browser.new_page(viewport=SIZE)
        page.goto((Path(report).resolve() / "index.html").as_uri())
        page.click("#scripts tbody tr:first-child a")
        page.click("nav a:has(.some)")
        page.locator("#scrub").evaluate(
            "(slider, time) => { slider.value = time; slider.dispatchEvent(new Event('input')); }", MOMENT
        )
        page.mouse.move(0, 0)
        page.screenshot(path=picture)
        browser.close()


if __name__ == "__main__":
    main(*sys.argv[1:])
