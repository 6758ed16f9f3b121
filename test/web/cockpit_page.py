"""Helpers for the tests of the cockpit's page: opening the page, waiting, and the drone's state from its topics."""

import contextlib
import time

WAIT = 90_000  # ms; a browser without a GPU is slow


class Drone:
    """The latest state of a drone from its topics; needs an initialised ROS node."""

    def __init__(self, name="drone"):
        import rospy
        from geometry_msgs.msg import TwistStamped
        from nav_msgs.msg import Odometry
        from std_msgs.msg import String

        self.place = self.command = self.pose = self.velocity = self.state = None
        self.odometry_count = 0  # received odometry messages
        self.flight_steps = {}  # place and command (vx, vy, vz, wz) of each step, by stamp
        rospy.Subscriber(f"/{name}/odom", Odometry, self._on_odometry)
        rospy.Subscriber(f"/{name}/command", TwistStamped, self._on_command)
        rospy.Subscriber(f"/{name}/state", String, lambda message: setattr(self, "state", message.data))

    def _on_odometry(self, message):
        self.pose, self.velocity = message.pose.pose, message.twist.twist.linear
        at = self.pose.position
        self.place = at.x, at.y, at.z
        self.odometry_count += 1
        self.flight_steps.setdefault(message.header.stamp, {})["place"] = self.place

    def _on_command(self, message):
        linear, turn = message.twist.linear, message.twist.angular.z
        self.command = linear.x, linear.z, turn
        self.flight_steps.setdefault(message.header.stamp, {})["command"] = (linear.x, linear.y, linear.z, turn)


def _page_texts(page):
    """Return the texts that the page shows, for the message of a failed test."""
    texts = {name: page.locator(f"#{name}").all_inner_texts() for name in ("notice", "said", "status", "flown")}
    script = page.locator("#script").all_inner_texts() and page.input_value("#script")
    return {**texts, "script": script, "text": page.locator("#text .cm-content").all_inner_texts()[:1]}


def wait_until(page, condition, seconds=90):
    """Wait until `condition()` is true, while the browser runs."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, f"the condition is not true after {seconds} s; {_page_texts(page)}"
        page.wait_for_timeout(50)


def wait_for(page, expression, *argument):
    """Wait until an expression is true in a page. Our pages' policy blocks Playwright's `wait_for_function`."""
    wait_until(page, lambda: page.evaluate(expression, *argument))


def let_time_pass(page, milliseconds):
    """Wait until the page's clock has advanced by `milliseconds`, so that the page's timers have expired."""
    wait_for(page, "end => Date.now() >= end", page.evaluate("Date.now()") + milliseconds)


def wait_for_steps(page, drone, steps):
    """Wait until the simulation has made `steps` more steps of 0.05 s."""
    steps_before = len(drone.flight_steps)
    wait_until(page, lambda: len(drone.flight_steps) >= steps_before + steps)


# Project a point of the world to the page, px.
PROJECT = """point => {
    const at = scene.camera.position.clone().set(...point).project(scene.camera);
    const box = scene.canvas.dom.getBoundingClientRect();
    return [box.left + (at.x + 1) / 2 * box.width, box.top + (1 - at.y) / 2 * box.height];
}"""
# Return the world position of a point of a handle's part: 0 to 2 are the arrows along x, y and z, 6 is the ring.
TIP = "([part, at]) => scene.gizmo.parts[part].localToWorld(scene.camera.position.clone().set(...at)).toArray()"

STARTED = "localStorage['drone_sim/started'] = 'true';"  # the start page has been answered


@contextlib.contextmanager
def initial_state_restored(cockpit):
    """Restart the pilot now and at the end; at the end also delete the scripts that were written in between."""
    cockpit.start_afresh()
    cockpit.scripts.mkdir(exist_ok=True)
    before = set(cockpit.scripts.glob("*"))
    yield
    cockpit.start_afresh()
    for script in set(cockpit.scripts.glob("*")) - before:
        script.unlink()


@contextlib.contextmanager
def open_page(cockpit, browser, init="", started=True, **options):
    """Yield the page in a browser context of its own, with the flown script in the editor.

    `init` is JavaScript that runs before the page's own; `started`: the start page has been answered before; `options`
    are passed to the browser context.
    """
    context = browser.new_context(**{"viewport": {"width": 1280, "height": 720}, **options})
    context.add_init_script((STARTED if started else "") + init)
    page = context.new_page()
    page.set_default_timeout(WAIT)
    page.troubles = []
    page.on("pageerror", lambda error: page.troubles.append(str(error)))
    page.on("console", lambda message: message.type == "error" and page.troubles.append(message.text))
    page.goto(cockpit.address, wait_until="commit")
    ready(page)
    wait_until(page, lambda: cockpit.drone.place is not None)
    yield page
    assert page.troubles == [], str(page.troubles)
    context.close()


class Panel:
    """The toolbar and panels of a page, operated as a user does."""

    def __init__(self, page):
        self.page = page

    def field(self, label):
        return self.page.get_by_label(label, exact=True)

    @property
    def message(self):
        return self.page.inner_text("#notice span")

    @property
    def status(self):
        return self.page.inner_text("#status").lower()

    def press(self, button, answer=""):
        """Press a button, and wait until the message line contains `answer`."""
        self.page.get_by_role("button", name=button, exact=True).click()
        if answer:
            self.wait_for(answer)

    def wait_for(self, answer):
        wait_until(self.page, lambda: answer in self.message)

    def show(self, name):
        button = self.page.locator("#rail").get_by_role("button", name=name, exact=True)
        if button.get_attribute("aria-expanded") != "true":
            button.click()

    def choose(self, field, choice):
        """Choose an entry of a list."""
        self.field(field).select_option(label=choice)


def ready(page):
    """Wait until the editor has its script, the scene its canvas, and the panels the state of the simulation."""
    wait_for(page, "document.querySelector('.cm-content')?.textContent.length > 100")
    page.locator("#scene canvas").wait_for()
    wait_for(page, "document.querySelector('#status').dataset.is !== 'no simulation'")


def switch_camera(page, name="front"):
    Panel(page).show("Cameras")
    page.locator("#camera-list").get_by_label(name, exact=True).click()


# Hold the page's requests with this name until goOn() is called.
HOLD = """name => {
    const send = WebSocket.prototype.send, held = [];
    WebSocket.prototype.send = function (text) {
        if (!String(text).includes(`"ask":"${name}"`)) return send.call(this, text);
        held.push(() => send.call(this, text));
    };
    window.goOn = () => {
        WebSocket.prototype.send = send;
        for (const sendNow of held) sendNow();
    };
    window.isHeld = () => held.length > 0;
}"""


@contextlib.contextmanager
def requests_held(page, name):
    """Hold the page's requests with this name until the end of the block, as a slow network does."""
    page.evaluate(HOLD, name)
    yield lambda: wait_for(page, "isHeld()")
    page.evaluate("goOn()")
