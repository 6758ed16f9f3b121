"""README.md, CONTRIBUTING.md, docs and tasks: links, commands, parameters and messages in them are what there is."""

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
    """Return the anchors of a page: its own, and those that GitHub gives to headings."""
    headings = HEADING.findall(FENCE.sub("", text))
    return {*(re.sub(r"[^\w\- ]", "", one.lower()).replace(" ", "-") for one in headings), *NAMED.findall(text)}


def broken(page):
    for link in LINK.findall(FENCE.sub("", page.read_text(encoding="utf-8"))):
        name, _, anchor = link.partition("#")
        file = page.parent / name if name else page
        if link.startswith("https://"):
            continue
        if not file.is_file() or (anchor and anchor not in anchors(file.read_text(encoding="utf-8"))):
            yield link


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(Path(page).relative_to(ROOT)))
def test_every_link_of_a_page_leads_somewhere(page):
    assert list(broken(page)) == []


def test_a_link_to_nowhere_is_found(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("# Here\n[a](page.md#here) [b](#there) [c](gone.md) [d](https://example.org) [e](.)\n")
    assert list(broken(page)) == ["#there", "gone.md", "."]  # a folder is no page of the site


# ---- commands, which `./dev.sh docs-commands` runs


def loaded(name):
    spec = importlib.util.spec_from_file_location(name, ROOT / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


commands, writing = loaded("test/docs/commands"), loaded("docs/write_interface")


def test_what_is_left_out_is_in_the_docs():
    texts = {one.text for one in commands.everything()}
    for left_out in (commands.NOT_RUN, commands.SLOW, commands.SHOWN_OTHERWISE):
        assert set(left_out) - texts == set(), "no longer in README.md or docs: take it from the list"


def test_the_commands_of_a_page_are_found_with_what_it_shows(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("```bash\nx\n```\ntext\n```console\n$ a b \\\n  c  # why\nsaid\n$ d\n```\n```python\n$ e\n```\n")
    found = [(one.line, one.text, one.shown) for one in commands.commands(page)]
    assert found == [(6, "a b \\\n  c", ("said",)), (9, "d", ())]


def test_readme_begins_with_a_start_and_the_tests():
    assert [one.text for one in commands.commands(ROOT / "README.md")][:2] == [
        "./dev.sh run web:=true",
        "./dev.sh test",
    ]


# ---- the parameters in docs/interface.md; a rostest compares its other tables


def leaves(mapping, above=()):
    """Return the values of a mapping by their names with slashes."""
    found = {}
    for key, value in mapping.items():
        found |= leaves(value, (*above, key)) if isinstance(value, dict) and value else {"/".join((*above, key)): value}
    return found


def test_the_page_has_the_table_that_is_made():
    text = writing.PAGE.read_text(encoding="utf-8")
    assert writing.page(text) == text, "run docs/write_interface.py"


def test_every_parameter_has_its_default():
    text = writing.CONFIG.read_text(encoding="utf-8")
    assert {one.name: yaml.safe_load(one.default) for one in writing.rows(text)} == leaves(yaml.safe_load(text))


def test_every_parameter_is_explained():
    rows = writing.rows(writing.CONFIG.read_text(encoding="utf-8"))
    assert {one.name for one in rows if not one.comment and not one.name.startswith("cameras/")} == set()


# ---- messages in docs/troubleshooting.md


QUOTED = re.compile(r"^\| (`.+?`) \| .+ \|$", re.MULTILINE)
SPAN = re.compile(r"`([^`]+)`")
PLACEHOLDER = "…"


def printed():
    """Return all texts from which messages are made: string literals of Python, shell scripts, the cockpit's page."""
    texts = [path.read_text(encoding="utf-8") for path in (ROOT / "web/src").rglob("*.js")]
    texts += [path.read_text(encoding="utf-8") for path in (ROOT / "dev.sh", *(ROOT / "packaging").glob("*.sh"))]
    for path in (ROOT / "src/drone_sim").rglob("*.py"):
        nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        texts += [node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)]
    return "\0".join(texts)


def test_every_quoted_message_is_one_of_the_programs():
    page = (ROOT / "docs/troubleshooting.md").read_text(encoding="utf-8")
    messages = [message for cell in QUOTED.findall(page) for message in SPAN.findall(cell)]
    assert len(messages) > 40
    texts = printed()
    parts = {part.strip() for message in messages for part in message.split(PLACEHOLDER)}
    assert {part for part in parts if part not in texts} == set()
