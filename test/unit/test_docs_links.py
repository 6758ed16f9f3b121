"""Every link in README.md, CONTRIBUTING.md, docs and tasks leads to a file, and to a heading in it, that is there."""

import re
from pathlib import Path

import pytest

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
