"""Triangles of shapes and mesh files: size, normals and materials."""

import cv2
import numpy as np
import pytest
import trimesh

from drone_sim.render.surfaces import load
from drone_sim.shapes.box import Box
from drone_sim.shapes.capsule import Capsule
from drone_sim.shapes.cylinder import Cylinder
from drone_sim.shapes.mesh import Mesh
from drone_sim.shapes.plane import Plane
from drone_sim.shapes.sphere import Sphere
from drone_sim.shapes.visual import Visual

WHITE = (1.0, 1.0, 1.0, 1.0)


def visual(shape, texture=""):
    return Visual("it", shape, WHITE, texture=str(texture))


def mesh_visual(file, scale=(1.0, 1.0, 1.0), texture=""):
    return visual(Mesh(str(file), scale), texture)


def extents(mesh):
    return np.ptp(mesh.vertices, axis=0)


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        (Box((0.2, 0.4, 0.6)), (0.2, 0.4, 0.6)),
        (Cylinder((0.3, 0.5)), (0.6, 0.6, 0.5)),
        (Sphere((0.3,)), (0.6, 0.6, 0.6)),
        (Capsule((0.1, 0.5)), (0.2, 0.2, 0.7)),
    ],
    ids=["box", "cylinder", "sphere", "capsule"],
)
def test_primitives_have_their_size_are_centred_and_face_outwards(shape, expected):
    (mesh,) = load(visual(shape))
    np.testing.assert_allclose(extents(mesh), expected, rtol=0.02)
    np.testing.assert_allclose(mesh.vertices.min(axis=0), -mesh.vertices.max(axis=0), atol=1e-6)
    assert mesh.closed
    assert np.einsum("ij,ij->i", mesh.vertices, mesh.normals).min() > 0
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-6)
    assert mesh.vertices.dtype == mesh.normals.dtype == np.float32 and mesh.faces.dtype == np.uint32


def test_box_normals_are_flat_sphere_normals_smooth_and_cylinder_normals_both():
    (box,) = load(visual(Box((1.0, 1.0, 1.0))))
    assert len(box.vertices) == 24 and (np.abs(box.normals).max(axis=1) == 1.0).all()
    (sphere,) = load(visual(Sphere((1.0,))))
    np.testing.assert_allclose(sphere.normals, sphere.vertices, atol=0.02)
    (cylinder,) = load(visual(Cylinder((1.0, 2.0))))
    caps = np.abs(cylinder.normals[:, 2]) > 0.5
    np.testing.assert_allclose(np.abs(cylinder.normals[caps, 2]), 1.0, atol=1e-6)
    radial = cylinder.vertices[~caps] * [1, 1, 0]
    np.testing.assert_allclose(cylinder.normals[~caps], radial / np.linalg.norm(radial, axis=1)[:, None], atol=1e-5)


def test_a_plane_is_level_and_repeats_its_texture_every_metre(tmp_path):
    cv2.imwrite(str(tmp_path / "tile.png"), np.zeros((4, 4, 3), np.uint8))
    (plane,) = load(visual(Plane(), tmp_path / "tile.png"))
    assert (plane.vertices[:, 2] == 0).all() and (plane.normals == [0, 0, 1]).all() and not plane.closed
    np.testing.assert_array_equal(plane.uv, plane.vertices[:, :2])


def write_two_materials(folder):
    cv2.imwrite(str(folder / "blue.png"), np.full((4, 4, 3), (255, 0, 0), np.uint8))
    (folder / "two.mtl").write_text("newmtl red\nKd 1 0 0\nd 0.5\nnewmtl picture\nKd 1 1 1\nmap_Kd blue.png\n")
    (folder / "two.obj").write_text(
        "mtllib two.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 2 0\nvt 2 2\nvt 0 2\n"
        "usemtl red\nf 1 2 3\nusemtl picture\nf 1/1 3/3 4/4\n"
    )
    return folder / "two.obj"


def test_an_obj_file_with_two_materials_gives_two_parts(tmp_path):
    parts = load(mesh_visual(write_two_materials(tmp_path), (2.0, 3.0, 1.0)))
    red = next(part for part in parts if part.texture is None)
    picture = next(part for part in parts if part.texture is not None)
    assert red.rgba == (1.0, 0.0, 0.0, 0.5) and red.transparent and not red.closed
    assert picture.rgba == WHITE and not picture.transparent
    np.testing.assert_array_equal(picture.texture, np.full((4, 4, 3), (0, 0, 255)))
    assert picture.uv.max() == 2.0
    np.testing.assert_allclose(extents(picture), (2.0, 3.0, 0.0), atol=1e-6)


def test_a_texture_parameter_replaces_the_texture_of_the_file(tmp_path):
    cv2.imwrite(str(tmp_path / "other.png"), np.full((2, 2, 4), (1, 2, 3, 128), np.uint8))
    parts = load(mesh_visual(write_two_materials(tmp_path), texture=tmp_path / "other.png"))
    (picture,) = [part for part in parts if part.texture is not None]
    np.testing.assert_array_equal(picture.texture[0, 0], (3, 2, 1, 128))
    assert picture.transparent


def test_an_stl_file_is_white_with_sharp_edges_and_outward_normals(tmp_path):
    trimesh.creation.box().export(str(tmp_path / "box.stl"))
    for scale in ((1.0, 1.0, 1.0), (-1.0, 2.0, 1.0)):
        (mesh,) = load(mesh_visual(tmp_path / "box.stl", scale))
        assert mesh.rgba == WHITE and len(mesh.vertices) == 24 and mesh.closed
        assert np.einsum("ij,ij->i", mesh.vertices, mesh.normals).min() > 0
        np.testing.assert_allclose(extents(mesh), np.abs(scale), atol=1e-6)


def test_a_collada_file_has_its_own_unit_and_colour(tmp_path):
    box = trimesh.creation.box((10, 20, 30))
    material = trimesh.visual.material.PBRMaterial(baseColorFactor=(255, 0, 0, 255))
    box.visual = trimesh.visual.TextureVisuals(material=material)
    box.vertex_normals = np.zeros_like(box.vertices)  # otherwise trimesh computes them with scipy
    text = trimesh.exchange.dae.export_collada(box).decode()
    (tmp_path / "box.dae").write_text(text.replace("<up_axis>", '<unit name="centimeter" meter="0.01"/><up_axis>'))
    (mesh,) = load(mesh_visual(tmp_path / "box.dae"))
    np.testing.assert_allclose(extents(mesh), (0.1, 0.2, 0.3), atol=1e-6)
    assert mesh.rgba == (1.0, 0.0, 0.0, 1.0) and mesh.closed


@pytest.mark.parametrize("name", ["missing.obj", "garbage.stl", "empty.obj", "picture.png", "broken.dae"])
def test_the_error_for_an_unreadable_file_names_it_in_one_line(tmp_path, name):
    if name != "missing.obj":
        (tmp_path / name).write_text("" if name == "empty.obj" else "this is no mesh\n" * 20)
    with pytest.raises(ValueError, match=name) as caught:
        load(mesh_visual(tmp_path / name))
    assert "\n" not in str(caught.value)


def test_an_unreadable_texture_is_refused(tmp_path):
    with pytest.raises(ValueError, match="nowhere"):
        load(visual(Box((1.0, 1.0, 1.0)), tmp_path / "nowhere.png"))
