"""What a folder of submissions holds."""

import pytest

from drone_sim.grading.submissions import scripts_of

SCRIPT = "def sysCall_init():\n    pass\n"


def laid(folder, **files):
    for name, text in files.items():
        path = folder / name.replace("__", "/").replace("_dot_", ".")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


def test_a_folder_holds_scripts_and_folders_with_one(tmp_path):
    laid(
        tmp_path,
        alice_dot_py=SCRIPT,
        bob__deep__main_dot_lua="function sysCall_init() end\n",
        bob__pid_dot_py="x = 1\n",
    )
    laid(tmp_path, helper_dot_py="x = 1\n", notes_dot_txt=SCRIPT, empty__notes_dot_txt="")
    (tmp_path / ".git").mkdir()
    (tmp_path / ".git" / "hook.py").write_text(SCRIPT)
    (tmp_path / "carol.py").symlink_to("nowhere.py")
    named = [one.removeprefix(f"{tmp_path}/") for one in scripts_of(str(tmp_path))]
    assert named == ["alice.py", "bob/deep/main.lua", "carol.py"]


def test_a_script_is_itself_whatever_it_is(tmp_path):
    assert scripts_of("pilot") == ["pilot"] and scripts_of(str(tmp_path / "none.py")) == [str(tmp_path / "none.py")]


def test_folders_that_say_nothing_get_a_line(tmp_path):
    with pytest.raises(ValueError, match="no submission is in this folder"):
        scripts_of(str(tmp_path))
    laid(tmp_path, dave__one_dot_py=SCRIPT, dave__two_dot_py=SCRIPT)
    with pytest.raises(ValueError, match=r"holds 2 child scripts \(one.py, two.py\); one is to be graded"):
        scripts_of(str(tmp_path))
