"""A real browser that opens the cockpit now and then: `chromium.py ADDRESS SEED FOLDER`, until it is killed.

It logs to FOLDER/chromium.jsonl, in the format of browsers.py.
"""

from __future__ import annotations

import json
import random
import shutil
import sys
import time
from pathlib import Path
from typing import Any

from playwright.sync_api import sync_playwright

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "web"))
from cockpit_page import STARTED, wait_for

SIZE = {"width": 640, "height": 400}  # px
PATIENCE = 90_000  # ms; other processes may use the processor
BETWEEN = (30.0, 120.0)  # s
KEYS = "wasdqerf"


def visit(driver: Any, chromium: str, address: str, rng: random.Random) -> float:
    """Open the cockpit, press keys, and leave with a key held; return the time until the page was loaded (s)."""
    browser = driver.chromium.launch(executable_path=chromium, timeout=10 * PATIENCE)
    try:
        page = browser.new_context(viewport=SIZE).new_page()
        page.add_init_script(STARTED)
        page.set_default_timeout(PATIENCE)
        start_time = time.monotonic()
        page.goto(address)
        wait_for(page, "document.querySelector('.cm-content')?.innerText.length > 100")
        page.locator("#scene canvas").wait_for()
        load_time = time.monotonic() - start_time
        page.locator("#command").click(force=True)
        for _ in range(rng.randrange(2, 8)):
            key = rng.choice(KEYS)
            page.keyboard.down(key)
            page.wait_for_timeout(rng.uniform(200, 2000))
            page.keyboard.up(key)
        page.keyboard.down("w")
        page.wait_for_timeout(1000)
        return load_time
    finally:
        browser.close()


def main() -> None:
    address, seed, folder = sys.argv[1], int(sys.argv[2]), Path(sys.argv[3])
    rng, chromium = random.Random(f"chromium {seed}"), str(shutil.which("chromium"))
    with sync_playwright() as driver:
        while True:
            load_time, trouble = 0.0, ""
            time.sleep(rng.uniform(*BETWEEN))
            try:
                load_time = visit(driver, chromium, address, rng)
            except Exception as error:  # also errors of the node
                trouble = f"{type(error).__name__}: {error}".splitlines()[0]
            with (folder / "chromium.jsonl").open("a", encoding="utf-8") as file:
                file.write(json.dumps(["chromium", round(load_time, 3), trouble]) + "\n")


if __name__ == "__main__":
    main()
