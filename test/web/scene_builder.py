"""The Edit panel of the cockpit's page, as somebody clicks it; tests and pictures build with it."""

from cockpit_page import PROJECT, Panel, wait_until

SELECTED = "scene.editing.objects.get(scene.editing.last)?.name ?? null"
# Names of an object, of what it hangs on, and where it is in that one's frame.
OBJECT = """name => {
    const { objects } = scene.editing;
    const one = objects.named(name);
    return one && { ...one, matrix: null, above: objects.get(one.parent)?.name ?? "" };
}"""
# Half way along the arrow in the direction of y, in the world.
ARROW = """() => {
    const { taken, controls } = scene.editing.handles, { camera } = scene;
    const at = taken.getWorldPosition(camera.position.clone());
    const near = Math.min(1.9 * Math.tan((Math.PI * camera.fov) / 360), 7);
    at.y += (at.distanceTo(camera.position) * near * controls.size) / 4 / 2;
    return at.toArray();
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
        self.page.get_by_role("button", name=which).click()  # "Scene file" has the file's name behind it
        self.page.get_by_role("menuitem", name=item).click()

    def new_scene(self):
        """Begin a scene of a floor alone, without what is not saved; wait until old cameras' pictures are gone."""
        page = self.page
        self.menu("Scene file", "New")
        sure = page.get_by_role("button", name="Throw them away")
        wait_until(page, lambda: sure.is_visible() or page.get_by_role("treeitem").count() == 1)
        if sure.is_visible():
            sure.click()
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

    def pull(self, pixels):
        """Drag what is selected by the arrow in the direction of y, so far to the right."""
        wait_until(self.page, lambda: self.page.evaluate("Boolean(scene.editing.handles.controls.object)"))
        x, y = self.page.evaluate(PROJECT, self.page.evaluate(ARROW))
        self.page.mouse.move(x, y)
        wait_until(self.page, lambda: self.page.evaluate("scene.editing.handles.controls.axis") == "Y")
        self.page.mouse.down()
        self.page.mouse.move(x + pixels, y, steps=5)
        self.page.mouse.up()

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

    def ask_to_save_as(self, name):
        self.menu("Scene file", "Save as …")
        self.page.get_by_label("Name", exact=True).fill(name)
        self.page.get_by_role("button", name="Save", exact=True).click()

    def save_as(self, name):
        self.ask_to_save_as(name)
        wait_until(self.page, lambda: self.page.inner_text("#scene-file") == name)
