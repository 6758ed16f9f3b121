"""A student's first minutes at the cockpit, by clicks and keys alone: from the address to a graded task."""

import re

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy
from cockpit_page import Panel, initial_state_restored, let_time_pass, open_page, ready, wait_until

STAGES = ("1_thrust", "2_elevation", "3_yaw", "4_pitch", "5_roll", "6_ros", "7_camera", "8_gate")
GAIN = 'self.thrust = gain("thrust_gravity")'


@pytest.fixture(name="student")
def _student(cockpit, browser):
    """A page that is opened for the first time."""
    with initial_state_restored(cockpit):
        with open_page(cockpit, browser, started=False, viewport={"width": 1440, "height": 900}) as page:
            yield page
        rospy.set_param("/drone_sim/scene_file", "")  # lessons and tasks load their own scenes
        cockpit.call("load_scene")


def open_from_start_page(page, name):
    if not page.get_by_role("dialog", name="drone_sim").is_visible():
        page.click("#home")
    page.get_by_role("dialog", name="drone_sim").get_by_role("button", name=name).click()


def run(page, answer="started"):
    page.click("#run")
    wait_until(page, lambda: page.inner_text("#said").startswith(answer))


def type_into(page, place, keys, words):
    """Click into the line that contains `place`, press keys that move the cursor, and type the words."""
    page.locator("#text .cm-line", has_text=place).click()
    for key in keys:
        page.keyboard.press(key)
    page.keyboard.type(words)


def test_a_student_flies_fixes_a_script_debugs_it_and_tunes_a_gain(cockpit, student):
    open_from_start_page(student, "Just fly")
    wait_until(student, lambda: cockpit.drone.state == "flying")
    student.keyboard.down("w")
    wait_until(student, lambda: cockpit.drone.command[0] == 1.0)
    student.keyboard.up("w")
    wait_until(student, lambda: cockpit.drone.command[0] == 0.0)

    open_from_start_page(student, "Tutorial")
    wait_until(student, lambda: student.input_value("#script") == "tutorial/1_thrust.py")
    student.select_option("#lesson", label="Stage 6: the twist topic")
    wait_until(student, lambda: student.input_value("#script") == "tutorial/6_ros.py")
    wait_until(student, lambda: GAIN in student.inner_text("#text .cm-content"))
    type_into(student, GAIN, ["End", "Enter"], "prnt('hello')")
    wait_until(student, lambda: student.input_value("#script") == "mine/6_ros.py")
    run(student, "init, line 27: NameError")
    wait_until(student, lambda: "prnt" in "".join(student.locator("#text .cm-lintRange-error").all_inner_texts()))
    type_into(student, "prnt('hello')", ["End", "Shift+Home"], "sim.getObjectPosi")
    options = student.locator(".cm-tooltip-autocomplete li")
    wait_until(student, lambda: options.count() and options.first.inner_text().startswith("getObjectPosition"))
    let_time_pass(student, 100)  # for the first 75 ms of a completion, Enter starts a new line
    student.keyboard.press("Enter")
    student.keyboard.press("Home")
    student.keyboard.type("print('at', ")
    student.keyboard.press("End")
    student.keyboard.type("(self.d, -1)[2])")
    run(student)
    wait_until(student, lambda: re.search(r"at 0\.\d+", student.inner_text("#console")))
    assert student.locator("#text .cm-lintRange-error").count() == 0

    numbers = student.locator("#text .cm-lineNumbers .cm-gutterElement")
    numbers.filter(has_text=re.compile("^27$")).click()
    run(student, "paused at line 27")
    row = student.locator("#variables tr", has=student.locator("th", has_text=re.compile("^thrust$")))
    wait_until(student, lambda: row.count() and row.locator("td").first.inner_text() == "5.33")
    numbers.filter(has_text=re.compile("^27$")).click()
    student.locator("#toolbar").get_by_role("button", name="Start", exact=True).click()
    wait_until(student, lambda: Panel(student).status == "flying")

    panel = Panel(student)
    panel.show("Tune")
    field = panel.field("Kzref (m/s) per m")
    for value in ("2.5", "5"):  # and back, since another script of the drone uses it
        field.click()
        student.keyboard.press("Control+a")
        student.keyboard.type(value)
        student.keyboard.press("Enter")
        panel.wait_for(f"Kzref = {value}")
        assert field.input_value() == value


def test_every_stage_of_the_tutorial_flies_one_after_the_other(cockpit, student):
    open_from_start_page(student, "Tutorial")
    for stage in STAGES:
        wait_until(student, lambda stage=stage: student.input_value("#script") == f"tutorial/{stage}.py")
        wait_until(student, lambda: "Run" in student.inner_text("#lesson-text"))
        run(student)
        wait_until(student, lambda stage=stage: student.inner_text("#flown") == f"tutorial/{stage}.py")
        wait_until(student, lambda: cockpit.drone.state == "flying" and Panel(student).status == "flying")
        assert "error" not in student.inner_text("#console").lower()
        student.click("#after")
        if stage == "5_roll":  # the stability tests come next, with the same script
            wait_until(student, lambda: student.input_value("#lesson") == "stability-tests")
            student.click("#after")


def has_focus(page, element):
    return page.evaluate("one => document.activeElement?.matches(one)", element)


def test_keys_alone_lead_from_the_start_page_to_a_graded_task_and_its_replay(student):
    student.keyboard.press("Tab")
    student.keyboard.press("Enter")
    wait_until(student, lambda: has_focus(student, "#gallery-tasks button:first-child"))
    student.keyboard.press("Enter")
    wait_until(student, lambda: has_focus(student, "#lesson-body"))
    wait_until(student, lambda: student.input_value("#script") == "tasks/hover.py")
    student.locator("#start").wait_for(state="hidden")
    assert "solution" not in student.inner_text("#lesson-text").lower(), "the task offers no solution"
    student.keyboard.press("Tab")
    assert has_focus(student, "#grade")
    student.keyboard.press("Enter")
    wait_until(student, lambda: student.locator("#graded tr").count() > 1, 120)
    wait_until(student, lambda: has_focus(student, "#grade"))
    student.keyboard.press("Tab")
    assert has_focus(student, "#graded .seeds button:first-child")
    graded = student.inner_text("#graded")
    assert re.search(r"\d+(\.\d)? of \d+ points", graded) and "seed 2" in graded and "Try this" in graded
    check_replay_of_failure(student)
    student.locator("#graded a.when").first.click()
    student.locator("#replay").wait_for()
    run(student)
    student.locator("#replay").wait_for(state="hidden")
    with student.context.expect_page() as opened:
        student.get_by_role("link", name="Replay and plots of all flights").click()
    wait_until(opened.value, lambda: opened.value.locator("#stage[data-shown]").count())
    opened.value.close()
    student.click("#home")
    open_from_start_page(student, "Tasks")
    assert "your best: 3 of 6 points" in student.locator("#gallery-tasks button").first.inner_text()


def check_replay_of_failure(page):
    """Open the replay at the second of a failure, play it with a ghost in the scene, and close it, all with keys."""
    view = page.evaluate("scene.view.name")
    link = page.locator("#graded a.when").first
    link.press("Enter")
    slider = page.get_by_role("slider", name="Second of the flight")
    wait_until(page, lambda: slider.is_visible() and slider.evaluate("one => one === document.activeElement"))
    second = float(slider.input_value())
    assert second == pytest.approx(float(link.get_attribute("data-at")), abs=0.05)
    assert page.evaluate("scene.isShown({ layer: 'view/bodies', ns: 'drone' })") is False, "only the ghost is shown"
    position_before = page.evaluate("scene.replay.ghost.position.toArray()")
    slider.press("Home")
    assert page.evaluate("scene.replay.ghost.position.toArray()") != position_before
    assert page.inner_text("#replay-text") == "Replay, seed 0: 0.00 s"
    page.get_by_role("button", name="Play", exact=True).press("Enter")
    wait_until(page, lambda: float(slider.input_value()) > 0.3)
    page.keyboard.press("Escape")
    page.locator("#replay").wait_for(state="hidden")
    assert page.evaluate("scene.view.name") == view
    assert link.evaluate("one => one === document.activeElement")


def test_a_failing_script_is_graded_with_the_reason(student):
    open_from_start_page(student, "Tasks")
    student.locator("#gallery-tasks button").first.click()
    wait_until(student, lambda: student.input_value("#script") == "tasks/hover.py")
    student.locator("#text .cm-content").click()
    student.keyboard.press("Control+a")
    student.keyboard.insert_text("raise ValueError('of the script')\n")
    student.click("#grade")
    wait_until(student, lambda: "of the script" in student.inner_text("#graded"), 120)
    student.reload()
    wait_until(student, lambda: "of the script" in student.inner_text("#graded"))


# Ask for a lesson that does not exist, once, instead of the next one.
FAIL_A_LESSON = """() => {
    const send = WebSocket.prototype.send;
    WebSocket.prototype.send = function (text) {
        if (!String(text).includes('"ask":"lesson"')) return send.call(this, text);
        WebSocket.prototype.send = send;
        return send.call(this, text.replace("tasks/hover", "tasks/none"));
    };
}"""


def test_a_lesson_that_failed_opens_no_script_and_can_be_chosen_again(student):
    open_from_start_page(student, "Tutorial")
    wait_until(student, lambda: student.input_value("#script") == "tutorial/1_thrust.py")
    student.evaluate(FAIL_A_LESSON)
    open_from_start_page(student, "Tasks")
    student.locator("#gallery-tasks button").first.click()
    wait_until(student, lambda: "none" in student.locator("#flies").text_content())
    assert student.input_value("#script") == "tutorial/1_thrust.py"
    open_from_start_page(student, "Tasks")
    student.locator("#gallery-tasks button").first.click()
    wait_until(student, lambda: student.input_value("#script") == "tasks/hover.py")


def test_the_browsers_back_button_returns_to_the_edited_script(student):
    student.click("#start-close")
    student.select_option("#script", "tutorial/3_yaw.py")
    wait_until(student, lambda: "Stage 3" in student.inner_text("#text .cm-content"))
    type_into(student, "Stage 3", ["Home"], "# mine\n")
    student.goto("about:blank")
    student.go_back(wait_until="commit")
    ready(student)
    wait_until(student, lambda: student.input_value("#script") == "mine/3_yaw.py")
    wait_until(student, lambda: student.inner_text("#text .cm-content").startswith("# mine"))
    assert not student.locator("#start-page").is_visible()
    student.go_forward()
    student.go_back(wait_until="commit")
    ready(student)
    wait_until(student, lambda: student.inner_text("#text .cm-content").startswith("# mine"))
