"""Handing in the script of a task, and what a course exchanges with its students."""

import os

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from cockpit_page import STARTED, ready, wait_until
from launched import launched

from drone_sim.grading import classroom


def find_copies(folder, line):
    return [file for file in folder.iterdir() if file.read_text().startswith(line)]


def test_a_changed_script_can_be_handed_in_twice(cockpit, browser, tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_MASTER_URI", os.environ["ROS_MASTER_URI"])  # restored after the test
    monkeypatch.setenv("DRONE_SIM_HAND_IN", str(tmp_path))
    (tmp_path / "hover").mkdir()
    with launched() as course, browser.new_page() as page:
        page.add_init_script(STARTED)
        page.goto(course.address, wait_until="commit")
        ready(page)
        button, notes = page.locator("#hand-in"), page.locator("#graded .handed-in")
        page.select_option("#lesson", "tasks/gates")
        wait_until(page, lambda: page.locator("#grade").is_visible())
        assert not button.is_visible(), "this task has no folder for it"
        page.select_option("#lesson", "tasks/hover")
        wait_until(page, lambda: page.input_value("#script") == "tasks/hover.py")
        for line in ("# mine\n", "# better\n"):
            page.locator(".cm-content").press("Control+Home")
            page.keyboard.type(line)
            button.click()
            wait_until(page, lambda line=line: find_copies(tmp_path / "hover", line))
            (copy,) = find_copies(tmp_path / "hover", line)
            words = "mine/hover.py handed in", copy.stem.rpartition("+")[2]
            wait_until(page, lambda words=words: notes.count() and all(word in notes.inner_text() for word in words))


def test_a_course_watches_its_student_and_sends_a_task_and_a_scene(cockpit, browser, tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_MASTER_URI", os.environ["ROS_MASTER_URI"])  # restored after the test
    monkeypatch.setenv(classroom.VARIABLE, str(tmp_path))
    (tmp_path / "reports").mkdir()
    classroom.tell_all(tmp_path, "Let us hover.", "hover")
    with launched() as course, browser.new_context() as context, context.new_page() as page:
        page.add_init_script(STARTED)
        page.goto(course.address, wait_until="commit")
        ready(page)
        page.get_by_text("Let us hover.").wait_for()
        page.click("text=Open hover")
        wait_until(page, lambda: page.input_value("#script") == "tasks/hover.py")
        assert not page.get_by_text("Let us hover.").is_visible()
        classroom.keep_scene(tmp_path, "wide.yaml", b"floor: {size: 31}\n")
        classroom.tell_all(tmp_path, "Fly here.", "", "wide.yaml")
        page.click("text=Open the scene wide")
        wait_until(page, lambda: page.input_value("#scene-choice") == "course/wide.yaml")
        assert not page.get_by_text("Fly here.").is_visible()
        (tmp_path / "scenes/bad.yaml").write_text("flor: {size: 31}\n")
        classroom.tell_all(tmp_path, "Well done.", "", "bad.yaml")
        page.get_by_text("Well done.").wait_for()
        assert not page.get_by_text("Open the scene").is_visible(), "an invalid scene is not offered"
        wait_until(page, lambda: any(one["picture"] for one in classroom.reports(tmp_path).values()))
        (report,) = classroom.reports(tmp_path).values()
        assert (report["script"], report["status"]) == ("built-in/pilot.py", "flying")
        with context.new_page() as watcher:
            watcher.goto(page.url.split("?")[0] + "?watch", wait_until="commit")
            ready(watcher)
            hidden = "#sim-stop", "#editor", "#rail", "#start-page"
            assert not any(watcher.locator(part).is_visible() for part in hidden)
            watcher.keyboard.press("Enter")  # would stop the flight of the student's page
            watcher.get_by_text("you only watch").wait_for()
            assert page.locator("#status").get_attribute("data-is") == "flying"
