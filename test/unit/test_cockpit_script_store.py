"""The cockpit's scripts and lessons without a browser: reading, writing, and the lesson shown beside a script."""

import json
import os
from pathlib import Path

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from cockpit_asked import LESSONS, Asked

from drone_sim.files import writing
from drone_sim.grading import tasks
from drone_sim.ros.cockpit.editor.lessons import Lessons
from drone_sim.ros.cockpit.editor.script_store import LARGEST, ScriptStore, ScriptStoreError

STAGES = [
    f"tutorial/{name}.py"
    for name in ("1_thrust", "2_elevation", "3_yaw", "4_pitch", "5_roll", "6_ros", "7_camera", "8_gate")
]


@pytest.fixture(name="own")
def _own(tmp_path):
    """The user's folder, which does not exist yet."""
    return tmp_path / "mine"


@pytest.fixture(name="store")
def _store(tmp_path, own):
    pilot = tmp_path / "pilot.py"
    pilot.write_text("shipped", encoding="utf-8")
    return ScriptStore(own, {"built-in": lambda: {"pilot.py": pilot}})


@pytest.fixture(name="ask")
def _ask(own, tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    return Asked(ScriptStore(own))


# ---- reading and writing


def test_saving_a_script_of_the_package_creates_a_copy(store, own):
    pilot = store.find("built-in/pilot.py")
    copy, version = store.save(pilot, "changed", "")
    assert copy.name == "mine/pilot.py" and (own / "pilot.py").read_text() == "changed"
    assert store.read(pilot)[0] == "shipped"
    again, _ = store.save(copy, "changed again", version)
    assert again == copy and store.original(copy) == "shipped"
    assert store.save(pilot, "other", "")[0].name == "mine/pilot_2.py", "the earlier copy is kept"


def test_a_page_that_resends_its_draft_writes_into_the_same_copy(store, own):
    pilot = store.find("built-in/pilot.py")
    for text in ("# mi", "# mine"):  # the page was closed before the reply, and resends all when it is reopened
        copy, _ = store.save(pilot, text, "", "draft")
        assert copy.name == "mine/pilot.py" and (own / "pilot.py").read_text() == text
    (own / "pilot.py").write_text("by another program")
    assert store.save(pilot, "# mine!", "", "draft")[0].name == "mine/pilot_2.py"
    assert store.save(pilot, "# mine", "", "another")[0].name == "mine/pilot_3.py"
    assert (own / "pilot.py").read_text() == "by another program"


def test_a_file_changed_elsewhere_is_not_overwritten_and_both_texts_are_kept(store, own):
    script, version = store.save_as("x.py", "first")
    assert store.version("mine/x.py") == version
    (own / "x.py").write_text("theirs", encoding="utf-8")
    assert store.version("mine/x.py") != version
    assert store.save(script, "mine", version) is None and (own / "x.py").read_text() == "theirs"
    _, version, other = store.keep_both("mine/x.py", "mine", True)
    assert other == "mine/x_2.py" and (own / "x_2.py").read_text() == "theirs" and (own / "x.py").read_text() == "mine"
    assert store.save(script, "mine again", version)
    _, _, other = store.keep_both("mine/x.py", "third", False)
    assert (
        (own / "x.py").read_text() == "mine again"
        and (own / "x_3.py").read_text() == "third"
        and other == "mine/x_3.py"
    )


def test_a_deleted_file_is_reported_and_can_be_written_again(ask, own):
    saved = ask("save_as", name="x.py", text="a")
    digest = ask("look", script="mine/x.py")["digest"]
    (own / "x.py").unlink()
    assert ask("look", script="mine/x.py")["version"] == "" and ask("look", script="mine/x.py")["digest"] != digest
    assert ask("save", script="mine/x.py", text="b", version=saved["version"]) == {"changed": True}
    reply = ask("keep", script="mine/x.py", text="b", mine=False)
    assert reply["text"] == "b" and reply["other"] == "" and (own / "x.py").read_text() == "b"


@pytest.mark.parametrize(
    "name", ["/etc/passwd", "mine/../../x.py", "built-in/../x", "tasks/hover/solution.py", "", None, 3, ["a"]]
)
def test_only_listed_scripts_can_be_opened(ask, name):
    with pytest.raises(ScriptStoreError, match="no such script"):
        ask("open", script=name)


@pytest.mark.parametrize(
    "name, words",
    [
        ("../x.py", "letters, digits"),
        ("a/b.py", "letters, digits"),
        (".x.py", "must not begin"),
        ("a\nb.py", "letters, digits"),
        ("x.txt", "ends in .py or .lua"),
        ("", "1 to 100"),
        ("x" * 200 + ".py", "1 to 100"),
        (None, "1 to 100"),
    ],
)
def test_a_new_name_is_checked(store, own, name, words):
    with pytest.raises(ScriptStoreError, match=words) as error:
        store.save_as(name, "text")
    assert "\n" not in str(error.value) and not own.exists()


def test_an_existing_script_is_not_overwritten_by_save_as(store, own):
    store.save_as("ü b.py", "first")
    with pytest.raises(ScriptStoreError, match="is there already"):
        store.save_as("ü b.py", "second")
    assert (own / "ü b.py").read_text() == "first"


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda file: file.write_bytes(b"# fine\n\xff\xfe"), "line 2: is not UTF-8"),
        (lambda file: file.write_bytes(b"#" * (LARGEST + 1)), "larger than 1 MiB"),
        (os.mkfifo, "must be a regular file"),
        (lambda file: file.mkdir(), "must be a regular file"),
        (lambda file: file.symlink_to("/etc/hostname"), "a link to a file outside"),
        (lambda file: file.symlink_to("nowhere.py"), "No such file"),
    ],
)
def test_an_unreadable_script_gets_one_line(ask, own, make, words):
    own.mkdir()
    make(own / "odd.py")
    with pytest.raises(ScriptStoreError, match=words) as error:
        ask("open", script="mine/odd.py")
    assert "mine/odd.py" in str(error.value) and "\n" not in str(error.value)


def test_a_script_whose_name_is_not_utf8_can_be_opened_but_not_run(ask, own):
    own.mkdir()
    Path(os.fsdecode(os.fsencode(own) + b"/\xff.py")).write_text("text")
    name = ask("scripts")["groups"][-1]["scripts"][0]
    assert json.loads(json.dumps(ask("open", script=name)))["text"] == "text" and ask("look", script=name)["version"]
    with pytest.raises(ScriptStoreError, match="under another name"):
        ask("run", script=name, lesson="")


def test_saving_keeps_the_line_endings(store, own):
    own.mkdir()
    (own / "dos.py").write_bytes(b"a\r\nb\r\n")
    script = store.find("mine/dos.py")
    text, version = store.read(script)
    assert text == "a\nb\n"
    store.save(script, "a\nc\nb\n", version)
    assert (own / "dos.py").read_bytes() == b"a\r\nc\r\nb\r\n"


def test_a_failed_write_is_reported_and_leaves_the_file_unchanged(store, own, monkeypatch):
    script, version = store.save_as("x.py", "kept")
    with pytest.raises(ScriptStoreError, match="at most"):
        store.save(script, "x" * (LARGEST + 1), version)
    with pytest.raises(ScriptStoreError, match="half of a character"):
        store.save(script, "\ud800", version)

    def full(*_):
        raise OSError(28, "No space left on device", str(own / "x.py"))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(ScriptStoreError, match=r"mine/x.py: .*No space left on device"):
        store.save(script, "lost?", version)
    assert (own / "x.py").read_text() == "kept" and len(list(own.iterdir())) == 1
    with pytest.raises(ScriptStoreError, match=r"File exists|Not a directory"):
        ScriptStore(own / "x.py", {}).save_as("y.py", "text")


# ---- links and special files


def _link(place, outside):
    place.symlink_to(outside)


def _fifo(place, _outside):
    os.mkfifo(place)


def _folder(place, _outside):
    place.mkdir()


@pytest.mark.parametrize("put", [_link, _fifo, _folder])
def test_nothing_is_written_through_a_link_fifo_or_folder_of_the_same_name(store, own, tmp_path, put):
    own.mkdir()
    outside = tmp_path / "outside.py"
    put(own / "pilot.py", outside)  # the link dangles
    copy, version = store.save(store.find("built-in/pilot.py"), "text", "")
    assert copy.name == "mine/pilot_2.py" and (own / "pilot_2.py").read_text() == "text"
    put(own / "pilot_2_2.py", outside)
    assert store.keep_both(copy.name, "mine", True)[2] == "mine/pilot_2_3.py"
    put(own / "pilot_2_4.py", outside)
    assert store.keep_both(copy.name, "other", False)[2] == "mine/pilot_2_5.py"
    for name in ("mine/pilot.py", "mine/pilot_2_2.py"):
        with pytest.raises(ScriptStoreError, match=rf"{name}: ") as error:
            store.keep_both(name, "text", put is not _link)
        assert "\n" not in str(error.value)
    with pytest.raises(ScriptStoreError, match="is there already"):
        store.save_as("pilot.py", "text")
    assert not outside.exists() and version


@pytest.mark.parametrize("put", [_link, _fifo, _folder])
@pytest.mark.parametrize("how", ["save", "save as", "copy", "keep mine", "keep theirs"])
def test_a_link_created_between_check_and_write_is_not_followed(store, own, tmp_path, monkeypatch, how, put):
    """As when an archive is unpacked at the same time: the name is taken after the check and before the write."""
    script, version = store.save_as("x.py", "first")
    outside = tmp_path / "outside.py"
    outside.write_text("theirs", encoding="utf-8")
    acts = {
        "save": ("x.py", lambda: store.save(script, "text", version)),
        "save as": ("y.py", lambda: store.save_as("y.py", "text")),
        "copy": ("pilot.py", lambda: store.save(store.find("built-in/pilot.py"), "text", "")),
        "keep mine": ("x_2.py", lambda: store.keep_both("mine/x.py", "text", True)),
        "keep theirs": ("x_2.py", lambda: store.keep_both("mine/x.py", "text", False)),
    }
    name, act = acts[how]

    def with_replacement(function):
        def replace_and_call(*arguments, **options):
            if not (own / name).is_symlink() and (not (own / name).exists() or name == "x.py"):
                (own / name).unlink(missing_ok=True)
                put(own / name, outside)
            return function(*arguments, **options)

        return replace_and_call

    for function in ("write", "write_new"):
        monkeypatch.setattr(writing, function, with_replacement(getattr(writing, function)))
    try:
        act()
    except ScriptStoreError as error:
        assert "\n" not in str(error) and f"mine/{name}" in str(error)
    assert outside.read_text() == "theirs"
    assert not [one for one in own.iterdir() if one.name.startswith(".")], "no temporary file is left"


def test_saving_through_a_link_within_the_folder_keeps_the_link(store, own):
    script, _ = store.save_as("real.py", "first")
    (own / "again.py").symlink_to("real.py")
    again = store.find("mine/again.py")
    assert store.save(again, "second", store.version(again.name))
    assert (own / "again.py").is_symlink() and script.path.read_text() == "second"


def test_the_users_folder_may_be_a_link(tmp_path):
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to("real")
    store = ScriptStore(tmp_path / "link", {})
    script, version = store.save_as("x.py", "a")
    assert store.save(script, "b", version) and (tmp_path / "real" / "x.py").read_text() == "b"


# ---- lessons


def test_every_stage_and_every_task_has_a_lesson_and_a_script(ask):
    lists = ask("scripts")
    groups = {one["name"]: one["scripts"] for one in lists["groups"]}
    assert list(groups) == ["built-in", "tutorial", "solutions", "tasks", "mine"]
    assert lists["flown"] == "built-in/pilot.py"
    in_lua = [one.replace(".py", ".lua") for one in STAGES[:6]]
    assert groups["tutorial"] == sorted([*STAGES, *in_lua])
    assert groups["tasks"] == [f"tasks/{name}.py" for name in tasks.names()]
    assert ask("lesson", lesson=ask("open", script=in_lua[1])["lesson"])["script"] == STAGES[1]
    for script in (*STAGES, *groups["tasks"]):
        opened = ask("open", script=script)
        lesson = ask("lesson", lesson=opened["lesson"])
        assert lesson["script"] == script and lesson["text"].startswith("#") and len(lesson["text"]) > 500
        assert "solution" not in opened["file"] and "solution" not in opened["text"].lower()
    assert ask("open", script="built-in/pilot.py")["lesson"] == ""


def test_a_users_script_belongs_to_a_lesson_by_its_name(ask):
    ask("save_as", name="2_elevation_of_mine.py", text="")
    ask("save_as", name="hoverfly.py", text="")
    assert ask("open", script="mine/2_elevation_of_mine.py")["lesson"] == "stage-2-elevation"
    assert ask("lesson", lesson="stage-2-elevation")["script"] == "mine/2_elevation_of_mine.py"
    assert ask("open", script="mine/hoverfly.py")["lesson"] == ""


def test_a_solution_and_its_copy_belong_to_the_stage_of_their_number(ask):
    assert ask("open", script="solutions/5_square.py")["lesson"] == "stage-5-roll"
    ask("save_as", name="5_square.py", text="")
    assert ask("open", script="mine/5_square.py")["lesson"] == "stage-5-roll"
    assert ask("lesson", lesson="stage-5-roll")["script"] == "tutorial/5_roll.py"


def test_a_lesson_ends_at_the_next_heading_outside_of_code_blocks(tmp_path):
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "tutorial.md").write_text("# T\n## One\na\n```\n## no\n```\n## Two: b\n", encoding="utf-8")
    sections = [one for one in Lessons(tmp_path).all() if not one.task]
    assert [(one.name, one.text) for one in sections] == [("one", "## One\na\n```\n## no\n```"), ("two-b", "## Two: b")]


def test_only_the_pictures_of_lessons_are_served():
    kind, content = LESSONS.picture("/docs/pictures/tutorial_loops.png")
    assert kind == "image/png" and content.startswith(b"\x89PNG") and LESSONS.picture("/tasks/hover/picture.png")
    for path in (
        "/docs/pictures/../../setup.py",
        "/tasks/hover/plan.yaml",
        "/tasks/../../x/a.png",
        "/docs/pictures/tutorial_no.png",
    ):
        assert LESSONS.picture(path) is None


# ---- renaming, duplicating and deleting


def test_renaming_a_script_overwrites_no_other_file(store, own):
    script, version = store.save_as("x.py", "text")
    store.save(script, "changed", version)
    renamed, version = store.rename(script, "y.lua")
    assert renamed.name == "mine/y.lua" and (own / "y.lua").read_text() == "changed" and not (own / "x.py").exists()
    assert store.original(renamed) == "text" and store.version("mine/y.lua") == version
    other, _ = store.save_as("z.py", "other")
    for name in ("z.py", "../z.py", "z.txt", ".z.py", ""):
        with pytest.raises(ScriptStoreError):
            store.rename(renamed, name)
    with pytest.raises(ScriptStoreError, match="belongs to the package"):
        store.rename(store.find("built-in/pilot.py"), "mine.py")
    assert store.read(other)[0] == "other" and (own / "y.lua").exists()


def test_a_duplicate_has_the_text_shown_in_the_editor(store, own):
    copy, _ = store.duplicate(store.find("built-in/pilot.py"), "shown")
    again, _ = store.duplicate(copy, "shown too")
    assert (copy.name, again.name) == ("mine/pilot.py", "mine/pilot_2.py")
    assert (own / "pilot_2.py").read_text() == "shown too"


def test_a_deleted_script_is_restored_byte_by_byte(store, own):
    own.mkdir()
    (own / "x.py").write_bytes(b"a\r\nb\xff")
    store.remove(store.find("mine/x.py"))
    assert not (own / "x.py").exists()
    (own / "x.py").write_text("another's")
    back, _ = store.bring_back("mine/x.py")
    assert back.name == "mine/x_2.py" and back.path.read_bytes() == b"a\r\nb\xff"
    with pytest.raises(ScriptStoreError, match="not deleted here"):
        store.bring_back("mine/x.py")
    with pytest.raises(ScriptStoreError, match="belongs to the package"):
        store.remove(store.find("built-in/pilot.py"))


def test_a_link_to_a_file_outside_is_neither_renamed_nor_deleted(store, own, tmp_path):
    own.mkdir()
    (tmp_path / "outside.py").write_text("outside")
    (own / "x.py").symlink_to(tmp_path / "outside.py")
    link = next(one for one in store.scripts() if one.is_own)
    for act in (store.remove, lambda one: store.rename(one, "y.py")):
        with pytest.raises(ScriptStoreError, match="a link to a file outside"):
            act(link)
    assert (tmp_path / "outside.py").read_text() == "outside" and (own / "x.py").is_symlink()


def test_renaming_the_running_script_updates_the_parameter_of_the_simulation(ask, own):
    ask("save_as", name="x.py", text="x = 1")
    ask.node.parameters["script"] = str(own / "x.py")
    assert ask("rename", script="mine/x.py", name="y.py")["script"] == "mine/y.py"
    assert ask.node.parameters["script"] == str(own / "y.py")
    assert ask("locate", file=str(own / "y.py")) == {"script": "mine/y.py"} and ask("locate", file=1) == {"script": ""}
    assert ask("locate", file="pilot") == {"script": "built-in/pilot.py"}
    assert ask("locate", file="tutorial_v3") == {"script": "built-in/tutorial_v3.lua"}
    ask("delete", script="mine/y.py")
    assert ask("bring back", script="mine/y.py")["script"] == "mine/y.py"
    assert ask("check", text="x = = 1", lua=False)["found"][0]["line"] == 1
    assert any(row[1] == "getObjectPosition" for row in ask("api")["functions"])
