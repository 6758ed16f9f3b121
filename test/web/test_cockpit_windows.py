"""Windows in the page that scripts open (views, dialogs, consoles); the speed; overlays and recordings of cameras."""

from pathlib import Path

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy
from cockpit_page import switch_camera, wait_for, wait_until
from dynamic_reconfigure.client import Client

SCRIPT = """
def sysCall_init():
    view = sim.floatingViewAdd(0.9, 0.9, 0.2, 0.2, 0)
    sim.adjustView(view, sim.getObjectHandle('Quadricopter_floorCamera'), 64)
    depth = sim.floatingViewAdd(0.7, 0.9, 0.2, 0.2, 0)
    sim.adjustView(depth, sim.getObjectHandle('DepthVision'), 64, 'how far')
    self.dialog = sim.displayDialog('Height', 'How <b>high</b>?', sim.dlgstyle_input, False, '0.8')
    self.console = sim.auxiliaryConsoleOpen('Said', 5, 0)

def sysCall_actuation():
    if self.dialog and sim.getDialogResult(self.dialog) == sim.dlgret_ok:
        sim.auxiliaryConsolePrint(self.console, 'answered ' + sim.getDialogInput(self.dialog))
        self.dialog = None
"""

# Add up the bytes of all recordings, which arrive about every second.
COUNT_RECORDED = """() => {
    window.recorded = 0;
    const { start } = MediaRecorder.prototype;
    MediaRecorder.prototype.start = function (...options) {
        this.addEventListener("dataavailable", ({ data }) => { window.recorded += data.size; });
        start.apply(this, options);
    };
}"""
RECTANGLES = "all => all.map((one) => document.querySelector(one).getBoundingClientRect().toJSON())"


@pytest.fixture(name="flown")
def _flown(cockpit, opened):
    """The page while SCRIPT flies."""
    cockpit.scripts.mkdir(exist_ok=True)
    (cockpit.scripts / "opens.py").write_text(SCRIPT)
    opened.reload()
    wait_for(opened, "[...document.querySelectorAll('#script option')].some((one) => one.value === 'mine/opens.py')")
    opened.select_option("#script", "mine/opens.py")
    wait_for(opened, "document.querySelector('.cm-content').innerText.includes('floatingViewAdd')")
    opened.click("#run")
    wait_until(opened, lambda: opened.inner_text("#said") == "started")
    yield opened
    opened.select_option("#script", "built-in/pilot.py")
    wait_for(opened, "!document.querySelector('.cm-content').innerText.includes('floatingViewAdd')")
    opened.click("#run")
    wait_for(opened, "!document.querySelector('.window')")


def test_views_dialogs_and_consoles_of_a_script_are_shown(flown):
    for picture in ("Quadricopter_floorCamera", "how far"):
        window = flown.locator(".picture", has_text=picture)
        wait_until(flown, lambda window=window: window.locator("img").evaluate("one => one.naturalWidth") > 0)
    assert " m (blue) to " in flown.locator(".picture", has_text="how far").inner_text()
    dialog = flown.locator(".dialog")
    assert "How <b>high</b>?" in dialog.inner_text(), "markup is shown as text"
    field = dialog.locator("input")
    assert field.input_value() == "0.8"
    field.fill("1.2 m")
    dialog.get_by_role("button", name="ok").click()
    wait_until(flown, lambda: flown.locator(".console pre").inner_text() == "answered 1.2 m")
    wait_until(flown, lambda: dialog.count() == 0)


def test_the_speed_field_sets_and_follows_the_real_time_factor(cockpit, opened):
    node = Client("/drone_sim", timeout=90)
    field = opened.get_by_label("Speed", exact=True)
    field.select_option("0.5")
    wait_until(opened, lambda: (node.get_configuration() or {}).get("real_time_factor") == 0.5)
    wait_until(opened, lambda: opened.locator("#pace").text_content().startswith(("0.4", "0.5")))
    node.update_configuration({"real_time_factor": 3.0})
    wait_until(opened, lambda: field.input_value() == "3")
    node.update_configuration({"real_time_factor": 1.0})
    node.close()


def test_boxes_and_a_mask_can_be_shown_over_a_cameras_picture(cockpit, opened):
    rospy.set_param("/drone_sim/scene_file", str(Path(__file__).parents[2] / "docs/tutorial/8_scene.yaml"))
    cockpit.call("load_scene")
    try:
        switch_camera(opened)
        for kind in ("Boxes", "Mask"):
            opened.get_by_role("button", name=f"{kind} over /drone/front").click()
        window = opened.locator(".picture")
        wait_until(opened, lambda: set(window.locator("svg text").all_text_contents()) == {"Red", "Green"})
        wait_until(opened, lambda: {"Red", "Green"} <= set(window.locator(".legend span").all_text_contents()))
        # In a single call, since every picture brings new boxes.
        image, rect = opened.evaluate(RECTANGLES, [".picture img", ".picture .boxes-over rect"])
        assert image["x"] - 2 < rect["x"] < rect["x"] + rect["width"] < image["x"] + image["width"] + 2
        opened.get_by_role("button", name="Boxes over /drone/front").click()
        wait_until(opened, lambda: window.locator("svg text").count() == 0)
    finally:
        switch_camera(opened)
        rospy.set_param("/drone_sim/scene_file", "")
        cockpit.call("load_scene")


def test_a_recording_is_named_after_its_camera_and_saved_at_the_end(cockpit, opened):
    switch_camera(opened)
    picture = opened.locator(".picture img")
    wait_until(opened, lambda: picture.evaluate_all("all => all.some(one => one.naturalWidth === 640)"))
    record_button = opened.get_by_role("button", name="Record /drone/front")
    opened.evaluate(COUNT_RECORDED)
    record_button.click()
    wait_until(opened, lambda: record_button.get_attribute("aria-pressed") == "true")
    wait_for(opened, "recorded > 1000")
    with opened.expect_download() as download:
        record_button.click()
    assert download.value.suggested_filename.startswith("drone_sim-drone_front-")
    assert Path(download.value.path()).stat().st_size > 1000
    record_button.click()
    wait_for(opened, "recorded > 2000")
    with opened.expect_download():  # switching the camera off saves the recording
        switch_camera(opened)
