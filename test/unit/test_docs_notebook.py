"""The notebook of docs, run as Jupyter runs it."""

import nbformat
from nbclient import NotebookClient

from drone_sim.files.resources import package_path, python_path

NOTEBOOKS = package_path() / "docs/notebooks"


def test_the_first_flight_climbs_is_plotted_and_seen(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", python_path())
    notebook = nbformat.read(NOTEBOOKS / "first_flight.ipynb", as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells), "outputs would be out of date"
    notebook.cells.append(nbformat.v4.new_code_cell("print(*places[-1])"))
    NotebookClient(notebook, timeout=100, resources={"metadata": {"path": str(NOTEBOOKS)}}).execute()
    *outputs, last = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert [one["output_type"] for one in outputs if "image/png" in one.get("data", {})] == ["display_data"] * 2
    assert any(one.get("data", {}).get("text/plain") == "(480, 640, 3)" for one in outputs)
    x, _, z = map(float, last["text"].split())
    assert abs(z - 1.5) < 0.1 and x > 1.5
