"""The cockpit's panel, pressed button by button, against the running node; its plots, its log, and several drones."""

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy
from cockpit_page import Drone, wait_for, wait_until
from diagnostic_msgs.msg import KeyValue

HOSTILE = '<img src=x onerror="window.top.hacked = true">'
# Of the chart of heights: the first time, the last height, how many pixels have its line's colour, the axis's ends.
HEIGHTS = """() => {
    const charts = Object.values(window.__viserTestpoints?.uplots ?? {}).map((one) => one.chart);
    const chart = charts.find((one) => one.series[1].label === "z");
    if (!chart?.ctx.canvas.width) return null;
    const canvas = chart.ctx.canvas;
    const colours = chart.ctx.getImageData(0, 0, canvas.width, canvas.height).data;
    let red = 0;
    for (let at = 0; at < colours.length; at += 4)
        red += colours[at] > colours[at + 1] + 80 && colours[at] > colours[at + 2] + 80 && colours[at + 3] > 90;
    return [chart.data[0].at(0), chart.data[1].at(-1), red, chart.scales.y.min, chart.scales.y.max];
}"""


@pytest.fixture(autouse=True)
def _afresh(cockpit, panel):
    cockpit.start_afresh()
    wait_until(panel.page, lambda: panel.status == "flying")
    panel.show("Fly")


def stands(panel, drone):
    """Return where the paused drone is, once odometry says so."""
    place = None
    while place != drone.place:
        place = drone.place
        panel.page.wait_for_timeout(150)
    return place


def test_pause_one_step_snapshot_and_restore(cockpit, panel):
    panel.press("pause", "paused at t =")
    assert panel.status == "paused"
    before = stands(panel, cockpit.drone)
    time = float(panel.message.rpartition("= ")[2].removesuffix(" s"))
    panel.press("snapshot", f"snapshot at t = {time:.2f} s")
    cockpit.drone.flown.clear()
    panel.press("step", f"step: t = {time + 0.05:.2f} s")
    assert stands(panel, cockpit.drone) != before
    assert len({one["place"] for one in cockpit.drone.flown.values() if "place" in one} - {before}) == 1
    panel.press("restore", f"restored t = {time:.2f} s")
    wait_until(panel.page, lambda: cockpit.drone.place == before)
    panel.press("resume", "resumed at t =")
    wait_until(panel.page, lambda: panel.status == "flying")


def test_stop_start_and_restart(cockpit, panel):
    panel.press("stop", "stop: stopped")
    wait_until(panel.page, lambda: panel.status == "stopped")
    panel.press("step", "failed: ")
    panel.press("start", "start: started")
    wait_until(panel.page, lambda: panel.status == "flying")
    panel.press("restart", "restart: started")


def test_landing_and_takeoff(cockpit, panel):
    panel.press("land", "land sent to drone")
    wait_until(panel.page, lambda: cockpit.drone.place[2] < 0.1)
    wait_until(panel.page, lambda: cockpit.drone.state == "landed")
    panel.press("takeoff", "takeoff sent to drone")
    wait_until(panel.page, lambda: cockpit.drone.place[2] > 0.5)


def test_another_scene(cockpit, panel):
    scene = "package://drone_sim/config/scenes/empty.yaml"
    panel.choose("Scene", "empty")
    panel.wait_for(f"load_scene: started in {scene}")
    assert rospy.get_param("/drone_sim/scene_file") == scene
    panel.choose("Scene", "none")
    panel.wait_for("load_scene: started in the scene of the parameters")


def test_the_keys_fly_the_drone_that_is_chosen(cockpit, panel):
    rospy.set_param("/drone_sim/vehicles", {"drone": {}, "wing": {"position": [0, 2, 1]}})
    try:
        assert cockpit.call("set_vehicles") == "wing added"
        wing = Drone("wing")
        panel.choose("Vehicle", "wing")
        panel.page.locator("#command").click()
        panel.page.keyboard.down("w")
        wait_until(panel.page, lambda: wing.command is not None and wing.command[0] == 1.0)
        wait_until(panel.page, lambda: wing.velocity.x > 0.3)
        assert cockpit.drone.command == (0.0, 0.0, 0.0)
        panel.page.keyboard.up("w")
        wait_until(panel.page, lambda: wing.command == (0.0, 0.0, 0.0))
    finally:
        rospy.set_param("/drone_sim/vehicles", {"drone": {}})
        cockpit.call("set_vehicles")
    wait_until(panel.page, lambda: panel.field("Vehicle").input_value() == "drone")
    panel.page.keyboard.down("r")
    wait_until(panel.page, lambda: cockpit.drone.command[1] == 1.0)
    panel.page.keyboard.up("r")


def test_plots_are_drawn_and_a_slider_tunes(cockpit, panel):
    panel.show("Plots")

    def plotted():
        began, height, red, low, high = panel.scene.locator("body").evaluate(HEIGHTS) or (0, 0, 0, 0, 0)
        return began < -1 and abs(height - cockpit.drone.place[2]) < 0.02 and red > 50 and low <= 0 and high >= 1

    wait_until(panel.page, plotted)
    panel.show("Tune")
    slider = panel.scene.get_by_role("slider").first  # those of other tabs are hidden
    before = float(slider.get_attribute("aria-valuenow"))
    slider.focus()
    slider.press("ArrowRight")
    wait_until(panel.page, lambda: " = " in panel.message and "refused" not in panel.message)
    name, _, value = panel.message.partition(" = ")
    assert float(value) > before
    slider.press("ArrowLeft")
    wait_until(panel.page, lambda: panel.message.startswith(f"{name} = ") and panel.message != f"{name} = {value}")
    assert float(slider.get_attribute("aria-valuenow")) == before


def test_the_log_shows_a_warning_and_text_is_never_html(cockpit, panel):
    weather = rospy.Publisher("/drone/weather", KeyValue, queue_size=1, latch=True)
    weather.publish(KeyValue(HOSTILE, "3"))
    panel.show("Log")
    said = f"warning: weather refused: {HOSTILE}: unknown key"
    wait_until(panel.page, lambda: any(said in text for text in panel.scene.locator("pre").all_inner_texts()))
    weather.unregister()
    script = cockpit.scripts / "<img src=x onerror=hacked()>.py"
    script.parent.mkdir(exist_ok=True)
    script.write_text(f"raise ValueError({HOSTILE!r})\n")
    page = panel.page
    page.reload()
    wait_for(page, "document.querySelectorAll('#script option').length > 3")
    page.select_option("#script", f"mine/{script.name}")
    wait_for(page, "document.querySelector('.cm-content').innerText.includes('raise')")
    page.click("#run")
    wait_until(page, lambda: f"ValueError: {HOSTILE}" in page.inner_text("#said"))
    script.unlink()
    for frame in page.frames:
        assert frame.locator("img[src='x']").count() == 0
    assert page.evaluate("window.hacked") is None
