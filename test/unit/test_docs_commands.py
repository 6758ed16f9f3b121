"""The commands in README.md and docs are found as they stand there; `./dev.sh docs-commands` runs them."""

import importlib.util
import sys

from drone_sim.files.resources import package_path

FOLDER = package_path() / "test/docs"


def loaded(name):
    spec = importlib.util.spec_from_file_location(name, FOLDER / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


commands = loaded("commands")


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
    assert [one.text for one in commands.commands(package_path() / "README.md")][:2] == [
        "./dev.sh run web:=true",
        "./dev.sh test",
    ]
