"""Objects are copied to the clipboard and pasted into another scene, another page, and from text."""

import pytest
import yaml

pytest.importorskip("rospy", reason="needs ROS")

from cockpit_page import Panel, open_page
from scene_builder import Builder

BALL = "- {name: Ball, shape: sphere, size: [0.1], position: [1, 1, 0.5]}"
SIZE = {"width": 1440, "height": 900}


def clipboard(page):
    return page.evaluate("navigator.clipboard.readText()")


def put_on_clipboard(page, text):
    page.evaluate("text => navigator.clipboard.writeText(text)", text)


def test_objects_are_pasted_into_another_scene_another_page_and_from_text(cockpit, browser):
    options = {"viewport": SIZE, "permissions": ["clipboard-read", "clipboard-write"]}
    with open_page(cockpit, browser, **options) as page:
        panel, builder = Panel(page), Builder(page)
        builder.new_scene()
        crate = builder.drop("Cuboid", [1, 0, 0])
        builder.rename(crate, "Crate")
        builder.set("mass", 2)
        before = builder.wait("Crate", lambda entry: entry["values"].get("mass") == 2)
        page.keyboard.press("Escape")  # leaves the field; a click on the row could become a triple click
        page.keyboard.press("Control+c")
        panel.wait_for("copied: Crate")
        (item,) = yaml.safe_load(clipboard(page))["objects"]
        assert (item["name"], item["shape"], item["mass"], item["position"]) == ("Crate", "box", 2, before["position"])
        page.keyboard.press("Control+v")
        builder.wait("Crate0", lambda entry: entry["position"][0] == before["position"][0] + 0.5)
        page.keyboard.press("Control+z")
        builder.row("Crate0").wait_for(state="detached")

        builder.new_scene()
        with open_page(cockpit, browser, **options) as other:
            target = Builder(other)
            other.bring_to_front()
            other.keyboard.press("Control+v")
            target.wait("Crate", lambda entry: entry["position"] == before["position"] and entry["values"]["mass"] == 2)
            put_on_clipboard(other, BALL)
            target.select("Floor")
            other.keyboard.press("Control+v")
            target.wait("Ball", lambda entry: entry["position"] == [1, 1, 0.5])
            put_on_clipboard(other, "Dear John,\nhow are you?")
            other.keyboard.press("Control+v")
            Panel(other).wait_for("must be objects as in a scene file")
            names = {entry.inner_text() for entry in other.locator("#tree .name").all()}
            assert names == {"Floor", "Crate", "Ball"}
    cockpit.load("")  # the scene of the launch
