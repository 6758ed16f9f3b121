#!/usr/bin/env python3
"""Mutants of the source, drawn at random, that the unit tests must kill: test/mutants.py [COUNT] [SEED].

A mutant has one changed operator or constant. The test files that concern its module run on it, in a temporary copy of
the tree, up to the first failure or the time limit. A test that also fails without the mutant kills nothing.
"""

import ast
import copy
import functools
import random
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = ["world", "forces", "scene", "scripting", "grading"]  # the same number of mutants of each
FILES = 8  # test files for a mutant
LIMIT = 180  # s for the tests of a mutant
REPLACEMENT = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In,
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Mod: ast.Mult, ast.FloorDiv: ast.Mult,
    ast.And: ast.Or, ast.Or: ast.And,
}  # fmt: skip


def change(node):
    """Mutate `node` in place; return whether it can be mutated."""
    if isinstance(node, ast.Compare):
        node.ops[0] = REPLACEMENT[type(node.ops[0])]()
    elif isinstance(node, ast.BinOp | ast.BoolOp | ast.AugAssign) and type(node.op) in REPLACEMENT:
        node.op = REPLACEMENT[type(node.op)]()
    elif isinstance(node, ast.Constant) and isinstance(node.value, bool | int | float):
        node.value = not node.value if isinstance(node.value, bool) else node.value + 1
    else:
        return False
    return True


@functools.cache
def mutants(package):
    """Return (path, index of the node, line, before, after) of each mutant of a package."""
    found = []
    for path in sorted((ROOT / "src/drone_sim" / package).rglob("*.py")):
        for index, node in enumerate(ast.walk(ast.parse(path.read_text()))):
            before, mutant = ast.unparse(node), copy.deepcopy(node)
            if change(mutant):
                found.append((path.relative_to(ROOT), index, node.lineno, before, ast.unparse(mutant)))
    return found


def tests_of(path):
    """Return the test files that import the module at `path`, have its name, or mention most of its definitions."""
    dotted = ".".join(path.with_suffix("").parts[1:]).removesuffix(".__init__")
    package, _, module = dotted.rpartition(".")
    imported = re.compile(rf"{re.escape(dotted)}\b|from {re.escape(package)} import [^\n]*\b{module}\b")
    nodes = ast.walk(ast.parse((ROOT / path).read_text()))
    names = {node.name for node in nodes if isinstance(node, ast.ClassDef | ast.FunctionDef)}
    words = {test: set(re.findall(r"\w+", test.read_text())) for test in sorted(ROOT.glob("test/unit/test_*.py"))}
    rarity = {name: 1 / max(1, sum(name in found for found in words.values())) for name in names if len(name) > 3}
    topics = {word.rstrip("s") for part in path.with_suffix("").parts[2:] for word in part.split("_") if len(word) > 3}
    score = {
        test: bool(imported.search(test.read_text()))
        + sum(topic in test.stem for topic in topics)
        + sum(rarity[name] for name in rarity.keys() & found)
        for test, found in words.items()
    }
    best = sorted(score, key=lambda test: (-score[test], test.name))[:FILES]
    return [str(test.relative_to(ROOT)) for test in best if score[test] > 0.25 or test in best[:2]]


def run(tree, tests, deselected=()):
    """Run tests in `tree` up to the first failure; return pytest's exit status and the name of the failed test."""
    options = ["-x", "-q", "-rfE", "--show-capture=no", "-o", "addopts=", "-p", "no:randomly", "-p", "no:cacheprovider"]
    options += [f"--deselect={one}" for one in deselected]
    command = [sys.executable, "-m", "pytest", *options, *tests]
    try:
        process = subprocess.run(command, cwd=tree, capture_output=True, text=True, timeout=LIMIT)
    except subprocess.TimeoutExpired:
        return None, "the time limit"
    failed = re.findall(r"^(?:FAILED|ERROR) (test\S+\.py(?:::.*?)?)(?: - .*)?$", process.stdout, re.MULTILINE)
    return process.returncode, failed[-1] if failed else process.stdout[-200:]


def result(tree, path, index, tests):
    """Return whether the tests kill a mutant. A test that also fails without the mutant is deselected."""
    original, deselected = (tree / path).read_text(), []
    module = ast.parse(original)
    change(list(ast.walk(module))[index])
    while len(deselected) < 5:
        try:
            (tree / path).write_text(ast.unparse(module))
            status, failed = run(tree, tests, deselected)
        finally:
            (tree / path).write_text(original)
        if status == 0:
            return "lives"
        if status is None or run(tree, [failed])[0] == 0:
            return f"killed by {failed}" if status else f"lives for {LIMIT} s"
        deselected.append(failed)
    return f"lives: {deselected} fail without it, too"


def main(count=40, seed=1):
    draw = random.Random(seed)
    killed = 0
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder, "tree")
        shutil.copytree(ROOT, tree, symlinks=True, ignore=shutil.ignore_patterns(".git", "build", "devel"))
        for number in range(count):
            path, index, line, before, after = draw.choice(mutants(PACKAGES[number % len(PACKAGES)]))
            tests = tests_of(path)
            verdict = result(tree, path, index, tests)
            killed += verdict.startswith("killed")
            print(f"{path}:{line}: {before} -> {after}: {verdict}", flush=True)
    print(f"{killed} of {count} killed")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
