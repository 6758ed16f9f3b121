"""YAML files: surprising or unbounded input is refused in one line, and written values are read back."""

import os

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drone_sim.files import yaml_files, yaml_writing
from drone_sim.run import parameters
from drone_sim.run.parameters import ParameterError


def bomb(levels, start, link):
    lines = [f"a0: &a0 {start}", *(f"a{n}: &a{n} {link.replace('*', f'*a{n - 1}')}" for n in range(1, levels))]
    return "\n".join(lines)


@pytest.mark.parametrize(
    "text, words",
    [
        (bomb(9, "[1, 2, 3, 4, 5, 6, 7, 8, 9]", "[*, *, *, *, *, *, *, *, *]"), "more than 100000 values"),
        (bomb(25, "{k: v}", "{<<: [*, *]}"), "more than"),
        (bomb(5000, "{k: v}", "{k: *}"), "more than 32 deep (line 3"),
        ("a: &a [*a]", "more than 32 deep (line 1"),
        ("[" * 100_000, "more than 32 deep (line 1, column "),
        ("{a: " * 100_000, "more than 32 deep"),
        ("\n".join(" " * n + "a:" for n in range(1000)), "more than 32 deep (line 33"),
        ("x: [" + "1," * 300_000 + "]", "more than 100000 values"),
        ("a: 1\nb: 2\na: 3", "key 'a' is given twice (line 3, column 1)"),
        ("a: {b: 1, b: 2}", "key 'b' is given twice (line 1, column 11)"),
        ("1: 2", "key '1' must be a string (line 1"),
        ("true: 2", "key 'true' must be a string"),
        ("~: 2", "key '~' must be a string"),
        ("? [1, 2]\n: 3", "must be a string"),
        ("a: 1\n---\na: 2", "expected a single document"),
        ("a:\n\t1", "cannot start any token (line 2"),
        ('a: "\0"', "#x0000"),
        ("a: !!python/object/apply:os.system [ls]", "is not allowed (line 1, column 4)"),
        ("a: !!binary aGFsbG8=", "tag:yaml.org,2002:binary' is not allowed"),
        ("a: !other 1", "the tag '!other' is not allowed"),
        ("a: " + "9" * 100_000, "a number of 100000 characters (line 1"),
        ('a: !!int "1:30"', "'1:30' is not a number"),
        ("a: *nobody", "undefined alias (line 1"),
        ("x" * 2_000_000, "larger than 1 MiB"),
    ],
)
def test_surprising_or_unbounded_yaml_is_refused_in_one_line(text, words):
    with pytest.raises(yaml_files.YamlError) as caught:
        yaml_files.parse(text)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 300


@pytest.mark.parametrize(
    "text, value",
    [
        *(("1e3", 1000.0), ("-1.5E-2", -0.015), ("+.5", 0.5), ("5.", 5.0), ("010", 10), ("0x1F", 31), ("-7", -7)),
        *(("1:30", "1:30"), ("1:30.5", "1:30.5"), ("1_000", "1_000"), ("2001-01-01", "2001-01-01"), (".5.5", ".5.5")),
        *(("-.inf", float("-inf")), (".INF", float("inf")), ("true", True), ("~", None), ("''", ""), ("-", [None])),
    ],
)
def test_scalars_are_those_of_yaml_1_2(text, value):
    read = yaml_files.parse(text)
    assert read == value and type(read) is type(value)


def test_aliases_and_merges_work():
    assert yaml_files.parse("a: &a {x: 1}\nb: {<<: *a, y: 2}\nc: [*a, *a]") == {
        "a": {"x": 1},
        "b": {"x": 1, "y": 2},
        "c": [{"x": 1}, {"x": 1}],
    }


@pytest.mark.parametrize(
    "name", ["/dev/zero", "/tmp", "fifo", "no.yaml", "x" * 300, "a\0b", "latin.yaml", "utf16.yaml"]
)
def test_only_regular_files_in_utf_8_are_read(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    os.mkfifo("fifo")
    (tmp_path / "latin.yaml").write_bytes(b"gravity: 1\nscript: \xff")
    (tmp_path / "utf16.yaml").write_bytes("gravity: 1".encode("utf-16"))
    for key in ("config", "scene_file"):
        with pytest.raises(ParameterError) as caught:
            parameters.load({key: name})
        assert name[:50].split("\0")[0] in str(caught.value)
        assert "\n" not in str(caught.value) and len(str(caught.value)) < 900
    if name == "latin.yaml":
        assert "line 2: must be text in UTF-8" in str(caught.value)


def test_refused_paths_leave_no_open_file_descriptor(tmp_path):
    os.mkfifo(tmp_path / "pipe.yaml")
    (tmp_path / "large.yaml").write_text(" " * (2**20 + 1))
    before = len(os.listdir("/proc/self/fd"))
    for name in ("", "pipe.yaml", "large.yaml"):
        with pytest.raises(yaml_files.YamlError):
            yaml_files.read(tmp_path / name)
    assert len(os.listdir("/proc/self/fd")) == before


WRITTEN = """\
# above
floor:            # wide
  size: 20.0      # enough
  # and more
  edge: true
defaults: &own {mass: 2, color: [1, 0, 0]}
objects:
- name: A   # first
  position: &here [0, 0, 1]
  size: [1,
         2]
# before B
- {name: B, size: [0.2], position: *here}   # second
-   name: "C: d"
    <<: *own

    position: *here
  # below C
# the end
"""
ITEM = {"name": "New", "parts": [{"size": 1.5}, {"size": [2, "a: b"]}], "on": True, "off": None}
VALUES = st.sampled_from([1, 2.5, "x: y", None, [1, 2], {"a": {"b": 1}}, [ITEM], {}])


@given(
    keys=st.dictionaries(st.sampled_from(["floor", "defaults", "new"]), VALUES),
    floor=st.dictionaries(st.sampled_from(["size", "edge", "tile"]), VALUES),
    stay=st.lists(st.sampled_from([0, 1, 2]), unique=True).map(sorted),
    changes=st.dictionaries(st.sampled_from(["name", "position", "size", "mass", "more"]), VALUES),
    removed_key=st.sampled_from(["name", "position", "size", "none"]),
    added_count=st.integers(0, 2),
)
def test_rewritten_text_has_the_requested_values(keys, floor, stay, changes, removed_key, added_count):
    original = yaml_files.parse(WRITTEN)
    items = [original["objects"][index] for index in stay]
    for item in items[:1]:
        item.update(changes)
        item.pop(removed_key, None)
    new = {**original, "floor": {**original["floor"], **floor}, **keys, "objects": [*items, *[ITEM] * added_count]}
    rewritten = yaml_writing.YamlText(WRITTEN).rewrite(new, {"objects": [*stay, *[None] * added_count]})
    assert yaml_writing.has_values(rewritten, new), rewritten
    assert "# above\n" in rewritten


@pytest.mark.parametrize("layout", ["block", "compact", "line", "scene"])
def test_values_survive_dump_and_parse_in_every_layout(layout):
    strings = {text: text for text in ("1e3", "1:30", "010", "0x1F", "yes", "~", ".inf", "2001-01-01", "a: b", "å", "")}
    long = {f"key {number}": "word " * number for number in range(9)}
    values = {**strings, "numbers": [1, -2.5, 1e300, 1e15, float("inf")], "long": [long], "inner": {"a": {"b": [long]}}}
    assert yaml_files.parse(yaml_writing.dump(values, layout)) == values
