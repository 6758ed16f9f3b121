"""The page shows the current state: pauses, errors, the flown script, the last edited script, and lost connections."""

import contextlib
import os
import re
import signal
import subprocess
import time

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from cockpit_page import STARTED, WAIT, initial_state_restored, let_time_pass, open_page, ready, wait_for, wait_until
from launched import free_port

STEPS = "def sysCall_actuation():\n    height = 1\n    again = 2\n"
TWO_SYNTAX_ERRORS = "def sysCall_init():\n    pass\n\n\nx = = 1\n" + "\n" * 22 + "def sysCall_sensing(:\n    pass\n"


@pytest.fixture(name="desk", scope="module")
def _desk(cockpit, browser):
    """A page that the tests of this module share."""
    with initial_state_restored(cockpit), open_page(cockpit, browser, viewport={"width": 1440, "height": 900}) as page:
        yield page


def message(page):
    return page.inner_text("#said")


def text(page):
    return page.inner_text("#text .cm-content")


def replace_text(page, words):
    page.locator("#text .cm-content").click()
    page.keyboard.press("Control+a")
    page.keyboard.insert_text(words)


def open_file(cockpit, page, name, content):
    (cockpit.scripts / name).write_text(content)
    wait_until(page, lambda: page.locator(f"#script option[value='mine/{name}']").count())
    page.select_option("#script", f"mine/{name}")
    wait_until(page, lambda: content.split("\n")[0] in text(page))


def line_number(page, line):
    numbers = page.locator("#text .cm-lineNumbers .cm-gutterElement")
    return numbers.filter(has_text=re.compile(rf"^{line}$")).locator("visible=true")


def test_a_pause_ends_on_start_after_its_breakpoint_was_removed(cockpit, desk):
    open_file(cockpit, desk, "steps.py", STEPS)
    line_number(desk, 3).click()
    desk.click("#run")
    wait_until(desk, lambda: message(desk).startswith("paused at line 3"))
    assert desk.locator("#text .cm-paused").count() == 1 and desk.inner_text("#flying") == "is paused"
    line_number(desk, 3).click()
    rows = desk.locator("#variables-body tr")
    wait_until(desk, lambda: rows.count())
    desk.get_by_role("tab", name="Console").click()  # now no page shows the variables
    wait_until(desk, lambda: not rows.count())
    assert message(desk).startswith("paused at line 3"), "the script is still paused"
    desk.locator("#toolbar").get_by_role("button", name="Start", exact=True).click()
    wait_until(desk, lambda: not desk.locator("#text .cm-paused").count())
    wait_until(desk, lambda: "paused" not in message(desk) and desk.inner_text("#flying") == "flies")


def test_a_fixed_syntax_error_is_replaced_by_the_message_of_the_next_one(cockpit, desk):
    open_file(cockpit, desk, "wrong.py", TWO_SYNTAX_ERRORS)
    desk.click("#run")
    wait_until(desk, lambda: "not started, line 5: SyntaxError" in message(desk))
    replace_text(desk, TWO_SYNTAX_ERRORS.replace("= =", "="))
    wait_until(desk, lambda: "not started, line 28: SyntaxError" in message(desk))
    assert "wrong.py:28" in desk.inner_text("#console") and "wrong.py:5" not in desk.inner_text("#console")
    replace_text(desk, STEPS)
    wait_until(desk, lambda: message(desk) == "" and "wrong.py" not in desk.inner_text("#console"))


def test_a_failed_script_is_not_shown_as_flying(cockpit, desk):
    open_file(cockpit, desk, "bad.py", "def sysCall_actuation():\n    raise ValueError('of the script')\n")
    desk.click("#run")
    wait_until(desk, lambda: "actuation, line 2: ValueError: of the script" in message(desk))
    wait_until(desk, lambda: desk.inner_text("#flying") == "has failed")
    assert desk.inner_text("#status") == "Script failed" and desk.get_attribute("#flown", "data-is") == "failed"
    wait_until(desk, lambda: desk.inner_text("#why") == "1 warning")  # one, although node and vehicle report it
    open_file(cockpit, desk, "steps.py", STEPS)
    wait_until(desk, lambda: desk.inner_text("#flying") == "mine/bad.py has failed")
    assert message(desk).startswith("actuation, bad.py, line 2"), "the error names its file while another one is open"
    desk.click("#run")
    wait_until(desk, lambda: message(desk).startswith("started") and desk.inner_text("#flying") == "flies")


def test_an_error_box_is_complete_reachable_by_keys_and_closed_by_a_good_run(cockpit, desk):
    long_message = "; ".join(f"reason {number} why this does not work at all" for number in range(11))
    open_file(cockpit, desk, "long.py", f"def sysCall_init():\n    raise ValueError({long_message!r})\n")
    desk.click("#run")
    wait_until(desk, lambda: "reason 10" in message(desk))
    desk.locator("#toolbar").get_by_role("button", name="Restart", exact=True).click()
    wait_until(desk, lambda: "reason 10" in desk.inner_text("#notice"))
    box = desk.locator("#notice-text")
    assert box.evaluate("one => one.clientHeight > 5 * parseFloat(getComputedStyle(one).lineHeight)")
    for one in (box, desk.locator("#said")):
        assert not one.evaluate("one => one.scrollHeight > one.clientHeight + 1 && one.tabIndex !== 0"), "focusable"
    desk.locator("#notice button").focus()
    desk.keyboard.press("Escape")
    wait_until(desk, lambda: not desk.locator("#notice").is_visible())
    desk.locator("#toolbar").get_by_role("button", name="Restart", exact=True).click()
    wait_until(desk, lambda: "reason 10" in desk.inner_text("#notice"))
    open_file(cockpit, desk, "steps.py", STEPS)
    desk.click("#run")
    wait_until(desk, lambda: message(desk).startswith("started") and not desk.locator("#notice").is_visible())


def test_a_reload_opens_the_last_edited_script_at_its_cursor(cockpit, browser):
    cockpit.start_afresh()
    with open_page(cockpit, browser) as page:
        page.select_option("#script", "tutorial/1_thrust.py")
        wait_until(page, lambda: "Stage 1" in text(page))
        page.click("#run")  # so that the flown script is not one of another launch
        wait_until(page, lambda: page.inner_text("#flown") == "tutorial/1_thrust.py")
        page.select_option("#script", "tasks/hover.py")
        wait_until(page, lambda: "how far the wind" in text(page))
        page.locator("#text .cm-content").click()
        page.keyboard.press("Control+End")
        page.keyboard.type("# mine")
        wait_until(page, lambda: page.input_value("#script") == "mine/hover.py")
        wait_until(page, lambda: page.inner_text("#saved") == "saved as mine/hover.py")
        wait_for(page, "JSON.parse(localStorage['drone_sim/places'])['mine/hover.py']")
        for _ in range(2):
            page.reload()
            ready(page)
            wait_until(page, lambda: page.input_value("#script") == "mine/hover.py" and "# mine" in text(page))
            wait_until(page, lambda: page.locator("#lesson").input_value() == "tasks/hover")
        page.locator("#text .cm-content").focus()
        page.keyboard.type("!")
        wait_until(page, lambda: (cockpit.scripts / "hover.py").read_text().endswith("# mine!"))
        page.select_option("#script", "tasks/hover.py")
        wait_until(page, lambda: "# mine" not in text(page))
        page.reload()
        ready(page)
        wait_until(page, lambda: page.input_value("#script") == "mine/hover.py")
    (cockpit.scripts / "hover.py").unlink()


# ---- processes that do not answer


class Processes:
    """A master, a simulator and a cockpit, as processes that a test can freeze and end."""

    def __init__(self, home):
        self.home, self.port, self.processes = home, free_port(), {}
        master = free_port()
        ros_environment = {"ROS_MASTER_URI": f"http://localhost:{master}", "ROS_HOSTNAME": "localhost"}
        self.environment = {**os.environ, **ros_environment, "HOME": str(home), "ROS_HOME": str(home / ".ros")}
        self._start("master", "rosmaster", "--core", "-p", str(master))

    def start(self, name):
        """Start the simulator or the cockpit, as a user does in a terminal."""
        arguments = {"simulator": "__name:=drone_sim", "cockpit": f"_port:={self.port}"}
        self._start(name, "rosrun", "drone_sim", name, arguments[name])

    def _start(self, name, *command):
        self.processes[name] = subprocess.Popen(command, env=self.environment, stdout=subprocess.DEVNULL)

    def stop(self, name, signal_number=signal.SIGTERM):
        self.processes[name].send_signal(signal_number)
        self.processes.pop(name).wait(60)

    @contextlib.contextmanager
    def frozen(self, name):
        self.processes[name].send_signal(signal.SIGSTOP)
        try:
            yield
        finally:
            self.processes[name].send_signal(signal.SIGCONT)

    @property
    def key(self):
        return self.home / ".ros" / "drone_sim" / f"cockpit_{self.port}.key"

    @property
    def address(self):
        file = self.key.with_suffix(".txt")
        deadline = time.monotonic() + 60
        while not file.exists() or not file.read_text().endswith("\n"):
            assert time.monotonic() < deadline, "the cockpit did not start"
            time.sleep(0.1)
        return file.read_text().strip()


@pytest.fixture(name="own", scope="module")
def _own(tmp_path_factory):
    own = Processes(tmp_path_factory.mktemp("own"))
    own.start("simulator")
    own.start("cockpit")
    yield own
    for name in reversed(list(own.processes)):
        own.stop(name)


@pytest.fixture(name="tab")
def _tab(own, browser):
    """A page that may lose its connection: errors in its console are not checked."""
    context = browser.new_context(viewport={"width": 1440, "height": 900})
    context.add_init_script(STARTED)
    page = context.new_page()
    page.set_default_timeout(WAIT)
    page.goto(own.address, wait_until="commit")
    wait_until(page, lambda: is_alive(page))
    yield page
    context.close()


def banner(page):
    return page.inner_text("#banner") if page.locator("#banner").is_visible() else ""


def is_alive(page):
    return page.locator("#status").inner_text() == "Flying" and page.is_enabled("#run") and not banner(page)


def test_frozen_processes_are_reported_and_their_buttons_are_disabled(own, tab):
    with own.frozen("simulator"):
        wait_until(tab, lambda: banner(tab).startswith("No data from the simulator for "))
        assert all(tab.is_disabled(one) for one in ("#run", "#sim-pause", "#takeoff", "#speed"))
        assert tab.is_enabled("#more"), "the file menu needs only the cockpit"
        wait_until(tab, lambda: float(tab.locator("#scene").evaluate("one => getComputedStyle(one).opacity")) < 0.5)
    wait_until(tab, lambda: is_alive(tab))
    with own.frozen("cockpit"):
        wait_until(tab, lambda: re.match(r"No data from the cockpit for \d+ s", banner(tab)))
        assert tab.is_disabled("#run") and tab.is_disabled("#more")
        wait_until(tab, lambda: banner(tab).startswith("No connection to the cockpit for "))
    wait_until(tab, lambda: is_alive(tab))


def test_a_killed_simulator_is_reported_and_tabs_reconnect_to_the_next_cockpit(own, tab):
    """The tab still has the cookie of the previous cockpit."""
    requested_urls = []
    tab.on("request", lambda one: requested_urls.append(one.url))
    own.stop("simulator", signal.SIGKILL)
    wait_until(tab, lambda: banner(tab) == "The simulator has ended: start it again.")
    assert tab.is_disabled("#run") and tab.inner_text("#flying") == ""
    own.stop("cockpit")
    wait_until(tab, lambda: banner(tab).startswith("No connection to the cockpit for "))
    own.start("simulator")
    own.start("cockpit")
    wait_until(tab, lambda: is_alive(tab))
    assert len([url for url in requested_urls if "/return?" in url]) == 1
    tab.reload()
    wait_until(tab, lambda: is_alive(tab))


def test_a_tab_with_an_outdated_key_is_refused_and_seldom_retries(own, tab):
    requested_urls = []
    tab.on("request", lambda one: requested_urls.append(one.url))
    own.stop("cockpit")
    own.key.unlink()
    own.start("cockpit")
    wait_until(tab, lambda: "Open the address" in banner(tab))
    requested_urls.clear()
    let_time_pass(tab, 5000)
    assert len(requested_urls) <= 1, "a refused page retries at most once in 5 s"
