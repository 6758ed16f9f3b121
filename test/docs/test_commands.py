"""The commands in README.md and docs do what the pages say; `./dev.sh docs-commands --all` runs the others, too."""

import pytest

pytest.importorskip("roslaunch", reason="needs ROS")

import commands
import run

PAGES = ("fleet", "import", "states", "time", "tuning", "weather")


def test_what_is_left_out_is_in_the_docs():
    texts = {one.text for one in commands.everything()}
    for left_out in (commands.NOT_RUN, commands.SLOW, commands.SHOWN_OTHERWISE):
        assert set(left_out) - texts == set(), "no longer in README.md or docs: take it from the list"


def test_the_commands_of_a_page_are_found_with_what_it_shows(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("```bash\nx\n```\ntext\n```console\n$ a b \\\n  c  # why\nsaid\n$ d\n```\n```python\n$ e\n```\n")
    found = [(one.line, one.text, one.shown) for one in commands.commands(page)]
    assert found == [(6, "a b \\\n  c", ("said",)), (9, "d", ())]


def test_the_commands_of_the_pages_do_what_they_say():
    wrong = run.run([commands.ROOT / "docs" / f"{page}.md" for page in PAGES], everything=False)
    assert not wrong, "\n".join(wrong)
