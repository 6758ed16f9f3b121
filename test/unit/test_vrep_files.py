"""Reading of V-REP files; an invalid file is reported in one line."""

import itertools
import math
import struct

import numpy as np
import pytest
from vrep_encoder import (
    chunk,
    collection_item,
    container,
    file,
    integers,
    mesh,
    numbers,
    packed,
    scene_object,
    script,
    shape,
    text,
    weight,
)

from drone_sim.vrep_files.model import VrepCollection, VrepCollectionItem, VrepFileError
from drone_sim.vrep_files.reading import read, read_file
from drone_sim.vrep_files.shapes import _packed

HALF_TURN_ABOUT_Z = (0.0, 0.0, 0.0, 1.0)  # w, x, y, z


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize("version", [16, 22, 23, 24, 25])
def test_single_and_double_precision_with_and_without_compression(version, compressed):
    own = (
        integers("Jtt", 10)
        + numbers("_rt", "Prt", 0.5, version=version)
        + numbers("_mr", "Pmr", -1, 3, version=version)
    )
    joint = scene_object("JNT", 3, "Hinge", at=(1, 2, 3), own=own, version=version)
    (data,) = read(file(joint, version=version, compressed=compressed)).objects
    assert (data.name, data.pose.position, data.of.position, data.of.limits) == ("Hinge", (1, 2, 3), 0.5, (-1, 2))


def test_double_tag_takes_precedence_over_the_single_tag():
    level = numbers("_y2", "Dy2", 0.1, version=25) + numbers("_y2", "Dy2", 0.9, version=22)
    assert read(file(scene_object("DMY", 0, "D", own=level))).objects[0].of.size == 0.1


def test_unknown_tags_are_ignored():
    unknown = chunk("???", b"anything")
    dummy = scene_object("DMY", 0, "D", base=unknown, own=unknown)
    data = read(file(chunk("New", b"x"), dummy, version=25))
    assert [one.name for one in data.objects] == ["D"]


def test_a_child_may_come_before_its_parent():
    data = read(file(scene_object("DMY", 5, "Child", parent=9), scene_object("DMY", 9, "Parent"))).objects
    assert [one.name for one in data] == ["Parent", "Child"] and data[0].children == [data[1]]


def test_names_and_aliases():
    one = scene_object("DMY", 0, "Quadricopter#0", alias="target")
    two = scene_object("DMY", 1, "Drohne-é", alias="target")
    assert [(one.name, one.alias) for one in read(file(one, two)).objects] == [
        ("Quadricopter#0", "target"),
        ("Drohne-é", "target"),
    ]


# ---- shapes


def test_mesh_is_placed_in_the_frame_of_its_shape():
    data = read(file(shape(0, "S", mesh("cylinder", (2, 2, 5), (0, 0, 4), HALF_TURN_ABOUT_Z)))).objects[0].shape
    (one,) = data.meshes
    assert np.allclose(one.vertices, [[0, 0, 4], [-1, 0, 4], [0, -1, 4]])
    assert (one.primitive.word, one.primitive.size, one.primitive.pose.position) == ("cylinder", (2, 2, 5), (0, 0, 4))


@pytest.mark.parametrize("faces", ["Ind", "In2"])
def test_meshes_may_be_stored_in_a_pool(faces):
    indices = {"Ind": struct.pack("<3i", 2, 1, 0), "In2": packed([2, 1, 0])}[faces]
    pool = chunk("VIN", chunk("Ver", struct.pack("<9f", *range(9))) + chunk(faces, indices) + b"EOO")
    (one,) = read(file(pool, shape(0, "S", mesh(inline=False)))).objects[0].shape.meshes
    assert one.faces.tolist() == [[2, 1, 0]] and one.vertices[2].tolist() == [6, 7, 8]


def test_nested_compounds_are_flattened_and_the_root_has_the_mass():
    inner = chunk("Wrp", weight(7.0) + chunk("Geo", b"EOO" + mesh(size=(1, 2, 3))) + b"EOO")
    outer = chunk("Gsg", weight(0.5, (1, 2, 3), (0, 0, 0.1)) + inner + chunk("Geo", b"EOO" + mesh("sphere")) + b"EOO")
    own = chunk("Ge2", outer + b"EOO") + chunk("Sss", b"\x80") + chunk("Ss3", b"\x01")
    data = read(file(scene_object("SHP", 0, "S", own=own))).objects[0].shape
    assert [one.primitive.word for one in data.meshes] == ["cuboid", "spheroid"]
    assert (data.mass, data.inertia.moments, data.inertia.pose.position) == (0.5, (1, 2, 3), (0, 0, 0.1))
    assert data.is_dynamic and data.is_respondable


def test_packed_faces_of_every_length():
    indices = [0, 1, 9000, 3, 2_500_000, 2, 400_000_000, 0, 31]
    assert _packed(packed(indices)).ravel().tolist() == indices


def test_colours():
    new = chunk(
        "Cl0", chunk("Cl3", struct.pack("<15f", 0.1, 0.2, 0.3, *[0] * 12)) + chunk("Trf", struct.pack("<f", 0.5))
    )
    old = chunk(
        "Cl0", chunk("Cl2", struct.pack("<12f", 0.17, 0.34, 0.51, 0.34, 0.34, 0.34, *[0] * 6)) + chunk("Var", b"\x04")
    )
    data = [read(file(shape(0, "S", mesh(more=color)))).objects[0].shape.meshes[0].color for color in (new, old)]
    assert np.allclose(data, [(0.1, 0.2, 0.3, 0.5), (0.4, 0.6, 0.8, 1.0)])


# ---- other objects


def test_sensors_with_unset_values():
    volume = numbers("_s3", "Ss3", 0.1, 5.0, math.nan, 1e38, 0, 0, 0, 0, math.inf)
    ray = scene_object("SNR", 0, "Ray", own=integers("Snt", 34) + chunk("Vod", volume))
    eye = scene_object(
        "RSN", 1, "Eye", own=numbers("_cp", "Ccp", 1, 1.5, 0.01, 10) + integers("Res", 64, 32) + chunk("Va3", b"\1")
    )
    proximity, camera = (one.of for one in read(file(ray, eye)).objects)
    assert (proximity.kind, proximity.offset, proximity.range, proximity.angle) == ("ray", 0.1, 5.0, 0.0)
    assert (camera.is_perspective, camera.angle, camera.resolution) == (True, 1.5, (64, 32))


@pytest.mark.parametrize(
    "switches, mode, target", [(0x00, "passive", 0.7), (0x10, "velocity", 2.0), (0x30, "position", 0.7)]
)
def test_mode_and_target_of_a_joint(switches, mode, target):
    own = (
        integers("Jmd", 5)
        + chunk("Va9", bytes([switches | 1]))
        + numbers("_mp", "Dmp", 2, 9)
        + numbers("_tp", "Dtp", 0.7)
    )
    joint = read(file(scene_object("JNT", 0, "J", own=own))).objects[0].of
    assert (joint.mode, joint.target, joint.max_force, joint.limits) == (mode, target, 9.0, None)


def test_time_step_preset_takes_precedence_over_the_number():
    said = chunk("St2", struct.pack("<Q", 20_000)) + chunk("Sts", struct.pack("<f", 0.5))
    gravity = chunk("En3", struct.pack("<i3fi", 0, 0, 0, -9.81, 0))
    steps = [
        read(file(chunk("SIM", integers("Spi", preset) + said), chunk("DYN", gravity))).settings for preset in (4, 5)
    ]
    assert [one.time_step for one in steps] == [0.01, 0.02]
    assert (steps[0].gravity, steps[0].dynamics_step) == ((0, 0, -9.81), 0.005)


# ---- scripts


@pytest.mark.parametrize("code", ["", "x", "ab", "abc", "-- été\nx = 1", "\x7f\x80 far"])
def test_script_texts_of_any_length_and_characters(code):
    (data,) = read(file(scene_object("DMY", 4, "D"), script(4, code, parameters=[("gain", "2.5")]))).scripts
    assert (data.text, data.object, data.kind, data.parameters) == (code, 4, "child", (("gain", "2.5"),))


def test_latin_1_script_without_its_language_line_and_trailing_zeros():
    (data,) = read(file(script(-1, b"--lua\r\nx = '\xe9'\r\n\0\0"))).scripts
    assert data.text == "x = 'é'\n"


def test_script_object_belongs_to_its_parent():
    own = script(99, "x = 1", tag="Soo", more=chunk("Lne", text("lua")))
    script_object = scene_object("SCT", 8, "Script", parent=2, own=own)
    (data,) = read(file(scene_object("DMY", 2, "D"), script_object, version=25)).scripts
    assert (data.object, data.text, data.is_enabled) == (2, "x = 1", True)


@pytest.mark.parametrize("switches, enabled", [(8, True), (9, True), (10, False)])
def test_switches_of_a_script_tell_whether_it_is_enabled(switches, enabled):
    (data,) = read(file(scene_object("DMY", 0, "D"), script(0, "x = 1", switches=switches))).scripts
    assert data.is_enabled == enabled


def test_a_collection():
    items = collection_item(7, 1) + collection_item(8, 3, removes=True)
    (data,) = read(
        file(chunk("GRP", chunk("Grn", text("arm")) + integers("Gix", 2000000) + items + b"EOO"))
    ).collections
    assert data == VrepCollection(
        "arm", (VrepCollectionItem("tree", 7, False, False), VrepCollectionItem("chain", 8, True, False))
    )
    with pytest.raises(VrepFileError, match="collection 1: Gty: an item of type 9"):
        read(file(chunk("GRP", collection_item(7, 9) + b"EOO")))


# ---- invalid files


def small_file(compressed=False):
    pool = chunk(
        "VIN", chunk("Ver", struct.pack("<9f", *range(9))) + chunk("Ind", struct.pack("<3i", 2, 1, 0)) + b"EOO"
    )
    one = shape(0, "S", mesh(inline=False), mesh("sphere"), dynamic=True)
    return file(
        pool,
        one,
        scene_object("JNT", 1, "J", parent=0),
        script(1, "abcdef", parameters=[("a", "1")]),
        compressed=compressed,
    )


def test_file_cut_at_any_byte_is_reported_in_one_line():
    whole = small_file()
    for length in itertools.chain(range(0, 1021, 100), range(1020, len(whole))):
        with pytest.raises(VrepFileError) as error:
            read(whole[:length])
        assert str(error.value) and "\n" not in str(error.value)


def test_payload_cut_at_any_byte_is_refused():
    """The header has the length of the cut payload, so the error is found within the chunks."""
    payload = small_file()[1021:]
    for length in range(len(payload)):
        with pytest.raises(VrepFileError):
            read(container(payload[:length]))


def test_truncated_compressed_file_is_refused():
    whole = small_file(compressed=True)
    for length in (1021, 1022, 1100, 1021 + 320, len(whole) - 2):
        with pytest.raises(VrepFileError, match=r"is truncated|ends within its Huffman tree"):
            read(whole[:length])


@pytest.mark.parametrize("size", [-1, -(2**31), 2**31 - 1, 10**6])
def test_impossible_chunk_sizes_are_refused(size):
    payload = small_file()[1021:]
    at = payload.index(b"Ge2") + 3
    broken = payload[:at] + struct.pack("<i", size) + payload[at + 4 :]
    with pytest.raises(VrepFileError, match=r"Ge2: a chunk of .* does not fit"):
        read(container(broken))


def _nested(depth):
    geometry = chunk("Geo", b"EOO" + mesh())
    for _ in range(depth):
        geometry = chunk("Wrp", geometry + b"EOO")
    return file(scene_object("SHP", 0, "S", own=chunk("Ge2", geometry + b"EOO")))


def _chain(length):
    return file(*(scene_object("DMY", number, f"D{number}", parent=number - 1) for number in range(length)))


INVALID_FILES = {
    "empty": (b"", "is empty"),
    "foreign": (b"solid cube" * 200, "is not a file of V-REP"),
    "no header": (b"VREP1234", "is truncated"),
    "too new": (container(b"", version=30)[:8] + struct.pack("<i", 30) + container(b"")[12:], "has format"),
    "too old": (container(b"", version=12), "has format 12"),
    "compressed otherwise": (container(b"")[:12] + b"\7" + container(b"")[13:], "has compression 7"),
    "negative length": (container(b"", length=-5), "-5 bytes"),
    "huge": (container(b"", length=2**31 - 1), "at most"),
    "longer than it is": (container(b"EOF", length=1000), "3 of 1000 bytes"),
    "no end": (container(b""), "has no EOF"),
    "one leaf": (container(b"x" * 100, compressed=True)[:1021] + b"\xff" * 100, "single leaf"),
    "endless tree": (container(b"x" * 100, compressed=True)[:1021] + b"\0" * 5000, "more than 256 leaves"),
    "a loop of parents": (file(scene_object("DMY", 0, "A", 1), scene_object("DMY", 1, "B", 0)), "object A: is its own"),
    "its own parent": (file(scene_object("DMY", 0, "A", 0)), "object A: is its own ancestor"),
    "no such parent": (file(scene_object("DMY", 0, "A", 7)), "object A: its parent 7 is not in the file"),
    "a handle twice": (file(scene_object("DMY", 0, "A"), scene_object("DMY", 0, "B")), "same handle 0"),
    "not a number": (file(scene_object("DMY", 0, "A", at=(math.nan, 0, 0))), "object A: Cfq: the number nan"),
    "no rotation": (file(scene_object("DMY", 0, "A", turned=(0, 0, 0, 0))), "object A: _fq: the quaternion has"),
    "no such vertex": (
        file(shape(0, "S", mesh().replace(packed([0, 1, 2]), packed([0, 1, 9])))),
        "object S: a face refers to a vertex",
    ),
    "no such mesh": (file(shape(0, "S", mesh(inline=False))), "object S: Vev: the file has no mesh 0"),
    "many parameters": (
        file(scene_object("DMY", 0, "A", base=chunk("Lsp", integers("Par", 2**30) + b"EOO"))),
        "object A: Par: 1073741824 script parameters",
    ),
    "deep compounds": (_nested(100), "deeper than 16"),
    "a deep tree": (_chain(300), "deeper than 200 levels"),
}


@pytest.mark.parametrize("content, words", INVALID_FILES.values(), ids=INVALID_FILES)
def test_invalid_file_is_reported_in_one_line_with_its_path(tmp_path, content, words):
    path = tmp_path / "scene.ttt"
    path.write_bytes(content)
    with pytest.raises(VrepFileError) as error:
        read_file(path)
    said = str(error.value)
    assert said.startswith(f"{path}: ") and words in said and "\n" not in said


def test_folder_or_missing_file_is_refused(tmp_path):
    for path in (tmp_path, tmp_path / "none.ttt"):
        with pytest.raises(VrepFileError, match=str(path)):
            read_file(path)
