"""Scripts and texts in the cockpit's page: a stage, a task in its scene, and edits that are never lost."""

import contextlib
import json

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy
from cockpit_page import STARTED, requests_held, wait_until

from drone_sim.files.resources import package_path

PILOT = "src/drone_sim/child_scripts/pilot.py"
DRAFT = "drone_sim/draft/mine/edited.py"


@contextlib.contextmanager
def editor_page(cockpit, browser):
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    context.add_init_script(STARTED)
    page = context.new_page()
    page.troubles = []
    page.on("pageerror", lambda error: page.troubles.append(str(error)))
    page.goto(cockpit.address)
    wait_until(page, lambda: text(page).strip())
    yield page
    assert page.troubles == []
    context.close()


@pytest.fixture(name="desk", scope="module")
def _desk(cockpit, browser):
    """A page that the tests of this module share; afterwards the pilot flies again and new scripts are deleted."""
    before = {path.name for path in cockpit.scripts.glob("*")}
    with editor_page(cockpit, browser) as page:
        yield page
        open_script(page, "built-in/pilot.py", "stops the propellers")
        page.click("#run")
        wait_until(page, lambda: message(page).startswith("started"))
    for path in cockpit.scripts.glob("*"):
        if path.name not in before:
            path.unlink()


def message(page):
    return page.inner_text("#said")


def text(page):
    return page.inner_text("#text .cm-content")


def open_script(page, script, words):
    page.select_option("#script", script)
    wait_until(page, lambda: words in text(page))


def write_at_the_end(page, words):
    page.locator("#text").click()
    page.keyboard.press("Control+End")
    page.keyboard.insert_text(words)


def test_a_stage_opens_with_its_text_and_leads_to_the_next_stage(desk):
    open_script(desk, "tutorial/1_thrust.py", "constant thrust")
    wait_until(desk, lambda: "A propeller blows particles" in desk.inner_text("#lesson-text"))
    assert desk.locator("#lesson-text math").count() > 3 and desk.locator("#lesson-text .tok-number").count() > 3
    wait_until(
        desk, lambda: desk.evaluate("[...document.querySelectorAll('#lesson-text img')].every(one => one.naturalWidth)")
    )
    assert desk.locator("#lesson-text a", has_text="Solution").count() == 2
    desk.click("#after")
    wait_until(desk, lambda: desk.input_value("#script").endswith("/2_elevation.py") and "zref" in text(desk))
    wait_until(desk, lambda: "You need two control laws" in desk.inner_text("#lesson-text"))
    desk.locator("#lesson-body").focus()
    desk.keyboard.down("ArrowDown")
    assert "-" not in desk.inner_text("#command"), "keys in the lesson do not fly the drone"
    desk.keyboard.up("ArrowDown")


def test_a_task_flies_in_its_scene_and_the_users_scene_returns_afterwards(cockpit, desk):
    before = rospy.get_param("/drone_sim/scene_file")
    open_script(desk, "tasks/hover.py", "how far the wind")
    wait_until(desk, lambda: "The wind blows with 2.7 m/s" in desk.inner_text("#flies"))
    desk.click("#run")
    wait_until(desk, lambda: message(desk) == "started in the scene of the task hover")
    wait_until(desk, lambda: cockpit.drone.place[2] > 1.1)
    assert rospy.get_param("/drone_sim/scene_file").endswith("tasks/hover.yaml")
    open_script(desk, "tutorial/2_elevation.py", "zref")
    desk.click("#run")
    wait_until(desk, lambda: "the launch" in message(desk))
    assert rospy.get_param("/drone_sim/scene_file") == before
    wait_until(desk, lambda: desk.inner_text("#flown") == "tutorial/2_elevation.py")


def test_an_error_mark_disappears_when_its_line_is_fixed(cockpit, desk):
    cockpit.scripts.mkdir(exist_ok=True)
    (cockpit.scripts / "fails.py").write_text("1 / 0\nx = 1\n")
    wait_until(desk, lambda: desk.locator("#script option[value='mine/fails.py']").count())
    open_script(desk, "mine/fails.py", "1 / 0")
    desk.click("#run")
    wait_until(desk, lambda: "ZeroDivisionError" in message(desk))
    assert desk.locator(".cm-lintRange-error").inner_text() == "1 / 0"
    write_at_the_end(desk, "y = 2")
    wait_until(desk, lambda: desk.locator(".cm-lintRange-error").count())
    desk.keyboard.press("Control+Home")
    desk.keyboard.type("#")
    assert not desk.locator(".cm-lintRange-error").count()


def test_the_help_button_shows_all_keys_and_a_link_to_the_manual(desk):
    desk.click("#help-open")
    assert "forward, back" in desk.inner_text("#sheet") and "find, replace" in desk.inner_text("#sheet")
    with desk.expect_popup() as opened:
        desk.click("#sheet a")
    wait_until(desk, lambda: "/manual/" in opened.value.url and opened.value.inner_text("body"))
    opened.value.close()
    desk.get_by_role("button", name="Close").click()
    assert not desk.is_visible("#sheet")


def test_a_file_changed_by_another_program_is_reported_and_both_texts_survive(cockpit, desk):
    open_script(desk, "tutorial/1_thrust.py", "constant thrust")
    write_at_the_end(desk, "# mine\n")
    wait_until(desk, lambda: desk.input_value("#script").startswith("mine/1_thrust"))
    file = cockpit.scripts / desk.input_value("#script").partition("/")[2]
    file.write_text(file.read_text().replace("# mine", "# theirs"))
    wait_until(desk, lambda: "# theirs" in text(desk) and "changed by another program" in message(desk))
    desk.locator("#text .cm-content").press("Control+z")
    wait_until(desk, lambda: "# mine" in file.read_text())
    desk.locator("#text .cm-content").press("Control+End")
    with requests_held(desk, "save"):
        desk.keyboard.insert_text("# not saved yet")
        file.write_text("# written meanwhile\n")
    desk.get_by_role("button", name="The other's").click()
    wait_until(desk, lambda: text(desk).startswith("# written meanwhile"))
    copy = cockpit.scripts / message(desk).rpartition("/")[2]
    assert copy != file and "# not saved yet" in copy.read_text() and file.read_text() == "# written meanwhile\n"
    open_script(desk, "built-in/pilot.py", "stops the propellers")
    desk.locator("#text .cm-content").press("Control+z")
    assert "stops the propellers" in text(desk), "each script has its own undo history"
    desk.click("#more")
    desk.get_by_role("menuitem", name="Save as").click()
    desk.keyboard.type("named")
    desk.keyboard.press("Enter")
    wait_until(desk, lambda: desk.input_value("#script") == "mine/named.py")
    assert (cockpit.scripts / "named.py").read_text() == (package_path() / PILOT).read_text()


def test_an_unsaved_draft_is_restored_after_a_reload(cockpit, desk, browser):
    cockpit.scripts.mkdir(exist_ok=True)
    (cockpit.scripts / "edited.py").write_text("first")
    with editor_page(cockpit, browser) as page:
        page.evaluate(
            f"localStorage[{json.dumps(DRAFT)}] = {json.dumps(json.dumps({'text': 'second', 'version': 'old'}))}"
        )
        page.reload()
        wait_until(page, lambda: page.is_visible("#question"))
        assert text(page) == "second"
        page.get_by_role("button", name="Mine").click()
        wait_until(page, lambda: (cockpit.scripts / "edited.py").read_text() == "second")
        assert (cockpit.scripts / "edited_2.py").read_text() == "first"
        wait_until(page, lambda: page.evaluate(f"localStorage[{json.dumps(DRAFT)}] === undefined"))


def test_each_script_has_its_own_scroll_position(desk):
    open_script(desk, "built-in/pilot.py", "stops the propellers")
    scroller = desk.locator("#text .cm-scroller")
    scroller.evaluate("one => one.scrollTo(60, 700)")
    for script, words in (("tasks/pad.py", "To begin with"), ("tutorial/4_pitch.py", "Stage 4")):
        open_script(desk, script, words)
        assert scroller.evaluate("one => [one.scrollTop, one.scrollLeft]") == [0, 0], script
    desk.select_option("#script", "built-in/pilot.py")
    wait_until(desk, lambda: scroller.evaluate("one => one.scrollTop") > 0)
    scroller.evaluate("one => one.scrollTo(0, 0)")


@pytest.mark.parametrize("number", ["5.33", "-1"])
def test_a_double_click_selects_a_whole_number(desk, number):
    open_script(desk, "tutorial/1_thrust.py", "Stage 1")
    digits = desk.locator("#text .cm-line", has_text=f" {number}").locator("span", has_text=number.lstrip("-")).last
    digits.dblclick()
    wait_until(desk, lambda: desk.evaluate("document.getSelection().toString()") == number)


# Choose a task, and a second task while the script of the first is being opened.
CHOOSE_TWICE = """async () => {
    const choice = document.querySelector("#lesson");
    const choose = (name) => {
        choice.value = name;
        choice.dispatchEvent(new Event("change"));
    };
    choose("tasks/gates");
    while (!document.querySelector("#lesson-text h1, #lesson-text h2")) await new Promise((done) => setTimeout(done));
    choose("tasks/hover");
}"""


def test_the_task_chosen_last_is_shown(opened):
    opened.evaluate(CHOOSE_TWICE)
    wait_until(opened, lambda: opened.input_value("#script") == "tasks/hover.py")
    wait_until(opened, lambda: opened.input_value("#lesson") == "tasks/hover")
