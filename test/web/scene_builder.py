"""Operates the Edit panel of the cockpit's page, for tests and pictures."""

from cockpit_page import PROJECT, Panel, wait_until

SELECTED = "scene.editing.objects.get(scene.editing.last)?.name ?? null"
# Return the description of an object by its name; `above` is the name of its parent.
OBJECT = """name => {
    const { objects } = scene.editing;
    const one = objects.named(name);
    return one && { ...one, matrix: null, above: objects.get(one.parent)?.name ?? "" };
}"""
# Return the middle of the arrow along y, in the world.
ARROW = """() => {
    const { taken, controls } = scene.editing.handles, { camera } = scene;
    const at = taken.getWorldPosition(camera.position.clone());
    const near = Math.min(1.9 * Math.tan((Math.PI * camera.fov) / 360), 7);
    at.y += (at.distanceTo(camera.position) * near * controls.size) / 4 / 2;
    return at.toArray();
}"""


class Builder:
    """The Edit panel, operated as a user does."""

    def __init__(self, page):
        self.page = page
        Panel(page).show("Edit")
        self.row("Floor").wait_for()

    def row(self, name):
        return self.page.get_by_role("treeitem").filter(has=self.page.get_by_text(name, exact=True)).first

    def object(self, name):
        return self.page.evaluate(OBJECT, name)

    def wait(self, name, condition):
        """Wait until the condition is true for the description of an object; return the description."""
        wait_until(self.page, lambda: (entry := self.object(name)) is not None and condition(entry))
        return self.object(name)

    def menu(self, button, item):
        self.page.get_by_role("button", name=button).click()  # the button "Scene file" also shows the file's name
        self.page.get_by_role("menuitem", name=item).click()

    def new_scene(self):
        """Open a new scene with only a floor, discard unsaved edits, and wait until old camera pictures are closed."""
        page = self.page
        self.menu("Scene file", "New")
        discard = page.get_by_role("button", name="Throw them away")
        wait_until(page, lambda: discard.is_visible() or page.get_by_role("treeitem").count() == 1)
        if discard.is_visible():
            discard.click()
            wait_until(page, lambda: page.get_by_role("treeitem").count() == 1)
        wait_until(page, lambda: page.locator(".picture").count() == 0)

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

    def set_parent(self, name, parent):
        self.row(name).drag_to(self.row(parent))
        self.wait(name, lambda entry: entry["above"] == parent)

    def drop(self, model, point):
        """Drag a model from the shelf to a point of the world; return the name of the new object, which is selected."""
        self.page.get_by_role("searchbox", name="Find a model").fill(model)
        self.page.locator("#models").get_by_role("button", name=model, exact=True).hover()
        self.page.mouse.down()
        self.page.mouse.move(*self.page.evaluate(PROJECT, point), steps=4)
        before = self.page.evaluate(SELECTED)
        self.page.mouse.up()
        wait_until(self.page, lambda: self.page.evaluate(SELECTED) not in (before, None))
        return self.page.evaluate(SELECTED)

    def drag_along_y(self, pixels):
        """Drag the selected object by its arrow along y, to the right by `pixels`."""
        wait_until(self.page, lambda: self.page.evaluate("Boolean(scene.editing.handles.controls.object)"))
        x, y = self.page.evaluate(PROJECT, self.page.evaluate(ARROW))
        self.page.mouse.move(x, y)
        wait_until(self.page, lambda: self.page.evaluate("scene.editing.handles.controls.axis") == "Y")
        self.page.mouse.down()
        self.page.mouse.move(x + pixels, y, steps=5)
        self.page.mouse.up()

    def write(self, relative="World", **numbers):
        """Enter numbers of the position and orientation: X, Y, Z (m), Alpha, Beta, Gamma (degrees)."""
        self.page.get_by_label("Relative to").select_option(label=relative)
        for name, value in numbers.items():
            field = self.page.get_by_label(f"{name}, {'m' if len(name) == 1 else 'degrees'}", exact=True)
            field.fill(str(value))
            field.press("Enter")

    def set(self, key, value):
        field = self.page.locator("#properties").get_by_label(key, exact=True)
        field.fill(str(value))
        field.press("Enter")

    def ask_to_save_as(self, name):
        self.menu("Scene file", "Save as …")
        self.page.get_by_label("Name", exact=True).fill(name)
        self.page.get_by_role("button", name="Save", exact=True).click()

    def save_as(self, name):
        self.ask_to_save_as(name)
        wait_until(self.page, lambda: self.page.inner_text("#scene-file") == name)
