"""The scene is built with the mouse: the V-REP tutorial's first scene, and an arena; saved, begun anew, and flown."""

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

# The stock script, with one view less: it shows what TrackCam sees, as the tutorial asks.
SCRIPT = """
import target
from target import sysCall_actuation, sysCall_sensing


def sysCall_init():
    target.sysCall_init()
    view = sim.floatingViewAdd(0.9, 0.9, 0.2, 0.2, 0)
    sim.adjustView(view, sim.getObjectHandle("TrackCam"), 64)
"""
FAR = 1e-4  # m, rad
IS_SEEN = "([x, y]) => document.elementFromPoint(x, y) === scene.canvas.dom"
ACTS = """
window.acts = 0;
for (const kind of ["pointerdown", "input"]) addEventListener(kind, () => window.acts++, true);
"""
MOST_ACTS = 40
# Keeps what the page asks for in `asked`; what is answered, the page hears so late (ms).
LATE = """late => {
    const { editing } = scene, { ask } = editing;
    window.asked = [];
    editing.ask = async (...one) => {
        window.asked.push(one[0]);
        const answer = await ask(...one);
        await new Promise(done => setTimeout(done, late));
        return answer;
    };
}"""
# A tree that is asked for, and two messages that come before the answer: one is lost, and this is the other.
OVERTAKEN = """() => {
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
# Before a new scene is asked for, the tree of the old one is told again.
TOLD_AGAIN = """() => {
    const { editing } = scene, { ask } = editing;
    editing.ask = async (...one) => {
        editing.emit("tree");
        editing.emit("objects");
        return ask(...one);
    };
}"""
COURSE = ({"X": 3, "Y": 0}, {"X": 6, "Y": 1, "Gamma": 30}, {"X": 8, "Y": 4, "Gamma": 90})  # m, degrees


def near(one, position):
    return math.dist(one["position"], position) < FAR


def build(builder, script):
    """Click what the tutorial's sections "Our first drone scene" and "Game-like tracking camera" ask for."""
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
    builder.hang("TrackCam", "Quadricopter_base")
    builder.write("Parent", X=-0.8, Y=0, Z=0.3, Alpha=180, Beta=75, Gamma=-90)
    builder.wait("TrackCam", lambda one: near(one, (-0.8, 0, 0.3)))
    builder.rename(builder.drop("Dummy", [1, -0.6, 0]), "Track_base")
    builder.hang("Track_base", "Quadricopter_base")
    builder.write("Parent", X=0, Y=0, Z=0)
    builder.hang("TrackCam", "Track_base")


def move_target(builder):
    """Start, and move the green sphere: the drone follows; stop puts both back."""
    panel = Panel(builder.page)
    panel.press("Start", "started")
    builder.select("DronePosition")
    builder.write(X=0.5)
    builder.wait("Drone", lambda one: one["pose"][0] > 0.2)
    panel.press("Stop", "stopped")
    builder.select("Drone")
    builder.wait("Drone", lambda one: near(one, (0, 0, 0.8)))


def check(builder):
    """See that objects, names, parents and poses are as the tutorial asks."""
    assert builder.object("Floor")["values"]["size"] == 10
    assert math.dist(builder.object("Quadricopter_base")["pose"][:3], (0, 0, 0.8)) < 0.1
    assert builder.object("DronePosition") and builder.object("Drone")
    assert near(builder.wait("Track_base", lambda one: one["above"] == "Quadricopter_base"), (0, 0, 0))
    assert near(builder.wait("TrackCam", lambda one: one["above"] == "Track_base"), (-0.8, 0, 0.3))


def flies(page):
    """See that it flies where it was put, and that the page shows what TrackCam sees."""
    wait_for(page, "document.querySelector('#status').dataset.is === 'flying'")
    window = page.locator(".picture", has_text="TrackCam")
    wait_until(page, lambda: window.locator("img").evaluate("one => one.naturalWidth") > 0)


def test_the_tutorials_first_scene_is_clicked_saved_and_flown_from_its_file(cockpit, browser, monkeypatch):
    monkeypatch.setenv("ROS_MASTER_URI", os.environ["ROS_MASTER_URI"])  # that of this process, afterwards
    cockpit.scripts.mkdir(exist_ok=True)
    script, scene = cockpit.scripts / "stock.py", cockpit.scripts / "Drone.yaml"
    script.write_text(SCRIPT)
    with open_page(cockpit, browser, viewport={"width": 1440, "height": 900}) as page:
        page.click("#toggle")
        builder = Builder(page)
        build(builder, str(script))
        check(builder)
        builder.save_as(scene.name)
    cockpit.load("")  # as it was launched
    said = yaml.safe_load(scene.read_text())
    assert [one["name"] for one in said["objects"]] == ["TrackCam", "Track_base"]
    with launched(f"scene:={scene}") as again, browser.new_page() as page:
        page.add_init_script(STARTED)
        page.goto(again.address, wait_until="commit")
        ready(page)
        flies(page)
        Panel(page).press("Stop", "stopped")  # which puts back what the script has unparented
        check(Builder(page))


def test_a_start_comes_after_the_numbers_that_were_written_before_it(cockpit, browser):
    written = (0.5, 0.4, 2)
    with open_page(cockpit, browser, viewport={"width": 1440, "height": 900}) as page:
        builder, panel = Builder(page), Panel(page)
        builder.new_scene()
        gate = builder.drop("Gate", [1, 1, 0])
        builder.wait(gate, lambda one: one["position"][:2] == [1, 1])
        page.evaluate(LATE, 1000)
        builder.write(**dict(zip("XYZ", written)))
        panel.press("Start", "started")
        builder.wait(gate, lambda one: near(one, written))
        assert page.evaluate("asked") == ["edit"] * 3, "each number is taken once"
        panel.press("Stop", "stopped")
        wait_for(page, "scene.editing.is.state === 'stopped'")
        assert near(builder.object(gate), written), "stop takes back what was done in flight, and no more"
    cockpit.load("")


def test_a_start_comes_after_the_text_that_was_written_before_it(cockpit, browser):
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
        assert builder.object("Ball"), "stop takes back what was done in flight, and no more"
    cockpit.load("")


def test_what_another_does_meanwhile_is_seen_in_the_numbers(cockpit, browser):
    with open_page(cockpit, browser, viewport={"width": 1440, "height": 900}) as page:
        builder, numbers = Builder(page), page.locator("#pose")
        builder.new_scene()
        gate = builder.drop("Gate", [1, 1, 0])
        _, _, height = builder.wait(gate, lambda one: one["position"][:2] == [1, 1])["position"]
        page.evaluate(LATE, 3000)
        builder.write(X=0.5)
        builder.wait(gate, lambda one: one["position"][0] == 0.5)
        move = {"do": "move", "object": gate, "position": [0.9, 1, height], "relative_to": "world"}
        rospy.ServiceProxy("/drone_sim/edit_scene", AddDiagnostics)(json.dumps({"edit": [move]}))
        builder.wait(gate, lambda one: one["position"][0] == 0.9)
        wait_until(page, lambda: numbers.get_by_label("X, m", exact=True).input_value() == "0.9")
    cockpit.load("")


def test_a_tree_that_is_older_than_what_was_missed_meanwhile_is_asked_for_once_more(opened):
    Builder(opened)
    wait_until(opened, lambda: not opened.evaluate("scene.editing.asking"))
    opened.evaluate(OVERTAKEN)
    wait_for(opened, "asked === 2")


def build_arena(builder):
    """Build three gates, a pad and a wall."""
    builder.new_scene()
    for place in COURSE:
        gate = builder.drop("Gate", [1, 1, 0])
        builder.write(**place)
        builder.wait(gate, lambda one, wanted=(place["X"], place["Y"], 1.1): near(one, wanted))
    builder.drop("Landing pad", [-1, -1, 0])
    builder.drop("Quadricopter", [0, 0, 0])
    builder.drop("Wall", [-1.5, 1, 0])  # last: from where the page looks it hides what is behind it


def test_an_arena_is_built_with_the_mouse_and_flown_by_the_gates_tasks_solution(cockpit, browser, tmp_path):
    cockpit.scripts.mkdir(exist_ok=True)
    scene = cockpit.scripts / "arena.yaml"
    with open_page(cockpit, browser, init=ACTS, viewport={"width": 1440, "height": 900}) as page:
        builder = Builder(page)
        before = page.evaluate("acts")
        build_arena(builder)
        builder.save_as(scene.name)
        assert page.evaluate("acts") - before <= MOST_ACTS
    cockpit.load("")
    task = tasks.find("gates")
    said = {**yaml.safe_load(task.read_text()), "scene": str(scene), "script": str(task.parent / "solution.py")}
    plan = tmp_path / "plan.yaml"
    plan.write_text(yaml.safe_dump(said))
    result = flight.grade(plans.read(plan))
    assert result.passed, result
    assert [one.value for one in result.outcomes if one.kind == "reach"] == [3], "each of the three gates"


def test_saved_in_flight_it_is_a_copy_and_the_page_says_so(cockpit, browser):
    cockpit.scripts.mkdir(exist_ok=True)
    with open_page(cockpit, browser) as page:
        builder = Builder(page)
        before = page.inner_text("#scene-file")
        builder.ask_to_save_as("flown.yaml")
        Panel(page).wait_for("This is a copy")
        assert page.inner_text("#scene-file") == before == "as launched"
    assert (cockpit.scripts / "flown.yaml").is_file()


def test_a_drag_is_one_step_of_undo_and_the_text_is_the_same_scene(cockpit, browser):
    with open_page(cockpit, browser, viewport={"width": 1440, "height": 900}) as page:
        builder = Builder(page)
        builder.new_scene()
        builder.drop("Cuboid", [1, 0, 0])
        before = builder.wait("Cuboid", lambda one: one["position"][:2] == [1, 0])["position"]
        builder.pull(60)
        moved = builder.wait("Cuboid", lambda one: one["position"][1] < -0.05)["position"]
        assert moved[0] == before[0] and moved[2] == before[2]
        assert abs(moved[1] * 10 - round(moved[1] * 10)) < FAR, "in steps of 0.1 m"
        wait_until(page, lambda: "Move Cuboid" in page.get_attribute("[data-edit=undo]", "title"))
        page.keyboard.press("Control+z")
        builder.wait("Cuboid", lambda one: one["position"] == before)
        page.click("[data-edit=text]")
        text = page.get_by_label("Text of the scene; Escape and then Tab leaves it")
        wait_until(page, lambda: "name: Cuboid" in text.inner_text())
        text.fill("floor: {size: 4}\nobjects:\n  - {name: Ball, shape: sphere, size: [0.2], position: [1, 1, 0.2]}\n")
        builder.row("Ball").wait_for()
        assert builder.object("Cuboid") is None
        text.fill("floor: {size: 4}\nobjects:\n  - {name: Ball, shape: ball}\n")
        wait_until(page, lambda: "line 3" in page.inner_text("#scene-text-said"))
        assert builder.object("Ball")["position"] == [1, 1, 0.2], "what is wrong changes nothing"
        page.reload()
        ready(page)
        builder.row("Ball").wait_for()
    cockpit.load("")


def test_a_new_scene_flies_the_pilot_and_a_saved_one_the_script_that_was_run(cockpit, browser):
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
        wait_until(page, lambda: all(page.evaluate(IS_SEEN, page.evaluate(PROJECT, corner)) for corner in corners))
        page.evaluate("scene.view.approachBy(0.3)")
        page.locator("#scene canvas").press("Home")
        wait_until(page, lambda: all(page.evaluate(IS_SEEN, page.evaluate(PROJECT, corner)) for corner in corners))
        builder.drop("Quadricopter", [0, 0, 0])
        wait_until(page, lambda: page.inner_text("#flown") == "built-in/pilot.py")
        panel.press("Start", "started")
        wait_until(page, lambda: page.inner_text("#flying") == "built-in/pilot.py flies")
        page.click("#run")
        wait_until(page, lambda: page.inner_text("#flying") == "flies")
        panel.press("Stop", "stopped")
        builder.save_as("owned.yaml")
        builder.wait("Drone", lambda one: one["own_script"] == "package://drone_sim/docs/tutorial/1_thrust.lua")
        wait_until(page, lambda: page.locator("#scene-choice option:checked").inner_text() == "owned.yaml")
        page.locator("#script").select_option("tutorial/2_elevation.py")
        wait_for(page, "document.querySelector('.cm-content').textContent.includes('Kzref')")
        page.click("#run")
        builder.wait("Drone", lambda one: one["own_script"] == "package://drone_sim/docs/tutorial/2_elevation.py")
        wait_until(page, lambda: page.inner_text("#flying") == "flies")
    cockpit.load("")


def test_a_scene_is_framed_after_a_drone_that_flew_away_and_a_new_one_though_the_old_one_is_told_again(
    cockpit, browser
):
    with open_page(cockpit, browser, viewport={"width": 1440, "height": 900}) as page:
        page.evaluate("scene.look('free')")
        for show_floor in (lambda: Builder(page), lambda: Panel(page).press("Stop", "stopped")):
            page.evaluate("scene.view.center.z = 900; scene.change()")
            wait_for(page, "scene.camera.position.z > 800")
            show_floor()
            wait_for(page, "scene.camera.position.length() < 60")
        builder = Builder(page)
        page.evaluate("scene.view.approachBy(0.1)")
        page.evaluate(TOLD_AGAIN)
        builder.new_scene()
        corners = [[x, y, 0] for x in (-2.5, 2.5) for y in (-2.5, 2.5)]
        wait_until(page, lambda: all(page.evaluate(IS_SEEN, page.evaluate(PROJECT, corner)) for corner in corners))
    cockpit.load("")


def test_what_was_just_made_can_be_deleted_before_the_tree_has_it(cockpit, browser):
    with open_page(cockpit, browser, viewport={"width": 1440, "height": 900}) as page:
        builder = Builder(page)
        builder.new_scene()
        builder.drop("Cuboid", [1, 1, 0])
        before = page.evaluate("scene.editing.last")
        page.evaluate("scene.editing.take = () => {}")  # no tree is heard
        page.keyboard.press("Control+d")
        wait_until(page, lambda: page.evaluate("scene.editing.last") != before)
        page.keyboard.press("Delete")
        page.evaluate("delete scene.editing.take; scene.editing.connected()")
        wait_until(page, lambda: page.evaluate("scene.editing.is.undo").startswith("Delete"))
        assert page.get_by_role("treeitem").count() == 2  # the floor, and the first cuboid
    cockpit.load("")


def test_what_is_no_model_cannot_be_saved_as_one_and_the_menu_says_why(cockpit, browser):
    with open_page(cockpit, browser) as page:
        builder = Builder(page)
        item = page.locator("#scene-menu [data-edit=model]")
        for name, why in (("Floor", "The floor"), ("Drone", "a vehicle")):
            builder.select(name)
            assert why in item.get_attribute("title") and item.is_disabled()
        page.evaluate("scene.editing.select([])")
        assert "Nothing is selected" in item.get_attribute("title") and item.is_disabled()


def test_models_added_by_keys_stand_side_by_side_in_view(cockpit, browser):
    with open_page(cockpit, browser) as page:
        builder = Builder(page)
        builder.new_scene()
        page.get_by_role("searchbox", name="Find a model").fill("Cuboid")
        for _ in range(3):
            page.locator("#models .card").press("Enter")
        places = [builder.wait(name, lambda one: True)["position"] for name in ("Cuboid", "Cuboid0", "Cuboid1")]
        assert min(math.dist(one, other) for one, other in itertools.combinations(places, 2)) >= 0.5, places
        for place in places:
            x, y = page.evaluate(PROJECT, place)
            assert page.evaluate(IS_SEEN, [x, y])
    cockpit.load("")


def test_a_taken_name_selects_its_object_and_the_handles_go_when_a_flight_starts(cockpit, browser):
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


def drag_across(page, field, *way):
    """Press a number, and drag it to the right by so many px; return what lets go of it."""
    field.scroll_into_view_if_needed()
    place = field.bounding_box()
    page.mouse.move(place["x"] + 20, place["y"] + 10)
    page.mouse.down()
    for right in way:
        page.mouse.move(place["x"] + 20 + right, place["y"] + 10, steps=5)
    return page.mouse.up


def test_properties_are_computed_dragged_and_in_degrees(cockpit, browser):
    with open_page(cockpit, browser, viewport={"width": 1440, "height": 900}) as page:
        builder, fields = Builder(page), page.locator("#properties")
        panel = Panel(page)
        builder.new_scene()
        builder.select("Floor")
        assert fields.locator("[data-key=size]").inner_text() == "size m"
        camera = builder.drop("Camera", [1, 0, 0])
        builder.write(X="0.5+0.1", Gamma="2*(40 + 5)")
        builder.wait(camera, lambda one: abs(one["position"][0] - 0.6) < FAR)
        angle = fields.locator("[data-key=fov]")
        assert angle.inner_text().split("\n")[0] == "perspective angle °"
        assert "fov: in the scene's file, in rad" in angle.get_attribute("title")
        builder.set("perspective angle", 90)
        builder.wait(camera, lambda one: abs(one["values"]["fov"] - math.pi / 2) < FAR)
        builder.set("perspective angle", "2*")
        panel.wait_for("perspective angle = 2*: must be a number from 0.573 to 177.617")
        let_go = drag_across(page, fields.get_by_label("far clipping plane", exact=True), 10)
        builder.wait(camera, lambda one: abs(one["values"].get("far", 100) - 100.1) < FAR)  # while it is dragged
        page.mouse.move(*page.evaluate("[innerWidth - 1, 1]"))
        far = builder.wait(camera, lambda one: one["values"].get("far", 100) > 100.2)["values"]["far"]
        let_go()
        panel.press("Undo")
        builder.wait(camera, lambda one: abs(one["values"].get("far", 100) - 100) < FAR)  # all of it is one step
        panel.press("Redo")
        builder.wait(camera, lambda one: abs(one["values"].get("far", 100) - far) < FAR)
        joint = builder.drop("Joint", [1, -1, 0])
        builder.set("value", 30)
        builder.wait(joint, lambda one: abs(one["values"].get("value", 0) - math.pi / 6) < FAR)
        fields.get_by_label("type", exact=True).select_option("prismatic")
        wait_until(page, lambda: fields.locator("[data-key=value]").inner_text() == "value m")
        builder.drop("Cuboid", [1, 1, 0])
        groups = page.locator("#properties summary").all_inner_texts()
        assert groups == ["look", "physics", "advanced"]
    cockpit.load("")


def label_and_drone(page):
    """Return the frames in which the drone's label stands, and in which its body is."""
    return page.evaluate("""['view/state', 'view/bodies'].map((layer) =>
        [...scene.tree.markers.values()].find((one) => one.userData.said.layer === layer)?.parent?.name)""")


def test_run_asks_before_it_leaves_a_new_scene_and_goes_back_to_it_without_a_text(cockpit, browser):
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
        wait_until(page, lambda: label_and_drone(page) == ["quadricopter/base_link"] * 2)
        page.select_option("#lesson", "tasks/hover")
        page.locator("#grade").wait_for()
        page.click("#run")
        page.get_by_role("button", name="Leave my scene").click()
        wait_until(page, lambda: page.inner_text("#said") == "started in the scene of the task hover")
        builder.row("Cuboid").wait_for(state="detached")
        wait_until(page, lambda: label_and_drone(page) == ["base_link"] * 2)
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
