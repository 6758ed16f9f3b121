"""Files are written whole or not at all."""

import os
import resource
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from drone_sim.files import writing
from drone_sim.offline.fly import main

SOURCE = Path(__file__).resolve().parents[2] / "src"


def in_child(program, *arguments):
    """Run a program on a disk that takes no more than 64 KiB a file; return the ended process."""

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


def test_the_content_and_the_mode_are_there(tmp_path):
    path = tmp_path / "file"
    writing.write(path, "one\n")
    mask = os.umask(0)
    os.umask(mask)
    assert path.read_bytes() == b"one\n" and stat.S_IMODE(path.stat().st_mode) == 0o666 & ~mask
    path.chmod(0o640)
    writing.write(path, "två\n")
    assert path.read_text(encoding="utf-8") == "två\n" and stat.S_IMODE(path.stat().st_mode) == 0o640
    assert os.listdir(tmp_path) == ["file"]


def test_a_link_stays_a_link(tmp_path):
    (tmp_path / "there").write_text("old")
    (tmp_path / "link").symlink_to("there")
    writing.write(tmp_path / "link", "new")
    assert (tmp_path / "link").is_symlink() and (tmp_path / "there").read_text() == "new"


def test_what_fails_half_way_keeps_the_old_file_only_on_an_oserror(tmp_path):
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


def test_a_full_disk_leaves_what_was_there(tmp_path):
    path = tmp_path / "file"
    path.write_text("old")
    ended = in_child("import sys; from drone_sim.files import writing; writing.write(sys.argv[1], 'x' * 100_000)", path)
    assert f"OSError: {path}: File too large" in ended.stderr
    assert path.read_text() == "old" and os.listdir(tmp_path) == ["file"]


def test_a_table_on_a_full_disk_ends_with_one_line_and_keeps_the_old_one(tmp_path):
    path = tmp_path / "flight.csv"
    path.write_text("old")
    program = "import sys; from drone_sim.offline.fly import main; sys.exit(main(sys.argv[1:]))"
    ended = in_child(program, "--duration", "60", "--csv", path)
    assert ended.returncode == 1 and ended.stderr == f"fly: {path}: File too large\n"
    assert path.read_text() == "old" and os.listdir(tmp_path) == ["flight.csv"]


@pytest.mark.parametrize("option", ["--csv", "--plot"])
@pytest.mark.parametrize("name", ["/dev/full", "/tmp", "/no/such/folder.png", "x" * 300, "a\0b"])
def test_what_cannot_be_written_gets_one_line(capsys, option, name):
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
