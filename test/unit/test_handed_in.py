"""Scripts handed in to a folder that all users can write to: forged files do not harm or help anybody."""

import os
import pwd
from pathlib import Path

import pytest

from drone_sim.grading.submissions import handed_in
from drone_sim.grading.submissions.folders import submissions_of

SCRIPT = "def sysCall_actuation():\n    pass\n"
ME = pwd.getpwuid(os.getuid()).pw_name
OTHER = next(one.pw_name for one in pwd.getpwall() if one.pw_uid != os.getuid())


@pytest.fixture(name="folder")
def _folder(tmp_path, monkeypatch):
    monkeypatch.setenv(handed_in.VARIABLE, str(tmp_path / "course"))
    folder = tmp_path / "course" / "hover"
    folder.mkdir(parents=True)
    return folder


@pytest.fixture(name="another")
def _another(monkeypatch):
    """Return a function that makes the grader another user than the owner of the files."""
    return lambda: monkeypatch.setattr(handed_in.os, "getuid", lambda: 4_000_000)


def read_submissions(folder, tmp_path):
    return submissions_of(str(folder), tmp_path / "store")


def test_the_last_script_handed_in_by_a_user_is_graded(folder, tmp_path, another):
    handed_in.hand_in("hover", SCRIPT, ".py")
    handed_in.hand_in("hover", f"# better\n{SCRIPT}", ".py")
    another()
    (one,) = read_submissions(folder, tmp_path)
    assert (one.name, one.error) == (ME, "")
    assert Path(one.script).read_text() == f"# better\n{SCRIPT}"
    assert not Path(one.script).is_relative_to(folder), "a copy, since its owner could replace it"
    assert {path.stat().st_mode & 0o777 for path in folder.iterdir()} == {0o640}


def test_a_file_named_after_another_user_is_not_graded_for_that_user(folder, tmp_path, another):
    handed_in.hand_in("hover", SCRIPT, ".py")
    (own_file,) = folder.iterdir()
    own_file.rename(folder / own_file.name.replace(ME, OTHER, 1))
    another()
    (one,) = read_submissions(folder, tmp_path)
    assert one.error.endswith(f"belongs to {ME}, not to {OTHER}") and one.name == ME


def test_a_file_changed_after_it_was_handed_in_is_refused(folder, tmp_path, another):
    handed_in.hand_in("hover", SCRIPT, ".py")
    (own_file,) = folder.iterdir()
    own_file.write_text(f"# later\n{SCRIPT}")
    another()
    assert "was changed after it was handed in" in read_submissions(folder, tmp_path)[0].error


def test_other_files_in_the_folder_are_ignored(folder, tmp_path, another):
    _, digest = handed_in.hand_in("hover", SCRIPT, ".py")
    solution = tmp_path / "solution.py"
    solution.write_text(SCRIPT)
    (folder / f"{OTHER}+2026-11-28T12.00.00Z+{digest}.py").symlink_to(solution)
    (folder / "forged.py").write_text(SCRIPT)
    (folder / "Bob_8_assignsubmission_file_").mkdir()
    (folder / "Bob_8_assignsubmission_file_" / "bob.py").write_text(SCRIPT)
    (folder / "submission_metadata.yml").write_text("forged.py: {':submitters': [{':name': Bob}]}")
    os.mkfifo(folder / f"{OTHER}+2026-11-28T12.00.01Z+{digest}.py")
    another()
    assert [one.name for one in read_submissions(folder, tmp_path)] == [ME]


def test_the_time_in_the_file_name_decides_which_script_is_last(folder, tmp_path, another):
    for day, text in (("29", f"# last\n{SCRIPT}"), ("28", SCRIPT)):  # the earlier one is written later
        _, digest = handed_in.hand_in("hover", text, ".py")
        (new_file,) = folder.glob(f"*+{digest}.py")
        new_file.rename(folder / f"{ME}+2026-11-{day}T12.00.00Z+{digest}.py")
    another()
    assert Path(read_submissions(folder, tmp_path)[0].script).read_text().startswith("# last")


@pytest.mark.parametrize("user, is_graded", [("..", False), (".", False), (".ann", False), ("", False), ("ann", True)])
def test_a_copied_file_is_graded_for_the_user_in_its_name_if_valid(folder, tmp_path, user, is_graded):
    _, digest = handed_in.hand_in("hover", SCRIPT, ".py")
    (folder / f"{user}+2026-11-28T12.00.00Z+{digest}.py").write_text(SCRIPT)
    assert sorted(one.name for one in read_submissions(folder, tmp_path)) == sorted([ME, user] if is_graded else [ME])


def test_a_file_with_two_hard_links_is_ignored(folder, tmp_path):
    _, digest = handed_in.hand_in("hover", SCRIPT, ".py")
    (own_file,) = folder.iterdir()
    os.link(own_file, folder / f"bob+2026-11-28T12.00.00Z+{digest}.py")
    assert handed_in.submissions_in(folder, tmp_path / "store") == []


def test_forged_moodle_folders_are_not_graded_before_the_first_submission(folder, tmp_path):
    (folder / "Bob_8_assignsubmission_file_").mkdir()
    (folder / "Bob_8_assignsubmission_file_" / "bob.py").write_text(SCRIPT)
    folder.chmod(0o3773)
    with pytest.raises(ValueError, match="no submission is in it"):
        read_submissions(folder, tmp_path)
    folder.chmod(0o3770)  # the mode after the deadline
    with pytest.raises(ValueError, match="no submission is in it"):
        read_submissions(folder, tmp_path)


@pytest.mark.parametrize("task", ["gates", "", "../hover"])
def test_without_a_folder_of_the_task_handing_in_is_refused(folder, task):
    folder.rename(folder.with_name("closed"))
    assert handed_in.folder_of(task) is None
    with pytest.raises(ValueError, match="cannot be handed in now"):
        handed_in.hand_in(task, SCRIPT, ".py")
