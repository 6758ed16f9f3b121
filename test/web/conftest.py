"""Fixtures: Debian's chromium, driven by playwright, and a simulation. `./dev.sh test-web` installs both programs."""

import shutil
import sys
from pathlib import Path

import pytest
import rospy
from cockpit_page import Drone, Panel, initial_state_restored, open_page
from launched import launched
from playwright.sync_api import sync_playwright

sys.path.insert(0, str(Path(__file__).parents[1] / "unit"))

# Without a GPU, Mesa draws the cockpit's scene four times as fast as Chromium's own SwiftShader. Without GPU
# compositing, Chromium puts the page together faster.
DRAWING = ["--use-gl=angle", "--use-angle=gl-egl", "--ignore-gpu-blocklist", "--disable-gpu-compositing"]


@pytest.fixture(name="browser", scope="session")
def _browser():
    chromium = shutil.which("chromium")
    if chromium is None:
        pytest.fail("no chromium on the PATH: ./dev.sh test-web installs Debian's")
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=chromium, args=DRAWING)
        yield browser
        browser.close()


@pytest.fixture(name="page")
def _page(browser):
    """A page that collects console messages, errors, dialogs and network requests in `troubles`."""
    context = browser.new_context(viewport={"width": 1000, "height": 700})
    page = context.new_page()
    page.troubles = []
    page.on("console", lambda message: page.troubles.append(message.text))
    page.on("pageerror", lambda error: page.troubles.append(str(error)))
    page.on("dialog", lambda dialog: (page.troubles.append("a dialog"), dialog.dismiss()))
    page.on("requestfailed", lambda request: page.troubles.append(f"{request.url} failed"))
    page.on(
        "request",
        lambda request: None if request.url.startswith(("file:", "data:")) else page.troubles.append(request.url),
    )
    yield page
    context.close()


@pytest.fixture(name="cockpit", scope="session")
def _cockpit(browser):
    """One running simulation for all tests of a worker; each test restores its initial state."""
    with launched() as cockpit:
        rospy.init_node("test_cockpit", anonymous=True, disable_signals=True)
        cockpit.drone = Drone()
        yield cockpit


@pytest.fixture(name="opened")
def _opened(cockpit, browser):
    """The cockpit's page in a browser context of its own, while the pilot flies; new scripts are deleted afterwards."""
    with initial_state_restored(cockpit), open_page(cockpit, browser) as page:
        yield page


@pytest.fixture(name="panel", scope="module")
def _panel(cockpit, browser):
    """The panel of a page that the tests of a module share; each test restores its initial state."""
    cockpit.start_afresh()
    with open_page(cockpit, browser) as page:
        yield Panel(page)
