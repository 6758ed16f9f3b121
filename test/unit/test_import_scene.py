"""Import of V-REP files: the scene keeps the masses, poses and scripts of the file, and flies."""

import logging
import math
import struct
from pathlib import Path

import numpy as np
import pytest
import yaml
from vrep_encoder import (
    chunk,
    collection_item,
    container,
    file,
    integers,
    mesh,
    numbers,
    scene_object,
    script,
    shape,
    text,
    weight,
)
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
def imported(tmp_path, capsys, new_simulation):
    """Return a function that imports a file with the given chunks and returns the content of the scene file.

    Its attributes `output`, `scene` and `values` hold the printed output, the path of the scene file, and the
    parameters that name it. Its `fly` creates a simulation of the scene.
    """

    def import_file(*chunks, suffix=".ttt", **options):
        path = tmp_path / f"Thing{suffix}"
        path.write_bytes(file(*chunks, **options))
        assert main([str(path), str(tmp_path / "out"), "--force"]) == 0
        import_file.output = capsys.readouterr().out
        import_file.scene = tmp_path / "out" / "scene.yaml"
        import_file.values = {"scene_file": str(import_file.scene)}
        return yaml.safe_load(import_file.scene.read_text())

    def fly(steps=0, started=True, **more):
        return new_simulation({**import_file.values, **more}, steps, started=started)

    import_file.fly = fly
    return import_file


def objects(content):
    return {one["name"]: one for one in content["objects"]}


# ---- objects


def test_shapes_keep_their_size_mass_pose_and_parent(imported):
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
    assert found["Ball"]["position"] == [0.0, 0.0, 1.0] and found["Ball"]["parent"] == "Box"
    ball = imported.fly(40).scene.things()["Ball"]
    assert ball.matrix()[11] == pytest.approx(0.1, abs=0.01), "a dynamic child falls to the floor by itself"


def test_a_compound_keeps_its_parts_and_an_ellipsoid_becomes_a_mesh(imported):
    cabin = shape(0, "Cabin", mesh(size=(1, 1, 1), at=(0, 0, 2)), mesh("cylinder", (2, 2, 5)), at=(9, 9, 9))
    found = objects(imported(cabin, shape(1, "Egg", mesh("sphere", (1, 2, 3)))))
    assert found["Cabin"]["parts"][0]["position"] == [0.0, 0.0, 2.0]
    assert found["Cabin"]["parts"][1]["shape"] == "cylinder" and found["Cabin"]["parts"][1]["size"] == [1.0, 5.0]
    assert found["Egg"]["shape"] == "mesh"
    assert (imported.scene.parent / found["Egg"]["file"]).read_text().count("\nf ") == 1


RED, GREEN, BLUE, GREY = (255, 0, 0), (0, 255, 0), (0, 0, 255), (9, 9, 9)
IMAGE = np.array([[RED, GREEN], [BLUE, GREY]], np.uint8)  # the bottom row is first, as in the file
_IMAGE = chunk("Gon", text("tiles.jpg")) + chunk("Img", IMAGE.tobytes())
TEXTURE = chunk("TEX", integers("Ipa", 77, 2, 2) + _IMAGE + b"EOO")
IDENTITY_POSE = struct.pack("<7d", 1, 0, 0, 0, 0, 0, 0)


def uv_map(*more, number=77, mode=0, scaling=(1.0, 1.0)):
    ob = chunk("_ob", struct.pack("<2i2d", number, mode, *scaling))
    return chunk("Toj", ob + chunk("_rc", IDENTITY_POSE) + b"".join(more) + b"EOO")


@pytest.mark.parametrize(
    "covered, corners",
    [
        (uv_map(chunk("Ftc", struct.pack("<6f", 0, 0, 1, 0, 0.25, 1))), [[0, 0], [1, 0], [0.25, 1]]),
        (uv_map(scaling=(2.0, 4.0)), [[0.5, 0.5], [1, 0.5], [0.5, 0.75]]),
        (uv_map(mode=3), [[0.5, 0.5], [1.5, 0.5], [0.5, 1.5]]),
    ],
    ids=["as the file says", "seen along z", "on a cube"],
)
def test_a_textured_mesh_keeps_its_texture_and_uv_coordinates(imported, covered, corners):
    """The mesh is the triangle (0, 0, 0), (1, 0, 0), (0, 1, 0)."""
    leaf = objects(imported(TEXTURE, shape(0, "Leaf", mesh("none", more=covered))))["Leaf"]
    assert leaf["shape"] == "mesh" and "color" not in leaf
    (part,) = mesh_files.read(str(imported.scene.parent / leaf["file"]))
    assert part.texture.tolist() == IMAGE[::-1].tolist()
    assert np.allclose(part.uv[part.faces[0]], corners)
    assert np.allclose(part.vertices[part.faces[0]], [(0, 0, 0), (1, 0, 0), (0, 1, 0)])


@pytest.mark.parametrize(
    "covered",
    [uv_map(number=78), uv_map(mode=1), uv_map(chunk("Ftc", struct.pack("<6f", 0, 0, math.nan, 0, 0, 1)))],
    ids=["no such texture", "round a cylinder", "not finite"],
)
def test_an_unsupported_texture_mapping_is_not_imported(imported, covered):
    leaf = objects(imported(TEXTURE, shape(0, "Leaf", mesh("none", more=covered))))["Leaf"]
    (part,) = mesh_files.read(str(imported.scene.parent / leaf["file"]))
    assert part.texture is None and "color" in leaf


def test_a_truncated_texture_raises_a_one_line_error():
    cut = chunk("TEX", integers("Ipa", 77, 2, 2) + chunk("Img", bytes(11)) + b"EOO")
    with pytest.raises(VrepFileError, match=r"^TEX: a texture of 2 x 2 px in 11 bytes$"):
        read(file(cut))


def test_joints_keep_their_limits_value_and_children(imported):
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
    tree = imported.fly(started=False).context.objects
    place = tree.matrix(tree.handle("Door"))
    assert np.allclose(place[3::4], [np.cos(0.5), np.sin(0.5), 0], atol=1e-6)


def test_a_path_of_coppeliasim_4_becomes_a_path_object(imported):
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
    loaded = parameters.load(imported.values)
    path = loaded.scene.objects[0].make(Place(("Track",), "Track", None, frames.IDENTITY), None)
    assert struct.pack("<21d", *path.table) == content


@pytest.mark.parametrize("engine, turns", [(0, False), (1, True), (4, True)], ids=["Bullet", "ODE", "MuJoCo"])
def test_the_gyroscopic_term_follows_the_physics_engine_of_the_file(imported, engine, turns):
    imported(
        shape(0, "Mark", mesh(size=(1, 1, 1))), chunk("DYN", chunk("En3", struct.pack("<i3fi", engine, 0, 0, -9.81, 0)))
    )
    assert parameters.load(imported.values).physics.gyroscopic == turns


def test_floor_time_step_and_gravity_are_imported(imported):
    flat = shape(1, "Floor_part", mesh(size=(2, 2, 0.1)), parent=0)
    chunks = [shape(0, "ResizableFloor_5_25", mesh(size=(1, 1, 1))), flat]
    moon = chunk("DYN", chunk("En3", struct.pack("<i3fi", 0, 0, 0, -1.62, 0)))
    content = imported(*chunks, moon, chunk("SIM", integers("Spi", 4)))
    assert content == {"time_step": 0.01, "gravity": -1.62, "floor": {"size": 2.0}, "vehicles": {}, "objects": []}
    loaded = parameters.load(imported.values)
    assert (loaded.time_step, loaded.sub_steps, loaded.gravity) == (0.01, 2, -1.62)
    with pytest.raises(parameters.ParameterError, match=r"time_step = 0\.01: the time step cannot change"):
        parameters.load().in_scene(str(imported.scene))


def test_a_file_without_a_quadricopter_has_no_vehicle_unless_one_is_requested(imported, tmp_path):
    ball = shape(1, "Ball", mesh("sphere", (0.2, 0.2, 0.2)), at=(0, 0, 2), dynamic=True, wrapper=weight(1.0))
    imported(ball, script(1, "sim.setFloatSignal('height', sim.getObjectPosition(sim.getObject('/Ball'), -1)[3])"))
    simulation = imported.fly(20)
    assert not simulation.vehicles
    assert simulation.scene.things()["Ball"].matrix()[11] == pytest.approx(0.1, abs=0.01), "it lies on the floor"
    assert simulation.context.signals.get(float, "height") == 2.0
    simulation.save_scene(tmp_path / "saved.yaml")
    simulation.restore(simulation.snapshot())
    assert simulation.set_vehicles({"guest": {"position": [1, 0, 1]}}) == (["guest"], [])
    simulation.step()
    assert simulation.drone.name == "guest"
    assert simulation.set_vehicles({}) == ([], ["guest"])
    assert parameters.load({"scene_file": str(tmp_path / "saved.yaml")}).fleet == ()
    assert [one.name for one in parameters.load({**imported.values, "vehicles": 1}).fleet] == ["drone1"]
    with pytest.raises(parameters.ParameterError, match=r"scene\.yaml: the scene has no vehicle \(vehicles: {}\)"):
        parameters.load(imported.values).first  # noqa: B018


SAME_NAMES = {
    "roots": (shape(0, "water12", mesh()), shape(1, "water12", mesh())),
    "one in the other": (shape(0, "water12", mesh()), shape(1, "water12", mesh(), parent=0)),
    "beside each other": (scene_object("DMY", 0, "D"), *(shape(n, "water12", mesh(), parent=0) for n in (1, 2))),
    "of two trees": (shape(0, "water12", mesh()), scene_object("DMY", 1, "D"), shape(2, "water12", mesh(), parent=1)),
    "by their aliases": tuple(shape(handle, "", mesh(), alias="water12") for handle in (0, 1)),
}


@pytest.mark.parametrize("objects_twice", SAME_NAMES.values(), ids=SAME_NAMES)
def test_the_second_of_two_objects_of_equal_name_gets_another_name(imported, objects_twice):
    content = imported(*objects_twice)
    names = [one["name"] for one in content["objects"]]
    assert len({*names}) == len(names) and "water12" in names
    assert ": is called water12" in imported.output
    imported.fly(started=False)


def test_script_objects_with_script_children_get_one_object_each(imported):
    def scripted(handle, name, parent):
        own = script(99, f"function sysCall_init() sim.setInt32Signal('{name}', 1) end", tag="Soo")
        return scene_object("SCT", handle, name, parent=parent, own=own, alias="Script")

    content = imported(
        scene_object("DMY", 0, "D"), scripted(1, "one", 0), scripted(2, "two", 0), scripted(3, "on", 2), version=25
    )
    assert sorted(one["object"] for one in content["scripts"]) == ["D", "on", "two"]
    signals = imported.fly(vehicles={"drone": {}}).context.signals
    assert [signals.get(int, name) for name in ("one", "two", "on")] == [1, 1, 1]


def test_parts_that_cannot_be_imported_are_reported_per_object(imported):
    own = scene_object("PTC", 0, "Points"), scene_object("GRH", 1, "Graph"), scene_object("DMY", 2, "Drone")
    imported(*own, script(2, "x = 1", kind=6), script(2, "y = 1", switches=10))
    listed = (imported.scene.parent / "IMPORT.txt").read_text()
    for line in (
        "Points: a point cloud: only its pose is imported",
        "Drone: is called Drone#0 here",
        "Drone: its child script is disabled in the file, and is not imported",
    ):
        assert line in listed and line in imported.output
    assert "The file has no quadricopter" in imported.output


CUSTOMIZATION = """
function sysCall_init() state = sim.getSimulationState() end
function sysCall_beforeSimulation() sim.setInt32Signal('before', state == sim.simulation_stopped and 1 or 2) end
function sysCall_actuation()
    sim.setStringSignal('child', sim.callScriptFunction('own@' .. sim.getObjectAlias(sim.getObject('.'), 1), 1))
end
"""


@pytest.mark.parametrize("child", [True, False])
def test_a_customization_script_is_imported_with_its_object_and_child_script(imported, child):
    own = [script(0, "function own() return 'own' end function sysCall_init() end", parameters=(("size", "3"),))]
    text = CUSTOMIZATION if child else CUSTOMIZATION.replace("sim.callScriptFunction", "tostring")
    content = imported(scene_object("DMY", 0, "Mover"), script(0, text, kind=6), *(own if child else ()))
    (entry,) = content["scripts"]
    assert set(entry) >= {"object", "customization"} and ("script" in entry) == child
    simulation = imported.fly(vehicles={"drone": {}})
    simulation.step()
    signals = simulation.context.signals
    assert signals.get(int, "before") == 1 and signals.get(str, "child").startswith("own")


def linked(tag_of_type=b""):
    """Yield two bodies, each with a dummy that is linked to the dummy of the other body."""
    for first, other in ((0, 3), (2, 1)):
        yield shape(first, f"Body{first}", mesh(), at=(0, 0, 1 + first), dynamic=True, wrapper=weight(0.1))
        link = integers("Lli", other) + tag_of_type
        yield scene_object("DMY", first + 1, f"Tip{first}", parent=first, own=link)


def test_an_overlap_constraint_becomes_a_link_between_two_dummies(imported):
    imported(*linked())
    simulation = imported.fly(vehicles={"drone": {}})
    tip, other = (simulation.context.objects.handle(name) for name in ("Tip0", "Tip2"))
    assert simulation.operations.linked(tip) == other
    imported(*linked(integers("Dl2", 5)))
    assert "Tip0, Tip2: its link to another dummy is not imported" in (imported.scene.parent / "IMPORT.txt").read_text()


PUSH = """
function sysCall_actuation()
    local body = sim.getObjectHandle('Quadricopter_propeller_respondable{}')
    sim.setStringSignal('{}', sim.getObjectName(body)..' of '..sim.getObjectName(sim.getObjectHandle('Quadricopter')))
end
"""


def _rigid_quadricopter(end=""):
    """Yield a rigid model with a quadricopter's names. It is no vehicle: its propellers have only scripts."""
    yield shape(0, f"Quadricopter{end}", mesh(size=(0.3, 0.3, 0.05)), at=(3, 0, 1), base=chunk("Var", b"\1"))
    for number in (1, 2):
        name = f"Quadricopter_propeller_respondable{number}{end}"
        yield scene_object("DMY", number, name, 0, (0.1, 0, 0))
        yield script(number, PUSH.format(number, number))


@pytest.mark.parametrize("end", ["", "#0", "#3"])
def test_a_model_with_a_drone_s_names_gets_a_suffix_and_its_scripts_find_its_objects(imported, end):
    copy = end or "#0"
    found = objects(imported(*_rigid_quadricopter(end), suffix=".ttm"))
    assert [*found] == [f"Quadricopter{copy}", *(f"Quadricopter_propeller_respondable{n}{copy}" for n in (1, 2))]
    simulation = imported.fly(1, vehicles=1)
    aliases = [simulation.context.signals.find(str(n)) for n in (1, 2)]
    assert aliases == [f"Quadricopter_propeller_respondable{n}{copy} of Quadricopter{copy}" for n in (1, 2)]


def test_a_script_of_a_copy_does_not_find_another_drone_s_objects(imported, caplog):
    """V-REP has the same rule: the script of a copy does not find the objects of the original."""
    code = "function sysCall_init() sim.getObjectHandle('Quadricopter_base') end"
    imported(*_rigid_quadricopter("#0"), scene_object("DMY", 7, "Eye"), script(0, code))
    imported.fly(vehicles=1)
    assert "no object named 'Quadricopter_base#0'" in caplog.text


def test_scripts_outside_of_a_renamed_tree_find_its_objects_by_their_old_names(imported):
    code = "sim.setStringSignal('found', sim.getObjectName(sim.getObjectHandle('Arm')))"
    robot = scene_object("DMY", 0, "Drone"), scene_object("DMY", 1, "Arm", 0), scene_object("DMY", 2, "Eye")
    imported(*robot, script(2, f"function sysCall_init() {code} end"))
    assert imported.fly(vehicles=1).context.signals.find("found") == "Arm#0"


def test_scripts_are_attached_to_their_objects_with_their_parameters(imported):
    lamp = scene_object("DMY", 3, "Lamp", base=chunk("Lsp", integers("Par", 0)[:0]))
    content = imported(lamp, script(3, "-- é\nfunction sysCall_init() end", parameters=[("on", "true"), ("n", "3")]))
    assert content["scripts"] == [
        {"object": "Lamp", "script": "Lamp.lua", "embedded": True, "parameters": {"on": True, "n": 3.0}}
    ]
    assert (imported.scene.parent / "Lamp.lua").read_text() == "-- é\nfunction sysCall_init() end\n"


PATH_LOOKUPS = """
function sysCall_init()
    local paths = {'.', '..', './Eye', '../Eye', '../Eye[1]', ':', ':/Eye', '::', '/Robot/*/Eye', '/R*t/Eye[1]'}
    for _, path in pairs(paths) do
        local found = sim.getObject(path, {noError = true})
        sim.setStringSignal(NAME .. path, found == -1 and 'none' or sim.getObjectAlias(found, 1))
    end
end
"""


def _found_by_path(scene, name):
    """Return the aliases that the script `name` found, by path."""
    simulation = Simulation(parameters.load({"scene_file": str(scene)}))
    signals = simulation.context.signals
    paths = ".", "..", "./Eye", "../Eye", "../Eye[1]", ":", ":/Eye", "::", "/Robot/*/Eye", "/R*t/Eye[1]"
    found = {path: signals.find(f"{name}{path}") for path in paths}
    simulation.close()
    return found


def _robots(*more):
    """Yield two robot models as in CoppeliaSim 4.3, each with an arm that has an Eye, and with two Eyes of its own."""
    for index, name in ((0, "Robot"), (10, "Robot#0")):
        base, end = chunk("Var", b"\1"), name[5:]
        yield scene_object("DMY", index, name, at=(index, 0, 0), base=base, alias="Robot")
        yield scene_object("DMY", index + 1, f"Arm{end}", index, alias="Arm")
        yield scene_object("DMY", index + 2, f"Eye{end}", index + 1, alias="Eye")
        yield scene_object("DMY", index + 3, f"Left{end}", index, alias="Eye")
        yield scene_object("DMY", index + 4, f"Right{end}", index, alias="Eye")
    yield from more


def test_relative_paths_in_scripts_up_to_4_8_start_at_the_object(imported):
    imported(*_robots(script(11, PATH_LOOKUPS.replace("NAME", "'arm'"))))
    assert _found_by_path(imported.scene, "arm") == {
        ".": "/Robot[1]/Arm",
        "..": "/Robot[1]",
        "./Eye": "/Robot[1]/Arm/Eye",
        "../Eye": "/Robot[1]/Eye[0]",
        "../Eye[1]": "/Robot[1]/Eye[1]",
        ":": "/Robot[1]",
        ":/Eye": "/Robot[1]/Eye[0]",
        "::": "none",
        "/Robot/*/Eye": "/Robot[0]/Arm/Eye",
        "/R*t/Eye[1]": "/Robot[0]/Eye[1]",
    }


def test_relative_paths_in_scripts_of_4_9_start_at_the_script_object(imported):
    own = script(99, PATH_LOOKUPS.replace("NAME", "'arm'"), tag="Soo")
    scripted = scene_object("SCT", 20, "Script", parent=11, own=own, alias="Script")
    found = objects(imported(*_robots(scripted)))
    assert found["Script"]["kind"] == "script" and found["Script"]["parent"] == "Arm#0"
    aliases = _found_by_path(imported.scene, "arm")
    assert aliases[".."] == "/Robot[1]/Arm" and aliases["../Eye"] == "/Robot[1]/Arm/Eye" and aliases[":"] == "/Robot[1]"


def test_a_script_object_is_accepted_where_the_api_takes_a_script_handle(imported):
    own = script(99, "function twice(x) return 2 * x end", tag="Soo")
    scripted = scene_object("SCT", 20, "Script", parent=11, own=own, alias="Script")
    code = """
    function sysCall_sensing()
        local script = sim.getObject('/Robot[1]/Arm/Script')
        sim.setInt32Signal('type', sim.getObjectType(script) == sim.sceneobject_script and 1 or 0)
        sim.setInt32Signal('by handle', sim.callScriptFunction('twice', script, 4))
        sim.setInt32Signal('by path', sim.callScriptFunction('twice@/Robot[1]/Arm/Script', 1, 5))
        local of = sim.getScript(sim.scripttype_simulation, sim.getObject('/Robot[1]/Arm'))
        sim.setInt32Signal('by object', sim.callScriptFunction('twice', of, 6))
    end
    """
    imported(*_robots(scripted, script(0, code)))
    signals = imported.fly(1).context.signals
    assert [signals.get(int, name) for name in ("type", "by handle", "by path", "by object")] == [1, 8, 10, 12]


def test_collections_are_found_by_their_names(imported, tmp_path):
    items = collection_item(0, 1) + collection_item(2, 0, removes=True) + collection_item(77, 0)
    arm = chunk("GRP", chunk("Grn", text("arm")) + items + b"EOO")
    code = """
    function sysCall_init()
        for _, one in pairs(simGetCollectionObjects(simGetCollectionHandle('arm'))) do
            simSetStringSignal(simGetObjectName(one), 'in the arm')
        end
    end
    """
    content = imported(*_robots(script(10, code), arm))
    assert content["collections"] == [
        {
            "name": "arm",
            "items": [{"what": "tree", "object": "Robot"}, {"what": "single", "object": "Eye", "removes": True}],
        }
    ]
    assert "arm: a collection: some of its objects are not imported" in imported.output
    simulation = imported.fly()
    simulation.save_scene(tmp_path / "saved.yaml")
    found = [name for name in simulation.context.objects.names if simulation.context.signals.find(name)]
    simulation.stop()
    simulation.start()
    assert found == ["Robot", "Arm", "Left", "Right"]
    assert [name for name in simulation.context.objects.names if simulation.context.signals.find(name)] == found
    assert parameters.load({"scene_file": str(tmp_path / "saved.yaml")}).scene.collections[0].name == "arm"


# ---- quadricopters


def test_a_quadricopter_becomes_a_vehicle_with_its_masses_and_hovers(imported):
    """The model is V-REP's. With the built-in thrust law it hovers at the same particle velocity as in V-REP."""
    content = imported(*quadricopter(code=HOVER), compressed=True)
    vehicle = content["vehicles"]["drone"]
    assert vehicle["propellers"]["particle_size"] == 0.005 and "scripts" not in content and content["objects"] == []
    assert "Quadricopter: the built-in thrust model" in imported.output
    assert vehicle["script_parameters"] == {"gain": 2.5, "shown": True}
    rigid = urdf.read(str(imported.scene.parent / vehicle["urdf"]))
    assert rigid.mass == pytest.approx(0.52) and np.diag(rigid.inertia) == pytest.approx(
        [4.04e-3, 4.94e-3, 8.93e-3], rel=2e-3
    )
    assert imported.fly(40).drone.body.state.position[2] == pytest.approx(1.0, abs=0.02)


def test_a_scaled_quadricopter_has_scaled_propellers_masses_and_offsets(imported):
    vehicle = imported(*quadricopter(scale=1.3), suffix=".ttm")["vehicles"]["drone"]
    assert vehicle["propellers"]["particle_size"] == pytest.approx(0.0065)
    assert vehicle["objects"]["Quadricopter_base"]["position"] == [0.0, 0.0, -0.013]
    rigid = urdf.read(str(imported.scene.parent / vehicle["urdf"]))
    assert rigid.mass == pytest.approx(0.52 * 1.3**3)
    assert rigid.links["propeller_front_left"][3::4] == pytest.approx((0.119496, 0.119496, 0.0026), abs=1e-6)


def test_a_script_of_a_scaled_propeller_reads_its_size_factor(imported):
    """Force and mass scale with the cube of the size factor, so it hovers at the velocity of the unscaled model."""
    own = PROPELLER.replace("function sysCall_actuation()", "function sysCall_actuation()\n  local own = 'setObject'")
    content = imported(*quadricopter(scale=0.5, code=HOVER, propeller=own))
    assert len(content["scripts"]) == 4
    simulation = imported.fly(40)
    tree, operations = simulation.context.objects, simulation.operations
    factor = operations.factors(tree.handle("Quadricopter_propeller1"))
    height, start_height = simulation.drone.body.state.position[2], simulation.drone.parameters.position[2]
    assert factor == (0.5, 0.5, 0.5)
    assert height == pytest.approx(start_height, abs=0.02)


def test_a_scaled_object_of_the_scene_keeps_its_size_factor(imported):
    content = imported(shape(0, "Box", mesh(), base=numbers("_fa", "Sfa", 2.0)), shape(1, "Plain", mesh()))
    found = objects(content)
    assert found["Box"]["size_factor"] == 2 and "size_factor" not in found["Plain"]
    simulation = imported.fly(started=False)
    handle = simulation.context.objects.handle("Box")
    simulation.operations.scale([handle], (1.5, 1.5, 1.5))
    assert simulation.operations.factors(handle) == (3, 3, 3)


def test_propellers_with_scripts_of_their_own_keep_them(imported):
    content = imported(*quadricopter(propeller=PROPELLER.replace("0.002", "0.003 + 0.002")))
    assert [one["object"] for one in content["scripts"]] == [
        f"Quadricopter_propeller_respondable{n}" for n in (1, 2, 3, 4)
    ]
    assert "propellers" not in content["vehicles"]["drone"]


def test_a_target_without_a_parent_becomes_the_target_of_the_vehicle(imported):
    target = shape(90, "Quadricopter_target", mesh("sphere", (0.1,) * 3), at=(1, 2, 3), respondable=False)
    chunks = quadricopter()
    del chunks[2]  # the target that is a child of the quadricopter
    vehicle = imported(*chunks, target)["vehicles"]["drone"]
    assert vehicle["objects"]["DronePosition"] == {
        "name": "Quadricopter_target",
        "parent": "",
        "position": [1.0, 2.0, 3.0],
    }
    tree = imported.fly(started=False).context.objects
    assert tree.matrix(tree.handle("Quadricopter_target"))[3::4] == (1.0, 2.0, 3.0)


def test_names_without_a_suffix_in_a_copy_s_script_mean_its_own_objects(imported):
    code = "function sysCall_init() sim.getObjectHandle('{}_propeller_joint3') end"
    one, other = (
        quadricopter(first=first, end="#7", name=name, at=(first, 0, 1), code=code.format(name))
        for first, name in ((0, "Left"), (40, "Right"))
    )
    imported(*one, *other)
    imported.fly()


def test_several_quadricopters_keep_the_names_of_their_objects(imported):
    content = imported(*quadricopter(), *quadricopter(40, "#3", (2, 0, 1), "UAV"))
    first, second = content["vehicles"]["Quadricopter"], content["vehicles"]["UAV_3"]
    assert (first["suffix"], second["suffix"]) == (-1, 3)
    assert second["objects"]["Drone"] == {"name": "UAV#3"}
    tree = imported.fly(started=False).context.objects
    found = [
        tree[tree.handle(name)] for name in ("UAV_propeller_respondable2#3", "Quadricopter_propeller_respondable2#3")
    ]
    assert found[0] is found[1] and tree.matrix(tree.handle("UAV#3"))[3] == pytest.approx(2.0)


def test_a_quadricopter_may_be_called_drone_like_an_object_of_another_vehicle(imported):
    content = imported(*quadricopter(), *quadricopter(40, "", (2, 0, 1), "Drone"))
    assert [one.get("suffix") for one in content["vehicles"].values()] == [-1, 0]
    imported.fly(started=False)


def test_sensors_and_shapes_attached_to_a_quadricopter_stay_attached(imported):
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
    assert camera["mount"]["rpy"] == pytest.approx([0, 0, 0], abs=1e-5), "the camera looks along +x"
    assert [(one["name"], one["parent"]) for one in content["objects"]] == [("Sonar", "Quadricopter_base")]
    parameters.load(imported.values)


def test_a_vision_sensor_named_like_a_v_rep_camera_becomes_a_camera(imported):
    own = numbers("_cp", "Ccp", 1, 1.0, 0.01, 50) + integers("Res", 64, 48) + chunk("Va3", b"\1")
    content = imported(*quadricopter(), scene_object("RSN", 70, "DroneFloorCamera", 0, (0, 0, -0.1), own=own))
    vehicle = content["vehicles"]["drone"]
    assert "Quadricopter_floorCamera" not in vehicle["objects"]
    assert [one["object"] for one in vehicle["cameras"].values()] == ["DroneFloorCamera"]


def test_masses_of_jointed_bodies_count_where_they_are_attached(imported):
    def link(handle, parent, name):
        thread = {"dynamic": True, "wrapper": weight(0.05, (1e-4, 1e-4, 1e-4))}
        ball = scene_object("JNT", handle, f"Ball{handle}", parent, (0, 0, -0.5), own=integers("Jtt", 12))
        return [ball, shape(handle + 1, name, mesh(size=(0.01, 0.01, 1)), parent=handle, at=(0, 0, -0.5), **thread)]

    ties = [scene_object("DMY", 86 + at, f"Tie{at}", 85 * (1 - at), own=integers("Lli", 87 - at)) for at in (0, 1)]
    imported(*quadricopter(), *link(80, 0, "Upper"), *link(82, 81, "Lower"), *link(84, 0, "Finger"), *ties)
    assert "Upper, Lower: on Quadricopter: is rigidly attached: its mass counts" in imported.output
    assert "Finger: on Quadricopter: is rigidly attached" in imported.output
    body = urdf.read(str(next(imported.scene.parent.glob("*.urdf"))))
    assert body.mass == pytest.approx(0.52 + 3 * 0.05)
    assert body.centre_of_mass[2] == pytest.approx((4 * 0.1 * 0.002 - 0.1 * 0.5 - 0.05) / 0.67, abs=1e-4)


def test_a_jointed_body_of_tiny_mass_is_imported(imported):
    ball = scene_object("JNT", 80, "Ball", 0, (0, 0, -0.5), own=integers("Jtt", 12))
    dust = {"dynamic": True, "wrapper": weight(8e-9, (1e-4, 1e-4, 1e-4))}
    imported(*quadricopter(), ball, shape(81, "Thread", mesh(size=(0.01, 0.01, 1)), parent=80, **dust))
    assert urdf.read(str(next(imported.scene.parent.glob("*.urdf")))).mass == pytest.approx(0.52, abs=1e-5)


def test_a_tilted_quadricopter_without_a_script_keeps_its_tilt(imported):
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
    assert vehicle["tilt"] == pytest.approx([0.2, 0.0], abs=1e-6) and vehicle["script"] == "none"
    assert "Quadricopter: has no child script" in imported.output


def test_a_target_missing_in_the_file_is_created_at_the_base(imported):
    """The body lies on its side and its base is upright, so the target that its scripts follow is upright too."""
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
    tree = imported.fly(started=False).context.objects
    found, wanted = (tree.matrix(tree.handle(f"Quadricopter_{name}")) for name in ("target", "base"))
    assert np.allclose(found, wanted, atol=1e-5) and wanted[10] == pytest.approx(1.0, abs=1e-5)


# ---- a V-REP file as scene_file, and errors


def test_a_ttt_file_can_be_the_scene_file(tmp_path, monkeypatch, caplog):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "My scene.ttt").write_bytes(file(*quadricopter(), scene_object("PTC", 90, "Points")))
    with caplog.at_level(logging.INFO):
        first, second = (parameters.load({"scene_file": str(tmp_path / "My scene.ttt")}) for _ in range(2))
    assert first.scene_file == second.scene_file and first.scene_file.startswith(str(tmp_path / "cache"))
    assert [one.name for one in first.fleet] == ["drone"]
    assert caplog.messages == [caplog.messages[0]] * 2 and "IMPORT.txt" in caplog.messages[0]


REQUIRES = "require 'scripts/fly'\ndofile('own.lua')\nrequire('../out')\nrequire 'linked'\nrequire 'nothing'\n"


@pytest.fixture(name="beside")
def _beside(tmp_path, monkeypatch):
    """Return a folder with a scene and the modules that its script requires. Other files lie outside."""
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
    (tmp_path / "repo" / "a.ttt").write_bytes(file(*quadricopter(name="own", code=REQUIRES)))
    return tmp_path / "repo"


def test_lua_modules_beside_the_scene_are_imported(beside, capsys):
    out = beside / "out"
    assert main([str(beside / "a.ttt"), str(out)]) == 0
    assert (out / "MODULES.txt").read_text().split() == ["scripts/fly.lua", "own.lua", "more.lua"]
    assert (out / "own_2.lua").read_text() == REQUIRES, "own_2.lua is the script of the scene"
    assert sorted(str(one.relative_to(out)) for one in out.rglob("*.lua")) == [
        "more.lua",
        "own.lua",
        "own_2.lua",
        "scripts/fly.lua",
    ]


def test_a_script_file_is_not_named_like_a_module_that_it_requires(imported, tmp_path, caplog):
    (tmp_path / "blimp.lua").write_text("return {lift = 3}")
    code = "function sysCall_init() sim.setInt32Signal('lift', require('blimp').lift) end"
    content = imported(scene_object("DMY", 0, "blimp"), script(0, code))
    assert content["scripts"][0]["script"] == "blimp_2.lua"
    assert imported.fly().context.signals.get(int, "lift") == 3
    for folder in (tmp_path, tmp_path / "out"):
        (folder / "blimp.lua").unlink()
    imported(scene_object("DMY", 0, "blimp"), script(0, code))
    imported.fly()
    assert "no module 'blimp': there is no file blimp.lua" in caplog.text


def test_lua_modules_are_copied_again_at_each_load_of_the_scene(beside):
    for content in ("x = 1", "x = 2"):
        (beside / "more.lua").write_text(content)
        scene = parameters.load({"scene_file": str(beside / "a.ttt")}).scene_file
        assert Path(scene).with_name("more.lua").read_text() == content
        assert Path(scene).with_name("own_2.lua").read_text() == REQUIRES


def test_a_truncated_ttt_file_as_scene_raises_a_one_line_error(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "a.ttt").write_bytes(container(b"", length=9))
    with pytest.raises(parameters.ParameterError, match=r"parameter scene_file = .*a\.ttt: is truncated: 0 of 9 bytes"):
        parameters.load({"scene_file": str(tmp_path / "a.ttt")})
    assert not any((tmp_path / "cache").rglob("*.yaml"))


@pytest.mark.parametrize(
    "name, out, words",
    [
        ("a.ttt", "out", "a.ttt: is empty"),
        ("none.ttt", "out", "No such file"),
        ("a.txt", "out", "must end in .ttt or .ttm"),
        ("a.ttt", ".", "is not empty"),
        ("a.ttt", "a.ttt", "is not a folder"),
    ],
)
def test_a_wrong_argument_is_reported_in_one_line(tmp_path, capsys, name, out, words):
    (tmp_path / "a.ttt").write_bytes(b"")
    assert main([str(tmp_path / name), str(tmp_path / out)]) == 1
    output = capsys.readouterr().err
    assert output.startswith("import_scene: ") and words in output and output.count("\n") == 1


def test_invalid_names_are_changed_to_valid_ones(imported):
    content = imported(
        scene_object("DMY", 0, "x" * 200), scene_object("DMY", 1, "a\nb", base=chunk("Ali", text("a\nb")))
    )
    assert [len(one["name"]) for one in content["objects"]] == [64, 3]
    parameters.load(imported.values)
