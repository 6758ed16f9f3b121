"""Takes the picture of the cockpit, in chromium: docs/take_cockpit_picture.py OUT.png. Half a minute."""

import shutil
import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "test" / "web"))
from cockpit_page import wait_for
from launched import launched

SIZE = {"width": 1280, "height": 760}  # px
PATIENCE = 60_000  # ms, without a GPU
FLIGHT, SETTLED = 2500, 4000  # ms


def main(picture: str) -> None:
    """Fly ahead between the gates, and look through the front camera."""
    scene = "scene:=" + str(Path(__file__).resolve().parents[1] / "config/scenes/gates.yaml")
    with launched(scene) as cockpit, sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"))
        page = browser.new_page(viewport=SIZE)
        page.set_default_timeout(PATIENCE)
        page.goto(cockpit.address)
        wait_for(page, "document.querySelector('.cm-content')?.innerText.length > 100")
        page.select_option("#script", "tutorial/2_elevation.py")
        wait_for(page, "document.querySelector('#lesson-text').innerText.includes('Two wishes')")
        inner = page.frame_locator("#scene")
        inner.locator("[class*=Notification-closeButton]").click()
        inner.get_by_role("tab", name="Cameras").click()
        inner.get_by_label("drone/front").click()
        page.locator("#command").click()
        page.keyboard.down("w")
        page.wait_for_timeout(FLIGHT)
        page.keyboard.up("w")
        page.wait_for_timeout(SETTLED)
        page.screenshot(path=picture)
        browser.close()


if __name__ == "__main__":
    main(*sys.argv[1:])
