"""The cockpit's toolbar and panels, operated with a running simulator: flight, plots, parameters, log, two drones."""

import re

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from pathlib import Path

import rospy
from cockpit_page import Drone, let_time_pass, ready, wait_for, wait_until
from diagnostic_msgs.msg import KeyValue

HOSTILE = '<img src=x onerror="window.top.hacked = true">'
# Count the pixels of a chart that have about the colour of its first line.
COUNT_COLOURED = """(figure) => {
    const canvas = figure.querySelector("canvas");
    const wanted = getComputedStyle(document.documentElement).getPropertyValue("--line-1").match(/\\w\\w/g);
    const [r, g, b] = wanted.map((one) => parseInt(one, 16));
    const found = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    let count = 0;
    for (let at = 0; at < found.length; at += 4)
        count += [r, g, b].every((one, which) => Math.abs(found[at + which] - one) < 25) && found[at + 3] > 90;
    return count;
}"""
SIGNALS = """
def sysCall_init():
    self.graph = sim.addGraphStream(sim.getObjectHandle('Quadricopter_base'), 'twice', 'm')

def sysCall_actuation():
    sim.setFloatSignal('height', 1.25)
    sim.setGraphStreamValue(sim.getObjectHandle('Quadricopter_base'), self.graph, 2.5)
"""


@pytest.fixture(autouse=True)
def _restart_pilot(cockpit, panel):
    cockpit.start_afresh()
    wait_until(panel.page, lambda: panel.status == "flying")


def settled_place(panel, drone):
    """Return the place of the paused drone, as soon as two more odometry messages confirm it."""
    place = None
    while place != drone.place:
        place, odometry_count = drone.place, drone.odometry_count
        wait_until(panel.page, lambda odometry_count=odometry_count: drone.odometry_count >= odometry_count + 2)
    return place


def test_a_paused_flight_is_stepped_saved_and_restored(cockpit, panel):
    panel.press("Pause", "paused at t =")
    assert panel.status == "paused"
    before = settled_place(panel, cockpit.drone)
    time = float(panel.message.rpartition("= ")[2].removesuffix(" s"))
    assert panel.page.get_attribute("#sim-pause", "aria-pressed") == "true"
    panel.press("Snapshot", f"snapshot at t = {time:.2f} s")
    cockpit.drone.flight_steps.clear()
    panel.press("Step", f"t = {time + 0.05:.2f} s")
    assert settled_place(panel, cockpit.drone) != before
    assert len({one["place"] for one in cockpit.drone.flight_steps.values() if "place" in one} - {before}) == 1
    panel.press("Restore", f"restored t = {time:.2f} s")
    wait_until(panel.page, lambda: cockpit.drone.place == before)
    panel.press("Start", "resumed at t =")
    wait_until(panel.page, lambda: panel.status == "flying")


def test_stop_start_and_restart(cockpit, panel):
    panel.press("Stop", "stopped")
    wait_until(panel.page, lambda: panel.status == "stopped")
    panel.press("Step", "step: failed: ")
    assert "bad" in panel.page.get_attribute("#notice", "class")
    panel.press("Start", "started")
    wait_until(panel.page, lambda: panel.status == "flying")
    assert panel.page.get_by_role("button", name="Start", exact=True).is_disabled()
    panel.press("Restart", "started")


def test_toolbar_keys_have_no_effect_in_a_text_field(cockpit, panel):
    page = panel.page
    page.locator("#command").click()
    page.keyboard.press("Space")
    wait_until(page, lambda: panel.status == "paused")
    page.keyboard.press("n")
    panel.wait_for("t = ")
    page.keyboard.press("Space")
    wait_until(page, lambda: panel.status == "flying")
    page.keyboard.press("Enter")
    wait_until(page, lambda: panel.status == "stopped")
    panel.show("Tune")
    page.locator("#tune-filter").click()
    page.keyboard.type("n p?")
    assert page.input_value("#tune-filter") == "n p?" and not page.locator("#sheet").is_visible()
    page.locator("#tune-filter").fill("")
    page.locator("#command").click()
    page.keyboard.press("Enter")
    wait_until(page, lambda: panel.status == "flying")
    page.keyboard.press("?")
    assert page.locator("#sheet").is_visible()
    page.keyboard.press("Escape")


def test_a_message_does_not_move_the_scene_and_an_error_stays(cockpit, panel):
    page = panel.page
    page.evaluate(
        "() => { const plain = setTimeout; window.setTimeout = (then, ms) => plain(then, Math.min(ms, 1500)) }"
    )
    before = page.locator("#scene").bounding_box()
    panel.press("Pause", "paused")
    wait_until(page, lambda: panel.message == "")
    panel.press("Stop")
    wait_until(page, lambda: panel.status == "stopped")
    panel.press("Step", "failed")
    let_time_pass(page, 2000)
    assert "failed" in panel.message and page.locator("#scene").bounding_box() == before
    panel.press("Put the message away")
    assert panel.message == ""
    page.reload()
    ready(page)


def test_landing_and_takeoff(cockpit, panel):
    panel.press("Land", "land sent to drone")
    wait_until(panel.page, lambda: cockpit.drone.place[2] < 0.1)
    wait_until(panel.page, lambda: panel.status == "landed")
    panel.press("Take off", "takeoff sent to drone")
    wait_until(panel.page, lambda: cockpit.drone.place[2] > 0.5)


def test_land_without_effect_is_reported_with_the_reason(cockpit, panel):
    rospy.set_param("/drone_sim/script", "tutorial")
    assert cockpit.call("restart").startswith("started")
    panel.press("Land", "land: no effect: the child script does not subscribe")


def test_a_scene_can_be_chosen_from_the_list(cockpit, panel):
    scene = "package://drone_sim/config/scenes/empty.yaml"
    panel.choose("Scene", "empty")
    panel.wait_for(f"started in {scene}")
    assert rospy.get_param("/drone_sim/scene_file") == scene
    panel.choose("Scene", "as launched")
    panel.wait_for("started in the scene of the parameters")


def test_the_keys_fly_the_chosen_drone(cockpit, panel):
    rospy.set_param("/drone_sim/vehicles", {"drone": {}, "wing": {"position": [0, 2, 1]}})
    try:
        assert cockpit.call("set_vehicles") == "wing added"
        wing = Drone("wing")
        wait_until(panel.page, lambda: panel.field("Vehicle").is_visible())
        panel.choose("Vehicle", "wing")
        panel.wait_for("the keys fly wing")
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
    wait_until(panel.page, lambda: not panel.field("Vehicle").is_visible())
    panel.page.keyboard.down("r")
    wait_until(panel.page, lambda: cockpit.drone.command[1] == 1.0)
    panel.page.keyboard.up("r")


def test_plots_are_drawn_enlarged_and_saved(cockpit, panel):
    page = panel.page
    panel.show("Plots")
    height = page.get_by_role("group", name="Height, m")
    wait_until(page, lambda: height.evaluate(COUNT_COLOURED) > 50)
    assert re.search(r"height:?\s*[01]\.\d\d", height.inner_text()), "without a pointer, the legend has the last value"
    small_width = height.bounding_box()["width"]
    height.get_by_role("button", name="Enlarge").click()
    wait_until(page, lambda: height.bounding_box()["width"] > 1.3 * small_width)
    velocity = page.get_by_role("group", name="Velocity, m/s")
    velocity.locator(".plot").click()
    wait_until(page, lambda: page.locator("#enlarged .chart").count() == 2)
    with page.expect_download() as export:
        height.get_by_role("button", name="CSV").click()
    head, *rows = Path(export.value.path()).read_text().splitlines()
    assert head == '"t, s","height, m"' and len(rows) > 10
    assert abs(float(rows[-1].split(",")[1]) - cockpit.drone.place[2]) < 0.1
    with page.expect_download() as export:
        height.get_by_role("button", name="PNG").click()
    assert Path(export.value.path()).read_bytes().startswith(b"\x89PNG") and export.value.suggested_filename.endswith(
        ".png"
    )
    for chart in (height, velocity):
        chart.get_by_role("button", name="Back to the panel").click()
    panel.press("Close the panel")


def test_signals_and_graph_streams_of_a_script_are_plotted(cockpit, panel):
    page = panel.page
    cockpit.scripts.mkdir(exist_ok=True)
    script = cockpit.scripts / "signals.py"
    script.write_text(SIGNALS)
    rospy.set_param("/drone_sim/script", str(script))
    cockpit.call("restart")
    panel.show("Plots")
    for name in ("height", "twice"):
        page.locator("#plot-list").get_by_label(name, exact=True).check()
        chart = page.get_by_role("group", name=name, exact=True)
        wait_until(page, lambda chart=chart: chart.count() and chart.evaluate(COUNT_COLOURED) > 20)
        chart.get_by_role("button", name="Close").click()
    cockpit.start_afresh()
    script.unlink()


def test_a_valid_number_is_accepted_and_an_invalid_one_is_refused(cockpit, panel):
    page = panel.page
    panel.show("Tune")
    field = panel.field("Kzref (m/s) per m")
    for value in ("2.5", "5"):
        field.fill(value)
        field.press("Enter")
        panel.wait_for(f"Kzref = {value}")
        assert field.input_value() == value
    field.fill("1e9")
    field.press("Enter")
    panel.wait_for("Kzref = 1000000000: must be a number from 0 to 10000")
    wait_until(page, lambda: field.input_value() == "5")
    slider = page.get_by_role("slider", name="Kzref, slider")
    slider.evaluate("one => { one.value = 4; one.dispatchEvent(new Event('input')) }")
    panel.wait_for("Kzref = 4")
    assert float(field.input_value()) == 4
    field.fill("5")
    field.press("Enter")
    panel.wait_for("Kzref = 5")
    page.locator("#tune-filter").fill("wind/x")
    wait_until(page, lambda: page.locator("#tune-groups .field:visible").count() == 1)
    page.locator("#tune-filter").fill("")


def test_a_parameter_without_limits_has_a_slider_around_its_value(cockpit, panel):
    page = panel.page
    panel.show("Tune")
    script = cockpit.scripts / "bend.py"
    cockpit.scripts.mkdir(exist_ok=True)
    script.write_text("def sysCall_init():\n    sim.setScriptSimulationParameter(sim.handle_self, 'bend', 2.5)\n")
    rospy.set_param("/drone_sim/script", str(script))
    cockpit.call("restart")
    slider = page.get_by_role("slider", name="script_parameters/bend, slider")
    wait_until(page, lambda: slider.is_visible() and slider.evaluate("one => [one.min, one.max]") == ["0", "5"])
    slider.evaluate("one => { one.value = 4; one.dispatchEvent(new Event('input')) }")
    panel.wait_for("script_parameters/bend = 4")
    cockpit.start_afresh()
    script.unlink()


def test_only_parameters_of_the_script_are_shown_and_ignored_commands_are_reported(cockpit, panel):
    page = panel.page
    panel.show("Tune")
    wait_until(page, lambda: page.locator("#deaf").is_hidden() and panel.field("Kzref (m/s) per m").is_visible())
    script = cockpit.scripts / "deaf.py"
    cockpit.scripts.mkdir(exist_ok=True)
    script.write_text("def sysCall_init():\n    sim.getScriptSimulationParameter(sim.handle_self, 'Dzref')\n")
    rospy.set_param("/drone_sim/script", str(script))
    cockpit.call("restart")
    wait_until(page, lambda: page.locator("#deaf").is_visible())
    wait_until(page, lambda: "This script does not listen to commands" in page.inner_text("#deaf"))
    wait_until(page, lambda: panel.field("Kzref (m/s) per m").count() == 0)
    assert panel.field("Dzref (m/s) per (m/s)").is_visible()
    cockpit.start_afresh()
    script.unlink()


def test_the_log_shows_a_warning_and_text_is_never_html(cockpit, panel):
    weather = rospy.Publisher("/drone/weather", KeyValue, queue_size=1, latch=True)
    weather.publish(KeyValue(HOSTILE, "3"))
    panel.show("Log")
    warning = f"warning: weather refused: {HOSTILE}: unknown key"
    wait_until(panel.page, lambda: warning in panel.page.inner_text("#log-lines"))
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
    assert page.locator("img[src='x']").count() == 0
    assert page.evaluate("window.hacked") is None
