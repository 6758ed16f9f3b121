"""Results that can be held against the flights that they are of: hashes, a signature, and the same flights again."""

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
    """All gradings use one fork server: to start it takes longer than their flights."""
    patch = pytest.MonkeyPatch()
    with contextlib.closing(Flyer(settings.load({}).limits, sandboxed=False)) as flyer:
        patch.setattr(pool, "Flyer", lambda *_: SimpleNamespace(fly=flyer.fly, close=lambda: None))
        yield
        patch.undo()


@pytest.fixture(scope="module")
def graded(tmp_path_factory):
    """A folder with a plan, a script, a key, and the results, signed."""
    folder = tmp_path_factory.mktemp("verified")
    (folder / "hold.yaml").write_text(PLAN)
    (folder / "my.py").write_text("def sysCall_init():\n    pass\n")
    (folder / "key").write_bytes(KEY)
    arguments = ["--seeds", "2", "--jobs", "1", "--results", str(folder / "kept"), "--key", str(folder / "key")]
    results = ["--json", str(folder / "results.json")]
    assert grade.main([str(folder / "hold.yaml"), str(folder / "my.py"), *arguments, *results]) == 0
    return folder


def verified(graded, path, capsys, *arguments):
    capsys.readouterr()
    status = grade.main(["--verify", str(path), "--jobs", "1", *arguments])
    said = capsys.readouterr()
    lines = [one for one in said.err.splitlines(keepends=True) if "bubblewrap does not work here" not in one]
    return status, said.out, "".join(lines)


def changed(graded, tmp_path, change):
    content = json.loads((graded / "results.json").read_text())
    change(content)
    (tmp_path / "changed.json").write_text(json.dumps(content))
    return tmp_path / "changed.json"


def test_results_are_flown_again_and_are_the_same(graded, capsys):
    status, out, err = verified(graded, graded / "results.json", capsys, "--key", str(graded / "key"))
    assert (status, out) == (0, "2 of 2 flights are what the file says, to the last bit\n") and not err


@pytest.mark.parametrize("name, value", [("digest", "0" * 64), ("points", 0.5), ("seed", 7)])
def test_a_result_that_was_changed_is_found(graded, tmp_path, capsys, name, value):
    path = changed(graded, tmp_path, lambda content: content["results"][1].update({name: value}))
    status, out, _ = verified(graded, path, capsys)
    assert status == 1 and "1 of 2 flights are what the file says" in out
    assert f"my.py, seed {value if name == 'seed' else 1}: {'digest' if name == 'seed' else name}: the file says" in out


def test_a_file_that_was_changed_is_not_signed(graded, tmp_path, capsys):
    path = changed(graded, tmp_path, lambda content: content["results"][1].update(points=0.5))
    status, _, err = verified(graded, path, capsys, "--key", str(graded / "key"))
    assert status == 1 and err.startswith(f"{path}: is not signed by {graded / 'key'}") and err.count("\n") == 1
    (tmp_path / "other").write_bytes(KEY[::-1])
    assert verified(graded, graded / "results.json", capsys, "--key", str(tmp_path / "other"))[0] == 1


def test_what_is_not_what_it_was_is_named(graded, tmp_path, capsys):
    path = changed(graded, tmp_path, lambda content: content["scripts"][0]["hashes"].update(script="0", plan="1"))
    _, _, err = verified(graded, path, capsys)
    assert err.splitlines() == [f"grade: {graded / 'my.py'}: not what it was: {name}" for name in ("plan", "script")]


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"format": "drone_sim grades", "version": 99}', '{"results": 3}'])
def test_what_is_no_file_of_results_gets_a_line(tmp_path, capsys, text):
    (tmp_path / "odd.json").write_text(text)
    status, _, err = verified(None, tmp_path / "odd.json", capsys)
    assert status == 2 and err.startswith(f"grade: {tmp_path / 'odd.json'}: ") and err.count("\n") == 1


def test_hashes_are_of_contents(graded, tmp_path):
    plan = plans.read(graded / "hold.yaml")
    before = as_json.hashes_of(plan, str(graded / "my.py"))
    assert set(before) == {"plan", "config", "script", "package"} and as_json.hashes_of(plan, "") != before
    (tmp_path / "my.py").write_bytes((graded / "my.py").read_bytes())
    assert as_json.hashes_of(plan, str(tmp_path / "my.py")) == before
    (tmp_path / "my.py").write_text("def sysCall_init():\n    return\n")
    after = as_json.hashes_of(plan, str(tmp_path / "my.py"))
    assert {name for name in before if before[name] != after[name]} == {"script"}


def test_a_key_that_could_be_guessed_is_refused(tmp_path):
    (tmp_path / "key").write_bytes(b"1234")
    with pytest.raises(ValueError, match="holds 4 bytes; it must hold at least 16"):
        as_json.read_key(str(tmp_path / "key"), "--key")
