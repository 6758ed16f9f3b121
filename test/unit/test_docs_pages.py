"""Links, commands, parameters and messages in README.md, CONTRIBUTING.md, docs and tasks are up to date."""

import ast
import importlib.util
import re
import sys
from pathlib import Path

import pytest
import yaml

from drone_sim.files.resources import package_path

ROOT = package_path()
PAGES = [*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("tasks/**/*.md")]
LINK = re.compile(r"\]\(([^)\s]+)\)")
FENCE = re.compile(r"^\s*```.*?^\s*```", re.MULTILINE | re.DOTALL)
NAMED = re.compile(r'<a id="([^"]+)">')
HEADING = re.compile(r"^#+ (.+)$", re.MULTILINE)


def anchors(text):
    """Return the anchors of a page: its `<a id>` elements, and those that GitHub creates for headings."""
    headings = HEADING.findall(FENCE.sub("", text))
    return {*(re.sub(r"[^\w\- ]", "", one.lower()).replace(" ", "-") for one in headings), *NAMED.findall(text)}


def broken_links(page):
    for link in LINK.findall(FENCE.sub("", page.read_text(encoding="utf-8"))):
        name, _, anchor = link.partition("#")
        file = page.parent / name if name else page
        if link.startswith("https://"):
            continue
        if not file.is_file() or (anchor and anchor not in anchors(file.read_text(encoding="utf-8"))):
            yield link


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(Path(page).relative_to(ROOT)))
def test_every_link_of_a_page_has_a_target(page):
    assert list(broken_links(page)) == []


def test_a_broken_link_is_found(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("# Here\n[a](page.md#here) [b](#there) [c](gone.md) [d](https://example.org) [e](.)\n")
    assert list(broken_links(page)) == ["#there", "gone.md", "."]  # a folder is not a page


def test_every_test_that_a_page_names_exists():
    """A row names files of tests (`test_fly`, `real_time.test`) and functions in them, whose end may be an ellipsis."""
    paths = list(ROOT.glob("test/*/test_*.py"))  # two of them may have the same name
    files = {path.stem for path in paths}
    rows = [row for page in PAGES for row in page.read_text(encoding="utf-8").splitlines() if "test_" in row]
    missing = []
    for row in rows:
        names = re.findall(r"(?<!\w)(test_\w+)(…?)", row)
        suites = {name for name, _ in names} | {f"test_{suite}" for suite in re.findall(r"(\w+)\.test\b", row)}
        source = "".join(path.read_text(encoding="utf-8") for path in paths if path.stem in suites)
        for name, ellipsis in names:
            end = "" if ellipsis else r"\("
            if name not in files and not re.search(f"def {name}{end}", source):
                missing.append(name)
    assert rows and not missing


# ---- commands, which `./dev.sh docs-commands` runs


def load_module(name):
    spec = importlib.util.spec_from_file_location(name, ROOT / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


commands, writing = load_module("test/docs/commands"), load_module("docs/write_interface")


def test_every_excluded_command_is_in_the_docs():
    texts = {one.text for one in commands.everything()}
    for excluded in (commands.NOT_RUN, commands.SLOW, commands.SHOWN_OTHERWISE):
        assert set(excluded) - texts == set(), "no longer in README.md or docs: remove it from the list"


def test_the_commands_of_a_page_are_found_with_their_output(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("```bash\nx\n```\ntext\n```console\n$ a b \\\n  c  # why\nsaid\n$ d\n```\n```python\n$ e\n```\n")
    found = [(one.line, one.text, one.shown) for one in commands.commands(page)]
    assert found == [(6, "a b \\\n  c", ("said",)), (9, "d", ())]


def test_the_readme_begins_with_the_commands_for_start_and_tests():
    assert [one.text for one in commands.commands(ROOT / "README.md")][:2] == [
        "./dev.sh run web:=true",
        "./dev.sh test",
    ]


# ---- parameters in docs/interface.md, whose other tables a rostest compares


def leaves(mapping, above=()):
    """Return the values of a nested mapping by their keys joined with slashes."""
    found = {}
    for key, value in mapping.items():
        found |= leaves(value, (*above, key)) if isinstance(value, dict) and value else {"/".join((*above, key)): value}
    return found


def test_the_table_of_parameters_is_up_to_date():
    text = writing.PAGE.read_text(encoding="utf-8")
    assert writing.page(text) == text, "run docs/write_interface.py"


def test_the_table_has_the_default_of_every_parameter():
    text = writing.CONFIG.read_text(encoding="utf-8")
    assert {one.name: yaml.safe_load(one.default) for one in writing.rows(text)} == leaves(yaml.safe_load(text))


def test_every_parameter_is_explained():
    rows = writing.rows(writing.CONFIG.read_text(encoding="utf-8"))
    assert {one.name for one in rows if not one.comment and not one.name.startswith("cameras/")} == set()


# ---- messages in docs/troubleshooting.md


QUOTED = re.compile(r"^\| (`.+?`) \| .+ \|$", re.MULTILINE)
SPAN = re.compile(r"`([^`]+)`")
PLACEHOLDER = "…"


def message_texts():
    """Return all sources of messages: Python's string literals, the shell scripts, the cockpit's JavaScript."""
    texts = [path.read_text(encoding="utf-8") for path in (ROOT / "web/src").rglob("*.js")]
    texts += [path.read_text(encoding="utf-8") for path in (ROOT / "dev.sh", *(ROOT / "packaging").glob("*.sh"))]
    for path in (ROOT / "src/drone_sim").rglob("*.py"):
        nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        texts += [node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)]
    return "\0".join(texts)


def test_every_quoted_message_occurs_in_the_source():
    page = (ROOT / "docs/troubleshooting.md").read_text(encoding="utf-8")
    messages = [message for cell in QUOTED.findall(page) for message in SPAN.findall(cell)]
    assert len(messages) > 40
    texts = message_texts()
    parts = {part.strip() for message in messages for part in message.split(PLACEHOLDER)}
    assert {part for part in parts if part not in texts} == set()
