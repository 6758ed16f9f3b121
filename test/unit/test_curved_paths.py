"""Paths of V-REP 3.x: curves through control points, frames, length, import from a file, and script functions."""

import itertools
import math
import struct

import numpy as np
import pytest
import yaml
from vrep_encoder import chunk, file, integers, numbers, scene_object

from drone_sim.importing import entries
from drone_sim.importing.main import main
from drone_sim.mechanics import frames
from drone_sim.mechanics.path import ControlledPath, PathRules
from drone_sim.mechanics.path_curves import ControlPoint, Station
from drone_sim.run import parameters

CLOSED, AUTOMATIC, FLAT, X_UP = 0x04, 0x08, 0x40, 0x800
CORNER = [(0, 0, 0), (1, 0, 0), (1, 1, 0)]
SQUARE = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)]
STRAIGHT_ON = (0.0, 0.0, 0.0, 1.0)


def about_z(angle):
    return (0.0, 0.0, math.sin(angle / 2), math.cos(angle / 2))


def path(points, turns=(), before=0.5, after=0.5, count=15, **rules):
    turns = turns or [STRAIGHT_ON] * len(points)
    stations = [Station(tuple(map(float, point)), turn) for point, turn in zip(points, turns)]
    controls = [ControlPoint(one, before, after, count) for one in stations]
    return ControlledPath(("Way",), "", None, frames.IDENTITY, controls, PathRules(**rules))


def quadratic(first, corner, last, count):
    """Return `count` points of a quadratic Bezier curve."""
    t = np.linspace(0, 1, count)[:, None]
    return (1 - t) ** 2 * np.array(first) + 2 * t * (1 - t) * np.array(corner) + t**2 * np.array(last)


def axes(m):
    """Return the x, y and z axis of a frame."""
    return [tuple(round(value, 9) + 0.0 for value in m[axis:11:4]) for axis in range(3)]


def length_of(points):
    return sum(math.dist(one, other) for one, other in itertools.pairwise(points))


# ---- points


def test_a_corner_becomes_a_bezier_curve_between_points_of_its_segments():
    curve = quadratic((1 - 0.8 / 2, 0, 0), (1, 0, 0), (1, 0.4 / 2, 0), 7)
    way = path(CORNER, before=0.8, after=0.4, count=7)
    assert np.allclose(way.points, [(0, 0, 0), *curve, (1, 1, 0)])
    assert way.length == pytest.approx(length_of([(0, 0, 0), *curve, (1, 1, 0)]))


def test_a_closed_path_has_a_curve_at_every_control_point():
    way = path(SQUARE, closed=True)
    assert way.points[0] == way.points[-1] == pytest.approx((0, 0.5, 0))
    assert len(way.points) == 4 * 15 + 1
    corner = length_of(quadratic((1.5, 0, 0), (2, 0, 0), (2, 0.5, 0), 15))
    assert way.length == pytest.approx(4 * (corner + 1))
    assert way.at(-0.5) == pytest.approx(way.at(way.length - 0.5))


@pytest.mark.parametrize("points", [[(0, 0, 0), (1, 0, 0), (3, 0, 0)], CORNER])
def test_without_a_bend_or_a_curve_the_points_are_the_control_points(points):
    is_straight = points is not CORNER
    assert path(points, count=15 if is_straight else 1).points == points


@pytest.mark.parametrize(("pauses", "count"), [((0, 2, 0), 15 + 2), ((0, 2, 2), 3), ((2, 2, 0), 3)])
def test_a_pause_that_differs_from_both_neighbours_creates_curve_points(pauses, count):
    points = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (2.0, 0.0, 0.0)]
    controls = [ControlPoint(Station(at, pause=pause), 0.5, 0.5, 15) for at, pause in zip(points, pauses)]
    assert len(ControlledPath(("Way",), "", None, frames.IDENTITY, controls, PathRules()).points) == count


def test_a_path_of_two_points_cannot_be_closed():
    assert path(CORNER[:2], closed=True).length == 1


def test_a_path_may_have_no_point_or_one_point():
    assert path([]).length == 0 and path([]).table == []
    with pytest.raises(ValueError, match="'Way' has no points"):
        path([]).at(0)
    assert frames.position(path([(1, 2, 3)]).at(7)) == (1, 2, 3)


# ---- length and data


@pytest.mark.parametrize(
    ("counts", "length"),
    [
        ("dl", 3),
        ("dac", 1),
        ("max_dl_dac", 3),
        ("dl_and_dac", 4),
        ("sqrt_dl2_and_dac2", math.sqrt(10)),
        ("dl_if_nonzero", 3),
        ("dac_if_nonzero", 1),
    ],
)
def test_the_length_depends_on_the_distance_method(counts, length):
    turns = [STRAIGHT_ON, about_z(2.0)]
    way = path([(0, 0, 0), (3, 0, 0)], turns, orientation="own", counts=counts, metres_per_radian=0.5)
    assert way.length == pytest.approx(length)


def test_a_turn_on_the_spot_adds_to_the_length():
    points, turns = [(0, 0, 0), (1, 0, 0), (1, 0, 0), (1, 2, 0)], [STRAIGHT_ON, STRAIGHT_ON, about_z(1.5), about_z(1.5)]
    way = path(points, turns, count=1, orientation="own", metres_per_radian=2.0)
    assert way.length == pytest.approx(1 + 3 + 2)
    assert frames.position(way.at(2.5)) == pytest.approx((1, 0, 0))
    assert frames.to_euler(way.at(2.5))[2] == pytest.approx(0.75)
    assert path(points, turns, count=1, orientation="own", counts="dl").length == pytest.approx(3)


def test_a_pause_adds_to_the_length():
    stations = [Station((0.0, 0.0, 0.0)), Station((1.0, 0.0, 0.0), pause=0.25)]
    rules = PathRules(metres_per_pause=4.0)
    way = ControlledPath(("Way",), "", None, frames.IDENTITY, [ControlPoint(one) for one in stations], rules)
    assert way.length == pytest.approx(1 + 1)


def test_a_path_returns_flags_and_channels_at_a_distance():
    stations = [
        Station((0.0, 0.0, 0.0), flags=1, channels=(0.0, 0.0, 0.0, 8.0)),
        Station((2.0, 0.0, 0.0), flags=2, channels=(1.0, 0.0, 0.0, 4.0)),
    ]
    way = ControlledPath(("Way",), "", None, frames.IDENTITY, [ControlPoint(one) for one in stations], PathRules())
    assert way.carried(0.5) == (1, pytest.approx([0.25, 0, 0, 7])) and way.carried(1.5)[0] == 2


# ---- frames


def test_the_z_axis_points_ahead_and_the_y_axis_out_of_the_bend():
    way = path(CORNER, count=1)
    x, y, z = axes(way.at(1))
    half = round(math.sqrt(0.5), 9)
    assert (x, y, z) == ((0, 0, 1), (half, -half, 0), (half, half, 0))
    assert [axes(way.at(along))[2] for along in (0, 2)] == [(1, 0, 0), (0, 1, 0)]


def test_a_straight_path_has_y_up_or_x_up_by_its_orientation():
    ends = [(0, 0, 0), (0, 3, 0)]
    assert axes(path(ends).at(1)) == [(-1, 0, 0), (0, 0, 1), (0, 1, 0)]
    assert axes(path(ends, orientation="x_up").at(1)) == [(0, 0, 1), (1, 0, 0), (0, 1, 0)]
    assert axes(path([(0, 0, 0), (0, 0, 1)]).at(0)) == [(0, -1, 0), (1, 0, 0), (0, 0, 1)]


def test_a_steeply_falling_path_has_y_up_as_in_vrep():
    _, y, z = axes(path([(0, 0, 0), (1, 0, -3)]).at(1))
    assert z == pytest.approx((math.sqrt(0.1), 0, -3 * math.sqrt(0.1)))
    assert y == pytest.approx((3 * math.sqrt(0.1), 0, math.sqrt(0.1)))


def test_the_y_axis_is_interpolated_between_two_bends():
    points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (1, 2, 0), (1, 2, 1)]
    _, y, z = axes(path(points, count=1).at(2))
    assert z == (0, 1, 0)
    assert y == pytest.approx((math.sqrt(0.5), 0, -math.sqrt(0.5)))


# ---- import and scripts


def mixed(double, single, numbers_before, whole, numbers_after, version):
    width, tag = ("d", double) if version >= 24 else ("f", single)
    form = f"<{len(numbers_before)}{width}{whole[0]}{len(numbers_after)}{width}"
    return chunk(tag, struct.pack(form, *numbers_before, whole[1], *numbers_after))


def control_point(position, turn=(1, 0, 0, 0), factors=(0.5, 0.5), count=15, speed=1.0, version=22):
    own = mixed("_t2", "At2", (*position, *turn, *factors), ("i", count), (speed,), version)
    own += numbers("_t3", "At3", 0.0, version=version)
    own += mixed("_t4", "At4", (), ("H", 3), (1.5, 0, 0, 0), version)
    return chunk("Pat", own + b"EOO")


def path_object(handle, name, *points, switches=AUTOMATIC, counts=5, version=22, along=0.25, **more):
    own = b"".join(points) + integers("At2", switches)
    own += mixed("_v3", "Av3", (0.0636620,), ("i", counts), (), version) + numbers("_v9", "Av9", 1.0, version=version)
    own += numbers("_m2", "Jm2", along, 0.01, 0.0, 0.0, version=version)
    return scene_object(
        "PAT", handle, name, own=chunk("Var", b"\0") + chunk("Ntp", own + b"EOO"), version=version, **more
    )


@pytest.fixture(name="imported")
def _imported(tmp_path, capsys):
    def import_scene(*chunks, version=22):
        model = tmp_path / "Way.ttt"
        model.write_bytes(file(*chunks, version=version))
        assert main([str(model), str(tmp_path / "out"), "--force"]) == 0
        import_scene.output = capsys.readouterr().out
        return tmp_path / "out" / "scene.yaml"

    return import_scene


@pytest.mark.parametrize("version", [16, 22, 24, 25])
def test_a_path_is_imported_with_its_control_points(imported, version):
    turn = (math.cos(0.5), 0, 0, math.sin(0.5))
    points = [
        control_point((0, 0, 0), version=version),
        control_point((1, 0, 0.5), turn, (0.9, 0.2), 9, version=version),
    ]
    switches = FLAT | CLOSED
    scene = imported(path_object(0, "Way", *points, switches=switches, counts=3, version=version), version=version)
    (entry,) = yaml.safe_load(scene.read_text())["objects"]
    carried = {"flags": 3, "channels": [1.5, 0, 0, 0]}
    curve = {"factors": [0.9, 0.2], "count": 9}
    assert entry["control_points"] == [
        {"position": [0, 0, 0], **carried},
        {"position": [1, 0, 0.5], "turn": pytest.approx([0, 0, math.sin(0.5), math.cos(0.5)]), **curve, **carried},
    ]
    rest = {key: value for key, value in entry.items() if key != "control_points"}
    assert rest == {
        "name": "Way",
        "kind": "curved_path",
        "closed": True,
        "flat": True,
        "orientation": "own",
        "counts": "dl_and_dac",
        "along": 0.25,
        "position": [0, 0, 0],
    }
    assert "Way: " not in imported.output


def test_the_velocity_profile_is_reported_as_not_imported(imported):
    imported(path_object(0, "Way", control_point((0, 0, 0), speed=0.5), control_point((1, 0, 0))))
    assert "Way: a path: its velocity profile is not imported" in imported.output


def test_a_path_with_too_many_curve_points_is_imported_with_fewer(imported, monkeypatch):
    monkeypatch.setattr(entries, "MAX_LINE", 10_000)
    points = [control_point((index % 2, index, 0), count=100) for index in range(150)]
    scene = imported(path_object(0, "Way", *points))
    (entry,) = yaml.safe_load(scene.read_text())["objects"]
    assert len(entry["control_points"]) == 150 and entry["control_points"][7]["count"] == 66
    assert "Way: a path: its curves are drawn with fewer points" in imported.output
    parameters.load({"scene_file": str(scene)})


@pytest.mark.parametrize("place", [math.nan, 1e9])
def test_a_control_point_with_an_invalid_position_is_left_out(imported, place):
    points = [control_point(point) for point in ((0, 0, 0), (place, 0, 0), (3, 0, 0))]
    scene = imported(path_object(0, "Way", *points))
    (entry,) = yaml.safe_load(scene.read_text())["objects"]
    assert [one["position"] for one in entry["control_points"]] == [[0, 0, 0], [3, 0, 0]]
    assert "Way: a path: 1 of its control points are not finite" in imported.output


FOLLOW = """
if (sim_call_type==sim_childscriptcall_initialization) then
    path=simGetObjectHandle('Way')
    length=simGetPathLength(path)
    simSetFloatSignal('length',length)
    simSetFloatSignal('begins',simGetPathPosition(path))
    p=simGetPositionOnPath(path,0.5)
    simSetFloatSignal('middle',p[1])
    e=simGetOrientationOnPath(path,0.5)
    simSetFloatSignal('beta',e[2])
    simSetPathPosition(path,99)
    simSetFloatSignal('position',simGetPathPosition(path))
    flags,channels=simGetDataOnPath(path,0.5)
    simSetFloatSignal('data',flags+channels[1])
    near=simGetClosestPositionOnPath(path,{5,0,9})
    simSetFloatSignal('near',near)
    simCutPathCtrlPoints(path,-1,0)
    simSetFloatSignal('empty',simGetPathLength(path))
    data={0,0,5,0,0,0,1,0,1,0.5,0.5, 3,0,5,0,0,0,1,0,1,0.5,0.5, 3,4,5,0,0,0,1,0,1,0.5,0.5}
    simInsertPathCtrlPoints(path,1,0,3,data)
    simSetFloatSignal('triangle',simGetPathLength(path))
    simCutPathCtrlPoints(path,2,1)
    simSetFloatSignal('cut',simGetPathLength(path))
    made=simCreatePath(-1,{1,sim_distcalcmethod_dac,0},{0.01,0.5,1})
    simInsertPathCtrlPoints(made,0,0,1,{0,0,0,0,0,0,1,0,15,0.5,0.5})
    simInsertPathCtrlPoints(made,0,1,1,{0,0,9,0,0,0,1,0,15,0.5,0.5})
    simSetFloatSignal('made',simGetPathLength(made))
end
"""


def test_a_3x_script_can_read_and_change_a_path(imported, new_simulation):
    points = [control_point(point) for point in ((0, 0, 0), (4, 0, 0), (8, 0, 0))]
    scene = imported(path_object(0, "Way", *points, at=(1, 0, 2)))
    simulation = new_simulation({"scene_file": str(scene), "vehicles": {"drone": {}}}, steps=1, lua=FOLLOW)
    expected = {"length": 8, "begins": 0.25, "middle": 5, "beta": math.pi / 2}
    expected |= {"position": 8, "data": 4.5, "near": 0.5, "empty": 0, "triangle": 12, "cut": 3, "made": 0}
    assert {name: simulation.context.signals.get(float, name) for name in expected} == pytest.approx(expected)


ALONG = """
function threadFunction()
    path=simGetObjectHandle('Way')
    box=simCreateDummy(0.1)
    simSetIntegerSignal('box',box)
    simFollowPath(box,path,3,0.5,VELOCITY)
    simSetFloatSignal('took',simGetSimulationTime())
end
simSetThreadSwitchTiming(200)
threadFunction()
"""


@pytest.mark.parametrize(("velocity", "end"), [(2.0, 9.0), (-2.0, 1.0)])
def test_an_object_follows_a_path_to_its_end_or_its_beginning(imported, new_simulation, velocity, end):
    points = [control_point(point) for point in ((0, 0, 0), (4, 0, 0), (8, 0, 0))]
    scene = imported(path_object(0, "Way", *points, at=(1, 0, 2)))
    values, along = {"scene_file": str(scene), "vehicles": {"drone": {}}}, ALONG.replace("VELOCITY", str(velocity))
    simulation = new_simulation(values, lua=along)
    places = []
    for _ in range(60):
        simulation.step()
        box = simulation.context.signals.get(int, "box")
        places.append(frames.position(simulation.context.objects.matrix(box))[0] if box is not None else 0.0)
    assert places[-1] == pytest.approx(end)
    assert simulation.context.signals.get(float, "took") == pytest.approx(2.0, abs=0.15)
    assert abs(places[20] - 5) == pytest.approx(2 * 20 * 0.05, abs=0.25)
