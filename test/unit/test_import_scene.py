"""A file of V-REP's becomes a scene that flies here, with its own masses, places and scripts."""

import logging
import math
import struct
from pathlib import Path

import numpy as np
import pytest
import yaml
from vrep_encoder import chunk, container, file, integers, mesh, numbers, scene_object, script, shape, text, weight
from vrep_quadricopter import PROPELLER, quadricopter

from drone_sim.files import mesh_files
from drone_sim.importing.main import main
from drone_sim.mechanics import frames, urdf
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation
from drone_sim.scene.entry import Place
from drone_sim.vrep_files.model import VrepFileError
from drone_sim.vrep_files.reading import read

HOVER = """
function sysCall_init()
    for i = 1, 4 do
        local body = sim.getObjectHandle('Quadricopter_propeller_respondable'..i)
        sim.setScriptSimulationParameter(sim.getScriptAssociatedWithObject(body), 'particleVelocity', 5.331)
    end
end
"""


@pytest.fixture
def imported(tmp_path, capsys):
    """Import a file of these chunks; return what the scene file says, and leave its path in `imported.scene`."""

    def do(*chunks, suffix=".ttt", **given):
        path = tmp_path / f"Thing{suffix}"
        path.write_bytes(file(*chunks, **given))
        assert main([str(path), str(tmp_path / "out"), "--force"]) == 0
        do.said = capsys.readouterr().out
        do.scene = tmp_path / "out" / "scene.yaml"
        return yaml.safe_load(do.scene.read_text())

    return do


def objects(content):
    return {one["name"]: one for one in content["objects"]}


# ---- objects


def test_shapes_in_their_tree(imported):
    sphere = shape(
        1,
        "Ball",
        mesh("sphere", (0.2, 0.2, 0.2)),
        parent=0,
        at=(0, 0, 1),
        dynamic=True,
        wrapper=weight(0.5, (0.01, 0.02, 0.03), (0, 0, 0.05)),
        alias="ball",
    )
    box = shape(0, "Box", mesh(size=(1, 2, 3)), at=(5, 0, 0), respondable=False, base=chunk("Lar", b"\x00\x01"))
    found = objects(imported(box, sphere))
    assert found["Box"] | {"color": 0} == {
        "name": "Box",
        "shape": "box",
        "size": [1.0, 2.0, 3.0],
        "color": 0,
        "respondable": False,
        "visible": False,
        "position": [5.0, 0.0, 0.0],
    }
    assert found["Ball"]["alias"] == "ball" and found["Ball"]["size"] == [0.1] and found["Ball"]["mass"] == 0.5
    assert found["Ball"]["inertia"] == {"moments": [0.005, 0.01, 0.015], "position": [0.0, 0.0, 0.05]}
    assert found["Ball"]["position"] == [5.0, 0.0, 1.0] and "parent" not in found["Ball"], "the tree does not weld"


def test_a_compound_keeps_its_parts_and_what_is_no_simple_form_is_a_mesh(imported):
    cabin = shape(0, "Cabin", mesh(size=(1, 1, 1), at=(0, 0, 2)), mesh("cylinder", (2, 2, 5)), at=(9, 9, 9))
    found = objects(imported(cabin, shape(1, "Egg", mesh("sphere", (1, 2, 3)))))
    assert found["Cabin"]["parts"][0]["position"] == [0.0, 0.0, 2.0]
    assert found["Cabin"]["parts"][1]["shape"] == "cylinder" and found["Cabin"]["parts"][1]["size"] == [1.0, 5.0]
    assert found["Egg"]["shape"] == "mesh"
    assert (imported.scene.parent / found["Egg"]["file"]).read_text().count("\nf ") == 1


RED, GREEN, BLUE, GREY = (255, 0, 0), (0, 255, 0), (0, 0, 255), (9, 9, 9)
IMAGE = np.array([[RED, GREEN], [BLUE, GREY]], np.uint8)  # the bottom row first, as in the file
_IMAGE = chunk("Gon", text("tiles.jpg")) + chunk("Img", IMAGE.tobytes())
TEXTURE = chunk("TEX", integers("Ipa", 77, 2, 2) + _IMAGE + b"EOO")
AS_IS = struct.pack("<7d", 1, 0, 0, 0, 0, 0, 0)


def cover(*more, number=77, way=0, scaling=(1.0, 1.0)):
    ob = chunk("_ob", struct.pack("<2i2d", number, way, *scaling))
    return chunk("Toj", ob + chunk("_rc", AS_IS) + b"".join(more) + b"EOO")


@pytest.mark.parametrize(
    "covered, corners",
    [
        (cover(chunk("Ftc", struct.pack("<6f", 0, 0, 1, 0, 0.25, 1))), [[0, 0], [1, 0], [0.25, 1]]),
        (cover(scaling=(2.0, 4.0)), [[0.5, 0.5], [1, 0.5], [0.5, 0.75]]),
        (cover(way=3), [[0.5, 0.5], [1.5, 0.5], [0.5, 1.5]]),
    ],
    ids=["as the file says", "seen along z", "on a cube"],
)
def test_a_mesh_is_covered_with_its_texture(imported, covered, corners):
    """Of a triangle (0, 0, 0), (1, 0, 0), (0, 1, 0)."""
    leaf = objects(imported(TEXTURE, shape(0, "Leaf", mesh("none", more=covered))))["Leaf"]
    assert leaf["shape"] == "mesh" and "color" not in leaf
    (part,) = mesh_files.read(str(imported.scene.parent / leaf["file"]))
    assert part.texture.tolist() == IMAGE[::-1].tolist()
    assert np.allclose(part.uv[part.faces[0]], corners)
    assert np.allclose(part.vertices[part.faces[0]], [(0, 0, 0), (1, 0, 0), (0, 1, 0)])


@pytest.mark.parametrize(
    "covered",
    [cover(number=78), cover(way=1), cover(chunk("Ftc", struct.pack("<6f", 0, 0, math.nan, 0, 0, 1)))],
    ids=["no such texture", "round a cylinder", "not finite"],
)
def test_what_covers_a_mesh_in_another_way_is_left_out(imported, covered):
    leaf = objects(imported(TEXTURE, shape(0, "Leaf", mesh("none", more=covered))))["Leaf"]
    (part,) = mesh_files.read(str(imported.scene.parent / leaf["file"]))
    assert part.texture is None and "color" in leaf


def test_a_texture_that_is_cut_is_one_line():
    cut = chunk("TEX", integers("Ipa", 77, 2, 2) + chunk("Img", bytes(11)) + b"EOO")
    with pytest.raises(VrepFileError, match=r"^TEX: a texture of 2 x 2 px in 11 bytes$"):
        read(file(cut))


def test_joints_and_what_hangs_on_them(imported):
    own = integers("Jtt", 10) + numbers("_rt", "Prt", 0.5) + numbers("_mr", "Pmr", -1, 3) + chunk("Va9", b"\0")
    content = imported(scene_object("JNT", 0, "Hinge", own=own), shape(1, "Door", mesh(), parent=0, at=(1, 0, 0)))
    found = objects(content)
    assert found["Hinge"] == {
        "name": "Hinge",
        "kind": "joint",
        "type": "revolute",
        "limits": [-1.0, 2.0],
        "value": 0.5,
        "position": [0.0, 0.0, 0.0],
    }
    assert found["Door"]["parent"] == "Hinge"
    loaded = parameters.load({"scene_file": str(imported.scene)})
    simulation = Simulation(loaded, started=False)
    door = simulation.context.objects.handle("Door")
    place = simulation.context.objects.matrix(door)
    simulation.close()
    assert np.allclose(place[3::4], [np.cos(0.5), np.sin(0.5), 0], atol=1e-6)


def test_a_path_of_4_x_is_a_path(imported):
    corners = [(0, 0, 1), (2, 0, 1), (2, 2, 1)]
    turns = [(0.0, 0.0, 0.0, 1.0), (0.0, 0.6, 0.0, 0.8), (1.0, 0.0, 0.0, 0.0)]
    content = struct.pack("<21d", *(number for both in zip(corners, turns) for part in both for number in part))
    blocks = [(b"CONF", b"abc"), (b"PATH", content)]
    data = chunk("Cda", b"".join(chunk("Cdt", text(name) + text(block)) for name, block in blocks) + b"EOO")
    track = scene_object("DMY", 0, "Track", base=data, own=numbers("_y2", "Dy2", 0.01))
    assert objects(imported(track))["Track"] == {
        "name": "Track",
        "kind": "path",
        "points": [list(map(float, corner)) for corner in corners],
        "turns": list(map(list, turns)),
        "position": [0.0, 0.0, 0.0],
    }
    loaded = parameters.load({"scene_file": str(imported.scene)})
    path = loaded.scene.objects[0].make(Place(("Track",), "Track", None, frames.IDENTITY), None)
    assert struct.pack("<21d", *path.table) == content


def test_the_floor_the_step_and_gravity(imported):
    flat = shape(1, "Floor_part", mesh(size=(2, 2, 0.1)), parent=0)
    chunks = [shape(0, "ResizableFloor_5_25", mesh(size=(1, 1, 1))), flat]
    moon = chunk("DYN", chunk("En3", struct.pack("<i3fi", 0, 0, 0, -1.62, 0)))
    content = imported(*chunks, moon, chunk("SIM", integers("Spi", 4)))
    assert content == {"time_step": 0.01, "gravity": -1.62, "floor": {"size": 2.0}, "vehicles": {}, "objects": []}
    loaded = parameters.load({"scene_file": str(imported.scene)})
    assert (loaded.time_step, loaded.sub_steps, loaded.gravity) == (0.01, 2, -1.62)
    with pytest.raises(
        parameters.ParameterError, match=r"time_step = 0\.01: a simulation that runs with 0\.05 s goes on"
    ):
        parameters.load().in_scene(str(imported.scene))


def test_nobody_flies_in_a_file_without_a_quadricopter_unless_that_is_asked_for(imported, tmp_path):
    ball = shape(1, "Ball", mesh("sphere", (0.2, 0.2, 0.2)), at=(0, 0, 2), dynamic=True, wrapper=weight(1.0))
    imported(ball, script(1, "sim.setFloatSignal('height', sim.getObjectPosition(sim.getObject('/Ball'), -1)[3])"))
    scene = {"scene_file": str(imported.scene)}
    simulation = Simulation(parameters.load(scene))
    for _ in range(20):
        simulation.step()
    assert not simulation.vehicles
    assert simulation.scene.things()["Ball"].matrix()[11] == pytest.approx(0.1, abs=0.01), "on the floor"
    assert simulation.context.signals.get(float, "height") == 2.0
    simulation.save_scene(tmp_path / "saved.yaml")
    simulation.restore(simulation.snapshot())
    assert simulation.set_vehicles({"guest": {"position": [1, 0, 1]}}) == (["guest"], [])
    simulation.step()
    assert simulation.drone.name == "guest"
    assert simulation.set_vehicles({}) == ([], ["guest"])
    simulation.close()
    assert parameters.load({"scene_file": str(tmp_path / "saved.yaml")}).fleet == ()
    assert [one.name for one in parameters.load({**scene, "vehicles": 1}).fleet] == ["drone1"]
    with pytest.raises(parameters.ParameterError, match=r"scene\.yaml: no vehicle flies there \(vehicles: {}\)"):
        parameters.load(scene).first  # noqa: B018


def test_what_cannot_be_brought_is_said_object_by_object(imported):
    own = scene_object("PAT", 0, "Way"), scene_object("GRH", 1, "Graph"), scene_object("DMY", 2, "Drone")
    imported(*own, script(2, "x = 1", kind=6), script(2, "y = 1", switches=10))
    listed = (imported.scene.parent / "IMPORT.txt").read_text()
    for line in (
        "Way: a path: only its place is brought",
        "Drone: is called Drone_2 here",
        "Drone: its customization script is not brought",
    ):
        assert line in listed and line in imported.said
    assert "No quadricopter is in the file: none flies, unless `vehicles` says so" in imported.said


def test_scripts_lie_on_their_objects(imported):
    lamp = scene_object("DMY", 3, "Lamp", base=chunk("Lsp", integers("Par", 0)[:0]))
    content = imported(lamp, script(3, "-- é\nfunction sysCall_init() end", parameters=[("on", "true"), ("n", "3")]))
    assert content["scripts"] == [{"object": "Lamp", "script": "Lamp.lua", "parameters": {"on": True, "n": 3.0}}]
    assert (imported.scene.parent / "Lamp.lua").read_text() == "-- é\nfunction sysCall_init() end\n"


# ---- quadricopters


def test_a_quadricopter_is_a_vehicle_with_its_own_masses_and_flies(imported):
    """V-REP's own: its built-in law hovers at the velocity at which V-REP's does."""
    content = imported(*quadricopter(code=HOVER), compressed=True)
    vehicle = content["vehicles"]["drone"]
    assert vehicle["propellers"]["particle_size"] == 0.005 and "scripts" not in content and content["objects"] == []
    assert "Quadricopter: its propellers' scripts are V-REP's own" in imported.said
    assert vehicle["script_parameters"] == {"gain": 2.5, "shown": True}
    rigid = urdf.read(str(imported.scene.parent / vehicle["urdf"]))
    assert rigid.mass == pytest.approx(0.52) and np.diag(rigid.inertia) == pytest.approx(
        [4.04e-3, 4.94e-3, 8.93e-3], rel=2e-3
    )
    simulation = Simulation(parameters.load({"scene_file": str(imported.scene)}))
    for _ in range(40):
        simulation.step()
    height = simulation.drone.body.state.position[2]
    simulation.close()
    assert height == pytest.approx(1.0, abs=0.02)


def test_a_scaled_one_has_the_propellers_of_its_size(imported):
    vehicle = imported(*quadricopter(scale=1.3), suffix=".ttm")["vehicles"]["drone"]
    assert vehicle["propellers"]["particle_size"] == pytest.approx(0.0065)
    assert vehicle["objects"]["Quadricopter_base"]["position"] == [0.0, 0.0, -0.013]
    rigid = urdf.read(str(imported.scene.parent / vehicle["urdf"]))
    assert rigid.mass == pytest.approx(0.52 * 1.3**3)
    assert rigid.links["propeller_front_left"][3::4] == pytest.approx((0.119496, 0.119496, 0.0026), abs=1e-6)


def test_propellers_with_scripts_of_their_own_keep_them(imported):
    content = imported(*quadricopter(propeller=PROPELLER.replace("0.002", "0.003 + 0.002")))
    assert [one["object"] for one in content["scripts"]] == [
        f"Quadricopter_propeller_respondable{n}" for n in (1, 2, 3, 4)
    ]
    assert "propellers" not in content["vehicles"]["drone"]


def test_a_target_in_the_world_is_the_target(imported):
    target = shape(90, "Quadricopter_target", mesh("sphere", (0.1,) * 3), at=(1, 2, 3), respondable=False)
    chunks = quadricopter()
    del chunks[2]  # the one that hangs on it
    vehicle = imported(*chunks, target)["vehicles"]["drone"]
    assert vehicle["objects"]["DronePosition"] == {
        "name": "Quadricopter_target",
        "parent": "",
        "position": [1.0, 2.0, 3.0],
    }
    simulation = Simulation(parameters.load({"scene_file": str(imported.scene)}), started=False)
    tree = simulation.context.objects
    place = tree.matrix(tree.handle("Quadricopter_target"))
    simulation.close()
    assert place[3::4] == (1.0, 2.0, 3.0)


def test_names_without_a_suffix_mean_the_objects_of_the_copy(imported):
    code = "function sysCall_init() sim.getObjectHandle('{}_propeller_joint3') end"
    one, other = (
        quadricopter(first=first, end="#7", name=name, at=(first, 0, 1), code=code.format(name))
        for first, name in ((0, "Left"), (40, "Right"))
    )
    imported(*one, *other)
    Simulation(parameters.load({"scene_file": str(imported.scene)})).close()


def test_several_keep_their_names_whatever_they_are_called(imported):
    content = imported(*quadricopter(), *quadricopter(40, "#3", (2, 0, 1), "UAV"))
    first, second = content["vehicles"]["Quadricopter"], content["vehicles"]["UAV_3"]
    assert (first["suffix"], second["suffix"]) == (-1, 3)
    assert second["objects"]["Drone"] == {"name": "UAV#3"}
    simulation = Simulation(parameters.load({"scene_file": str(imported.scene)}), started=False)
    tree = simulation.context.objects
    found = [
        tree[tree.handle(name)] for name in ("UAV_propeller_respondable2#3", "Quadricopter_propeller_respondable2#3")
    ]
    simulation.close()
    assert found[0] is found[1] and tree.matrix(tree.handle("UAV#3"))[3] == pytest.approx(2.0)


def test_one_may_be_called_as_objects_of_another_are_here(imported):
    content = imported(*quadricopter(), *quadricopter(40, "", (2, 0, 1), "Drone"))
    assert [one.get("suffix") for one in content["vehicles"].values()] == [-1, 0]
    Simulation(parameters.load({"scene_file": str(imported.scene)}), started=False).close()


def test_what_hangs_on_a_quadricopter_goes_with_it(imported):
    eye = scene_object(
        "RSN",
        70,
        "FrontVision",
        0,
        (0.2, 0, 0),
        (0.5, 0.5, 0.5, 0.5),
        own=numbers("_cp", "Ccp", 1, 1.0, 0.01, 50) + integers("Res", 64, 48) + chunk("Va3", b"\1"),
    )
    ray = scene_object("SNR", 71, "Sonar", 1, own=integers("Snt", 34) + chunk("Vod", numbers("_s3", "Ss3", *[1.0] * 9)))
    tail = shape(72, "Tail", mesh(), parent=0)
    content = imported(*quadricopter(), eye, ray, tail)
    camera = content["vehicles"]["drone"]["cameras"]["front"]
    assert (camera["object"], camera["width"], camera["mount"]["position"]) == ("FrontVision", 64, [0.2, 0.0, 0.0])
    assert camera["mount"]["rpy"] == pytest.approx([0, 0, 0], abs=1e-5), "along +x"
    assert [(one["name"], one["parent"]) for one in content["objects"]] == [("Sonar", "Quadricopter_base")]
    parameters.load({"scene_file": str(imported.scene)})


def test_a_rope_weighs_where_it_hangs_and_a_hand_is_of_one_piece(imported):
    def link(handle, parent, name):
        thread = {"dynamic": True, "wrapper": weight(0.05, (1e-4, 1e-4, 1e-4))}
        ball = scene_object("JNT", handle, f"Ball{handle}", parent, (0, 0, -0.5), own=integers("Jtt", 12))
        return [ball, shape(handle + 1, name, mesh(size=(0.01, 0.01, 1)), parent=handle, at=(0, 0, -0.5), **thread)]

    tie = [scene_object("DMY", 86 + at, f"Tie{at}", 85 * (1 - at), own=integers("Lli", 87 - at)) for at in (0, 1)]
    imported(*quadricopter(), *link(80, 0, "Upper"), *link(82, 81, "Lower"), *link(84, 0, "Finger"), *tie)
    assert "Upper, Lower: on Quadricopter: weighs where it hangs, but does not swing" in imported.said
    assert "Finger: on Quadricopter: is of one piece with it" in imported.said
    body = urdf.read(str(next(imported.scene.parent.glob("*.urdf"))))
    assert body.mass == pytest.approx(0.52 + 3 * 0.05)
    assert body.centre_of_mass[2] == pytest.approx((4 * 0.1 * 0.002 - 0.1 * 0.5 - 0.05) / 0.67, abs=1e-4)


def test_a_thread_that_weighs_next_to_nothing_is_no_mistake(imported):
    ball = scene_object("JNT", 80, "Ball", 0, (0, 0, -0.5), own=integers("Jtt", 12))
    dust = {"dynamic": True, "wrapper": weight(8e-9, (1e-4, 1e-4, 1e-4))}
    imported(*quadricopter(), ball, shape(81, "Thread", mesh(size=(0.01, 0.01, 1)), parent=80, **dust))
    assert urdf.read(str(next(imported.scene.parent.glob("*.urdf")))).mass == pytest.approx(0.52, abs=1e-5)


def test_one_that_begins_tilted_and_without_a_script(imported):
    chunks = quadricopter(code="", propeller="")
    chunks[0] = shape(
        0,
        "Quadricopter",
        mesh(size=(0.3, 0.02, 0.02)),
        at=(0, 0, 1),
        dynamic=True,
        wrapper=weight(0.12),
        turned=(np.cos(0.1), np.sin(0.1), 0, 0),
    )
    vehicle = imported(*chunks)["vehicles"]["drone"]
    assert vehicle["tilt"] == pytest.approx([0.2, 0.0], abs=1e-6) and "script" not in vehicle
    assert "Quadricopter: has no child script" in imported.said


def test_a_target_that_the_file_has_not_is_where_the_base_is(imported):
    """A body that lies on its side has a base that stands upright; so does the target that its scripts follow."""
    _root, base, _, *others = quadricopter()
    upright = (np.cos(0.75), 0, np.sin(0.75), 0)
    side = shape(
        0,
        "Quadricopter",
        mesh(size=(0.3, 0.02, 0.02)),
        at=(0, 0, 1),
        dynamic=True,
        wrapper=weight(0.12),
        turned=(np.cos(0.75), 0, -np.sin(0.75), 0),
    )
    base = scene_object("DMY", 1, "Quadricopter_base", 0, (0, 0, 0.1), turned=upright)
    imported(side, base, *others)
    simulation = Simulation(parameters.load({"scene_file": str(imported.scene)}), started=False)
    tree = simulation.context.objects
    found, wanted = (tree.matrix(tree.handle(f"Quadricopter_{name}")) for name in ("target", "base"))
    simulation.close()
    assert np.allclose(found, wanted, atol=1e-5) and wanted[10] == pytest.approx(1.0, abs=1e-5)


# ---- in one step, and what goes wrong


def test_a_file_of_v_reps_is_a_scene(tmp_path, monkeypatch, caplog):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "My scene.ttt").write_bytes(file(*quadricopter(), scene_object("PAT", 90, "Way")))
    with caplog.at_level(logging.INFO):
        first, second = (parameters.load({"scene_file": str(tmp_path / "My scene.ttt")}) for _ in range(2))
    assert first.scene_file == second.scene_file and first.scene_file.startswith(str(tmp_path / "cache"))
    assert [one.name for one in first.fleet] == ["drone"]
    assert caplog.messages == [caplog.messages[0]] * 2 and "see IMPORT.txt" in caplog.messages[0]


ASKS = "require 'scripts/fly'\ndofile('own.lua')\nrequire('../out')\nrequire 'linked'\nrequire 'nothing'\n"


@pytest.fixture(name="beside")
def _beside(tmp_path, monkeypatch):
    """A folder with a scene, and what its script asks for; others lie around it."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "repo" / "scripts").mkdir(parents=True)
    for name, content in {
        "repo/scripts/fly": "require('more')",
        "repo/more": "x = 1",
        "repo/own": "",
        "out": "",
    }.items():
        (tmp_path / f"{name}.lua").write_text(content)
    (tmp_path / "repo" / "linked.lua").symlink_to(tmp_path / "out.lua")
    (tmp_path / "repo" / "a.ttt").write_bytes(file(*quadricopter(name="own", code=ASKS)))
    return tmp_path / "repo"


def test_files_of_lua_beside_a_scene_are_brought(beside, capsys):
    out = beside / "out"
    assert main([str(beside / "a.ttt"), str(out)]) == 0
    assert (out / "MODULES.txt").read_text().split() == ["scripts/fly.lua", "more.lua"]
    assert (out / "own.lua").read_text() == ASKS, "the scene's own script"
    assert sorted(str(one.relative_to(out)) for one in out.rglob("*.lua")) == ["more.lua", "own.lua", "scripts/fly.lua"]


def test_they_are_brought_anew_whenever_the_scene_is_asked_for(beside):
    for content in ("x = 1", "x = 2"):
        (beside / "more.lua").write_text(content)
        scene = parameters.load({"scene_file": str(beside / "a.ttt")}).scene_file
        assert Path(scene).with_name("more.lua").read_text() == content
        assert Path(scene).with_name("own.lua").read_text() == ASKS


def test_a_broken_file_as_a_scene_gets_one_line(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "a.ttt").write_bytes(container(b"", length=9))
    with pytest.raises(parameters.ParameterError, match=r"parameter scene_file = .*a\.ttt: is cut: 0 of 9 bytes"):
        parameters.load({"scene_file": str(tmp_path / "a.ttt")})
    assert not any((tmp_path / "cache").rglob("*.yaml"))


@pytest.mark.parametrize(
    "name, out, words",
    [
        ("a.ttt", "out", "a.ttt: is empty"),
        ("none.ttt", "out", "No such file"),
        ("a.txt", "out", "must end in .ttt or .ttm"),
        ("a.ttt", ".", "is not empty; name another folder"),
        ("a.ttt", "a.ttt", "is no folder"),
    ],
)
def test_a_users_mistake_gets_one_line(tmp_path, capsys, name, out, words):
    (tmp_path / "a.ttt").write_bytes(b"")
    assert main([str(tmp_path / name), str(tmp_path / out)]) == 1
    said = capsys.readouterr().err
    assert said.startswith("import_scene: ") and words in said and said.count("\n") == 1


def test_a_name_that_cannot_be_is_changed(imported):
    content = imported(
        scene_object("DMY", 0, "x" * 200), scene_object("DMY", 1, "a\nb", base=chunk("Ali", text("a\nb")))
    )
    assert [len(one["name"]) for one in content["objects"]] == [64, 3]
    parameters.load({"scene_file": str(imported.scene)})
