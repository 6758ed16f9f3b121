"""A task that can be handed in has a button for it, and says what was handed in."""

import os

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from cockpit_page import STARTED, ready, wait_until
from launched import launched

from drone_sim.grading import classroom


def handed_in(folder, line):
    return [file for file in folder.iterdir() if file.read_text().startswith(line)]


def test_a_changed_script_is_handed_in_and_again(cockpit, browser, tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_MASTER_URI", os.environ["ROS_MASTER_URI"])  # that of this process, afterwards
    monkeypatch.setenv("DRONE_SIM_HAND_IN", str(tmp_path))
    (tmp_path / "hover").mkdir()
    with launched() as course, browser.new_page() as page:
        page.add_init_script(STARTED)
        page.goto(course.address, wait_until="commit")
        ready(page)
        button, said = page.locator("#hand-in"), page.locator("#graded .handed-in")
        page.select_option("#lesson", "tasks/gates")
        wait_until(page, lambda: page.locator("#grade").is_visible())
        assert not button.is_visible(), "it has no folder"
        page.select_option("#lesson", "tasks/hover")
        wait_until(page, lambda: page.input_value("#script") == "tasks/hover.py")
        for line in ("# mine\n", "# better\n"):
            page.locator(".cm-content").press("Control+Home")
            page.keyboard.type(line)
            button.click()
            wait_until(page, lambda line=line: handed_in(tmp_path / "hover", line))
            (copy,) = handed_in(tmp_path / "hover", line)
            words = "mine/hover.py handed in", copy.stem.rpartition("+")[2]
            wait_until(page, lambda words=words: said.count() and all(word in said.inner_text() for word in words))


def test_a_course_sees_the_drone_and_sends_its_student_a_task_and_a_scene(cockpit, browser, tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_MASTER_URI", os.environ["ROS_MASTER_URI"])  # that of this process, afterwards
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
        assert not page.get_by_text("Open the scene").is_visible(), "the simulator would refuse it"
        wait_until(page, lambda: any(one["picture"] for one in classroom.reports(tmp_path).values()))
        (report,) = classroom.reports(tmp_path).values()
        assert (report["script"], report["status"]) == ("built-in/pilot.py", "flying")
        with context.new_page() as watcher:
            watcher.goto(page.url.split("?")[0] + "?watch", wait_until="commit")
            ready(watcher)
            hidden = "#sim-stop", "#editor", "#rail", "#start-page"
            assert not any(watcher.locator(part).is_visible() for part in hidden)
            watcher.keyboard.press("Enter")  # would end the flight
            watcher.get_by_text("you only watch").wait_for()
            assert page.locator("#status").get_attribute("data-is") == "flying"
