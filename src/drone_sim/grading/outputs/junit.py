"""Results as JUnit XML for CI systems: a test suite per script, a test case per flight and criterion.

The elements and attributes are those that Jenkins' JUnit plugin and GitLab read. GitLab shows the text of a failure,
Jenkins also its message; both identify test cases by class and name.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from drone_sim.files import writing
from drone_sim.grading.outputs.script_results import describe, flight_label, group_by_script, named_outcomes
from drone_sim.grading.plan import Plan
from drone_sim.grading.result import Result
from drone_sim.message_text import escaped

_INVALID = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")  # XML 1.0, production 2


def write(plan: Plan, results: Sequence[Result], path: str | Path) -> None:
    """Write the file. Raises OSError, in one line that names the file."""
    writing.write(path, text(plan, results))


def text(plan: Plan, results: Sequence[Result]) -> str:
    """Return the XML; each flight has a test case with its simulated duration, and one for every criterion."""
    root = Element("testsuites", name=_xml(plan.name))
    for script in group_by_script(results):
        suite = SubElement(root, "testsuite", name=_xml(f"{plan.name}: {script.label}"), skipped="0")
        group = _xml(f"{plan.name}.{script.label.replace('.', '_')}")
        for result in script.flights:
            label = _xml(flight_label(result))
            case = SubElement(suite, "testcase", classname=group, name=f"{label}: flight", time=f"{result.flown:.3f}")
            if result.error:
                SubElement(case, "error", type="flight", message=_xml(result.error)).text = _xml(result.error)
            elif result.tried:
                message = _xml("; ".join(result.troubles))
                SubElement(case, "failure", type="rules", message=message).text = message
            for name, outcome in named_outcomes(result):
                case = SubElement(suite, "testcase", classname=group, name=f"{label}: {_xml(name)}", time="0.000")
                if not outcome.passed:
                    message = _xml(describe(outcome) or "failed")
                    SubElement(case, "failure", type=_xml(outcome.kind), message=message).text = message
        _set_totals(suite, script.flown)
    _set_totals(root, sum(result.flown for result in results))
    ElementTree.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ElementTree.tostring(root, encoding="unicode")}\n'


def _set_totals(element: Element, seconds: float) -> None:
    for attribute, tag in (("tests", "testcase"), ("failures", "failure"), ("errors", "error")):
        element.set(attribute, str(len(list(element.iter(tag)))))
    element.set("time", f"{seconds:.3f}")


def _xml(words: str) -> str:
    """Return text with escaped control characters, and without other characters that XML does not allow."""
    return _INVALID.sub("\N{REPLACEMENT CHARACTER}", escaped(words))
