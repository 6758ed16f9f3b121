"""A real browser that opens the cockpit now and then: `chromium.py ADDRESS SEED FOLDER`, until it is killed.

What it saw goes to FOLDER/chromium.jsonl, as that of browsers.py.
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
PATIENCE = 90_000  # ms; others may use the processor
BETWEEN = (30.0, 120.0)  # s
KEYS = "wasdqerf"


def visit(driver: Any, chromium: str, address: str, dice: random.Random) -> float:
    """Open the cockpit, hold keys, switch a camera on, and go, holding one; return how long the page took (s)."""
    browser = driver.chromium.launch(executable_path=chromium, timeout=10 * PATIENCE)
    try:
        page = browser.new_context(viewport=SIZE).new_page()
        page.add_init_script(STARTED)
        page.set_default_timeout(PATIENCE)
        began = time.monotonic()
        page.goto(address)
        wait_for(page, "document.querySelector('.cm-content')?.innerText.length > 100")
        page.locator("#scene canvas").wait_for()
        waited = time.monotonic() - began
        page.locator("#command").click(force=True)
        for _ in range(dice.randrange(2, 8)):
            key = dice.choice(KEYS)
            page.keyboard.down(key)
            page.wait_for_timeout(dice.uniform(200, 2000))
            page.keyboard.up(key)
        page.keyboard.down("w")
        page.wait_for_timeout(1000)
        return waited
    finally:
        browser.close()


def main() -> None:
    address, seed, folder = sys.argv[1], int(sys.argv[2]), Path(sys.argv[3])
    dice, chromium = random.Random(f"chromium {seed}"), str(shutil.which("chromium"))
    with sync_playwright() as driver:
        while True:
            waited, trouble = 0.0, ""
            time.sleep(dice.uniform(*BETWEEN))
            try:
                waited = visit(driver, chromium, address, dice)
            except Exception as error:  # also what the node should not do
                trouble = f"{type(error).__name__}: {error}".splitlines()[0]
            with (folder / "chromium.jsonl").open("a", encoding="utf-8") as file:
                file.write(json.dumps(["chromium", round(waited, 3), trouble]) + "\n")


if __name__ == "__main__":
    main()
