"""The table of parameters in docs/interface.md is that of config/drone.yaml. A rostest compares the other tables."""

import importlib.util

import yaml

from drone_sim.files.resources import package_path

ROOT = package_path()
SPEC = importlib.util.spec_from_file_location("write_interface", ROOT / "docs/write_interface.py")
writing = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(writing)


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
