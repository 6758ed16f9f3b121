"""Takes the pictures of the cockpit, in chromium: docs/take_cockpit_pictures.py FOLDER [NAME...]. Three minutes."""

import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import rospy
from playwright.sync_api import sync_playwright

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "test" / "web"))
from cockpit_page import STARTED, switch_camera, wait_for
from launched import launched
from scene_builder import Builder

LARGE, TABLET, PHONE = ({"width": x, "height": y} for x, y in ((1440, 900), (820, 1180), (390, 844)))  # px
TOUCH = {"has_touch": True, "is_mobile": True}
PATIENCE = 60_000  # ms, without a GPU
GATES = (  # models of a scene that is built, where they stand (m), and how they are turned (degrees)
    ("Quadricopter", -0.8, 0.0, 0),
    ("Landing pad", 0.2, -1.2, 0),
    ("Table", 1.6, 1.6, 30),
    ("Gate", 1.5, -0.4, -15),
)
FLIGHT, SETTLED = 2500, 3000  # ms


def start(page: Any) -> None:
    """The start page of a first visit."""
    page.get_by_role("dialog").first.wait_for()


def gallery(page: Any) -> None:
    """The gallery of tasks."""
    page.get_by_role("dialog").first.get_by_role("button", name="Tasks").click()
    page.locator("#gallery-tasks button").first.wait_for()


def grade(page: Any) -> None:
    """The result card of a task's start, which fails one criterion."""
    page.select_option("#script", "tasks/hover.py")
    page.locator("#grade").wait_for()
    page.wait_for_timeout(SETTLED)
    page.click("#grade")
    page.locator("#graded .result-card").wait_for(timeout=3 * PATIENCE)
    page.evaluate("document.documentElement.style.setProperty('--lesson', '60vh')")  # as the bar below it is dragged
    page.locator("#graded .charts").scroll_into_view_if_needed()


def stage(page: Any) -> None:
    """A stage of the tutorial beside the flight, and the front camera."""
    page.select_option("#script", "tutorial/2_elevation.py")
    wait_for(page, "document.querySelector('#lesson-text').innerText.includes('zref')")
    switch_camera(page)
    page.locator("#fold-side").click()
    page.locator("#command").click()
    page.keyboard.down("w")
    page.wait_for_timeout(FLIGHT)
    page.keyboard.up("w")


def task(page: Any) -> None:
    """A task, and the plots."""
    page.select_option("#lesson", "tasks/gates")
    page.get_by_role("button", name="Plots").click()


def build(page: Any) -> None:
    """The scene while it is built: another gate has been dropped, and is selected."""
    page.locator("#toggle").click()
    builder = Builder(page)
    builder.new_scene()
    for model, x, y, turn in GATES:
        builder.drop(model, [x, y, 0])
        builder.write(X=x, Y=y, Gamma=turn)
    page.get_by_role("searchbox", name="Find a model").fill("")
    page.locator("#models").evaluate("one => one.scrollTo(620, 0)")


def just_fly(page: Any) -> None:
    """The scene alone."""


# What each shows, on what, and whether the start page has been answered.
PICTURES: dict[str, tuple[Callable[[Any], None], dict[str, Any], bool]] = {
    "cockpit_start": (start, {"viewport": LARGE}, False),
    "cockpit_tasks": (gallery, {"viewport": LARGE}, False),
    "cockpit_grade": (grade, {"viewport": LARGE}, True),
    "cockpit": (stage, {"viewport": LARGE}, True),
    "cockpit_build": (build, {"viewport": LARGE}, True),
    "cockpit_task": (task, {"viewport": LARGE, "color_scheme": "dark"}, True),
    "cockpit_tablet": (just_fly, {"viewport": TABLET, **TOUCH}, True),
    "cockpit_phone": (just_fly, {"viewport": PHONE, **TOUCH}, True),
}


def main(folder: str, *names: str) -> None:
    """Take those that are named, or all of them, between the gates."""
    scene = str(Path(__file__).resolve().parents[1] / "config/scenes/gates.yaml")
    with launched(f"scene:={scene}") as cockpit, sync_playwright() as driver:
        rospy.init_node("pictures", anonymous=True, disable_signals=True)
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"))
        for name in names or PICTURES:
            act, options, is_started = PICTURES[name]
            cockpit.load(scene)  # another picture may have left another one
            cockpit.start_afresh()
            context = browser.new_context(**options)
            if is_started:
                context.add_init_script(STARTED)
            page = context.new_page()
            page.set_default_timeout(PATIENCE)
            page.goto(cockpit.address)
            wait_for(page, "document.querySelector('.cm-content')?.innerText.length > 100")
            act(page)
            page.wait_for_timeout(SETTLED)
            page.screenshot(path=str(Path(folder) / f"{name}.png"))
            context.close()
        browser.close()


if __name__ == "__main__":
    main(*sys.argv[1:])
