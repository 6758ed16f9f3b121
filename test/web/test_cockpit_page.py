"""The cockpit in a browser, against the running node: looked at, flown, tuned, and a script edited into an error."""

import time

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy
from cockpit_page import wait_for, wait_until


def test_a_key_that_is_held_flies_and_one_that_is_released_stops(cockpit, opened):
    assert "token" not in opened.url
    before = cockpit.drone.place[0]
    opened.locator("#command").click()
    opened.keyboard.down("w")
    wait_until(opened, lambda: cockpit.drone.command[0] == 1.0)
    wait_until(opened, lambda: cockpit.drone.place[0] > before + 0.3)
    opened.keyboard.up("w")
    wait_until(opened, lambda: cockpit.drone.command == (0.0, 0.0, 0.0))
    opened.keyboard.down("ArrowUp")
    wait_until(opened, lambda: cockpit.drone.command[1] == 1.0)
    opened.close()
    opened_again = time.monotonic()
    while cockpit.drone.command != (0.0, 0.0, 0.0):
        assert time.monotonic() < opened_again + 10, "a browser that is gone leaves a stopped drone"
        time.sleep(0.05)


def test_what_is_written_into_the_editor_is_no_command(cockpit, opened):
    opened.locator(".cm-content").click()
    opened.keyboard.press("Control+End")
    opened.keyboard.type("# wasd\n")
    assert cockpit.drone.command == (0.0, 0.0, 0.0)
    wait_until(opened, lambda: opened.inner_text("#saved") == "saved as mine/pilot.py")
    wait_until(opened, lambda: (cockpit.scripts / "pilot.py").read_text().endswith("# wasd\n"))  # it may save twice


def test_a_script_is_edited_into_an_error_mended_and_flown(cockpit, opened):
    opened.select_option("#script", "tutorial/2_elevation.py")
    wait_for(opened, "document.querySelector('.cm-content').innerText.includes('Stage 2 of')")
    opened.locator(".cm-line").first.click()
    opened.keyboard.press("Control+Home")
    opened.keyboard.type("1 / 0\n")
    opened.click("#run")
    wait_until(opened, lambda: "line 1: ZeroDivisionError" in opened.inner_text("#said"))
    assert opened.locator(".cm-lintRange-error").inner_text() == "1 / 0"
    opened.click("#revert")
    wait_for(opened, "!document.querySelector('.cm-content').innerText.includes('1 / 0')")
    opened.click("#run")
    wait_until(opened, lambda: opened.inner_text("#said") == "started")
    assert opened.locator("#script").input_value() == "mine/2_elevation.py"
    assert rospy.get_param("/drone_sim/script") == str(cockpit.scripts / "2_elevation.py")


def test_what_a_script_prints_stands_under_it(cockpit, opened):
    cockpit.scripts.mkdir(exist_ok=True)
    says = "def sysCall_init():\n    for _ in range(3):\n        print('<b>same</b>')\n"
    (cockpit.scripts / "says.py").write_text(says)
    wait_until(opened, lambda: opened.locator("#script option[value='mine/says.py']").count())
    opened.select_option("#script", "mine/says.py")
    wait_for(opened, "document.querySelector('.cm-content').innerText.includes('same')")
    opened.click("#run")
    wait_until(opened, lambda: "<b>same</b>  (3 times)" in opened.inner_text("#console"))


def test_buttons_fields_and_pictures(cockpit, opened):
    scene = opened.frame_locator("#scene")
    scene.get_by_role("button", name="pause").click()
    wait_until(opened, lambda: "paused at" in scene.get_by_role("status").inner_text())
    scene.get_by_role("button", name="resume").click()
    wait_until(opened, lambda: scene.locator("input[disabled]").first.input_value() == "flying")
    scene.get_by_role("tab", name="Cameras").click()
    scene.get_by_label("drone/front").click()
    picture = opened.locator(".picture img")
    wait_until(opened, lambda: picture.evaluate_all("all => all.some(one => one.naturalWidth === 640)"))
    opened.keyboard.down("w")  # the focus is on a switch, into which nobody writes
    wait_until(opened, lambda: cockpit.drone.command[0] == 1.0)
    opened.keyboard.up("w")
    scene.get_by_label("drone/front").click()
    wait_until(opened, lambda: not picture.count())
    scene.get_by_role("tab", name="Tune").click()
    field = scene.get_by_label("Kzref", exact=True)
    before = field.input_value()
    for value in ("2.5", before):
        field.press("Control+a")
        field.press_sequentially(value)  # as a hand does: it holds what is written so far
        field.press("Enter")
        wait_until(opened, lambda value=value: f"Kzref = {value}" in scene.get_by_role("status").inner_text())


def test_a_second_address_needs_the_token(cockpit, browser):
    context = browser.new_context()
    page = context.new_page()
    answer = page.goto(cockpit.address.partition("?")[0])
    assert answer.status == 403 and "token" in page.inner_text("body")
    context.close()
