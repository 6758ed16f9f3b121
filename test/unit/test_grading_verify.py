"""Verification of results by hashes, a signature and repeated flights."""

import contextlib
import json
from types import SimpleNamespace

import pytest

from drone_sim.grading import grade
from drone_sim.grading import plan as plans
from drone_sim.grading.jobs import pool, settings
from drone_sim.grading.jobs.flyer import Flyer
from drone_sim.grading.outputs import as_json

PLAN = """
duration: 0.2
spread: {position: [0.2, 0.2, 0.1]}
criteria:
  - {kind: no_contact}
"""
KEY = bytes(range(32))


@pytest.fixture(scope="module", autouse=True)
def one_fork_server():
    """Use one fork server for all gradings, since its start takes longer than their flights."""
    patch = pytest.MonkeyPatch()
    with contextlib.closing(Flyer(settings.load({}).limits, sandboxed=False)) as flyer:
        patch.setattr(pool, "Flyer", lambda *_: SimpleNamespace(fly=flyer.fly, close=lambda: None))
        yield
        patch.undo()


@pytest.fixture(scope="module")
def graded(tmp_path_factory):
    """Return a folder with a plan, a script, a key and signed results."""
    folder = tmp_path_factory.mktemp("verified")
    (folder / "hold.yaml").write_text(PLAN)
    (folder / "my.py").write_text("def sysCall_init():\n    pass\n")
    (folder / "key").write_bytes(KEY)
    arguments = ["--seeds", "2", "--jobs", "1", "--results", str(folder / "kept"), "--key", str(folder / "key")]
    results = ["--json", str(folder / "results.json")]
    assert grade.main([str(folder / "hold.yaml"), str(folder / "my.py"), *arguments, *results]) == 0
    return folder


def run_verify(graded, path, capsys, *arguments):
    capsys.readouterr()
    status = grade.main(["--verify", str(path), "--jobs", "1", *arguments])
    captured = capsys.readouterr()
    lines = [one for one in captured.err.splitlines(keepends=True) if "bubblewrap does not work here" not in one]
    return status, captured.out, "".join(lines)


def change_file(graded, tmp_path, change):
    content = json.loads((graded / "results.json").read_text())
    change(content)
    (tmp_path / "changed.json").write_text(json.dumps(content))
    return tmp_path / "changed.json"


def test_verify_flies_results_again_and_confirms_them(graded, capsys):
    status, out, err = run_verify(graded, graded / "results.json", capsys, "--key", str(graded / "key"))
    assert (status, out) == (0, "2 of 2 flights are what the file says, to the last bit\n") and not err


@pytest.mark.parametrize("name, value", [("digest", "0" * 64), ("points", 0.5), ("seed", 7)])
def test_verify_finds_a_changed_result(graded, tmp_path, capsys, name, value):
    path = change_file(graded, tmp_path, lambda content: content["results"][1].update({name: value}))
    status, out, _ = run_verify(graded, path, capsys)
    assert status == 1 and "1 of 2 flights are what the file says" in out
    assert f"my.py, seed {value if name == 'seed' else 1}: {'digest' if name == 'seed' else name}: the file says" in out


def test_the_signature_does_not_match_a_changed_file_or_another_key(graded, tmp_path, capsys):
    path = change_file(graded, tmp_path, lambda content: content["results"][1].update(points=0.5))
    status, _, err = run_verify(graded, path, capsys, "--key", str(graded / "key"))
    assert status == 1 and err.startswith(f"{path}: is not signed by {graded / 'key'}") and err.count("\n") == 1
    (tmp_path / "other").write_bytes(KEY[::-1])
    assert run_verify(graded, graded / "results.json", capsys, "--key", str(tmp_path / "other"))[0] == 1


def test_verify_names_files_whose_hashes_differ(graded, tmp_path, capsys):
    path = change_file(graded, tmp_path, lambda content: content["scripts"][0]["hashes"].update(script="0", plan="1"))
    _, _, err = run_verify(graded, path, capsys)
    assert err.splitlines() == [f"grade: {graded / 'my.py'}: not what it was: {name}" for name in ("plan", "script")]


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"format": "drone_sim grades", "version": 99}', '{"results": 3}'])
def test_an_invalid_results_file_is_reported_in_one_line(tmp_path, capsys, text):
    (tmp_path / "odd.json").write_text(text)
    status, _, err = run_verify(None, tmp_path / "odd.json", capsys)
    assert status == 2 and err.startswith(f"grade: {tmp_path / 'odd.json'}: ") and err.count("\n") == 1


def test_hashes_depend_only_on_file_contents(graded, tmp_path):
    plan = plans.read(graded / "hold.yaml")
    before = as_json.hashes_of(plan, str(graded / "my.py"))
    assert set(before) == {"plan", "config", "script", "package"} and as_json.hashes_of(plan, "") != before
    (tmp_path / "my.py").write_bytes((graded / "my.py").read_bytes())
    assert as_json.hashes_of(plan, str(tmp_path / "my.py")) == before
    (tmp_path / "my.py").write_text("def sysCall_init():\n    return\n")
    after = as_json.hashes_of(plan, str(tmp_path / "my.py"))
    assert {name for name in before if before[name] != after[name]} == {"script"}


def test_a_short_key_is_refused(tmp_path):
    (tmp_path / "key").write_bytes(b"1234")
    with pytest.raises(ValueError, match="holds 4 bytes; it must hold at least 16"):
        as_json.read_key(str(tmp_path / "key"), "--key")
