"""The tutorial in the cockpit: no terminal is needed, and every control that it names is one of the page's."""

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


def test_alternatives_are_closed_and_none_is_within_another():
    marks = re.findall(r"<!-- (browser|end)", TEXT)
    assert marks == ["browser", "end"] * (len(marks) // 2) and len(marks) > 20


@pytest.mark.parametrize("name", SECTIONS)
def test_no_section_needs_a_terminal(name):
    assert re.findall(TERMINAL, SECTIONS[name].text, re.IGNORECASE) == []


@pytest.mark.parametrize("stage", STAGES)
def test_a_stage_says_how_to_fly_it_here(stage):
    text = next(one.text for one in SECTIONS.values() if one.script == f"tutorial/{stage}.py")
    assert "**Run**" in text


def test_the_first_stage_begins_with_a_flight():
    text = SECTIONS["stage-1-constant-thrust"].text
    assert text.index("**Run**") < text.index("particles")


def test_every_control_that_is_named_is_one_of_the_pages():
    named = {one for text in ALTERNATIVES for one in re.findall(r"\*\*(.+?)\*\*", text)} - {"Exercise."}
    assert named - KEYS <= set(CONTROLS)
    assert set(CONTROLS) <= named, "a control of the list that no text names"


def test_what_commands_print_stays_and_the_commands_go():
    text = SECTIONS["stage-2-elevation"].text
    assert "```text\n3.03 rad/s, damping ratio 0.91\n```" in text
    assert re.search(r"```text\nafter 11\.00 s: x 0\.000 .*\n +t \[s\] +z \[m\]", text)


def test_readers_on_paper_see_no_word_of_the_browsers():
    shown = re.sub(r"<!--.*?-->", "", TEXT, flags=re.DOTALL)
    assert "**Run**" not in shown and "roslaunch drone_sim drone.launch script:=docs/tutorial/6_ros.py" in shown


def test_the_scene_of_a_stage_is_still_that_of_its_command():
    assert SECTIONS["stage-4-pitch"].scene.endswith("config/scenes/empty.yaml")
    assert SECTIONS["stage-7-the-image-topic"].scene.endswith("docs/tutorial/7_scene.yaml")


def test_the_folder_of_the_text_has_its_pictures():
    for picture in re.findall(r"\]\((pictures/[^)]+)\)", "".join(one.text for one in SECTIONS.values())):
        assert (DOCS / picture).is_file()


# ---- what it tells to do has the effect that is told


def fly_tuned(stage, seconds, **gains):
    """Fly a stage with other gains from the start, as Tune and a restart give them."""
    with flying(stage) as simulation:
        tuning = simulation.child_scripts["drone"].tuning
        tuning.change({name: float(value) for name, value in gains.items()})
        return fly(simulation, seconds)


def test_a_click_on_the_drone_of_stage_1_lets_it_slide_at_0_2_m_s():
    with flying("1_thrust") as simulation:
        push(simulation.drone, (0.5, 0, 0))
        assert fly(simulation, 5).vx[-1] == pytest.approx(0.19, abs=0.01)


@pytest.mark.parametrize(("thrust", "way"), [(5.4, 1), (5.2, -1)])
def test_a_slider_lets_the_drone_of_stage_1_rise_and_sink(thrust, way):
    assert way * (fly_tuned("1_thrust", 2, thrust_gravity=thrust).z[-1] - 0.8) > 0.05


def dragged_down(**gains):
    """Return the heights after the drone of stage 2 has been dragged to 0.8 m and let go."""
    with flying("2_elevation") as simulation:
        fly(simulation, 6)
        simulation.child_scripts["drone"].tuning.change({name: float(value) for name, value in gains.items()})
        simulation.drone.body.hold()
        simulation.drone.body.move(Pose((0, 0, 0.8)))
        assert fly(simulation, 1).z[-1] == pytest.approx(0.8)
        simulation.drone.body.let_go()
        return fly(simulation, 8).z


def test_let_go_the_drone_of_stage_2_comes_back_and_less_damping_lets_it_swing():
    heights = dragged_down()
    assert at(heights, 2) == pytest.approx(1.53, abs=0.02) and heights.max() < 1.55
    swinging = dragged_down(Dzref=0.5) - 1.53
    assert swinging.max() > 0.2 and (swinging[swinging.argmax() :]).min() < -0.1
    assert at(dragged_down(Kzref=1), 2) < 1.45


def test_a_smaller_dyaw_needs_longer():
    assert at(fly_tuned("3_yaw", 4, Dyaw=0.2).wz, 1.4) < 0.7 * at(fly_tuned("3_yaw", 4).wz, 1.4)
