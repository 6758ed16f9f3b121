"""Scripts are handed in to a folder where everybody can write; what others put there costs and helps nobody."""

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
    """Somebody else grades: the files belong to a student."""
    return lambda: monkeypatch.setattr(handed_in.os, "getuid", lambda: 4_000_000)


def graded(folder, tmp_path):
    return submissions_of(str(folder), tmp_path / "store")


def test_the_script_that_a_user_handed_in_last_is_graded(folder, tmp_path, another):
    handed_in.hand_in("hover", SCRIPT, ".py")
    handed_in.hand_in("hover", f"# better\n{SCRIPT}", ".py")
    another()
    (one,) = graded(folder, tmp_path)
    assert (one.name, one.error) == (ME, "")
    assert Path(one.script).read_text() == f"# better\n{SCRIPT}"
    assert not Path(one.script).is_relative_to(folder), "its owner could replace it during the flight"
    assert {path.stat().st_mode & 0o777 for path in folder.iterdir()} == {0o640}


def test_a_file_under_the_name_of_another_is_not_that_ones(folder, tmp_path, another):
    handed_in.hand_in("hover", SCRIPT, ".py")
    (mine,) = folder.iterdir()
    mine.rename(folder / mine.name.replace(ME, OTHER, 1))
    another()
    (one,) = graded(folder, tmp_path)
    assert one.error.endswith(f"belongs to {ME}, not to {OTHER}") and one.name == ME


def test_what_was_changed_afterwards_is_refused(folder, tmp_path, another):
    handed_in.hand_in("hover", SCRIPT, ".py")
    (mine,) = folder.iterdir()
    mine.write_text(f"# later\n{SCRIPT}")
    another()
    assert "was changed after it was handed in" in graded(folder, tmp_path)[0].error


def test_all_else_in_the_folder_is_ignored(folder, tmp_path, another):
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
    assert [one.name for one in graded(folder, tmp_path)] == [ME]


def test_the_time_in_the_name_counts_so_that_a_copy_of_the_folder_has_the_same_last_scripts(folder, tmp_path, another):
    for day, text in (("29", f"# last\n{SCRIPT}"), ("28", SCRIPT)):  # the earlier one is written later
        _, digest = handed_in.hand_in("hover", text, ".py")
        (made,) = folder.glob(f"*+{digest}.py")
        made.rename(folder / f"{ME}+2026-11-{day}T12.00.00Z+{digest}.py")
    another()
    assert Path(graded(folder, tmp_path)[0].script).read_text().startswith("# last")


@pytest.mark.parametrize("user, is_graded", [("..", False), (".", False), (".ann", False), ("", False), ("ann", True)])
def test_a_copy_is_graded_under_a_name_unless_that_leads_elsewhere(folder, tmp_path, user, is_graded):
    _, digest = handed_in.hand_in("hover", SCRIPT, ".py")
    (folder / f"{user}+2026-11-28T12.00.00Z+{digest}.py").write_text(SCRIPT)
    assert sorted(one.name for one in graded(folder, tmp_path)) == sorted([ME, user] if is_graded else [ME])


def test_a_file_with_two_links_is_nobodys(folder, tmp_path):
    _, digest = handed_in.hand_in("hover", SCRIPT, ".py")
    (mine,) = folder.iterdir()
    os.link(mine, folder / f"bob+2026-11-28T12.00.00Z+{digest}.py")
    assert handed_in.submissions_in(folder, tmp_path / "store") == []


def test_while_nobody_has_handed_in_a_forged_folder_of_another_kind_is_not_graded(folder, tmp_path):
    (folder / "Bob_8_assignsubmission_file_").mkdir()
    (folder / "Bob_8_assignsubmission_file_" / "bob.py").write_text(SCRIPT)
    folder.chmod(0o3773)
    with pytest.raises(ValueError, match="no submission is in it"):
        graded(folder, tmp_path)
    folder.chmod(0o3770)  # after the end of the handing in
    with pytest.raises(ValueError, match="no submission is in it"):
        graded(folder, tmp_path)


@pytest.mark.parametrize("task", ["gates", "", "../hover"])
def test_without_a_folder_nothing_is_handed_in(folder, task):
    folder.rename(folder.with_name("closed"))
    assert handed_in.folder_of(task) is None
    with pytest.raises(ValueError, match="cannot be handed in now"):
        handed_in.hand_in(task, SCRIPT, ".py")
