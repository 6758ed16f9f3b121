"""The tutorial in the cockpit: it needs no terminal, and names only controls of the page."""

import re

import pytest
from cockpit_controls import CONTROLS, KEYS
from tutorial_flights import DOCS, STAGES, TEXT, at, fly, flying, push

pytest.importorskip("rospy", reason="needs ROS")

from drone_sim.mechanics.state import Pose
from drone_sim.ros.cockpit.editor.lessons import Lessons

SECTIONS = {one.name: one for one in Lessons().all() if not one.task}
ALTERNATIVES = re.findall(r"<!-- browser:(.*?)-->", TEXT, re.DOTALL)
TERMINAL = r"rostopic|roslaunch|rosrun|rosservice|terminal|python3|Ctrl-C|dev\.sh|rviz|console\n|\d\$ |dynparam|<!--"


def test_browser_alternatives_are_closed_and_not_nested():
    marks = re.findall(r"<!-- (browser|end)", TEXT)
    assert marks == ["browser", "end"] * (len(marks) // 2) and len(marks) > 20


@pytest.mark.parametrize("name", SECTIONS)
def test_no_browser_section_mentions_a_terminal(name):
    assert re.findall(TERMINAL, SECTIONS[name].text, re.IGNORECASE) == []


@pytest.mark.parametrize("stage", STAGES)
def test_every_stage_mentions_the_run_button(stage):
    text = next(one.text for one in SECTIONS.values() if one.script == f"tutorial/{stage}.py")
    assert "**Run**" in text


def test_the_first_stage_starts_with_a_flight():
    text = SECTIONS["stage-1-constant-thrust"].text
    assert text.index("**Run**") < text.index("particles")


def test_the_text_names_exactly_the_listed_controls():
    controls_in_text = {one for text in ALTERNATIVES for one in re.findall(r"\*\*(.+?)\*\*", text)} - {"Exercise."}
    assert controls_in_text - KEYS <= set(CONTROLS)
    assert set(CONTROLS) <= controls_in_text, "CONTROLS has a control that no text names"


def test_browser_sections_show_printed_output_without_the_commands():
    text = SECTIONS["stage-2-elevation"].text
    assert "```text\n3.03 rad/s, damping ratio 0.91\n```" in text
    assert re.search(r"```text\nafter 11\.00 s: x 0\.000 .*\n +t \[s\] +z \[m\]", text)


def test_the_markdown_text_shows_commands_and_no_browser_alternatives():
    shown = re.sub(r"<!--.*?-->", "", TEXT, flags=re.DOTALL)
    assert "**Run**" not in shown and "roslaunch drone_sim drone.launch script:=docs/tutorial/6_ros.py" in shown


def test_each_stage_has_the_scene_of_its_command():
    assert SECTIONS["stage-4-pitch"].scene.endswith("config/scenes/empty.yaml")
    assert SECTIONS["stage-7-the-image-topic"].scene.endswith("docs/tutorial/7_scene.yaml")


def test_all_pictures_of_the_sections_exist():
    for picture in re.findall(r"\]\((pictures/[^)]+)\)", "".join(one.text for one in SECTIONS.values())):
        assert (DOCS / picture).is_file()


# ---- described actions have the described effect


def fly_tuned(stage, seconds, **gains):
    """Fly a stage with changed gains from the start, as after a change on the Tune panel and a restart."""
    with flying(stage) as simulation:
        tuning = simulation.child_scripts["drone"].tuning
        tuning.change({name: float(value) for name, value in gains.items()})
        return fly(simulation, seconds)


def test_a_push_makes_the_drone_of_stage_1_slide_at_0_2_m_s():
    with flying("1_thrust") as simulation:
        push(simulation.drone, (0.5, 0, 0))
        assert fly(simulation, 5).vx[-1] == pytest.approx(0.19, abs=0.01)


@pytest.mark.parametrize(("thrust", "way"), [(5.4, 1), (5.2, -1)])
def test_tuning_thrust_gravity_makes_the_drone_of_stage_1_rise_or_sink(thrust, way):
    assert way * (fly_tuned("1_thrust", 2, thrust_gravity=thrust).z[-1] - 0.8) > 0.05


def heights_after_drag(**gains):
    """Drag the drone of stage 2 down to 0.8 m, release it, and return its heights after that."""
    with flying("2_elevation") as simulation:
        fly(simulation, 6)
        simulation.child_scripts["drone"].tuning.change({name: float(value) for name, value in gains.items()})
        simulation.drone.body.hold()
        simulation.drone.body.move(Pose((0, 0, 0.8)))
        assert fly(simulation, 1).z[-1] == pytest.approx(0.8)
        simulation.drone.body.let_go()
        return fly(simulation, 8).z


def test_the_released_drone_of_stage_2_returns_and_swings_with_less_damping():
    heights = heights_after_drag()
    assert at(heights, 2) == pytest.approx(1.53, abs=0.02) and heights.max() < 1.55
    swinging = heights_after_drag(Dzref=0.5) - 1.53
    assert swinging.max() > 0.2 and (swinging[swinging.argmax() :]).min() < -0.1
    assert at(heights_after_drag(Kzref=1), 2) < 1.45


def test_a_smaller_dyaw_gives_a_slower_yaw_rate():
    assert at(fly_tuned("3_yaw", 4, Dyaw=0.2).wz, 1.4) < 0.7 * at(fly_tuned("3_yaw", 4).wz, 1.4)
