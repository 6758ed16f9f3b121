"""The drone's own cameras and sensors in the Edit panel: edits change its topics and the scene."""

import pytest
import yaml

pytest.importorskip("rospy", reason="needs ROS")

from cockpit_page import Panel, open_page, wait_until
from scene_builder import Builder


class Info:
    """The picture width in the latest camera_info of the front camera."""

    def __init__(self):
        import rospy
        from sensor_msgs.msg import CameraInfo

        self.width = 0
        self.subscriber = rospy.Subscriber("/drone/camera_info", CameraInfo, self._on_info)

    def _on_info(self, message):
        self.width = message.width


@pytest.fixture(name="info")
def _info(cockpit):
    latest = Info()
    yield latest
    latest.subscriber.unregister()


def test_editing_a_cameras_width_changes_its_camera_info(cockpit, browser, info):
    with open_page(cockpit, browser, viewport={"width": 1440, "height": 900}) as page:
        panel, builder = Panel(page), Builder(page)
        panel.press("Stop", "stopped")
        builder.unfold("Drone")
        builder.select("FrontVision")
        width = page.locator("#properties").get_by_label("width", exact=True)
        wait_until(page, lambda: width.input_value() == "640")
        builder.set("width", 320)
        builder.wait("FrontVision", lambda entry: entry["values"]["width"] == 320)
        builder.set("width", 0)
        panel.wait_for("width = 0: must be a whole number from 1 to 4096")
        wait_until(page, lambda: width.input_value() == "320")
        page.click("[data-edit=text]")
        text = page.get_by_label("Text of the scene; Escape and then Tab leaves it")
        wait_until(page, lambda: "width" in text.inner_text())
        content = yaml.safe_load(text.inner_text())
        assert content["vehicles"]["drone"]["cameras"] == {"front": {"width": 320}}
        panel.press("Start", "started")
        wait_until(page, lambda: info.width == 320)
        panel.press("Stop", "stopped")
        page.click("#build-bar [data-edit=undo]")
        builder.wait("FrontVision", lambda entry: entry["values"]["width"] == 640)
        panel.press("Start", "started")
        wait_until(page, lambda: info.width == 640)
    cockpit.load("")  # the scene of the launch
