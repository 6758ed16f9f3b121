"""Sphinx's settings for the manual: README.md, docs and tasks as a site that needs no network.

The pages are those that GitHub shows. The navigation is the table under "Every page" in README.md.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from docutils import nodes
from latex2mathml import converter
from sphinx.application import Sphinx

project = "drone_sim"
html_title = "drone_sim"
language = "en"
root_doc = "README"
extensions = ["myst_parser"]
include_patterns = ["*.md", "CHANGELOG.rst", "docs/*.md", "tasks/README.md", "tasks/*/README.md"]
exclude_patterns = [".*", "build", "devel", "docs/html", "src", "test", "web"]  # folders that need no looking into

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4

html_theme = "furo"
html_math_renderer = "mathml"
html_extra_path = ["index.html"]
html_static_path = ["manual.css", "theme.js"]
html_css_files = ["manual.css"]
html_js_files = ["theme.js"]
html_copy_source = False
html_show_copyright = False
html_show_sphinx = False
pygments_style = "friendly"
pygments_dark_style = "github-dark"

_ROW = re.compile(r"^\| \*\*([^*]+)\*\* \| (.+) \|$", re.MULTILINE)
_PAGE = re.compile(r"\[(\w)([^\]]*)\]\(([^)#]+)\.(?:md|rst)\)")


def setup(app: Sphinx) -> None:
    """Add the navigation, and formulas."""
    app.connect("source-read", _add_navigation)
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))


def _add_navigation(_app: Sphinx, page: str, source: list[str]) -> None:
    if page == root_doc:
        source[0] += "".join(_toctrees(source[0]))
    elif page == "tasks/README":
        source[0] += _toctree("Tasks", "*/README", "glob")


def _toctrees(readme: str) -> Iterator[str]:
    for part, pages in _ROW.findall(readme):
        yield _toctree(part, "\n".join(f"{first.upper()}{rest} <{page}>" for first, rest, page in _PAGE.findall(pages)))


def _toctree(caption: str, pages: str, *options: str) -> str:
    said = "".join(f":{option}:\n" for option in ("hidden", *options))
    return f"\n\n```{{toctree}}\n:caption: {caption}\n{said}\n{pages}\n```\n"


def _inline(self: Any, node: nodes.math) -> None:
    self.body.append(converter.convert(node.astext()))
    raise nodes.SkipNode


def _block(self: Any, node: nodes.math_block) -> None:
    self.body.append(converter.convert(node.astext(), display="block"))
    raise nodes.SkipNode
