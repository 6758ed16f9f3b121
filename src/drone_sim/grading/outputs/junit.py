"""Results as JUnit XML, which CI systems show: a suite per script, a case per flight and criterion.

The elements and attributes are those that Jenkins' JUnit plugin and GitLab read; GitLab shows a failure's text, Jenkins
its message as well, and both tell cases apart by class and name.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from drone_sim.files import writing
from drone_sim.grading.outputs.by_script import by_script, describe, flight_label, named_outcomes
from drone_sim.grading.plan import Plan
from drone_sim.grading.result import Result
from drone_sim.message_text import escaped

_NOT_IN_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")  # XML 1.0, production 2


def write(plan: Plan, results: Sequence[Result], path: str | Path) -> None:
    """Write the file. Raises OSError, in one line that names it."""
    writing.write(path, text(plan, results))


def text(plan: Plan, results: Sequence[Result]) -> str:
    """Return the file's text."""
    root = Element("testsuites", name=_xml(plan.name))
    for script in by_script(results):
        suite = SubElement(root, "testsuite", name=_xml(f"{plan.name}: {script.label}"), skipped="0")
        for result in script.flights:
            _add_flight(suite, _xml(f"{plan.name}.{script.label.replace('.', '_')}"), result)
        _count(suite, script.flown)
    _count(root, sum(one.flown for one in results))
    ElementTree.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ElementTree.tostring(root, encoding="unicode")}\n'


def _add_flight(suite: Element, group: str, result: Result) -> None:
    """Add a case for the flight itself, whose time is the simulated one, and one for every criterion."""
    flight = _xml(flight_label(result))
    case = SubElement(suite, "testcase", classname=group, name=f"{flight}: flight", time=f"{result.flown:.3f}")
    if result.error:
        SubElement(case, "error", type="flight", message=_xml(result.error)).text = _xml(result.error)
    elif result.tried:
        said = _xml("; ".join(result.troubles))
        SubElement(case, "failure", type="rules", message=said).text = said
    for name, outcome in named_outcomes(result):
        case = SubElement(suite, "testcase", classname=group, name=f"{flight}: {_xml(name)}", time="0.000")
        if not outcome.passed:
            said = _xml(describe(outcome) or "failed")
            SubElement(case, "failure", type=_xml(outcome.kind), message=said).text = said


def _count(element: Element, seconds: float) -> None:
    for attribute, tag in (("tests", "testcase"), ("failures", "failure"), ("errors", "error")):
        element.set(attribute, str(len(list(element.iter(tag)))))
    element.set("time", f"{seconds:.3f}")


def _xml(words: str) -> str:
    """Return text with visible control characters, and without the other characters that no XML can hold."""
    return _NOT_IN_XML.sub("\N{REPLACEMENT CHARACTER}", escaped(words))
