"""A report to open in a browser, from file:// and without a network: what was flown, and what came of it."""

from drone_sim.grading.outputs.html.report import check, write

__all__ = ["check", "write"]
