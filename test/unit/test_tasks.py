"""The tasks of a course: found by name, told by a text, passed by their solutions, and by nothing less.

`./dev.sh tasks` flies all of them on many seeds.
"""

import re

import pytest

from drone_sim.files.resources import package_path
from drone_sim.grading import flight, tasks
from drone_sim.grading import plan as plans
from drone_sim.run.simulation import Simulation

ALL = ("chase", "count", "formation", "gates", "gates_vision", "hover", "line", "pad", "stability", "steps")
SEED = 3
NOTHING = str(package_path() / "test" / "tasks" / "scripts" / "nothing.py")
STAGE_6 = str(package_path() / "docs" / "tutorial" / "6_ros.py")


def failed(task, script=None, seed=SEED):
    """Return the criteria that a flight failed, and what went wrong."""
    result = flight.grade(plans.read(tasks.find(task)), script, seed)
    assert result.error is None
    return {one.name for one in result.outcomes if not one.passed}


def test_a_task_is_found_by_its_name_its_folder_or_its_plan(tmp_path, monkeypatch):
    plan = package_path() / "tasks" / "hover" / "plan.yaml"
    monkeypatch.chdir(tmp_path)
    assert tasks.find("hover") == tasks.find(str(plan)) == tasks.find(str(plan.parent)) == plan
    (tmp_path / "hover").mkdir()
    (tmp_path / "hover" / "plan.yaml").touch()
    assert tasks.find("hover").resolve() == tmp_path / "hover" / "plan.yaml"  # one's own comes first


def test_a_course_has_tasks_of_its_own(tmp_path, monkeypatch):
    for name in ("hover", "waltz"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "plan.yaml").touch()
    monkeypatch.setenv("DRONE_SIM_TASKS", str(tmp_path))
    assert set(tasks.names()) == {*ALL, "waltz"}
    assert tasks.find("waltz") == tmp_path / "waltz" / "plan.yaml"
    assert tasks.find("hover") == tmp_path / "hover" / "plan.yaml", "it replaces the package's"
    assert tasks.find("gates") == tasks.folder() / "gates" / "plan.yaml"


@pytest.mark.parametrize(
    "name, near",
    [("hovr", "near names are hover"), ("", "known are chase, count"), ("a/b", "known are"), ("x" * 9999, "known are")],
)
def test_a_name_of_nothing_gets_one_line(name, near):
    with pytest.raises(plans.PlanError) as error:
        tasks.find(name)
    assert near in str(error.value)
    assert len(str(error.value)) < 600
    assert "\n" not in str(error.value)


def test_every_task_has_a_text_with_a_picture_and_a_line_in_the_list():
    assert tuple(tasks.names()) == ALL
    listed = (tasks.folder() / "README.md").read_text(encoding="utf-8")
    for name in ALL:
        folder = tasks.folder() / name
        text = (folder / "README.md").read_text(encoding="utf-8")
        assert f"({name}/README.md)" in listed
        for link in re.findall(r"\]\(([^)#]+)", text):
            assert (folder / link).exists(), f"{name}: {link}"
        assert plans.read(folder / "plan.yaml").name == name


@pytest.mark.parametrize("task", ["count", "formation", "gates", "gates_vision", "hover", "pad", "stability", "steps"])
def test_a_solution_passes(task):
    assert failed(task) == set()


@pytest.mark.parametrize("task", ["hover", "stability"])
def test_a_script_that_does_nothing_does_not(task):
    assert failed(task, NOTHING)


@pytest.mark.parametrize("task, missed", [("hover", "place"), ("gates", "gates"), ("pad", "landed")])
def test_a_script_that_only_hovers_misses_the_point(task, missed):
    assert failed(task, "tutorial") == {missed}


@pytest.mark.parametrize("task", ["hover", "steps", "stability"])
def test_the_built_in_script_passes_what_is_commanded(task):
    assert failed(task, "") == set()


def test_the_tutorials_last_stage_lacks_the_guard_alone():
    missed = failed("stability", STAGE_6)
    assert "guard" in missed
    assert missed <= {"guard", "height again"}
    assert failed("steps", STAGE_6) == set()


def test_the_pad_lies_elsewhere_with_another_seed():
    plan = plans.read(tasks.find("pad"))
    places = set()
    for seed in (1, 2, 2):
        simulation = Simulation(plan.parameters(seed), script=NOTHING)
        objects = simulation.context.objects
        places.add(tuple(objects.matrix(objects.handle("Pad7"))[3:12:4]))
        simulation.close()
    assert len(places) == 2
