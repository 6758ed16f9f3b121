"""The tutorial in the page: the controls that it names exist, its code goes into the script, its pictures enlarge."""

import re

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from cockpit_controls import CONTROLS
from cockpit_page import initial_state_restored, open_page, wait_until

SQUARE = "solutions/5_square.py"


@pytest.fixture(name="reader", scope="module")
def _reader(cockpit, browser):
    """A page that the tests of this module share."""
    with initial_state_restored(cockpit), open_page(cockpit, browser, viewport={"width": 1440, "height": 900}) as page:
        yield page


def choose(page, lesson, script):
    """Choose a lesson from the list, and wait until its script is in the editor."""
    page.select_option("#lesson", lesson)
    wait_until(page, lambda: page.input_value("#script") == script)


def has_control(page, label):
    roles = ("button", "tab", "menuitem")
    return any(page.get_by_role(role, name=label, include_hidden=role == "menuitem").count() for role in roles)


def block_buttons(page, words):
    """Return the row of buttons below the code block that contains `words`."""
    return page.locator("#lesson-text pre", has_text=words).locator("xpath=following-sibling::p[1]")


def message(page):
    return page.inner_text("#said")


def insert_block(page, words):
    block_buttons(page, words).get_by_role("button", name="Put into the script").click()
    wait_until(page, lambda: "line" in message(page))
    return message(page)


def test_every_control_named_in_the_text_exists_in_the_page(reader):
    labels = {name: re.compile(label, re.IGNORECASE) for name, label in CONTROLS.items()}
    assert [name for name, label in labels.items() if not has_control(reader, label)] == []


def test_choosing_a_stage_opens_its_script_and_a_link_opens_the_solution(reader):
    choose(reader, "stage-5-roll", "tutorial/5_roll.py")
    reader.locator("#lesson-text").get_by_role("link", name="one", exact=True).click()
    wait_until(reader, lambda: reader.input_value("#script") == SQUARE)
    assert reader.input_value("#lesson") == "stage-5-roll", "the lesson's text stays open"
    choose(reader, "stage-2-elevation", "tutorial/2_elevation.py")
    assert "roslaunch" not in reader.inner_text("#lesson-text")


def test_inserting_lines_that_the_script_already_has_only_reports_them(reader):
    choose(reader, "stage-2-elevation", "tutorial/2_elevation.py")
    assert "are in the script: line" in insert_block(reader, "if twist[2] == 0")
    assert reader.input_value("#script") == "tutorial/2_elevation.py", "the script is not modified"


def test_an_inserted_function_replaces_its_namesake_and_lines_go_to_the_cursor(cockpit, reader):
    cockpit.scripts.mkdir(exist_ok=True)
    own_script = cockpit.scripts / "2_elevation_short.py"
    own_script.write_text("def flight_plan(t):\n    return 0\n\n\ndef sysCall_sensing():\n    x = 1\n    y = 2\n")
    wait_until(reader, lambda: reader.locator("#script option[value='mine/2_elevation_short.py']").count())
    reader.select_option("#script", "mine/2_elevation_short.py")
    wait_until(reader, lambda: "y = 2" in reader.inner_text("#text .cm-content"))
    assert insert_block(reader, "def flight_plan") == "put into the script: line 1"
    wait_until(reader, lambda: "vz = 0.5" in own_script.read_text())
    assert "return 0\n" not in own_script.read_text() and own_script.read_text().endswith("    x = 1\n    y = 2\n")
    reader.get_by_text("y = 2", exact=True).click()
    insert_block(reader, "if twist[2] == 0")
    wait_until(reader, lambda: "    if twist[2] == 0:\n        self.thrust" in own_script.read_text())
    assert re.search(r"x = 1\n    if twist(.*\n)+?    y = 2", own_script.read_text())
    reader.locator("#text .cm-content").press("Control+z")
    wait_until(reader, lambda: "twist[2] ==" not in own_script.read_text())


def test_only_a_code_block_with_a_function_can_be_run(cockpit, reader):
    choose(reader, "stage-6-the-twist-topic", "tutorial/6_ros.py")
    block_buttons(reader, "def on_twist").get_by_role("button", name="Run").click()
    wait_until(reader, lambda: reader.inner_text("#flown").startswith("tutorial/6_ros.py"))
    assert not block_buttons(reader, "self.twist_subscriber = ").get_by_role("button", name="Run").count()


def test_a_picture_is_enlarged_and_closed_again(reader):
    reader.select_option("#lesson", "what-you-will-build")
    thumbnail = reader.get_by_role("button", name="Enlarge: Block diagram")
    thumbnail.click()
    enlarged = reader.get_by_role("dialog", name="Block diagram")
    enlarged.wait_for()
    wait_until(reader, lambda: enlarged.locator("img").evaluate("one => one.clientWidth") > 700)
    assert enlarged.locator("img").evaluate("one => one.clientWidth") > thumbnail.evaluate("one => one.clientWidth")
    enlarged.get_by_role("button", name="Close").click()
    assert not enlarged.count()
