"""The examples in docs/extending.md work, and change only the files that CONTRIBUTING.md names.

A section is `## Something to add`. Its code blocks are headed by a line with a file's name in backquotes. With a folder
in its name, a file belongs to the package: the whole file, or (```diff) lines to add. Without, it is the reader's own:
it is written into a separate folder, and every script there is run.
"""

import difflib
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SECTIONS = dict(re.findall(r"^## (.+?)\n(.*?)(?=^## |\Z)", (ROOT / "docs/extending.md").read_text(), re.S | re.M))
PATIENCE = 120.0  # s; a script takes a few seconds


def blocks(text):
    """Return file name, language and content of each code block that has a file name."""
    return re.findall(r"^`(\S+)`[^\n]*\n\n```(\w+)\n(.*?)^```$", text, re.S | re.M)


def patterns(title):
    """Return two lists of patterns from the title's row in CONTRIBUTING.md: new files, and files that get a line."""
    row = re.search(rf"^\| \[{re.escape(title.lower())}\].*$", (ROOT / "CONTRIBUTING.md").read_text(), re.M).group()
    _, _, new, with_a_line, _ = row.split("|")
    return [
        [re.sub(r"<\w+>", r"[^/]+", re.escape(name).replace(r"\<", "<").replace(r"\>", ">")) for name in names]
        for names in (re.findall(r"`(.+?)`", new), re.findall(r"`(.+?)`", with_a_line))
    ]


def patched(text, changes):
    """Return the text with the changes of a diff, whose context must occur exactly once."""
    for change in re.split(r"^@@.*\n", changes, flags=re.M):
        lines = change.splitlines(keepends=True)
        before = "".join(line[1:] for line in lines if line[0] != "+")
        assert text.count(before) == 1, f"must occur exactly once:\n{before}"
        text = text.replace(before, "".join(line[1:] for line in lines if line[0] != "-"))
    return text


def write(package, own, section):
    """Write a section's files into the package and into the reader's folder."""
    for name, language, content in blocks(section):
        path = (package if "/" in name else own) / name
        path.write_text(patched(path.read_text(), content) if language == "diff" else content)


def files(folder):
    """Return the contents of a package's files by their relative path."""
    found = (path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts)
    return {str(path.relative_to(folder)): path.read_bytes() for path in found}


def run(script, package):
    paths = [str(package / "src"), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}
    return subprocess.run(
        [sys.executable, script.name],
        cwd=script.parent,
        env=environment,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )


@pytest.mark.parametrize("title", SECTIONS)
def test_the_example_of_a_section_works_and_changes_only_the_allowed_files(title, tmp_path):
    package, own = tmp_path / "drone_sim", tmp_path / "own"
    for folder in ("src", "config", "urdf"):
        shutil.copytree(ROOT / folder, package / folder, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "package.xml", package)
    own.mkdir()
    before = files(package)
    write(package, own, SECTIONS[title])
    after = files(package)
    scripts = sorted(own.glob("*.py"))
    assert scripts, "the section has a script that uses its example"
    for script in scripts:
        done = run(script, package)
        assert done.returncode == 0, done.stderr
    new, with_a_line = patterns(title)
    touched = {name for name in after if after[name] != before.get(name)}
    assert before.keys() <= after.keys()
    for name in touched:
        assert any(re.fullmatch(pattern, name) for pattern in (new if name not in before else with_a_line)), name
        lines = difflib.ndiff(before.get(name, b"").decode().splitlines(), after[name].decode().splitlines())
        assert not [line for line in lines if line.startswith("- ")], f"{name}: lines were removed"
    assert all(any(re.fullmatch(pattern, name) for name in touched) for pattern in (*new, *with_a_line))
