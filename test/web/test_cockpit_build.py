"""Scenes built with the mouse, saved, loaded and flown: the V-REP tutorial's first scene, an arena, single edits."""

import itertools
import json
import math
import os

import pytest
import yaml

pytest.importorskip("rospy", reason="needs ROS")

import rospy
from cockpit_page import PROJECT, STARTED, Panel, open_page, ready, wait_for, wait_until
from diagnostic_msgs.srv import AddDiagnostics
from launched import launched
from scene_builder import SELECTED, Builder

from drone_sim.grading import flight, tasks
from drone_sim.grading import plan as plans

# The stock script with a single view, which shows TrackCam's picture as in the tutorial.
SCRIPT = """
import target
from target import sysCall_actuation, sysCall_sensing


def sysCall_init():
    target.sysCall_init()
    view = sim.floatingViewAdd(0.9, 0.9, 0.2, 0.2, 0)
    sim.adjustView(view, sim.getObjectHandle("TrackCam"), 64)
"""
EPSILON = 1e-4  # m, rad
IS_UNCOVERED = "([x, y]) => document.elementFromPoint(x, y) === scene.canvas.dom"
COUNT_ACTIONS = """
window.acts = 0;
for (const kind of ["pointerdown", "input"]) addEventListener(kind, () => window.acts++, true);
"""
MAX_ACTIONS = 40
# Record the names of the page's requests in `asked`, and delay each answer by `late` ms.
DELAY_ANSWERS = """late => {
    const { editing } = scene, { ask } = editing;
    window.asked = [];
    editing.ask = async (...one) => {
        window.asked.push(one[0]);
        const answer = await ask(...one);
        await new Promise(done => setTimeout(done, late));
        return answer;
    };
}"""
# Request the tree. Before its answer arrives, two updates are sent: the first is lost, the second is delivered.
LOSE_AN_UPDATE = """() => {
    const { editing } = scene, { ask } = editing;
    window.asked = 0;
    editing.ask = async (...one) => {
        window.asked++;
        const answer = await ask(...one), { version } = answer.tree;
        if (window.asked === 1) editing.take({ ...answer.tree, version: version + 2, since: version + 1 });
        return answer;
    };
    editing.connected();
}"""
# Announce the tree of the old scene again before each request.
REPEAT_OLD_TREE = """() => {
    const { editing } = scene, { ask } = editing;
    editing.ask = async (...one) => {
        editing.emit("tree");
        editing.emit("objects");
        return ask(...one);
    };
}"""
COURSE = ({"X": 3, "Y": 0}, {"X": 6, "Y": 1, "Gamma": 30}, {"X": 8, "Y": 4, "Gamma": 90})  # m, degrees


def is_near(entry, position):
    return math.dist(entry["position"], position) < EPSILON


def build(builder, script):
    """Build the scene of the tutorial's sections "Our first drone scene" and "Game-like tracking camera"."""
    builder.new_scene()
    builder.select("Floor")
    builder.set("size", 10)
    builder.rename(builder.drop("Quadricopter of V-REP", [0.5, 0.5, 0]), "Drone")
    builder.write(X=0, Y=0, Z=0.8)
    builder.unfold("Drone")
    move_target(builder)
    builder.set("script", script)
    for camera in ("Quadricopter_floorCamera", "Quadricopter_frontCamera"):
        builder.select(camera)
        builder.page.keyboard.press("Delete")
        builder.row(camera).wait_for(state="detached")
    builder.rename(builder.drop("Camera", [1, 0.6, 0]), "TrackCam")
    builder.set_parent("TrackCam", "Quadricopter_base")
    builder.write("Parent", X=-0.8, Y=0, Z=0.3, Alpha=180, Beta=75, Gamma=-90)
    builder.wait("TrackCam", lambda entry: is_near(entry, (-0.8, 0, 0.3)))
    builder.rename(builder.drop("Dummy", [1, -0.6, 0]), "Track_base")
    builder.set_parent("Track_base", "Quadricopter_base")
    builder.write("Parent", X=0, Y=0, Z=0)
    builder.set_parent("TrackCam", "Track_base")


def move_target(builder):
    """Move the green sphere during a flight: the drone follows. Stop resets both."""
    panel = Panel(builder.page)
    panel.press("Start", "started")
    builder.select("DronePosition")
    builder.write(X=0.5)
    builder.wait("Drone", lambda entry: entry["pose"][0] > 0.2)
    panel.press("Stop", "stopped")
    builder.select("Drone")
    builder.wait("Drone", lambda entry: is_near(entry, (0, 0, 0.8)))


def check_tutorial_scene(builder):
    """Assert that objects, names, parents and poses are those of the tutorial."""
    assert builder.object("Floor")["values"]["size"] == 10
    assert math.dist(builder.object("Quadricopter_base")["pose"][:3], (0, 0, 0.8)) < 0.1
    assert builder.object("DronePosition") and builder.object("Drone")
    assert is_near(builder.wait("Track_base", lambda entry: entry["above"] == "Quadricopter_base"), (0, 0, 0))
    assert is_near(builder.wait("TrackCam", lambda entry: entry["above"] == "Track_base"), (-0.8, 0, 0.3))


def wait_for_flight(page):
    """Wait until the drone flies and the page shows TrackCam's picture."""
    wait_for(page, "document.querySelector('#status').dataset.is === 'flying'")
    window = page.locator(".picture", has_text="TrackCam")
    wait_until(page, lambda: window.locator("img").evaluate("one => one.naturalWidth") > 0)


def test_the_tutorials_first_scene_is_built_saved_and_flown_from_its_file(cockpit, browser, monkeypatch):
    monkeypatch.setenv("ROS_MASTER_URI", os.environ["ROS_MASTER_URI"])  # restored after the test
    cockpit.scripts.mkdir(exist_ok=True)
    script, scene = cockpit.scripts / "stock.py", cockpit.scripts / "Drone.yaml"
    script.write_text(SCRIPT)
    with open_page(cockpit, browser, viewport={"width": 1440, "height": 900}) as page:
        page.click("#toggle")
        builder = Builder(page)
        build(builder, str(script))
        check_tutorial_scene(builder)
        builder.save_as(scene.name)
    cockpit.load("")  # the scene of the launch
    content = yaml.safe_load(scene.read_text())
    assert [entry["name"] for entry in content["objects"]] == ["TrackCam", "Track_base"]
    with launched(f"scene:={scene}") as relaunched, browser.new_page() as page:
        page.add_init_script(STARTED)
        page.goto(relaunched.address, wait_until="commit")
        ready(page)
        wait_for_flight(page)
        Panel(page).press("Stop", "stopped")  # which restores what the script has unparented
        check_tutorial_scene(Builder(page))


def test_start_waits_for_numbers_that_were_entered_before_it(cockpit, browser):
    target = (0.5, 0.4, 2)
    with open_page(cockpit, browser, viewport={"width": 1440, "height": 900}) as page:
        builder, panel = Builder(page), Panel(page)
        builder.new_scene()
        gate = builder.drop("Gate", [1, 1, 0])
        builder.wait(gate, lambda entry: entry["position"][:2] == [1, 1])
        page.evaluate(DELAY_ANSWERS, 1000)
        builder.write(**dict(zip("XYZ", target)))
        panel.press("Start", "started")
        builder.wait(gate, lambda entry: is_near(entry, target))
        assert page.evaluate("asked") == ["edit"] * 3, "each number is sent once"
        panel.press("Stop", "stopped")
        wait_for(page, "scene.editing.is.state === 'stopped'")
        assert is_near(builder.object(gate), target), "Stop reverts only changes made in flight"
    cockpit.load("")


def test_start_waits_for_scene_text_that_was_entered_before_it(cockpit, browser):
    with open_page(cockpit, browser, viewport={"width": 1440, "height": 900}) as page:
        builder, panel = Builder(page), Panel(page)
        panel.press("Stop", "stopped")
        page.click("[data-edit=text]")
        text = page.get_by_label("Text of the scene; Escape and then Tab leaves it")
        wait_until(page, lambda: page.inner_text("#scene-text-title"))
        text.fill("objects:\n  - {name: Ball, shape: sphere, size: [0.2], position: [1, 1, 0.2]}\n")
        panel.press("Start", "started")
        builder.row("Ball").wait_for()
        panel.press("Stop", "stopped")
        wait_for(page, "scene.editing.is.state === 'stopped'")
        assert builder.object("Ball"), "Stop reverts only changes made in flight"
    cockpit.load("")


def test_an_edit_by_another_client_is_shown_in_the_pose_fields(cockpit, browser):
    with open_page(cockpit, browser, viewport={"width": 1440, "height": 900}) as page:
        builder, numbers = Builder(page), page.locator("#pose")
        builder.new_scene()
        gate = builder.drop("Gate", [1, 1, 0])
        _, _, height = builder.wait(gate, lambda entry: entry["position"][:2] == [1, 1])["position"]
        page.evaluate(DELAY_ANSWERS, 3000)
        builder.write(X=0.5)
        builder.wait(gate, lambda entry: entry["position"][0] == 0.5)
        move = {"do": "move", "object": gate, "position": [0.9, 1, height], "relative_to": "world"}
        rospy.ServiceProxy("/drone_sim/edit_scene", AddDiagnostics)(json.dumps({"edit": [move]}))
        builder.wait(gate, lambda entry: entry["position"][0] == 0.9)
        wait_until(page, lambda: numbers.get_by_label("X, m", exact=True).input_value() == "0.9")
    cockpit.load("")


def test_a_tree_older_than_a_missed_update_is_requested_again(opened):
    Builder(opened)
    wait_until(opened, lambda: not opened.evaluate("scene.editing.asking"))
    opened.evaluate(LOSE_AN_UPDATE)
    wait_for(opened, "asked === 2")


def build_arena(builder):
    """Build three gates, a pad and a wall."""
    builder.new_scene()
    for place in COURSE:
        gate = builder.drop("Gate", [1, 1, 0])
        builder.write(**place)
        builder.wait(gate, lambda entry, expected=(place["X"], place["Y"], 1.1): is_near(entry, expected))
    builder.drop("Landing pad", [-1, -1, 0])
    builder.drop("Quadricopter", [0, 0, 0])
    builder.drop("Wall", [-1.5, 1, 0])  # last, since it hides what is behind it in the view


def test_an_arena_is_built_with_the_mouse_and_flown_by_the_gates_tasks_solution(cockpit, browser, tmp_path):
    cockpit.scripts.mkdir(exist_ok=True)
    scene = cockpit.scripts / "arena.yaml"
    with open_page(cockpit, browser, init=COUNT_ACTIONS, viewport={"width": 1440, "height": 900}) as page:
        builder = Builder(page)
        before = page.evaluate("acts")
        build_arena(builder)
        builder.save_as(scene.name)
        assert page.evaluate("acts") - before <= MAX_ACTIONS
    cockpit.load("")
    task = tasks.find("gates")
    content = {**yaml.safe_load(task.read_text()), "scene": str(scene), "script": str(task.parent / "solution.py")}
    plan = tmp_path / "plan.yaml"
    plan.write_text(yaml.safe_dump(content))
    result = flight.grade(plans.read(plan))
    assert result.passed, result
    assert [entry.value for entry in result.outcomes if entry.kind == "reach"] == [3], "all three gates are reached"


def test_a_scene_saved_in_flight_is_reported_as_a_copy(cockpit, browser):
    cockpit.scripts.mkdir(exist_ok=True)
    with open_page(cockpit, browser) as page:
        builder = Builder(page)
        before = page.inner_text("#scene-file")
        builder.ask_to_save_as("flown.yaml")
        Panel(page).wait_for("This is a copy")
        assert page.inner_text("#scene-file") == before == "as launched"
    assert (cockpit.scripts / "flown.yaml").is_file()


def test_a_drag_is_one_undo_step_and_the_text_edits_the_same_scene(cockpit, browser):
    with open_page(cockpit, browser, viewport={"width": 1440, "height": 900}) as page:
        builder = Builder(page)
        builder.new_scene()
        builder.drop("Cuboid", [1, 0, 0])
        before = builder.wait("Cuboid", lambda entry: entry["position"][:2] == [1, 0])["position"]
        builder.drag_along_y(60)
        moved = builder.wait("Cuboid", lambda entry: entry["position"][1] < -0.05)["position"]
        assert moved[0] == before[0] and moved[2] == before[2]
        assert abs(moved[1] * 10 - round(moved[1] * 10)) < EPSILON, "the position snaps to steps of 0.1 m"
        wait_until(page, lambda: "Move Cuboid" in page.get_attribute("[data-edit=undo]", "title"))
        page.keyboard.press("Control+z")
        builder.wait("Cuboid", lambda entry: entry["position"] == before)
        page.click("[data-edit=text]")
        text = page.get_by_label("Text of the scene; Escape and then Tab leaves it")
        wait_until(page, lambda: "name: Cuboid" in text.inner_text())
        text.fill("floor: {size: 4}\nobjects:\n  - {name: Ball, shape: sphere, size: [0.2], position: [1, 1, 0.2]}\n")
        builder.row("Ball").wait_for()
        assert builder.object("Cuboid") is None
        text.fill("floor: {size: 4}\nobjects:\n  - {name: Ball, shape: ball}\n")
        wait_until(page, lambda: "line 3" in page.inner_text("#scene-text-said"))
        assert builder.object("Ball")["position"] == [1, 1, 0.2], "an invalid text does not change the scene"
        page.reload()
        ready(page)
        builder.row("Ball").wait_for()
    cockpit.load("")


def test_a_new_scene_runs_the_pilot_and_a_saved_scene_the_last_script(cockpit, browser):
    cockpit.scripts.mkdir(exist_ok=True)
    with open_page(cockpit, browser, viewport={"width": 1440, "height": 900}) as page:
        page.locator("#script").select_option("tutorial/1_thrust.lua")
        wait_for(page, "document.querySelector('.cm-content').textContent.includes('thrust_gravity')")
        page.click("#run")
        wait_until(page, lambda: page.inner_text("#flown") == "tutorial/1_thrust.lua")
        builder, panel = Builder(page), Panel(page)
        builder.new_scene()
        wait_until(page, lambda: page.inner_text("#flown") == "")
        wait_until(page, lambda: page.locator("#scene-choice option:checked").inner_text() == "new scene")
        corners = [[x, y, 0] for x in (-2.5, 2.5) for y in (-2.5, 2.5)]
        wait_until(page, lambda: all(page.evaluate(IS_UNCOVERED, page.evaluate(PROJECT, corner)) for corner in corners))
        page.evaluate("scene.view.approachBy(0.3)")
        page.locator("#scene canvas").press("Home")
        wait_until(page, lambda: all(page.evaluate(IS_UNCOVERED, page.evaluate(PROJECT, corner)) for corner in corners))
        builder.drop("Quadricopter", [0, 0, 0])
        wait_until(page, lambda: page.inner_text("#flown") == "built-in/pilot.py")
        panel.press("Start", "started")
        wait_until(page, lambda: page.inner_text("#flying") == "built-in/pilot.py flies")
        page.click("#run")
        wait_until(page, lambda: page.inner_text("#flying") == "flies")
        panel.press("Stop", "stopped")
        builder.save_as("owned.yaml")
        builder.wait("Drone", lambda entry: entry["own_script"] == "package://drone_sim/docs/tutorial/1_thrust.lua")
        wait_until(page, lambda: page.locator("#scene-choice option:checked").inner_text() == "owned.yaml")
        page.locator("#script").select_option("tutorial/2_elevation.py")
        wait_for(page, "document.querySelector('.cm-content').textContent.includes('Kzref')")
        page.click("#run")
        builder.wait("Drone", lambda entry: entry["own_script"] == "package://drone_sim/docs/tutorial/2_elevation.py")
        wait_until(page, lambda: page.inner_text("#flying") == "flies")
    cockpit.load("")


def test_the_view_frames_the_scene_after_a_flyaway_and_after_an_old_tree(cockpit, browser):
    with open_page(cockpit, browser, viewport={"width": 1440, "height": 900}) as page:
        page.evaluate("scene.look('free')")
        for show_floor in (lambda: Builder(page), lambda: Panel(page).press("Stop", "stopped")):
            page.evaluate("scene.view.center.z = 900; scene.change()")
            wait_for(page, "scene.camera.position.z > 800")
            show_floor()
            wait_for(page, "scene.camera.position.length() < 60")
        builder = Builder(page)
        page.evaluate("scene.view.approachBy(0.1)")
        page.evaluate(REPEAT_OLD_TREE)
        builder.new_scene()
        corners = [[x, y, 0] for x in (-2.5, 2.5) for y in (-2.5, 2.5)]
        wait_until(page, lambda: all(page.evaluate(IS_UNCOVERED, page.evaluate(PROJECT, corner)) for corner in corners))
    cockpit.load("")


def test_keys_in_the_search_the_tree_and_a_number_field(cockpit, browser):
    with open_page(cockpit, browser, viewport={"width": 1440, "height": 900}) as page:
        builder = Builder(page)
        builder.new_scene()
        builder.drop("Cuboid", [1, 1, 0])
        builder.select("Floor")
        page.get_by_placeholder("Find an object").fill("box")  # the type of the cuboid
        page.keyboard.press("Enter")
        wait_until(page, lambda: page.evaluate(SELECTED) == "Cuboid")
        page.keyboard.press("ArrowLeft")
        assert page.evaluate(SELECTED) == "Cuboid", "an object without a parent stays selected"
        field = page.get_by_label("X, m", exact=True)
        field.fill("abc")
        field.press("ArrowUp")
        builder.wait("Cuboid", lambda entry: entry["position"][0] > 1)
        assert field.input_value() == str(round(builder.object("Cuboid")["position"][0], 4))
    cockpit.load("")


def test_a_new_copy_can_be_deleted_before_it_is_in_the_tree(cockpit, browser):
    with open_page(cockpit, browser, viewport={"width": 1440, "height": 900}) as page:
        builder = Builder(page)
        builder.new_scene()
        builder.drop("Cuboid", [1, 1, 0])
        before = page.evaluate("scene.editing.last")
        page.evaluate("scene.editing.take = () => {}")  # updates of the tree are ignored
        page.keyboard.press("Control+d")
        wait_until(page, lambda: page.evaluate("scene.editing.last") != before)
        page.keyboard.press("Delete")
        page.evaluate("delete scene.editing.take; scene.editing.connected()")
        wait_until(page, lambda: page.evaluate("scene.editing.is.undo").startswith("Delete"))
        assert page.get_by_role("treeitem").count() == 2  # the floor, and the first cuboid
    cockpit.load("")


def test_the_menu_says_why_the_floor_and_vehicles_cannot_be_saved_as_models(cockpit, browser):
    with open_page(cockpit, browser) as page:
        builder = Builder(page)
        item = page.locator("#scene-menu [data-edit=model]")
        for name, cause in (("Floor", "The floor"), ("Drone", "a vehicle")):
            builder.select(name)
            assert cause in item.get_attribute("title") and item.is_disabled()
        page.evaluate("scene.editing.select([])")
        assert "Nothing is selected" in item.get_attribute("title") and item.is_disabled()


def test_models_added_by_keys_stand_side_by_side_in_view(cockpit, browser):
    with open_page(cockpit, browser) as page:
        builder = Builder(page)
        builder.new_scene()
        page.get_by_role("searchbox", name="Find a model").fill("Cuboid")
        for _ in range(3):
            page.locator("#models .card").press("Enter")
        places = [builder.wait(name, lambda entry: True)["position"] for name in ("Cuboid", "Cuboid0", "Cuboid1")]
        assert min(math.dist(entry, other) for entry, other in itertools.combinations(places, 2)) >= 0.5, places
        for place in places:
            x, y = page.evaluate(PROJECT, place)
            assert page.evaluate(IS_UNCOVERED, [x, y])
    cockpit.load("")


def test_a_used_name_selects_its_object_and_handles_disappear_at_the_start(cockpit, browser):
    with open_page(cockpit, browser) as page:
        builder, panel = Builder(page), Panel(page)
        panel.press("Stop", "stopped")
        builder.unfold("Drone")
        builder.row("Quadricopter_floorCamera").dblclick()
        page.get_by_label("New name of Quadricopter_floorCamera").fill("TrackCam")
        page.keyboard.press("Enter")
        panel.wait_for("/TrackCam, a part of the vehicle 'drone'")
        wait_until(page, lambda: page.evaluate(SELECTED) == "TrackCam")
        has_handles = "Boolean(scene.editing.handles.controls.object)"
        builder.select("Drone")
        wait_for(page, has_handles)
        panel.press("Start", "started")
        wait_for(page, f"!{has_handles}")
        builder.row("Drone").click()
        wait_for(page, has_handles)


def drag_across(page, field, *distances):
    """Press a number field, and drag it to the right by each of `distances` (px); return its release function."""
    field.scroll_into_view_if_needed()
    place = field.bounding_box()
    page.mouse.move(place["x"] + 20, place["y"] + 10)
    page.mouse.down()
    for right in distances:
        page.mouse.move(place["x"] + 20 + right, place["y"] + 10, steps=5)
    return page.mouse.up


def test_property_fields_accept_expressions_drags_and_degrees(cockpit, browser):
    with open_page(cockpit, browser, viewport={"width": 1440, "height": 900}) as page:
        builder, fields = Builder(page), page.locator("#properties")
        panel = Panel(page)
        builder.new_scene()
        builder.select("Floor")
        assert fields.locator("[data-key=size]").inner_text() == "size m"
        camera = builder.drop("Camera", [1, 0, 0])
        builder.write(X="0.5+0.1", Gamma="2*(40 + 5)")
        builder.wait(camera, lambda entry: abs(entry["position"][0] - 0.6) < EPSILON)
        angle = fields.locator("[data-key=fov]")
        assert angle.inner_text().split("\n")[0] == "perspective angle °"
        assert "fov: in the scene's file, in rad" in angle.get_attribute("title")
        builder.set("perspective angle", 90)
        builder.wait(camera, lambda entry: abs(entry["values"]["fov"] - math.pi / 2) < EPSILON)
        builder.set("perspective angle", "2*")
        panel.wait_for("perspective angle = 2*: must be a number from 0.573 to 177.617")
        release = drag_across(page, fields.get_by_label("far clipping plane", exact=True), 10)
        builder.wait(camera, lambda entry: abs(entry["values"].get("far", 100) - 100.1) < EPSILON)  # during the drag
        page.mouse.move(*page.evaluate("[innerWidth - 1, 1]"))
        far = builder.wait(camera, lambda entry: entry["values"].get("far", 100) > 100.2)["values"]["far"]
        release()
        panel.press("Undo")
        builder.wait(camera, lambda entry: abs(entry["values"].get("far", 100) - 100) < EPSILON)  # the drag is one step
        panel.press("Redo")
        builder.wait(camera, lambda entry: abs(entry["values"].get("far", 100) - far) < EPSILON)
        joint = builder.drop("Joint", [1, -1, 0])
        builder.set("value", 30)
        builder.wait(joint, lambda entry: abs(entry["values"].get("value", 0) - math.pi / 6) < EPSILON)
        fields.get_by_label("type", exact=True).select_option("prismatic")
        wait_until(page, lambda: fields.locator("[data-key=value]").inner_text() == "value m")
        builder.drop("Cuboid", [1, 1, 0])
        groups = page.locator("#properties summary").all_inner_texts()
        assert groups == ["look", "physics", "advanced"]
    cockpit.load("")


def label_and_body_frames(page):
    """Return the names of the parent frames of the drone's label and of its body."""
    return page.evaluate("""['view/state', 'view/bodies'].map((layer) =>
        [...scene.tree.markers.values()].find((one) => one.userData.said.layer === layer)?.parent?.name)""")


def test_run_asks_before_leaving_a_new_scene_and_returns_without_a_lesson(cockpit, browser):
    with open_page(cockpit, browser, viewport={"width": 1440, "height": 900}) as page:
        builder = Builder(page)
        builder.new_scene()
        builder.drop("Quadricopter", [0, 0, 0])
        builder.drop("Cuboid", [1, 1, 0])
        page.select_option("#script", "tasks/hover.py")
        page.locator("#grade").wait_for()
        page.click("#run")
        page.get_by_role("button", name="Fly in my scene, close the text").click()
        wait_until(page, lambda: page.inner_text("#flown") == "tasks/hover.py")
        wait_until(page, lambda: page.inner_text("#said") == "started")
        assert page.input_value("#lesson") == "" and builder.object("Cuboid")
        wait_until(page, lambda: label_and_body_frames(page) == ["quadricopter/base_link"] * 2)
        page.select_option("#lesson", "tasks/hover")
        page.locator("#grade").wait_for()
        page.click("#run")
        page.get_by_role("button", name="Leave my scene").click()
        wait_until(page, lambda: page.inner_text("#said") == "started in the scene of the task hover")
        builder.row("Cuboid").wait_for(state="detached")
        wait_until(page, lambda: label_and_body_frames(page) == ["base_link"] * 2)
        page.select_option("#lesson", "")
        wait_until(page, lambda: not page.locator("#grade").is_visible())
        page.select_option("#script", "tutorial/2_elevation.py")
        wait_until(page, lambda: page.input_value("#lesson") == "stage-2-elevation")
        page.select_option("#lesson", "")
        page.click("#run")
        builder.row("Cuboid").wait_for()
        wait_until(page, lambda: page.inner_text("#flown") == "tutorial/2_elevation.py")
        assert page.inner_text("#scene-file") == "new scene"
    cockpit.load("")
