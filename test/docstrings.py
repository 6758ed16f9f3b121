#!/usr/bin/env python3
"""Print docstrings drawn at random, for a reader who sees nothing else: test/docstrings.py [COUNT] [SEED]."""

import ast
import random
import sys
from pathlib import Path

SOURCE = Path(__file__).parents[1] / "src" / "drone_sim"


def docstrings():
    """Yield file:line, name and docstring of each module, class and function."""
    for path in sorted(SOURCE.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and (text := ast.get_docstring(node)):
                place = f"{path.relative_to(SOURCE.parent)}:{getattr(node, 'lineno', 1)}"
                yield f"{place} {getattr(node, 'name', 'module')}\n    " + "\n    ".join(text.splitlines())


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    print(*random.Random(seed).sample(list(docstrings()), count), sep="\n")
