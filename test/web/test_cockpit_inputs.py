"""Touch sticks, a gamepad and keys that fly the drone, and the release of keys, with one browser and with two."""

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from cockpit_page import Panel, open_page, wait_for_steps, wait_until

FAKE_GAMEPAD = "window.pad = null; navigator.getGamepads = () => [window.pad];"
STILL = (0.0, 0.0, 0.0)
FRENCH_KEYBOARD = """Object.defineProperty(navigator, "keyboard", { value: { getLayoutMap: async () =>
    new Map(Object.entries({ KeyW: "z", KeyA: "q", KeyQ: "a", KeyS: "s", KeyD: "d" })) } });"""
PRESS = """([type, code, key]) => document.activeElement.dispatchEvent(
    new KeyboardEvent(type, { code, key, bubbles: true, cancelable: true }))"""


@pytest.fixture(name="tablet", scope="module")
def _tablet(cockpit, browser):
    """A page on a touch screen, with a simulated gamepad."""
    with open_page(cockpit, browser, init=FAKE_GAMEPAD, has_touch=True, is_mobile=True) as page:
        yield page


@pytest.fixture(autouse=True)
def _restart_pilot(cockpit, tablet):
    cockpit.start_afresh()
    wait_until(tablet, lambda: cockpit.drone.command == STILL)


def is_near(command, expected):
    return all(abs(one - other) < 0.1 for one, other in zip(command, expected))


def test_two_touch_sticks_fly_the_drone(cockpit, tablet):
    fingers = tablet.context.new_cdp_session(tablet)
    boxes = [tablet.locator(f"#{stick}").bounding_box() for stick in ("left", "right")]
    middles = [(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2) for box in boxes]

    def touch(kind, *shifts):
        points = [{"x": x + dx, "y": y + dy, "id": id} for id, ((x, y), (dx, dy)) in enumerate(zip(middles, shifts))]
        fingers.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    touch("touchStart", (0, 0), (0, 0))
    touch("touchMove", (0, -52), (0, -52))  # both up: climb, and forward
    wait_until(tablet, lambda: is_near(cockpit.drone.command, (0.85, 0.85, 0.0)))
    touch("touchMove", (52, 0), (0, 0))  # turn to the right
    wait_until(tablet, lambda: is_near(cockpit.drone.command, (0.0, 0.0, -0.85)))
    touch("touchEnd")
    wait_until(tablet, lambda: cockpit.drone.command == STILL)


def test_a_gamepad_with_the_standard_mapping_flies_the_drone(cockpit, tablet):
    tablet.evaluate("pad = { axes: [-0.5, 0.05, 0, -1], buttons: [], mapping: 'standard', connected: true }")
    wait_until(tablet, lambda: is_near(cockpit.drone.command, (1.0, 0.0, 0.5)))
    tablet.evaluate("pad = null")
    wait_until(tablet, lambda: cockpit.drone.command == STILL)


def test_keys_are_released_when_the_window_loses_the_focus(cockpit, tablet):
    tablet.locator("#command").click()
    tablet.keyboard.down("w")
    wait_until(tablet, lambda: cockpit.drone.command[0] == 1.0)
    tablet.locator("#script").focus()  # still in the window
    wait_for_steps(tablet, cockpit.drone, 5)
    assert cockpit.drone.command[0] == 1.0
    tablet.evaluate("window.dispatchEvent(new Event('blur'))")
    wait_until(tablet, lambda: cockpit.drone.command == STILL)
    tablet.keyboard.up("w")
    tablet.locator("#scene").focus()
    tablet.keyboard.down("w")
    wait_until(tablet, lambda: cockpit.drone.command[0] == 1.0)
    tablet.keyboard.up("w")
    wait_until(tablet, lambda: cockpit.drone.command == STILL)


def test_two_browsers_show_the_same_state_and_both_can_fly(cockpit, browser, tablet):
    with open_page(cockpit, browser) as other:
        panels = Panel(tablet), Panel(other)
        panels[1].press("Pause", "paused at")
        wait_until(tablet, lambda: panels[0].status == panels[1].status == "paused")
        panels[0].press("Start", "resumed")
        wait_until(other, lambda: panels[1].status == "flying")
        for page in (tablet, other):
            page.locator("#command").click()
        tablet.keyboard.down("w")
        wait_until(tablet, lambda: cockpit.drone.command == (1.0, 0.0, 0.0))
        other.keyboard.down("r")
        wait_until(tablet, lambda: cockpit.drone.command == (0.0, 1.0, 0.0))
        tablet.keyboard.up("w")
        wait_until(tablet, lambda: cockpit.drone.command == (0.0, 1.0, 0.0))
        other.context.close()
    wait_until(tablet, lambda: cockpit.drone.command == STILL)


def test_a_french_keyboard_uses_the_same_key_positions_with_its_own_letters(cockpit, browser):
    with open_page(cockpit, browser, init=FRENCH_KEYBOARD) as page:
        wait_until(page, lambda: page.inner_text("#keys").startswith("ZSQD"))
        page.evaluate(PRESS, ["keydown", "KeyW", "z"])
        wait_until(page, lambda: cockpit.drone.command[0] == 1.0)
        page.evaluate(PRESS, ["keyup", "KeyW", "z"])
        wait_until(page, lambda: cockpit.drone.command == STILL)
        Panel(page).show("Edit")
        turn = page.get_by_role("button", name="Turn", exact=True)
        page.evaluate(PRESS, ["keydown", "Digit2", "é"])
        wait_until(page, lambda: turn.get_attribute("aria-pressed") == "true")
