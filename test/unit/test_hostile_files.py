"""Meshes, textures and URDFs that could crash, fill or hang the process: each is refused in one line or built.

They are loaded in a child process with limited memory, so that a crash is a failed test.
"""

import json
import os
import resource
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
import trimesh

from drone_sim.files import mesh_files
from drone_sim.render.surfaces import load
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation
from drone_sim.shapes.mesh import Mesh
from drone_sim.shapes.visual import Visual

pytestmark = pytest.mark.long

SOURCE = Path(__file__).resolve().parents[2] / "src"
HANGS = 300.0  # s, limit for all files together, which take a few seconds
MEMORY = 4 * 2**30  # bytes
LOAD = """
import json, sys
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation

for name, scene in json.load(open("scenes.json")).items():
    open("scene.yaml", "w").write(scene)
    said = "built"
    try:
        simulation = Simulation(parameters.load({"scene_file": "scene.yaml"}))
        for _ in range(5):
            simulation.step()
        assert simulation.world.is_finite()
        simulation.close()
    except (ValueError, RuntimeError) as error:
        said = f"{type(error).__name__}: {error}"
    print(json.dumps([name, said]), flush=True)
"""

BOX = "<geometry><box size='1 1 1'/></geometry>"
INERTIA = "<inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/>"


def link(name, inside=f"<collision>{BOX}</collision><visual>{BOX}</visual>", mass="1", inertia=INERTIA):
    return f"<link name='{name}'><inertial><mass value='{mass}'/>{inertia}</inertial>{inside}</link>"


def joint(name, parent, child, kind="fixed", inside=""):
    return f"<joint name='{name}' type='{kind}'><parent link='{parent}'/><child link='{child}'/>{inside}</joint>"


LIMITED = "<axis xyz='0 0 1'/><limit lower='-1' upper='1' effort='1' velocity='1'/>"
A, B, C = link("a"), link("b"), link("c")
URDFS = {
    "two roots": (A + B, "must have one root link, has a, b"),
    "an empty name": (link(""), "link name='': must be a name"),
    "no link": ("", "must have at least one link"),
    "a circle": (A + B + C + joint("j", "b", "c") + joint("k", "c", "b"), "joints form a circle"),
    "a circle alone": (B + C + joint("j", "b", "c") + joint("k", "c", "b"), "joints form a circle"),
    "its own parent": (A + joint("j", "a", "a"), "joints form a circle"),
    "two parents": (A + B + C + joint("j", "a", "c") + joint("k", "b", "c"), "link c: is the child of two joints"),
    "a name twice": (A + A, "link a: is defined twice"),
    "a joint twice": (A + B + C + joint("j", "a", "b") + joint("j", "a", "c"), "joint j: is defined twice"),
    "a stranger": (A + joint("j", "a", "x"), "joint j: child 'x': there is no such link"),
    "no child": (A + "<joint name='j' type='fixed'><parent link='a'/></joint>", "joint j: child is missing"),
    "an odd joint": (A + B + joint("j", "a", "b", "floating"), "type floating: must be fixed, continuous, revolute or"),
    "no limit": (A + B + joint("j", "a", "b", "revolute"), "joint j: no limit"),
    "an axis of 0": (A + B + joint("j", "a", "b", "continuous", "<axis xyz='0 0 0'/>"), "axis xyz: must not be 0 0 0"),
    "a long name": (link("a" * 5000), "must be a name of 1 to 64 characters"),
    "many links": ("".join(link(f"l{n}") for n in range(200)), "200 links and 0 joints; at most 100"),
    "many joints": (A + "".join(joint(f"j{n}", "a", "b") for n in range(20_000)), "20000 joints; at most 100"),
    "many shapes": (link("a", f"<visual>{BOX}</visual>" * 20_000), "more than 500 visuals and collisions"),
    "a mass of NaN": (link("a", mass="nan"), "link a: 'nan': must be 1 finite numbers"),
    "a negative mass": (link("a", mass="-1"), "link a: mass -1.0 kg: must not be negative"),
    "a mass of 1e300": (link("a", mass="1e300"), "link a: mass 1e+300 kg: must be 0, or from 1e-06 to 1e+06"),
    "an inertia of 1e-300": (link("a", inertia=INERTIA.replace("ixx='1'", "ixx='1e-300'")), "inertia ixx = '1e-300'"),
    "a negative moment": (link("a", inertia=INERTIA.replace("ixx='1'", "ixx='-1'")), "inertia ixx = '-1'"),
    "a box of 0": (link("a", f"<visual>{BOX.replace('1 1 1', '0 1 1')}</visual>"), "box size = '0 1 1': must be from"),
    "two numbers": (link("a", f"<visual>{BOX.replace('1 1 1', '1 1')}</visual>"), "must be 3 finite numbers"),
    "no geometry": (link("a", "<visual><geometry/></visual>"), "geometry: must hold one of box, cylinder"),
    "an odd geometry": (link("a", "<visual><geometry><cone/></geometry></visual>"), "geometry: must hold one of"),
    "a missing mesh": (link("a", "<visual><geometry><mesh filename='x.obj'/></geometry></visual>"), "no such mesh"),
    "a mesh of zero": (link("a", "<visual><geometry><mesh filename='/dev/zero'/></geometry></visual>"), "no such mesh"),
    "a bad mesh": (
        link("a", "<visual><geometry><mesh filename='dots.obj'/></geometry></visual>"),
        "dots.obj: cannot be",
    ),
    "deep": ("<a>" * 100_000 + "</a>" * 100_000, "must have at least one link"),
    "broken": ("<link", "not well-formed"),
    # Unusual files that can be built.
    "no inertial": ("<link name='a'/>", "built"),
    "no inertia": (link("a", inertia=""), "built"),
    "a chain": (
        "".join(link(f"l{n}") for n in range(50))
        + "".join(joint(f"j{n}", f"l{n}", f"l{n + 1}", "revolute", LIMITED) for n in range(49)),
        "built",
    ),
    "a texture": (link("a", f"<visual>{BOX}<material name=''><texture filename='/x'/></material></visual>"), "built"),
    "a mesh": (link("a", "<collision><geometry><mesh filename='good.obj'/></geometry></collision>"), "built"),
}
DOCTYPE = '<!DOCTYPE r [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;">]>'

V = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
MESHES = {
    "narrow.obj": ("v 0\nv 1\nv 2\nf 1 2 3\n", "narrow.obj: cannot be read (a vertex must have 3 numbers"),
    "dots.obj": (f"mtllib ..\n{V}f 1 2 3\n", "dots.obj: cannot be read (..: must be a regular file)"),
    "zero.obj": (f"mtllib /dev/zero\n{V}f 1 2 3\n", "/dev/zero: must be a regular file"),
    "fifo.obj": (f"mtllib fifo\n{V}f 1 2 3\n", "fifo: must be a regular file"),
    "bomb.obj": (
        f"mtllib bomb.mtl\n{V}vt 0 0\nusemtl m\nf 1/1 2/1 3/1\n",
        "bomb.png: too large: at most 4096 x 4096 px",
    ),
    "nan.obj": (V.replace("1 0 0", "nan 0 0") + "f 1 2 3\n", "a vertex is not finite"),
    "far.obj": (V.replace("1 0 0", "1e30 0 0") + "f 1 2 3\n", "more than 1e+06 m from the origin"),
    "index.obj": (f"{V}f 1 2 9\n", "out of bounds"),
    "huge index.obj": (f"{V}f 1 2 99999999999999999999\n", "out of bounds"),
    "nothing.obj": ("", "holds no triangles"),
    "materials.obj": (V + "".join(f"usemtl m{n}\nf 1 2 3\n" for n in range(50_000)), "more than 256 `usemtl`"),
    "faces.obj": (V + "f 1 2 3\n" * 300_000, "more than 200000 `f`"),
    "quads.obj": (f"{V}v 1 1 0\n" + "f 1 2 3 4\n" * 150_000, "300000 triangles; at most 200000 are allowed"),
    "count.stl": (bytes(80) + b"\xff\xff\xff\xff", "count.stl: cannot be read"),
    "nan.stl": (bytes(80) + b"\1\0\0\0" + np.full(12, np.nan, "<f4").tobytes() + b"\0\0", "a vertex is not finite"),
    "zip.dae": (b"PK\3\4" + bytes(1000), "must be XML in UTF-8"),
    "entity.dae": (f"{DOCTYPE}<COLLADA/>", "must have no DOCTYPE"),
    "nodes.dae": ("<COLLADA>" + "<instance_node/>" * 99, "more than 16 `instance_node`"),
    "broken.dae": ("<COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema'/>", "cannot be read"),
    "good.obj": (f"mtllib missing.mtl\n# é\n{V}f 1 2 3\n".encode("latin-1"), "built"),
    "point.obj": ("v 0 0 0\n" * 3 + "f 1 2 3\n", "built"),
    "line.obj": ("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "built"),
    "tiny.obj": ("v 1e-30 0 0\nv 0 1e-30 0\nv 0 0 1e-30\nf 1 2 3\n", "built"),
}
BALL = "shape: sphere, size: [1], position: [9, 0, 1]"
MESH = "shape: mesh, position: [9, 0, 1], file"
SCENES = {
    "a big texture": (f"objects: [{{{BALL}, texture: bomb.png}}]", "bomb.png: too large: at most 4096 x 4096 px"),
    "a wide texture": (f"objects: [{{{BALL}, texture: wide.png}}]", "wide.png: 5000 x 2 px: at most 4096 x 4096"),
    "a deep texture": (f"objects: [{{{BALL}, texture: deep.png}}]", "deep.png: cannot be read as an 8-bit image"),
    "a folder": (f"objects: [{{{BALL}, texture: .}}]", "no such file: "),
    "a pipe": (f"objects: [{{{BALL}, texture: fifo}}]", "no such file: "),
    "a long name": (f"objects: [{{{BALL}, texture: {'x' * 300}}}]", "no such file"),
    "many boxes": ("objects: [" + f"{{{BALL}}}," * 2001 + "]", "at most 2000 items"),
    "a big mesh often": ("objects: [" + f"{{{MESH}: disc.stl}}," * 600 + "]", "more than 500000 triangles"),
    "a wide mesh": (f"objects: [{{{MESH}: good.obj, size: [1e6, 1, 1]}}]", "reaches 1e+06 m from its origin"),
    "a disc": (f"objects: [{{{MESH}: disc.stl, mass: 1}}]", "built"),
    "on each other": ("objects: [" + f"{{{BALL}, mass: 1e6}}, {{{BALL}, mass: 1e-6}}," * 5 + "]", "built"),
    "a heap": ("objects: [" + f"{{{BALL}, mass: 1e6}}, {{{BALL}, mass: 1e-6}}," * 40 + "]", "pairs of moving objects"),
}


@pytest.fixture(name="said", scope="module")
def _said(tmp_path_factory):
    """Return {scene: reply of the child process that loaded it}, and the completed child process."""
    folder = tmp_path_factory.mktemp("hostile")
    scenes = {name: scene for name, (scene, _) in SCENES.items()}
    for number, (name, (text, _)) in enumerate(URDFS.items()):
        for mass in (0, 1):
            scene = f"objects: [{{shape: urdf, file: {number}.urdf, position: [9, 0, 1], mass: {mass}}}]"
            scenes[f"urdf {name} {mass}"] = scene
        (folder / f"{number}.urdf").write_text(f"<robot name='r'>{text}</robot>", encoding="utf-8")
    for name, (content, _) in MESHES.items():
        for mass in (0, 1):
            scenes[f"{name} {mass}"] = f"objects: [{{{MESH}: {name}, mass: {mass}}}]"
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    os.mkfifo(folder / "fifo")
    header = struct.pack(">4sIIBBBBB", b"IHDR", 20_000, 20_000, 8, 2, 0, 0, 0)
    chunk = struct.pack(">I", 13) + header + struct.pack(">I", zlib.crc32(header))
    (folder / "bomb.png").write_bytes(b"\x89PNG\r\n\x1a\n" + chunk + struct.pack(">I4s", 9, b"IDAT") + bytes(13))
    cv2.imwrite(str(folder / "wide.png"), np.zeros((2, 5000), np.uint8))
    cv2.imwrite(str(folder / "deep.png"), np.zeros((4, 4), np.uint16))
    (folder / "bomb.mtl").write_text("newmtl m\nKd 1 1 1\nmap_Kd bomb.png\n")
    trimesh.creation.cylinder(1, 0.1, sections=300).export(str(folder / "disc.stl"))
    (folder / "scenes.json").write_text(json.dumps(scenes))
    child = subprocess.run(
        [sys.executable, "-c", LOAD],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(SOURCE)},
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY)),
        capture_output=True,
        text=True,
        timeout=HANGS,
    )
    return dict(map(json.loads, child.stdout.splitlines())), child


def assert_reply(said, name, words):
    lines, child = said
    assert name in lines, f"the process ended with {child.returncode} after {list(lines)[-1:]}: {child.stderr[-500:]}"
    assert words in lines[name]
    assert "\n" not in lines[name] and len(lines[name]) < 700


@pytest.mark.parametrize("mass", [0, 1])
@pytest.mark.parametrize("name", URDFS)
def test_a_hostile_urdf_never_ends_the_process(said, name, mass):
    assert_reply(said, f"urdf {name} {mass}", URDFS[name][1])


@pytest.mark.parametrize("mass", [0, 1])
@pytest.mark.parametrize("name", MESHES)
def test_a_hostile_mesh_never_ends_the_process(said, name, mass):
    assert_reply(said, f"{name} {mass}", MESHES[name][1])


@pytest.mark.parametrize("name", SCENES)
def test_a_hostile_scene_never_ends_the_process(said, name):
    assert_reply(said, name, SCENES[name][1])


@pytest.mark.parametrize(
    "text", [DOCTYPE + "<robot name='r'/>", "", "\0", "<?xml version='1.0' encoding='foo'?><robot/>"]
)
def test_an_invalid_urdf_of_the_drone_raises_a_one_line_error(tmp_path, text):
    (tmp_path / "drone.urdf").write_text(text)
    with pytest.raises(ValueError, match=r"drone\.urdf: ") as refused:
        Simulation(parameters.load({"drone": {"urdf": str(tmp_path / "drone.urdf")}}))
    assert "\n" not in str(refused.value)


def test_a_circle_of_joints_in_the_drone_is_refused(tmp_path):
    text = A + B + C + joint("j", "b", "c") + joint("k", "c", "b")
    (tmp_path / "drone.urdf").write_text(f"<robot name='r'>{text}</robot>")
    with pytest.raises(ValueError, match="link b: its joints form a circle"):
        Simulation(parameters.load({"drone": {"urdf": str(tmp_path / "drone.urdf")}}))


def test_a_file_is_read_once_until_it_changes(tmp_path, monkeypatch, new_simulation):
    """The check, the world, the renderer and the next start all use the mesh."""
    ball = trimesh.creation.icosphere()
    ball.export(str(tmp_path / "ball.stl"))
    (tmp_path / "scene.yaml").write_text("objects: [{shape: mesh, file: ball.stl, position: [9, 0, 1]}]")
    read, loaded = [], trimesh.load
    monkeypatch.setattr(trimesh, "load", lambda *args, **kw: read.append(kw["file_type"]) or loaded(*args, **kw))
    simulation = new_simulation({"scene_file": str(tmp_path / "scene.yaml")})
    for visual in simulation.world.pictures.visuals():
        load(visual)
    simulation.start()
    assert read.count("stl") == 1
    ball.apply_scale(2.0)
    ball.export(str(tmp_path / "ball.stl"))
    os.utime(tmp_path / "ball.stl", ns=(1, 1))
    simulation.start()
    assert read.count("stl") == 2


def test_the_hull_of_a_moving_mesh_of_80000_triangles_has_few_corners(tmp_path, new_simulation):
    """Bullet iterates over all corners of a hull in every step, so the hull is simplified."""
    ball = trimesh.creation.icosphere(subdivisions=6)
    ball.export(str(tmp_path / "ball.stl"))
    corners = np.frombuffer(mesh_files.as_stl(str(tmp_path / "ball.stl"), hull=True)[84:], np.uint8)
    assert len(corners) / 50 * 3 < 300, "the number of corners of the hull"
    (tmp_path / "scene.yaml").write_text("objects: [{shape: mesh, file: ball.stl, position: [5, 0, 3], mass: 1}]")
    simulation = new_simulation({"scene_file": str(tmp_path / "scene.yaml")}, steps=40)
    assert simulation.scene.visuals()[1][0, 2, 3] == pytest.approx(1.0, abs=0.05), "the ball lies on the floor"


def test_a_disc_of_20000_triangles_is_rendered_flat(tmp_path):
    angles = np.linspace(0, 2 * np.pi, 20_001)
    rim = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    corners = np.stack([0 * rim[1:], rim[:-1], rim[1:]], axis=1)
    trimesh.Trimesh(corners.reshape(-1, 3), np.arange(60_000).reshape(-1, 3), process=False).export(
        str(tmp_path / "disc.stl")
    )
    (disc,) = load(Visual("disc", Mesh(str(tmp_path / "disc.stl")), (1.0, 1.0, 1.0, 1.0)))
    np.testing.assert_allclose(disc.normals, [[0, 0, 1]] * len(disc.normals), atol=1e-6)
