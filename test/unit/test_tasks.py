"""The tasks of a course: lookup, descriptions, and the grades of solutions and of insufficient scripts.

`./dev.sh tasks` flies all of them on many seeds.
"""

import re
import runpy
from pathlib import Path

import pytest

from drone_sim.files.resources import package_path
from drone_sim.grading import flight, tasks
from drone_sim.grading import plan as plans
from drone_sim.run.simulation import Simulation

ALL = ("chase", "count", "formation", "gates", "gates_vision", "hover", "line", "pad", "stability", "steps")
SEED = 3
NOTHING = str(package_path() / "test" / "tasks" / "scripts" / "nothing.py")
STAGE_6 = str(package_path() / "docs" / "tutorial" / "6_ros.py")


def failed_criteria(task, script=None, seed=SEED):
    """Return the names of the criteria that a flight failed."""
    result = flight.grade(plans.read(tasks.find(task)), script, seed)
    assert result.error is None
    return {outcome.name for outcome in result.outcomes if not outcome.passed}


def test_a_task_is_found_by_its_name_its_folder_or_its_plan(tmp_path, monkeypatch):
    plan = package_path() / "tasks" / "hover" / "plan.yaml"
    monkeypatch.chdir(tmp_path)
    assert tasks.find("hover") == tasks.find(str(plan)) == tasks.find(str(plan.parent)) == plan
    (tmp_path / "hover").mkdir()
    (tmp_path / "hover" / "plan.yaml").touch()
    assert tasks.find("hover").resolve() == tmp_path / "hover" / "plan.yaml"  # the working directory comes first


def test_course_may_add_and_replace_tasks(tmp_path, monkeypatch):
    for name in ("hover", "waltz"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "plan.yaml").touch()
    monkeypatch.setenv("DRONE_SIM_TASKS", str(tmp_path))
    assert set(tasks.names()) == {*ALL, "waltz"}
    assert tasks.find("waltz") == tmp_path / "waltz" / "plan.yaml"
    assert tasks.find("hover") == tmp_path / "hover" / "plan.yaml", "it replaces the package's task"
    assert tasks.find("gates") == tasks.folder() / "gates" / "plan.yaml"


@pytest.mark.parametrize(
    "name, near",
    [("hovr", "near names are hover"), ("", "known are chase, count"), ("a/b", "known are"), ("x" * 9999, "known are")],
)
def test_unknown_task_is_reported_in_one_line(name, near):
    with pytest.raises(plans.PlanError) as error:
        tasks.find(name)
    assert near in str(error.value)
    assert len(str(error.value)) < 600
    assert "\n" not in str(error.value)


def test_every_task_is_listed_and_has_a_readme_with_valid_links():
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
    assert failed_criteria(task) == set()


@pytest.mark.parametrize("task", ["hover", "stability"])
def test_script_that_does_nothing_fails(task):
    assert failed_criteria(task, NOTHING)


@pytest.mark.parametrize("task, missed", [("hover", "place"), ("gates", "gates"), ("pad", "landed")])
def test_script_that_only_hovers_fails_the_main_criterion(task, missed):
    assert failed_criteria(task, "tutorial") == {missed}


@pytest.mark.parametrize("task", ["hover", "steps", "stability"])
def test_built_in_script_passes_the_tasks_with_commands(task):
    assert failed_criteria(task, "") == set()


def test_last_tutorial_stage_lacks_only_the_guard():
    missed = failed_criteria("stability", STAGE_6)
    assert "guard" in missed
    assert missed <= {"guard", "height again"}
    assert failed_criteria("steps", STAGE_6) == set()


def test_every_mistake_of_broken_scripts_is_possible(tmp_path):
    """`./dev.sh tasks broken` flies them. Each replaces a text of the tutorial, which may have changed."""
    broken = runpy.run_path(str(package_path() / "test" / "tasks" / "broken.py"))
    scripts = [case.script for case in broken["cases"](tmp_path) if case.script]
    assert len({Path(script).read_text() for script in scripts}) == len(scripts) == 6 + len(broken["MISTAKES"])


def test_position_of_the_pad_depends_on_the_seed():
    plan = plans.read(tasks.find("pad"))
    places = set()
    for seed in (1, 2, 2):
        simulation = Simulation(plan.parameters(seed), script=NOTHING)
        objects = simulation.context.objects
        places.add(tuple(objects.matrix(objects.handle("Pad7"))[3:12:4]))
        simulation.close()
    assert len(places) == 2
