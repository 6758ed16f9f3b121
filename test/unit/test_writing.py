"""Files are written whole or not at all, and removed only below a folder."""

import ast
import os
import resource
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from drone_sim.files import containment, writing
from drone_sim.offline.fly import main

SOURCE = Path(__file__).resolve().parents[2] / "src"


def in_child(program, *arguments):
    """Run a program that can write at most 64 KiB per file, as on a full disk; return the completed process."""

    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (65536, 65536))

    program = f"import signal; signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n{program}"
    return subprocess.run(
        [sys.executable, "-c", program, *map(str, arguments)],
        env={**os.environ, "PYTHONPATH": str(SOURCE), "PYTHONDONTWRITEBYTECODE": "1"},
        preexec_fn=limit,
        capture_output=True,
        text=True,
        timeout=60,
    )


def test_written_file_has_its_content_and_mode(tmp_path):
    path = tmp_path / "file"
    writing.write(path, "one\n")
    mask = os.umask(0)
    os.umask(mask)
    assert path.read_bytes() == b"one\n" and stat.S_IMODE(path.stat().st_mode) == 0o666 & ~mask
    path.chmod(0o640)
    writing.write(path, "två\n")
    assert path.read_text(encoding="utf-8") == "två\n" and stat.S_IMODE(path.stat().st_mode) == 0o640
    assert os.listdir(tmp_path) == ["file"]


def test_writing_through_a_link_keeps_the_link(tmp_path):
    (tmp_path / "there").write_text("old")
    (tmp_path / "link").symlink_to("there")
    writing.write(tmp_path / "link", "new")
    assert (tmp_path / "link").is_symlink() and (tmp_path / "there").read_text() == "new"


def test_interrupted_write_keeps_the_old_file_only_on_an_oserror(tmp_path):
    path = tmp_path / "file"
    path.write_text("old")
    with pytest.raises(OSError, match=r"file: No space left"), writing.replacing(path) as file:
        file.write("half")
        raise OSError(28, "No space left on device")
    assert path.read_text() == "old"
    with pytest.raises(KeyboardInterrupt), writing.replacing(path) as file:
        file.write("as far as it came")
        raise KeyboardInterrupt
    assert path.read_text() == "as far as it came"
    assert os.listdir(tmp_path) == ["file"]


def test_full_disk_keeps_the_old_file(tmp_path):
    path = tmp_path / "file"
    path.write_text("old")
    child = in_child("import sys; from drone_sim.files import writing; writing.write(sys.argv[1], 'x' * 100_000)", path)
    assert f"OSError: {path}: File too large" in child.stderr
    assert path.read_text() == "old" and os.listdir(tmp_path) == ["file"]


def test_full_disk_is_reported_in_one_line_and_keeps_the_old_table(tmp_path):
    path = tmp_path / "flight.csv"
    path.write_text("old")
    program = "import sys; from drone_sim.offline.fly import main; sys.exit(main(sys.argv[1:]))"
    child = in_child(program, "--duration", "60", "--csv", path)
    assert child.returncode == 1 and child.stderr == f"fly: {path}: File too large\n"
    assert path.read_text() == "old" and os.listdir(tmp_path) == ["flight.csv"]


@pytest.mark.parametrize("option", ["--csv", "--plot"])
@pytest.mark.parametrize("name", ["/dev/full", "/tmp", "/no/such/folder.png", "x" * 300, "a\0b"])
def test_unwritable_output_is_reported_in_one_line(capsys, option, name):
    assert main(["--duration", "1", option, name]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and lines[0].startswith("fly: ")


def test_a_device_is_written_directly(tmp_path, capfd):
    writing.write("/dev/stdout", "hello\n")
    assert capfd.readouterr().out == "hello\n"
    os.mkfifo(tmp_path / "fifo")
    end = os.open(tmp_path / "fifo", os.O_RDONLY | os.O_NONBLOCK)
    writing.write(tmp_path / "fifo", "through")
    assert os.read(end, 100) == b"through"
    os.close(end)


# ---- below a folder


@pytest.fixture(name="removed")
def _removed(monkeypatch):
    """Record the paths that would be removed; nothing is removed, even if the test fails."""
    paths = []
    monkeypatch.setattr("shutil.rmtree", lambda path, *_, **__: paths.append(str(path)))
    monkeypatch.setattr(Path, "unlink", lambda path, missing_ok=False: paths.append(str(path)))
    return paths


OUTSIDE_PATHS = ("/", "//", "..", ".", "", "../z", "a/../..", "a/../../z", "/etc", "link/z", "link/../z", "a/link/..")


@pytest.mark.parametrize("name", OUTSIDE_PATHS)
def test_path_outside_its_folder_is_refused(tmp_path, removed, name):
    folder = tmp_path / "folder"
    (folder / "a").mkdir(parents=True)
    (folder / "link").symlink_to("/usr/share")
    (folder / "a/link").symlink_to("/usr/share/")
    for action in (lambda: containment.path_below(folder, name), lambda: containment.remove(folder / name, folder)):
        with pytest.raises(containment.OutsideFolder):
            action()
    assert removed == []


def test_files_below_the_folder_are_removed_and_links_are_not_followed(tmp_path, removed):
    folder = tmp_path / "folder"
    (folder / "a/b").mkdir(parents=True)
    (folder / "file").touch()
    (folder / "link").symlink_to(tmp_path)
    (tmp_path / "way").symlink_to(folder)
    for name in ("a", "a/b", "file", "link", "nothing", "x" * 300):
        containment.remove(tmp_path / "way" / name, within=folder)
    assert removed == [str(folder / name) for name in ("a", "a/b", "file", "link")]


# The modules that remove or rename files, and the number of calls. No name comes from outside. Add a new module
# here; for a tree, for files in a loop, or for a name from outside use `drone_sim.files.containment`.
KNOWN = {
    "editing/drafts.py": 3,  # its own draft
    "files/containment.py": 2,
    "files/writing.py": 3,  # its own temporary files
    "grading/classroom.py": 4,  # two fixed names, temporary files, and a name that `_SCENE_NAME` checks
    "grading/jobs/job.py": 3,  # named by hashes
    "grading/submissions/archive.py": 1,  # a temporary folder, which is named by a hash
    "importing/cache.py": 1,  # a temporary folder, which is named by a hash
    "ros/cockpit/classroom.py": 1,  # its own report
    "ros/cockpit/editor/script_store.py": 3,  # checked by `_checked` and `_place`
    "ros/cockpit/server/address.py": 3,  # named by the port, and a temporary file
    "world/assemblies.py": 1,  # temporary files of BulletFiles
    "world/bodies.py": 1,
}
REMOVALS = {"unlink", "rmdir", "rmtree", "removedirs", "renames"}
MODULE_FUNCTIONS = {"remove", "rename", "replace", "link", "move"}


def _removals(tree):
    """Yield the calls in a module that remove or rename files, and whether each is in a loop."""
    loops = (ast.For, ast.While, ast.ListComp, ast.SetComp, ast.GeneratorExp, ast.DictComp)
    inside = {id(node) for loop in ast.walk(tree) if isinstance(loop, loops) for node in ast.walk(loop)}
    for call in (node for node in ast.walk(tree) if isinstance(node, ast.Call)):
        name = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
        owner = ast.unparse(call.func.value) if isinstance(call.func, ast.Attribute) else ""
        is_of_path = name in ("rename", "replace") and len(call.args) == 1 and not call.keywords and owner
        if name in REMOVALS or is_of_path or (owner in ("os", "shutil") and name in MODULE_FUNCTIONS):
            yield name, id(call) in inside


def test_only_known_places_remove_or_rename_files_and_none_does_in_a_loop():
    calls_by_module = {}
    for path in sorted((SOURCE / "drone_sim").rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        name, calls = str(path.relative_to(SOURCE / "drone_sim")), list(_removals(ast.parse(text)))
        assert "rmtree" not in text or name == "files/containment.py", name
        assert not any(in_loop for _, in_loop in calls), name
        if calls:
            calls_by_module[name] = len(calls)
    assert calls_by_module == KNOWN
