"""The page says what is true now: pauses, errors, what flies, what was edited last, and whether anything answers."""

import contextlib
import os
import re
import signal
import subprocess
import time

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from cockpit_page import STARTED, WAIT, left_as_found, let_pass, open_page, ready, wait_for, wait_until
from launched import free_port

STEPS = "def sysCall_actuation():\n    height = 1\n    again = 2\n"
WRONG = "def sysCall_init():\n    pass\n\n\nx = = 1\n" + "\n" * 22 + "def sysCall_sensing(:\n    pass\n"


@pytest.fixture(name="desk", scope="module")
def _desk(cockpit, browser):
    """A page that these tests share."""
    with left_as_found(cockpit), open_page(cockpit, browser, viewport={"width": 1440, "height": 900}) as page:
        yield page


def said(page):
    return page.inner_text("#said")


def text(page):
    return page.inner_text("#text .cm-content")


def write(page, words):
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


def test_a_pause_ends_though_its_breakpoint_is_gone(cockpit, desk):
    open_file(cockpit, desk, "steps.py", STEPS)
    line_number(desk, 3).click()
    desk.click("#run")
    wait_until(desk, lambda: said(desk).startswith("paused at line 3"))
    assert desk.locator("#text .cm-paused").count() == 1 and desk.inner_text("#flying") == "is paused"
    line_number(desk, 3).click()
    rows = desk.locator("#variables-body tr")
    wait_until(desk, lambda: rows.count())
    desk.get_by_role("tab", name="Console").click()  # no page shows the variables now
    wait_until(desk, lambda: not rows.count())
    assert said(desk).startswith("paused at line 3"), "it still is"
    desk.locator("#toolbar").get_by_role("button", name="Start", exact=True).click()
    wait_until(desk, lambda: not desk.locator("#text .cm-paused").count())
    wait_until(desk, lambda: "paused" not in said(desk) and desk.inner_text("#flying") == "flies")


def test_a_mended_syntax_error_is_not_said_any_more_and_the_next_one_is(cockpit, desk):
    open_file(cockpit, desk, "wrong.py", WRONG)
    desk.click("#run")
    wait_until(desk, lambda: "not started, line 5: SyntaxError" in said(desk))
    write(desk, WRONG.replace("= =", "="))
    wait_until(desk, lambda: "not started, line 28: SyntaxError" in said(desk))
    assert "wrong.py:28" in desk.inner_text("#console") and "wrong.py:5" not in desk.inner_text("#console")
    write(desk, STEPS)
    wait_until(desk, lambda: said(desk) == "" and "wrong.py" not in desk.inner_text("#console"))


def test_a_script_that_has_failed_does_not_fly(cockpit, desk):
    open_file(cockpit, desk, "bad.py", "def sysCall_actuation():\n    raise ValueError('of the script')\n")
    desk.click("#run")
    wait_until(desk, lambda: "actuation, line 2: ValueError: of the script" in said(desk))
    wait_until(desk, lambda: desk.inner_text("#flying") == "has failed")
    assert desk.inner_text("#status") == "Script failed" and desk.get_attribute("#flown", "data-is") == "failed"
    wait_until(desk, lambda: desk.inner_text("#why") == "1 warning")  # though the node and its vehicle say it
    open_file(cockpit, desk, "steps.py", STEPS)
    wait_until(desk, lambda: desk.inner_text("#flying") == "mine/bad.py has failed")
    assert said(desk).startswith("actuation, bad.py, line 2"), "the error is of another file now"
    desk.click("#run")
    wait_until(desk, lambda: said(desk).startswith("started") and desk.inner_text("#flying") == "flies")


def test_an_error_box_shows_all_of_it_is_reached_by_keys_and_goes_with_a_good_run(cockpit, desk):
    long = "; ".join(f"reason {number} why this does not work at all" for number in range(11))
    open_file(cockpit, desk, "long.py", f"def sysCall_init():\n    raise ValueError({long!r})\n")
    desk.click("#run")
    wait_until(desk, lambda: "reason 10" in said(desk))
    desk.locator("#toolbar").get_by_role("button", name="Restart", exact=True).click()
    wait_until(desk, lambda: "reason 10" in desk.inner_text("#notice"))
    box = desk.locator("#notice-text")
    assert box.evaluate("one => one.clientHeight > 5 * parseFloat(getComputedStyle(one).lineHeight)")
    for one in (box, desk.locator("#said")):
        assert not one.evaluate("one => one.scrollHeight > one.clientHeight + 1 && one.tabIndex !== 0"), "by keys, too"
    desk.locator("#notice button").focus()
    desk.keyboard.press("Escape")
    wait_until(desk, lambda: not desk.locator("#notice").is_visible())
    desk.locator("#toolbar").get_by_role("button", name="Restart", exact=True).click()
    wait_until(desk, lambda: "reason 10" in desk.inner_text("#notice"))
    open_file(cockpit, desk, "steps.py", STEPS)
    desk.click("#run")
    wait_until(desk, lambda: said(desk).startswith("started") and not desk.locator("#notice").is_visible())


def test_a_reload_opens_what_was_edited_last_where_it_was(cockpit, browser):
    cockpit.start_afresh()
    with open_page(cockpit, browser) as page:
        page.select_option("#script", "tutorial/1_thrust.py")
        wait_until(page, lambda: "Stage 1" in text(page))
        page.click("#run")  # what flies is no other launch's script
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


# ---- what does not answer


class Processes:
    """A master, a simulator and a cockpit, each a process that a test may stop and end."""

    def __init__(self, home):
        self.home, self.port, self.running = home, free_port(), {}
        master = free_port()
        local = {"ROS_MASTER_URI": f"http://localhost:{master}", "ROS_HOSTNAME": "localhost"}
        self.environment = {**os.environ, **local, "HOME": str(home), "ROS_HOME": str(home / ".ros")}
        self._begin("master", "rosmaster", "--core", "-p", str(master))

    def begin(self, name):
        """Start the simulator or the cockpit, as a user does in a terminal."""
        arguments = {"simulator": "__name:=drone_sim", "cockpit": f"_port:={self.port}"}
        self._begin(name, "rosrun", "drone_sim", name, arguments[name])

    def _begin(self, name, *command):
        self.running[name] = subprocess.Popen(command, env=self.environment, stdout=subprocess.DEVNULL)

    def end(self, name, how=signal.SIGTERM):
        self.running[name].send_signal(how)
        self.running.pop(name).wait(60)

    @contextlib.contextmanager
    def frozen(self, name):
        self.running[name].send_signal(signal.SIGSTOP)
        try:
            yield
        finally:
            self.running[name].send_signal(signal.SIGCONT)

    @property
    def key(self):
        return self.home / ".ros" / "drone_sim" / f"cockpit_{self.port}.key"

    @property
    def address(self):
        file = self.key.with_suffix(".txt")
        until = time.monotonic() + 60
        while not file.exists() or not file.read_text().endswith("\n"):
            assert time.monotonic() < until, "the cockpit did not start"
            time.sleep(0.1)
        return file.read_text().strip()


@pytest.fixture(name="own", scope="module")
def _own(tmp_path_factory):
    own = Processes(tmp_path_factory.mktemp("own"))
    own.begin("simulator")
    own.begin("cockpit")
    yield own
    for name in reversed(list(own.running)):
        own.end(name)


@pytest.fixture(name="tab")
def _tab(own, browser):
    """A page that loses its connection, which is no trouble here."""
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


def test_what_is_frozen_is_told_and_its_buttons_are_disabled(own, tab):
    with own.frozen("simulator"):
        wait_until(tab, lambda: banner(tab).startswith("No data from the simulator for "))
        assert all(tab.is_disabled(one) for one in ("#run", "#sim-pause", "#takeoff", "#speed"))
        assert tab.is_enabled("#more"), "the files are the cockpit's"
        wait_until(tab, lambda: float(tab.locator("#scene").evaluate("one => getComputedStyle(one).opacity")) < 0.5)
    wait_until(tab, lambda: is_alive(tab))
    with own.frozen("cockpit"):
        wait_until(tab, lambda: re.match(r"No data from the cockpit for \d+ s", banner(tab)))
        assert tab.is_disabled("#run") and tab.is_disabled("#more")
        wait_until(tab, lambda: banner(tab).startswith("No connection to the cockpit for "))
    wait_until(tab, lambda: is_alive(tab))


def test_a_simulator_that_was_killed_is_told_and_the_next_cockpit_takes_its_tabs_back(own, tab):
    """The tab has the cookie of the cockpit before."""
    asked = []
    tab.on("request", lambda one: asked.append(one.url))
    own.end("simulator", signal.SIGKILL)
    wait_until(tab, lambda: banner(tab) == "The simulator has ended: start it again.")
    assert tab.is_disabled("#run") and tab.inner_text("#flying") == ""
    own.end("cockpit")
    wait_until(tab, lambda: banner(tab).startswith("No connection to the cockpit for "))
    own.begin("simulator")
    own.begin("cockpit")
    wait_until(tab, lambda: is_alive(tab))
    assert len([url for url in asked if "/return?" in url]) == 1
    tab.reload()
    wait_until(tab, lambda: is_alive(tab))


def test_a_key_that_is_not_the_tabs_lets_nobody_in_and_the_page_asks_seldom(own, tab):
    asked = []
    tab.on("request", lambda one: asked.append(one.url))
    own.end("cockpit")
    own.key.unlink()
    own.begin("cockpit")
    wait_until(tab, lambda: "Open the address" in banner(tab))
    asked.clear()
    let_pass(tab, 5000)
    assert len(asked) <= 1, "a page that is refused asks seldom"
