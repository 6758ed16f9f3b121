"""The tutorial in the page: its controls are there, its lines go into the script, its pictures are enlarged."""

import re

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from cockpit_controls import CONTROLS
from cockpit_page import left_as_found, open_page, wait_until

SQUARE = "solutions/5_square.py"


@pytest.fixture(name="reader", scope="module")
def _reader(cockpit, browser):
    """A page that these tests share."""
    with left_as_found(cockpit), open_page(cockpit, browser, viewport={"width": 1440, "height": 900}) as page:
        yield page


def choose(page, lesson, script):
    """Choose a text of the list, and wait until its script is in the editor."""
    page.select_option("#lesson", lesson)
    wait_until(page, lambda: page.input_value("#script") == script)


def is_there(page, called):
    roles = ("button", "tab", "menuitem")
    return any(page.get_by_role(role, name=called, include_hidden=role == "menuitem").count() for role in roles)


def block(page, words):
    """The row of buttons below a block of Python."""
    return page.locator("#lesson-text pre", has_text=words).locator("xpath=following-sibling::p[1]")


def said(page):
    return page.inner_text("#said")


def put(page, words):
    block(page, words).get_by_role("button", name="Put into the script").click()
    wait_until(page, lambda: "line" in said(page))
    return said(page)


def test_the_controls_that_the_text_names_are_there(reader):
    named = {name: re.compile(called, re.IGNORECASE) for name, called in CONTROLS.items()}
    assert [name for name, called in named.items() if not is_there(reader, called)] == []


def test_choosing_a_stage_opens_its_script_and_a_solution_is_one_too(reader):
    choose(reader, "stage-5-roll", "tutorial/5_roll.py")
    reader.locator("#lesson-text").get_by_role("link", name="one", exact=True).click()
    wait_until(reader, lambda: reader.input_value("#script") == SQUARE)
    assert reader.input_value("#lesson") == "stage-5-roll", "its text stays"
    choose(reader, "stage-2-elevation", "tutorial/2_elevation.py")
    assert "roslaunch" not in reader.inner_text("#lesson-text")


def test_lines_that_are_there_already_are_shown(reader):
    choose(reader, "stage-2-elevation", "tutorial/2_elevation.py")
    assert "are in the script: line" in put(reader, "if twist[2] == 0")
    assert reader.input_value("#script") == "tutorial/2_elevation.py", "nothing has been changed"


def test_a_function_takes_the_place_of_its_namesake_and_lines_go_to_the_cursor(cockpit, reader):
    cockpit.scripts.mkdir(exist_ok=True)
    own = cockpit.scripts / "2_elevation_short.py"
    own.write_text("def flight_plan(t):\n    return 0\n\n\ndef sysCall_sensing():\n    x = 1\n    y = 2\n")
    wait_until(reader, lambda: reader.locator("#script option[value='mine/2_elevation_short.py']").count())
    reader.select_option("#script", "mine/2_elevation_short.py")
    wait_until(reader, lambda: "y = 2" in reader.inner_text("#text .cm-content"))
    assert put(reader, "def flight_plan") == "put into the script: line 1"
    wait_until(reader, lambda: "vz = 0.5" in own.read_text())
    assert "return 0\n" not in own.read_text() and own.read_text().endswith("    x = 1\n    y = 2\n")
    reader.get_by_text("y = 2", exact=True).click()
    put(reader, "if twist[2] == 0")
    wait_until(reader, lambda: "    if twist[2] == 0:\n        self.thrust" in own.read_text())
    assert re.search(r"x = 1\n    if twist(.*\n)+?    y = 2", own.read_text())
    reader.locator("#text .cm-content").press("Control+z")
    wait_until(reader, lambda: "twist[2] ==" not in own.read_text())


def test_a_block_with_a_function_flies(cockpit, reader):
    choose(reader, "stage-6-the-twist-topic", "tutorial/6_ros.py")
    block(reader, "def on_twist").get_by_role("button", name="Run").click()
    wait_until(reader, lambda: reader.inner_text("#flown").startswith("tutorial/6_ros.py"))
    assert not block(reader, "self.twist_subscriber = ").get_by_role("button", name="Run").count()


def test_a_picture_is_enlarged_and_closed_again(reader):
    reader.select_option("#lesson", "what-you-will-build")
    small = reader.get_by_role("button", name="Enlarge: Block diagram")
    small.click()
    large = reader.get_by_role("dialog", name="Block diagram")
    large.wait_for()
    wait_until(reader, lambda: large.locator("img").evaluate("one => one.clientWidth") > 700)
    assert large.locator("img").evaluate("one => one.clientWidth") > small.evaluate("one => one.clientWidth")
    large.get_by_role("button", name="Close").click()
    assert not large.count()
