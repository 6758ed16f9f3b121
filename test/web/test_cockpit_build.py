"""The scene is built with the mouse: the clicks of the V-REP tutorial's first scene, saved, begun anew, and flown."""

import math
import os

import pytest
import yaml

pytest.importorskip("rospy", reason="needs ROS")

from cockpit_page import PROJECT, Panel, open_page, wait_for, wait_until
from launched import launched

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
SELECTED = "scene.editing.objects.get(scene.editing.last)?.name ?? null"
# Names of an object, of what it hangs on, and where it is in that one's frame.
OBJECT = """name => {
    const { objects } = scene.editing;
    const one = objects.named(name);
    return one && { ...one, matrix: null, above: objects.get(one.parent)?.name ?? "" };
}"""


class Builder:
    """The Edit panel, as somebody clicks it."""

    def __init__(self, page):
        self.page = page
        Panel(page).show("Edit")
        self.row("Floor").wait_for()

    def row(self, name):
        return self.page.get_by_role("treeitem").filter(has=self.page.get_by_text(name, exact=True)).first

    def object(self, name):
        return self.page.evaluate(OBJECT, name)

    def wait(self, name, is_so):
        """Wait until what the node tells of an object is so; return that."""
        wait_until(self.page, lambda: (one := self.object(name)) is not None and is_so(one))
        return self.object(name)

    def menu(self, which, item):
        self.page.get_by_role("button", name=which, exact=True).click()
        self.page.get_by_role("menuitem", name=item).click()

    def select(self, name):
        self.row(name).click()
        wait_until(self.page, lambda: self.page.inner_text("#selected") == name)

    def unfold(self, name):
        self.row(name).get_by_role("button", name="Unfold").click()

    def rename(self, before, after):
        self.row(before).dblclick()
        self.page.get_by_label(f"New name of {before}").fill(after)
        self.page.keyboard.press("Enter")
        self.row(after).wait_for()

    def hang(self, name, parent):
        self.row(name).drag_to(self.row(parent))
        self.wait(name, lambda one: one["above"] == parent)

    def drop(self, model, point):
        """Drag a model from the shelf to a point of the world; it is selected then."""
        self.page.get_by_role("searchbox", name="Find a model").fill(model)
        self.page.locator("#models").get_by_role("button", name=model, exact=True).hover()
        self.page.mouse.down()
        self.page.mouse.move(*self.page.evaluate(PROJECT, point), steps=4)
        before = self.page.evaluate(SELECTED)
        self.page.mouse.up()
        wait_until(self.page, lambda: self.page.evaluate(SELECTED) not in (before, None))
        return self.page.evaluate(SELECTED)

    def write(self, relative="World", **numbers):
        """Write numbers of the position and orientation: X, Y, Z (m), Alpha, Beta, Gamma (degrees)."""
        self.page.get_by_label("Relative to").select_option(label=relative)
        for name, value in numbers.items():
            field = self.page.get_by_label(f"{name}, {'m' if len(name) == 1 else 'degrees'}", exact=True)
            field.fill(str(value))
            field.press("Enter")

    def set(self, key, value):
        field = self.page.locator("#properties").get_by_label(key, exact=True)
        field.fill(str(value))
        field.press("Enter")

    def save_as(self, name):
        self.menu("Scene file", "Save as")
        self.page.get_by_label("Name", exact=True).fill(name)
        self.page.get_by_role("button", name="Save", exact=True).click()
        wait_until(self.page, lambda: self.page.inner_text("#scene-file") == name)


def near(one, position):
    return math.dist(one["position"], position) < FAR


def build(builder, script):
    """Click what the tutorial's sections "Our first drone scene" and "Game-like tracking camera" ask for."""
    builder.menu("Scene file", "New")
    wait_until(builder.page, lambda: builder.page.get_by_role("treeitem").count() == 1)
    builder.select("Floor")
    builder.set("size", 10)
    builder.rename(builder.drop("Quadricopter of V-REP", [0.5, 0.5, 0]), "Drone")
    builder.write(X=0, Y=0, Z=0.8)
    builder.set("script", script)
    builder.unfold("Drone")
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


def check(builder):
    """See that objects, names, parents and poses are as the tutorial asks."""
    assert builder.object("Floor")["values"]["size"] == 10
    assert math.dist(builder.object("Quadricopter_base")["pose"][:3], (0, 0, 0.8)) < 0.1
    assert builder.object("DronePosition") and builder.object("Drone")
    assert near(builder.wait("Track_base", lambda one: one["above"] == "Quadricopter_base"), (0, 0, 0))
    assert near(builder.wait("TrackCam", lambda one: one["above"] == "Track_base"), (-0.8, 0, 0.3))


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
