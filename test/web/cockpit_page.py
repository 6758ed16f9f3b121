"""What the tests of the cockpit's page share: a page that is opened, what the node says of the drone, and waiting."""

import contextlib
import time

WAIT = 30_000  # ms; a browser without a GPU is slow


class Drone:
    """What the node says of a drone; needs ROS, and a node that is initialised."""

    def __init__(self, name="drone"):
        import rospy
        from geometry_msgs.msg import TwistStamped
        from nav_msgs.msg import Odometry
        from std_msgs.msg import String

        self.place = self.command = self.pose = self.velocity = self.state = None
        self.flown = {}  # places and commands (vx, vy, vz, wz), by their stamps
        rospy.Subscriber(f"/{name}/odom", Odometry, self._on_odometry)
        rospy.Subscriber(f"/{name}/command", TwistStamped, self._on_command)
        rospy.Subscriber(f"/{name}/state", String, lambda message: setattr(self, "state", message.data))

    def _on_odometry(self, message):
        self.pose, self.velocity = message.pose.pose, message.twist.twist.linear
        at = self.pose.position
        self.place = at.x, at.y, at.z
        self.flown.setdefault(message.header.stamp, {})["place"] = self.place

    def _on_command(self, message):
        linear, turn = message.twist.linear, message.twist.angular.z
        self.command = linear.x, linear.z, turn
        self.flown.setdefault(message.header.stamp, {})["command"] = (linear.x, linear.y, linear.z, turn)


def wait_until(page, condition, seconds=30):
    """Wait, and let the browser go on."""
    until = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < until, "it did not come to pass"
        page.wait_for_timeout(50)


def wait_for(page, expression, *argument):
    """Wait until an expression is true in a page. Playwright's `wait_for_function` is one that our pages forbid."""
    wait_until(page, lambda: page.evaluate(expression, *argument))


@contextlib.contextmanager
def open_page(cockpit, browser, init="", scene_first=False, **options):
    """Give the page in a browser of its own, with the flown script in the editor.

    `init` is run in it before anything else; `scene_first`: the scene is there before the page's own script comes;
    `options` are of the browser's context.
    """
    context = browser.new_context(viewport={"width": 1000, "height": 500}, **options)
    context.add_init_script(init)
    page = context.new_page()
    page.set_default_timeout(WAIT)
    page.troubles = []
    page.on("pageerror", lambda error: page.troubles.append(str(error)))
    page.on("console", lambda message: message.type == "error" and page.troubles.append(message.text))
    held = []
    if scene_first:
        page.route("**/cockpit.js", lambda route: held.append(route))
    page.goto(cockpit.address, wait_until="commit")
    if scene_first:
        page.frame_locator("#scene").locator("canvas").first.wait_for()
        page.frames[1].wait_for_load_state()
        held.pop().continue_()
    ready(page)
    wait_until(page, lambda: cockpit.drone.place is not None)
    yield page
    assert page.troubles == []
    context.close()


class Panel:
    """The panel beside the scene, as a user reads and presses it."""

    def __init__(self, page):
        self.page = page
        self.scene = page.frame_locator("#scene")

    def field(self, label):
        """What stands beside a label; viser's text fields are not tied to theirs."""
        beside = f"//label[normalize-space()='{label}']/ancestor::div[following-sibling::div][1]/following-sibling::div"
        return self.scene.locator(f"xpath={beside}//*[self::input or self::textarea]").first

    @property
    def message(self):
        return self.scene.get_by_role("status").inner_text()

    @property
    def status(self):
        return self.field("Status").input_value()

    def press(self, button, answer=""):
        """Press a button, and wait until the panel answers so."""
        self.scene.get_by_role("button", name=button, exact=True).click()
        if answer:
            self.wait_for(answer)

    def wait_for(self, answer):
        wait_until(self.page, lambda: answer in self.message)

    def show(self, tab):
        self.scene.get_by_role("tab", name=tab).click()

    def choose(self, field, choice):
        """Choose something of a list."""
        self.field(field).click()
        self.scene.get_by_role("option", name=choice, exact=True).click()


def ready(page):
    """Wait until the editor has its script, and the scene a canvas."""
    wait_for(page, "document.querySelector('.cm-content')?.innerText.length > 100")
    page.frame_locator("#scene").locator("canvas").first.wait_for()


def switch_camera(page, name="drone/front"):
    """Switch a camera on, or off."""
    scene = page.frame_locator("#scene")
    scene.get_by_role("tab", name="Cameras").click()
    scene.get_by_label(name).click()
