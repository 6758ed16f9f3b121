"""`require 'matrix'`, CoppeliaSim's matrices in Lua, against numpy."""

import logging
import re

import numpy as np
import pytest

from drone_sim.scripting import load
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.time_limit import TimeLimit

FLAT = "local _ = function() simGetSimulationTime() end\n"  # the flat API selects Lua 5.1
DIALECTS = pytest.mark.parametrize("dialect", ["", FLAT], ids=["newest", "5.1"])
A = np.array([[4.0, 7, 1], [2, 6, -1], [0.5, 3, 2]])
B = np.array([[1.0, -2, 3], [0, 5, 1], [7, 2, -4]])
V, W = np.array([1.0, 2, 3]), np.array([-2.0, 0.5, 4])
TURN = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
RIGID = np.vstack([np.column_stack([TURN, [5.0, 6, 7]]), [0, 0, 0, 1]])


@pytest.fixture(name="run")
def _run(tmp_path, caplog):
    caplog.set_level(logging.INFO)

    def run(text):
        path = tmp_path / "main.lua"
        path.write_text(text, encoding="utf-8")
        caplog.clear()
        load.load(str(path), {}, TimeLimit(5.0)).close()
        return caplog.messages

    return run


def lua(values):
    rows, cols = values.shape
    return f"Matrix({rows}, {cols}, {{{', '.join(map(str, values.ravel()))}}})"


BEGIN = f"""
local Matrix = require 'matrix'
local a, b, v, w = {lua(A)}, {lua(B)}, Vector{{1, 2, 3}}, Vector3{{-2, 0.5, 4}}
local turn, rigid = Matrix3x3:rotz(math.pi / 2), Matrix4x4{{0, -1, 0, 5, 1, 0, 0, 6, 0, 0, 1, 7}}
"""
EXAMPLES = {
    "a + b": A + B,
    "a - 2": A - 2,
    "1 + a": 1 + A,
    "2 * a * b": 2 * A @ B,
    "a / 2": A / 2,
    "-a": -A,
    "a ^ 3": A @ A @ A,
    "a ^ -1": np.linalg.inv(A),
    "a:inv()": np.linalg.inv(A),
    "Matrix(2, 2, {0, 1, 1, 0}):inv()": np.array([[0.0, 1], [1, 0]]),
    "a:t()": A.T,
    "a:times(b)": A * B,
    "a:applyfunc(function(x) return x * x end)": A**2,
    "a:abs():sqrt()": np.sqrt(np.abs(A)),
    "a:row(2)": A[1:2],
    "a:col(3)": A[:, 2:],
    "a:slice(1, 2, 2, 3)": A[:2, 1:],
    "a:copy():setrow(2, {7, 8, 9})": np.vstack([A[:1], [[7, 8, 9]], A[2:]]),
    "a:copy():setcol(1, v)": np.column_stack([V, A[:, 1:]]),
    "Matrix:zeros(3, 4):assign(1, 2, a)": np.column_stack([np.zeros(3), A]),
    "a:horzcat(b, v)": np.column_stack([A, B, V]),
    "a:vertcat(b)": np.vstack([A, B]),
    "a:sum(1)": A.sum(0, keepdims=True),
    "a:max(2)": A.max(1, keepdims=True),
    "a:mean(1)": A.mean(0, keepdims=True),
    "Matrix:diag{1, 2}": np.diag([1.0, 2]),
    "Matrix:fromtable(a:totable())": A,
    "Matrix:ones(2, 3)": np.ones((2, 3)),
    "Matrix(2, -1, {1, 2, 3, 4})": np.array([[1.0, 2], [3, 4]]),
    "Matrix(2, 2, function(i, j) return 10 * i + j end)": np.array([[11.0, 12], [21, 22]]),
    "v:cross(w)": np.cross(V, W)[:, None],
    "v:normalized()": (V / np.linalg.norm(V))[:, None],
    "turn": TURN,
    "rigid": RIGID,
    "rigid:inv()": np.linalg.inv(RIGID),
    "(rigid * v:hom()):nonhom()": (TURN @ V + [5, 6, 7])[:, None],
    "Matrix4x4:fromrt(turn, {5, 6, 7})": RIGID,
    "Matrix4x4:torotation(rigid)": TURN,
}
NUMBERS = {
    "a:det()": np.linalg.det(A),
    "a:trace()": np.trace(A),
    "a:sum()": A.sum(),
    "a:prod()": A.prod(),
    "a:max()": A.max(),
    "a:min()": A.min(),
    "a:mean()": A.mean(),
    "v:dot(w)": V @ W,
    "v:norm()": np.linalg.norm(V),
    "a[2][3]": A[1, 2],
    "a:get(3, 1)": A[2, 0],
    "Matrix4x4:toposition(rigid)[2]": 6.0,
    "Matrix(2, 2, {1, 2, 2, 4}):det()": 0.0,
}


@DIALECTS
def test_matrix_operations_agree_with_numpy(run, dialect):
    checks = [f"print({call})" for call in [*EXAMPLES, *NUMBERS]]
    said = run(dialect + BEGIN + "\n".join(checks))
    for line, (call, expected) in zip(said, EXAMPLES.items()):
        rows, cols, data = re.fullmatch(r"Matrix\((\d+),(\d+),\{(.*)\}\)", line).groups()
        matrix = np.array([float(number) for number in data.split(",")]).reshape(int(rows), int(cols))
        assert matrix == pytest.approx(expected, abs=1e-9), call
    for line, (call, expected) in zip(said[len(EXAMPLES) :], NUMBERS.items()):
        assert float(line) == pytest.approx(expected), call


@DIALECTS
def test_elements_can_be_set_and_a_matrix_can_be_printed(run, dialect):
    text = "local m = Matrix:eye(2) m[1][2] = 5 m:set(2, 1, 7):print() print(m == Matrix(2, 2, {1, 5, 7, 1}))"
    assert run(dialect + text) == ["1 5", "7 1", "true"]


def test_matrix_lua_beside_the_script_takes_precedence(run, tmp_path):
    (tmp_path / "matrix.lua").write_text("return {own = true}")
    assert run("print(require('matrix').own)") == ["true"]


@DIALECTS
@pytest.mark.parametrize(
    ("call", "said"),
    [
        ("Matrix(2, 2, {1, 2})", "Matrix: 2 x 2 numbers are expected"),
        ("Matrix(2.5, 2)", "Matrix: rows = 2.5: a whole number from 0 on is expected"),
        ("a + v", "Matrix: two of the same size are expected"),
        ("v * v", "Matrix: columns of the first and rows of the second differ"),
        ("Matrix(2, 2):inv()", "Matrix: it has no inverse"),
        ("v:det()", "Matrix: a square one is expected"),
        ("a:get(4, 1)", "Matrix: there is no [4, 1] in 3 x 3"),
        ("a:horzcat(Vector{1})", "Matrix: as many columns are expected"),
    ],
)
def test_matrix_error_is_reported_with_file_and_line(run, dialect, call, said):
    with pytest.raises(ScriptError) as caught:
        run(dialect + BEGIN + f"print({call})")
    assert said in str(caught.value)
    assert f"main.lua:{5 + bool(dialect)}: " in str(caught.value)
