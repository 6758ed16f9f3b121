"""The cockpit in a browser with a running simulator: keys, the editor, the console, the start page, and the token."""

import time

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy
from cockpit_page import open_page, ready, switch_camera, wait_for, wait_for_steps, wait_until


def test_a_held_key_flies_the_drone_and_a_released_key_stops_it(cockpit, opened):
    assert "token" not in opened.url
    before = cockpit.drone.place[0]
    opened.locator("#command").click()
    opened.keyboard.down("w")
    wait_until(opened, lambda: cockpit.drone.command[0] == 1.0)
    wait_until(opened, lambda: cockpit.drone.place[0] > before + 0.3)
    opened.keyboard.up("w")
    wait_until(opened, lambda: cockpit.drone.command == (0.0, 0.0, 0.0))
    opened.keyboard.down("ArrowUp")
    wait_until(opened, lambda: cockpit.drone.command == (1.0, 0.0, 0.0))
    opened.close()
    closed_at = time.monotonic()
    while cockpit.drone.command != (0.0, 0.0, 0.0):
        assert time.monotonic() < closed_at + 90, "the drone stops after its browser was closed"
        time.sleep(0.05)


def test_typing_in_the_editor_does_not_fly_the_drone(cockpit, opened):
    before = set(cockpit.drone.flight_steps)
    opened.locator(".cm-content").click()
    opened.keyboard.press("Control+End")
    opened.keyboard.type("# wasd\n")
    wait_for_steps(opened, cockpit.drone, 5)
    steps = [step for stamp, step in cockpit.drone.flight_steps.copy().items() if stamp not in before]
    assert {step["command"] for step in steps if "command" in step} == {(0.0, 0.0, 0.0, 0.0)}
    wait_until(opened, lambda: opened.inner_text("#saved") == "saved as mine/pilot.py")
    wait_until(opened, lambda: (cockpit.scripts / "pilot.py").read_text().endswith("# wasd\n"))  # it may save twice


def test_a_script_with_an_error_is_marked_and_flies_after_a_revert(cockpit, opened):
    opened.select_option("#script", "tutorial/2_elevation.py")
    wait_for(opened, "document.querySelector('.cm-content').innerText.includes('Stage 2 of')")
    opened.locator(".cm-line").first.click()
    opened.keyboard.press("Control+Home")
    opened.keyboard.type("1 / 0\n")
    opened.click("#run")
    wait_until(opened, lambda: "line 1: ZeroDivisionError" in opened.inner_text("#said"))
    assert opened.locator(".cm-lintRange-error").inner_text() == "1 / 0"
    opened.click("#more")
    opened.get_by_role("menuitem", name="Revert").click()
    wait_for(opened, "!document.querySelector('.cm-content').innerText.includes('1 / 0')")
    opened.click("#run")
    wait_until(opened, lambda: opened.inner_text("#said") == "started")
    assert opened.locator("#script").input_value() == "mine/2_elevation.py"
    assert rospy.get_param("/drone_sim/script") == str(cockpit.scripts / "2_elevation.py")


def test_the_console_shows_the_output_of_a_script(cockpit, opened):
    cockpit.scripts.mkdir(exist_ok=True)
    script = "def sysCall_init():\n    for _ in range(3):\n        print('<b>same</b>')\n"
    (cockpit.scripts / "says.py").write_text(script)
    wait_until(opened, lambda: opened.locator("#script option[value='mine/says.py']").count())
    opened.select_option("#script", "mine/says.py")
    wait_for(opened, "document.querySelector('.cm-content').innerText.includes('same')")
    opened.click("#run")
    wait_until(opened, lambda: "<b>same</b>  (3 times)" in opened.inner_text("#console"))


def test_a_key_flies_the_drone_while_a_switch_has_the_focus(cockpit, opened):
    switch_camera(opened)
    picture = opened.locator(".picture img")
    wait_until(opened, lambda: picture.evaluate_all("all => all.some(one => one.naturalWidth === 640)"))
    assert opened.locator(".picture header").inner_text() == "front"
    opened.keyboard.down("w")  # the focus is on a switch, which takes no text
    wait_until(opened, lambda: cockpit.drone.command[0] == 1.0)
    opened.keyboard.up("w")
    switch_camera(opened)
    wait_until(opened, lambda: not picture.count())


def test_the_start_page_opens_every_activity_and_can_be_reopened(cockpit, browser):
    with open_page(cockpit, browser, started=False) as page:
        start = page.get_by_role("dialog", name="drone_sim")
        assert start.is_visible() and not page.locator("#go-on").is_visible()
        for picture in start.locator("img").all():
            wait_until(page, lambda picture=picture: picture.evaluate("one => one.naturalWidth") > 100)
        start.get_by_role("button", name="Tutorial").click()
        wait_for(page, "document.querySelector('#script').value.startsWith('tutorial/1')")
        wait_until(page, lambda: page.locator("#lesson-body").is_visible())
        assert not start.is_visible() and page.locator("#scene").bounding_box()["width"] > 0.5 * 1280
        page.click("#home")
        start.get_by_role("button", name="Tasks").click()
        tasks = page.locator("#gallery-tasks button")
        wait_until(page, lambda: tasks.count() == 10)
        assert (
            tasks.first.inner_text().split("\n")[0] == "Hover and hold in wind" and "easy" in tasks.first.inner_text()
        )
        page.click("#gallery-back")
        start.get_by_role("button", name="Tasks").click()
        tasks.first.click()
        wait_for(page, "document.querySelector('#script').value === 'tasks/hover.py'")
        page.click("#home")
        start.get_by_role("button", name="Just fly").click()
        wait_until(page, lambda: page.locator("#scene").bounding_box()["width"] == 1280)
        assert not page.locator("#editor").is_visible()
        page.click("#home")
        start.get_by_role("button", name="Build").click()
        wait_until(page, lambda: page.get_by_role("treeitem").count() > 1)
        page.click("#fold-side")
        page.reload()
        ready(page)
        assert not start.is_visible(), "it has been answered"
        page.click("#home")
        page.keyboard.press("Escape")
        assert not start.is_visible()
        page.click("#home")
        page.get_by_role("button", name="Go on with").click()
        wait_for(page, "document.querySelector('#script').value.startsWith('tasks/')")
        assert page.locator("#editor").is_visible()


def test_an_address_without_the_token_is_refused(cockpit, browser):
    context = browser.new_context()
    page = context.new_page()
    answer = page.goto(cockpit.address.partition("?")[0])
    assert answer.status == 403 and "token" in page.inner_text("body")
    context.close()
