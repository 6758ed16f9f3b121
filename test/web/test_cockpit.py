"""The cockpit in a browser, against the running node: looked at, flown, tuned, and a script edited into an error."""

import time

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy
from geometry_msgs.msg import TwistStamped
from launched import launched
from nav_msgs.msg import Odometry

WAIT = 30_000  # ms; a browser without a GPU is slow


class Drone:
    """What the node says of it."""

    def __init__(self):
        self.place = self.command = None
        rospy.Subscriber("/drone/odom", Odometry, self._on_odometry, queue_size=1)
        rospy.Subscriber("/drone/command", TwistStamped, self._on_command, queue_size=1)

    def _on_odometry(self, message):
        at = message.pose.pose.position
        self.place = at.x, at.y, at.z

    def _on_command(self, message):
        self.command = message.twist.linear.x, message.twist.linear.z, message.twist.angular.z


def wait_until(page, condition, seconds=30):
    """Wait, and let the browser go on."""
    until = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < until, "it did not come to pass"
        page.wait_for_timeout(50)


@pytest.fixture(name="cockpit", scope="module")
def _cockpit(browser):
    with launched() as cockpit:
        rospy.init_node("test_cockpit", anonymous=True, disable_signals=True)
        cockpit.drone = Drone()
        yield cockpit


@pytest.fixture(name="opened")
def _opened(cockpit, browser):
    context = browser.new_context(viewport={"width": 1000, "height": 500})
    page = context.new_page()
    page.set_default_timeout(WAIT)
    page.troubles = []
    page.on("pageerror", lambda error: page.troubles.append(str(error)))
    page.goto(cockpit.address)
    page.wait_for_function("document.querySelector('.cm-content')?.innerText.length > 100")
    wait_until(page, lambda: cockpit.drone.place is not None)
    yield page
    assert page.troubles == []
    context.close()


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
    wait_until(opened, lambda: "saved as mine/pilot.py" in opened.inner_text("#saved"))
    assert (cockpit.scripts / "pilot.py").read_text().endswith("# wasd\n")


def test_a_script_is_edited_into_an_error_mended_and_flown(cockpit, opened):
    opened.select_option("#script", "tutorial/2_elevation.py")
    opened.wait_for_function("document.querySelector('.cm-content').innerText.includes('zref')")
    opened.locator(".cm-content").click()
    opened.keyboard.press("Control+Home")
    opened.keyboard.type("1 / 0\n")
    opened.click("#run")
    wait_until(opened, lambda: "2_elevation.py:1: ZeroDivisionError" in opened.inner_text("#said"))
    assert opened.locator(".cm-lintRange-error").inner_text() == "1 / 0"
    opened.click("#revert")
    opened.wait_for_function("!document.querySelector('.cm-content').innerText.includes('1 / 0')")
    opened.click("#run")
    wait_until(opened, lambda: opened.inner_text("#said") == "started")
    assert opened.locator("#script").input_value() == "mine/2_elevation.py"
    assert rospy.get_param("/drone_sim/script") == str(cockpit.scripts / "2_elevation.py")


def test_buttons_fields_and_pictures(cockpit, opened):
    scene = opened.frame_locator("#scene")
    scene.get_by_role("button", name="pause").click()
    wait_until(opened, lambda: "paused at" in scene.locator("textarea").first.input_value())
    scene.get_by_role("button", name="go on").click()
    wait_until(opened, lambda: scene.locator("input[disabled]").first.input_value() == "flying")
    scene.get_by_role("tab", name="Cameras").click()
    scene.get_by_label("drone/front").click()
    wait_until(opened, lambda: scene.locator("img").evaluate_all("all => all.some(one => one.naturalWidth === 640)"))
    scene.get_by_role("tab", name="Tune").click()
    field = scene.get_by_label("Kzref", exact=True)
    field.fill("2")
    field.press("Enter")
    wait_until(opened, lambda: "Kzref = 2" in scene.locator("textarea").first.input_value())


def test_a_second_address_needs_the_token(cockpit, browser):
    context = browser.new_context()
    page = context.new_page()
    answer = page.goto(cockpit.address.partition("?")[0])
    assert answer.status == 403 and "token" in page.inner_text("body")
    context.close()
