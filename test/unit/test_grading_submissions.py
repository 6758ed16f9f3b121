"""Submissions of a class: folders, Moodle and Gradescope zips, tables, hostile files, similarity."""

import os
import stat
import zipfile
from pathlib import Path

import pytest
from graded import read_plan

from drone_sim.grading import grade, tasks
from drone_sim.grading.jobs.files import Unreadable
from drone_sim.grading.submissions import archive, folders, similarity
from drone_sim.grading.submissions.folders import submissions_of
from drone_sim.grading.submissions.submission import Person, Submission, names_of

SCRIPT = "def sysCall_init():\n    pass\n"
METADATA = """---
submission_11:
  :submitters:
  - :name: Ada Lovelace
    :sid: '007'
    :email: ada@x.org
  - :name: Bo Ek
  :created_at: 2026-11-01 10:00:00.0 Z
  :results: !ruby/object:Thing {a: 1}
submission_12:
  :submitters:
  - :name: Che Li
"""


def write(folder, **files):
    for name, text in files.items():
        path = folder / name.replace("__", "/").replace("_dot_", ".")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


def pack(path, members):
    """Write a zip file of {name or ZipInfo: content} and return its path."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, content in members.items():
            file.writestr(name, content)
    return path


def moodle(name, number, file=""):
    return f"{name}_{number}_assignsubmission_file_{file}"


def found(given, tmp_path):
    """Return the submissions in `given` by student's name, or by file name if there is none."""
    return {one.name or Path(one.script).name: one for one in submissions_of(str(given), tmp_path / "store")}


def test_a_folder_may_hold_scripts_and_folders_with_one_script(tmp_path):
    folder = tmp_path / "class"
    write(
        folder, alice_dot_py=SCRIPT, bob__deep__main_dot_lua="function sysCall_init() end\n", bob__pid_dot_py="x = 1\n"
    )
    write(folder, helper_dot_py="x = 1\n", notes_dot_txt=SCRIPT, empty__notes_dot_txt="")
    write(folder, **{".git__hook_dot_py": SCRIPT})
    (folder / "carol.py").symlink_to("nowhere.py")
    pack(folder / "dave.zip", {"mine/main.py": SCRIPT, "mine/pid.py": "x = 1\n"})
    submissions = submissions_of(str(folder), tmp_path / "store")
    scripts = [one.script.removeprefix(f"{folder}/") for one in submissions]
    assert scripts[:3] == ["alice.py", "bob/deep/main.lua", "carol.py"] and scripts[3].endswith("/mine/main.py")
    assert not any(one.error or one.people for one in submissions) and len(scripts) == 4


def test_a_name_or_path_of_a_script_is_one_submission(tmp_path):
    for given in ("pilot", str(tmp_path / "none.py")):
        assert submissions_of(given, tmp_path) == [Submission(given)]


def test_empty_folders_and_folders_with_two_scripts_are_reported(tmp_path):
    folder = tmp_path / "class"
    folder.mkdir()
    with pytest.raises(ValueError, match="no submission is in it"):
        submissions_of(str(folder), tmp_path)
    write(folder, dave__one_dot_py=SCRIPT, dave__two_dot_py=SCRIPT, eve__notes_dot_txt="", fay__my_dot_py=SCRIPT)
    dave, eve, fay = submissions_of(str(folder), tmp_path)
    assert dave.error.startswith("'dave': holds 2 child scripts (one.py, two.py)")
    assert eve.error.startswith("'eve': holds no child script") and not fay.error


def test_a_moodle_zip_is_read_with_and_without_folders(tmp_path):
    inner = pack(tmp_path / "inner.zip", {"project/main.py": SCRIPT, "project/pid.py": ""}).read_bytes()
    path = pack(
        tmp_path / "Hover-42.zip",
        {
            f"{moodle('Ada Lovelace', 7)}/my.py": SCRIPT,
            f"{moodle('Ada Lovelace', 7)}/gains/pid.py": "x = 1\n",
            "Ada Lovelace_7_assignsubmission_onlinetext_/onlinetext.html": "hello",
            moodle("Bo Ek", 8, "main.py"): SCRIPT,
            moodle("Bo Ek", 8, "helper_1.py"): "x = 1\n",
            moodle("Che_Li", 9, "all.zip"): inner,
            moodle("Bo Ek", 10, "notes.pdf"): b"%PDF",
        },
    )
    submissions = submissions_of(str(path), tmp_path / "store")
    people = [one.people for one in submissions]
    numbers = {"Ada Lovelace": "7", "Bo Ek": "10"}, {"Bo Ek": "8", "Che_Li": "9"}
    assert people == [(Person(name, number),) for some in numbers for name, number in some.items()]
    ada, none, bo, che = submissions
    assert Path(ada.script).name == "my.py" and (Path(ada.script).parent / "gains/pid.py").is_file()
    assert Path(bo.script).name == "main.py" and (Path(bo.script).parent / "helper_1.py").is_file()
    assert che.script.endswith("/project/main.py") and "holds no child script" in none.error
    assert names_of(submissions)[bo.script] == "Bo Ek (8)" and names_of(submissions)[ada.script] == "Ada Lovelace"
    assert [one.script for one in submissions_of(str(path), tmp_path / "store")] == [one.script for one in submissions]


def test_a_gradescope_export_is_read_as_zip_and_as_folder(tmp_path):
    members = {
        "assignment_1_export/submission_metadata.yml": METADATA,
        "assignment_1_export/submission_11/my.py": SCRIPT,
        "assignment_1_export/submission_12/a.py": SCRIPT,
        "assignment_1_export/submission_12/b.py": SCRIPT,
    }
    both, che = submissions_of(str(pack(tmp_path / "export.zip", members)), tmp_path / "store")
    assert both.people == (Person("Ada Lovelace", id="007", email="ada@x.org"), Person("Bo Ek"))
    assert (che.name, "holds 2 child scripts" in che.error) == ("Che Li", True)
    folder = Path(both.script).parents[1]
    assert [one.people for one in submissions_of(str(folder), tmp_path / "store")] == [both.people, che.people]
    (folder / "submission_metadata.yml").write_text("- what\n")
    with pytest.raises(ValueError, match=r"submission_metadata.yml: must name the `:submitters:`"):
        submissions_of(str(folder), tmp_path / "store")


def test_a_csv_table_of_names_and_paths_is_read(tmp_path):
    write(tmp_path, one__my_dot_py=SCRIPT, two_dot_py=SCRIPT)
    (tmp_path / "class.csv").write_text(
        "\ufeffName;Path;ID\nAda;one;7\nBo;two.py;8\nChe;three.py;9\nDu;two.py;10\n", encoding="utf-8"
    )
    ada, bo, che = submissions_of(str(tmp_path / "class.csv"), tmp_path / "store")
    assert (ada.script, ada.people) == (str(tmp_path / "one/my.py"), (Person("Ada", id="7"),))
    assert (bo.script, bo.name) == (str(tmp_path / "two.py"), "Bo, Du")
    assert che.error == f"{tmp_path}/three.py: no such file"
    for text, said in (
        ("a,b\n1,2\n", r"line 1: must name the columns name, path \(and may id, email\), not 'a,b'"),
        ("name,path\nAda,\n", "line 2: must have a name and a path"),
        ("", "line 1: must name the columns"),
        (f"name,path\nAda,{'x' * 200_000}\n", "is not a table that can be read: field larger"),
    ):
        (tmp_path / "class.csv").write_text(text)
        with pytest.raises(ValueError, match=said):
            submissions_of(str(tmp_path / "class.csv"), tmp_path / "store")


def _member(name="link.py", kind=stat.S_IFREG, method=zipfile.ZIP_DEFLATED):
    info = zipfile.ZipInfo("replaced")
    info.filename = name  # set after construction, which cuts a name at a NUL
    info.external_attr = (kind | 0o777) << 16
    info.compress_type = method
    return info


HOSTILE = {  # the content of a student's zip, and a part of the error message
    "a bomb": ({"a.bin": bytes(2**20), "my.py": SCRIPT}, "holds more than 1 MiB"),
    "many files": ({f"{number}.txt": "" for number in range(1001)}, "holds more than 1000 files"),
    "a path outside": ({"../../evil.py": SCRIPT}, "holds a path that leads out of it: '../../evil.py'"),
    "an absolute path": ({"/tmp/evil.py": SCRIPT}, "holds a path that leads out of it: '/tmp/evil.py'"),
    "Windows": ({"my\\main.py": SCRIPT}, "holds a path that leads out of it: 'my\\\\main.py'"),
    "a NUL": ({_member("my.py\0.txt"): SCRIPT}, "holds a path that leads out of it: 'my.py\\x00.txt'"),
    "deep": ({"a/" * 64 + "my.py": SCRIPT}, "holds a path of more than 64 folders: "),
    "a link": ({_member(kind=stat.S_IFLNK): "/etc/passwd"}, "holds something that is not a regular file: 'link.py'"),
    "a FIFO": ({_member("fifo.py", stat.S_IFIFO): ""}, "holds something that is not a regular file: 'fifo.py'"),
    "a bomb of another kind": ({_member("a.bin", method=zipfile.ZIP_LZMA): bytes(9)}, "neither stored nor deflated"),
    "a name twice": ({_member("my.py"): SCRIPT, "my.py": SCRIPT}, "cannot be unpacked: File exists"),
    "too long a name": ({"x" * 300: ""}, "cannot be unpacked: File name too long"),
    "a file that is a folder": ({"a": "", "a/b": ""}, "cannot be unpacked: "),
    "no zip": (b"PK\x03\x04 and nothing more", "is not a zip that can be read: File is not a zip file"),
}


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_a_hostile_zip_fails_only_its_student_and_writes_nothing_outside(tmp_path, monkeypatch):
    monkeypatch.setattr(archive, "MAX_SIZE", 2**20)
    members = {f"{moodle('Good', 1)}/my.py": SCRIPT}
    for number, (what, (content, _)) in enumerate(HOSTILE.items(), start=2):
        (tmp_path / "s.zip").unlink(missing_ok=True)
        raw = content if isinstance(content, bytes) else pack(tmp_path / "s.zip", content).read_bytes()
        members[moodle(what, number, "s.zip")] = raw
    whole = pack(tmp_path / "class.zip", {**members, f"{moodle('Bad', 99)}/../../../evil.py": SCRIPT})
    before = {*tmp_path.iterdir()}
    submissions = found(whole, tmp_path)
    assert submissions.pop("Good").error == ""
    assert "holds a path that leads out of it" in submissions.pop("Bad").error
    assert [what for what, (_, said) in HOSTILE.items() if said not in submissions[what].error] == []
    assert not any("\n" in one.error for one in submissions.values())
    assert {*tmp_path.iterdir()} - before == {tmp_path / "store"}
    (tmp_path / "broken.zip").write_bytes(whole.read_bytes()[:-30])
    with pytest.raises(ValueError, match=r"broken.zip': is not a zip that can be read"):
        submissions_of(str(tmp_path / "broken.zip"), tmp_path / "store")


@pytest.fixture(name="removed")
def _removed(monkeypatch):
    """Return the folders passed to shutil.rmtree, which removes nothing here."""
    paths = []
    monkeypatch.setattr("shutil.rmtree", lambda path, *_, **__: paths.append(Path(path)))
    return paths


OUTSIDE_MEMBERS = {  # name of a zip member, and its student ("": none)
    **dict.fromkeys(("/", "//x", "..", "/home/x.py", "../z", "../../z"), ""),
    "\\x/..": "\\x",
    "Bad_9_assignsubmission_file_/../../z": "Bad",
    "/Ada Lovelace_1_assignsubmission_file_/my.py": "",
    "Bad_9_assignsubmission_file_..": "Bad",
    "Bad_9_assignsubmission_file_a\\b.py": "Bad",
    "alone/../x": "alone",
}


@pytest.mark.parametrize("around", ["", "export/"])
@pytest.mark.parametrize("name", OUTSIDE_MEMBERS)
def test_a_zip_member_outside_the_folder_fails_only_its_student(tmp_path, removed, name, around):
    good = {f"{around}{moodle(who, number)}/my.py": SCRIPT for number, who in enumerate(("Ada", "Bo", "Che"), start=1)}
    path = pack(tmp_path / "class.zip", {**good, name if name[0] in "./" else around + name: "", _member("../y"): ""})
    submissions = found(path, tmp_path)
    for who in ("Ada", "Bo", "Che"):
        one = submissions.pop(who)
        assert one.error == "" and Path(one.script).read_text() == SCRIPT
    assert "leads out" in submissions.pop("class.zip").error or "_.." in name
    if OUTSIDE_MEMBERS[name]:
        assert submissions.pop(OUTSIDE_MEMBERS[name]).error
    assert not submissions
    assert all(one.is_relative_to(tmp_path / "store") and one != tmp_path / "store" for one in removed)
    written = {one.relative_to(tmp_path).parts[0] for one in tmp_path.rglob("*")}
    assert written == {"class.zip", "store"} and not [*tmp_path.rglob("z"), *tmp_path.rglob("y")]


def test_large_submissions_in_a_zip_leave_room_for_the_others(tmp_path, monkeypatch):
    monkeypatch.setattr(archive, "_MIN_ROOM", 2 * 2**20)
    monkeypatch.setattr(archive, "_MAX_RATIO", 1)
    bombs = {f"{number}/my.py": SCRIPT + "#" * 1_000_000 for number in range(4)}
    path = pack(tmp_path / "class.zip", {**bombs, "good/my.py": SCRIPT})
    errors = {
        one.script.split("/")[-1]: one.error for one in submissions_of(str(path), tmp_path / "store") if one.error
    }
    assert [*errors] == ["2", "3"] and all("more than is left" in one for one in errors.values())


def test_a_file_named_like_another_submission_belongs_to_its_author(tmp_path):
    name = moodle("Ada", 7, moodle("Bob", 8, "my.py"))
    (one,) = submissions_of(str(pack(tmp_path / "class.zip", {name: SCRIPT})), tmp_path / "store")
    assert one.people == (Person("Ada", "7"),) and not one.error


def test_names_in_gradescope_metadata_must_be_strings(tmp_path):
    aliases = "".join(f"  a{number}: &a{number} [{f'*a{number - 1}, ' * 9}]\n" for number in range(1, 6))
    people = f"submission_1:\n  a0: &a0 [x]\n{aliases}  :submitters:\n  - :name: *a5\n"
    members = {"submission_metadata.yml": people, "submission_1/my.py": SCRIPT}
    with pytest.raises(ValueError, match=":submitters:"):
        submissions_of(str(pack(tmp_path / "export.zip", members)), tmp_path / "store")


def test_odd_entries_of_a_folder_do_not_affect_other_submissions(tmp_path, monkeypatch):
    folder = tmp_path / "class"
    write(folder, good_dot_py=SCRIPT, unreadable_dot_py=SCRIPT)
    write(tmp_path, solution__my_dot_py=SCRIPT)
    pack(tmp_path / "solution.zip", {"my.py": SCRIPT})
    for name in ("solution", "solution.zip"):
        (folder / moodle("Eve", len(name))).with_suffix(Path(name).suffix).symlink_to(tmp_path / name)
    os.mkfifo(folder / moodle("Fifo", 1, "my.zip"))
    (folder / moodle("Folder", 2, "my.zip")).mkdir()
    (folder / moodle("Loop", 3, "my.zip")).symlink_to(moodle("Loop", 3, "my.zip"))
    reads = folders.is_child_script

    def is_child_script(path):
        if path.name == "unreadable.py":
            raise Unreadable(f"{path}: Permission denied")
        return reads(path)

    monkeypatch.setattr(folders, "is_child_script", is_child_script)
    submissions = submissions_of(str(folder), tmp_path / "store")
    assert {Path(one.script).name for one in submissions if not one.error} == {"good.py", "unreadable.py"}
    errors = {f"{one.name} {one.error}" for one in submissions if one.error}
    assert len(errors) == 5 and sum("leads out of its folder" in one for one in errors) == 2


def test_a_zip_with_wrong_member_sizes_is_refused(tmp_path):
    path = pack(tmp_path / "lies.zip", {"my.py": SCRIPT * 100})
    content = path.read_bytes()
    path.write_bytes(content.replace(len(SCRIPT * 100).to_bytes(4, "little"), bytes(4)))
    with pytest.raises(archive.Refused):
        archive.unpack_whole(path, tmp_path / "store")


# ---- similarity


def solution(task):
    return (tasks.folder() / task / "solution.py").read_text()


def test_renamed_copies_are_similar_and_different_solutions_are_not(tmp_path):
    original = solution("hover")
    copy = original.replace("self.", "me.").replace("self", "me").replace("0.", "1.").replace("home", "start")
    copy = "".join(f"{line}  # mine\n" for line in copy.splitlines() if line)
    sources = {"hover.py": original, "copy.py": copy, "line.py": solution("line"), "pad.py": solution("pad")}
    given = similarity.provided_sources(read_plan(tmp_path))
    (pair,) = similarity.find_similar(sources, given)
    assert (pair.first, pair.second) == ("hover.py", "copy.py") and pair.share > 0.9
    similar_lines = [original.splitlines()[line - 1] for line in pair.lines[0]]
    assert len(similar_lines) > 10


def test_provided_code_and_code_that_most_share_is_not_similar():
    text = solution("hover")
    assert similarity.find_similar({"a.py": text, "b.py": text}, {}) and not similarity.find_similar(
        {"a.py": text, "b.py": text}, {"start.py": text}
    )
    assert not similarity.find_similar({f"{number}.py": text for number in range(6)}, {})


def test_lua_copies_are_found_and_hostile_texts_take_no_long_time():
    lines = [f"local v = sim.getObjectPosition(h, -1)[3]{' * v + 1' * number}" for number in range(20)]
    other = ["-- [[ mine ]]", *(line.replace(" v", " mine") for line in lines)]
    (pair,) = similarity.find_similar({"a.lua": "\n".join(lines), "b.lua": "\n".join(other)}, {})
    assert pair.share == 1.0 and min(pair.lines[1]) == 2
    for hostile in ("--[[ " * 20_000, '"' * 9_999, "'''" * 9_999, "x" * 99_999, "\0" * 4_000):
        assert not similarity.find_similar({"a.lua": hostile, "b.py": hostile, "c.py": ""}, {})[1:]


# ---- Gradescope's autograder


def test_an_autograder_zip_has_gradescope_s_files_and_no_solution(tmp_path, capsys):
    path = tmp_path / "hover.zip"
    assert grade.main(["hover", "--seeds", "3", "--autograder", str(path)]) == 0
    with zipfile.ZipFile(path) as file:
        found = {one.filename: one.external_attr >> 16 for one in file.infolist()}
        assert file.read("seeds") == b"3\n" and file.read("plan/plan.yaml").startswith(b"# Hold the place")
    assert {"setup.sh", "run_autograder", "requirements.txt", "drone_sim/package.xml"} <= found.keys()
    assert found["setup.sh"] & found["run_autograder"] & stat.S_IXOTH
    assert not [name for name in found if "solution" in name or "__pycache__" in name or "tasks/" in name]
    first = path.read_bytes()
    assert grade.main(["hover", "--seeds", "3", "--autograder", str(path)]) == 0 and path.read_bytes() == first
    (tmp_path / "room.yaml").write_text("objects: []\n")
    write(tmp_path, own__plan_dot_yaml=f"scene: {tmp_path}/room.yaml\nduration: 1\ncriteria: [{{kind: no_contact}}]\n")
    for arguments, said in (
        (["hover", "my.py"], "takes only a plan and --seeds"),
        ([str(tmp_path / "own/plan.yaml")], "room.yaml: the plan needs it, but it is not in the plan's folder"),
    ):
        assert grade.main([*arguments, "--autograder", str(path)]) == 2
        assert said in capsys.readouterr().err
