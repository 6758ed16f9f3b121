"""Output of results: table, JSON, JUnit, Gradescope and Moodle."""

import csv
import io
import json
import random
import re
from dataclasses import replace
from xml.etree import ElementTree

import pytest
from graded import EVIL, PLAN, read_plan, result

from drone_sim.grading.flight import result_of
from drone_sim.grading.outputs import as_json, gradescope, junit, marks, table
from drone_sim.grading.outputs.script_results import group_by_script
from drone_sim.grading.submissions.submission import Person, Submission, names_of
from drone_sim.message_text import escaped


@pytest.fixture(name="plan", scope="module")
def _plan(tmp_path_factory):
    return read_plan(tmp_path_factory.mktemp("plan"))


def results_of_a_class(scripts=40, seeds=20):
    rng = random.Random(1)
    return [
        result(f"/home/students/{'x' * script}{script}/solution.py", seed, [rng.random() < 0.8 for _ in range(2)])
        for script in range(scripts)
        for seed in range(seeds)
    ]


def test_labels_are_the_shortest_path_endings_that_differ():
    scripts = ["/a/my.py", "/b/my.py", "/b/other.py", ""]
    labels = [one.label for one in group_by_script([result(script) for script in scripts])]
    assert labels == ["a/my.py", "b/my.py", "other.py", "(built-in)"]


def test_a_script_gets_the_mean_points_of_its_flights_and_the_worst_flight():
    flights = [result(seed=0), result(seed=2, passed=(False, False)), result(seed=1, passed=(True, False))]
    (script,) = group_by_script(flights)
    assert [one.seed for one in script.flights] == [0, 1, 2]
    assert (script.passed, script.points, script.of, script.worst.seed) == (1, pytest.approx(5 / 3), 3, 2)
    assert script.failures == [("no_contact", 2), ("forward", 1)]


def test_the_table_has_one_line_of_eighty_columns_per_script(plan):
    lines = table.text(plan, results_of_a_class()).splitlines()
    assert len(lines) == 43
    assert all(len(line) <= 80 for line in lines)
    assert "solution.py" in lines[-2]
    assert re.fullmatch(r"\d+ of 40 scripts passed every flight", lines[-1])


def test_the_table_of_a_single_flight_lists_its_criteria(plan):
    text = table.text(plan, [result(passed=(True, False), error="it broke")])
    assert re.search(r"ok +forward +2/2 +it rose in 0.5 s\n", text)
    assert re.search(r"FAIL +no_contact +0/1 +it rose in 0.5 s \(at 1.50 s\)\n", text)
    assert "error: it broke" in text
    assert "2 of 3 points" in text


@pytest.mark.parametrize("terminal", [True, False])
def test_only_terminals_get_colours(plan, terminal):
    file = io.StringIO()
    file.isatty = lambda: terminal
    table.show(plan, [result()], file)
    assert ("\033[32m" in file.getvalue()) is terminal


def test_control_characters_in_names_and_errors_are_not_printed(plan):
    evil = [result(f"{EVIL}{number}.py", error=EVIL, names=(EVIL, EVIL)) for number in (1, 2)]
    for results in (evil, evil[:1]):
        assert not re.search("[\x1b\x07\ud800]", table.text(plan, results))


def test_json_holds_all_results(plan, tmp_path):
    results = [*results_of_a_class(2, 2), result(EVIL, error=EVIL, changes={"control": {"Kzref": float("inf")}})]
    as_json.write(plan, results, tmp_path / "r.json")
    data = json.loads((tmp_path / "r.json").read_text(), parse_constant=lambda word: pytest.fail(f"{word} is no JSON"))
    assert (data["version"], data["plan"]["name"], len(data["scripts"])) == (1, "steps", 3)
    assert data["results"][0] == results[0].to_json() | {"outcomes": data["results"][0]["outcomes"]}
    assert data["results"][0]["outcomes"][0] == results[0].to_json()["outcomes"][0]
    assert data["results"][-1]["changes"] == {"control": {"Kzref": None}}


def test_junit_counts_match_its_test_cases(plan, tmp_path):
    flights = [result(seed=0), result(seed=1, passed=(True, False)), result("b.py", error="it broke", passed=(False,))]
    junit.write(plan, flights, tmp_path / "r.xml")
    root = ElementTree.parse(tmp_path / "r.xml").getroot()
    assert [(suite.get("name"), suite.get("tests"), suite.get("failures"), suite.get("errors")) for suite in root] == [
        ("steps: my.py", "6", "1", "0"),
        ("steps: b.py", "2", "1", "1"),
    ]
    failed = [case for case in root.iter("testcase") if case.find("failure") is not None]
    assert [case.get("name") for case in failed] == ["seed 1: no_contact", "seed 0: forward"]
    assert failed[0].find("failure").get("message") == failed[0].find("failure").text == "it rose in 0.5 s (at 1.50 s)"
    cases = [(case.get("classname"), case.get("name")) for case in root.iter("testcase")]
    assert len(set(cases)) == len(cases)


def test_two_criteria_of_equal_name_become_two_test_cases(plan):
    root = ElementTree.fromstring(junit.text(plan, [result(names=("reach", "reach"))]))
    assert [case.get("name") for case in root.iter("testcase")][1:] == ["seed 0: reach", "seed 0: reach (2)"]


def test_junit_is_valid_xml_for_any_names_and_errors(plan, tmp_path):
    junit.write(plan, [result(EVIL, error=EVIL, passed=(False, False), names=(EVIL, EVIL))], tmp_path / "r.xml")
    root = ElementTree.parse(tmp_path / "r.xml").getroot()
    assert "<script>alert(1)" in root.find(".//error").get("message")
    assert r"\x1b[31m\x07\x00\x9b\u202e\ud800" in root.find(".//error").text


def test_gradescope_scores_are_means_over_the_flights(plan):
    data = gradescope.content(plan, [result(seed=0), result(seed=1, passed=(True, False), error=EVIL)])
    assert data["score"] == sum(test["score"] for test in data["tests"]) == 2.5
    forward, contact = data["tests"]
    assert (forward["name"], forward["score"], forward["max_score"], forward["status"]) == ("forward", 2, 2, "passed")
    assert (contact["name"], contact["score"], contact["max_score"], contact["status"]) == (
        "no_contact",
        0.5,
        1,
        "failed",
    )
    assert "seed 1: FAILED: it rose in 0.5 s (at 1.50 s)" in contact["output"]
    assert data["output_format"] == data["test_output_format"] == data["test_name_format"] == "text"
    assert escaped(EVIL) in data["output"]


def test_gradescope_output_of_two_scripts_is_refused(plan, tmp_path):
    with pytest.raises(ValueError, match=r"must be of one script, not 2"):
        gradescope.write(plan, [result("a.py"), result("b.py")], tmp_path / "r.json")
    assert not (tmp_path / "r.json").exists()


# Allowed values by Gradescope's autograder specifications, "Output format". Its harness refuses other values.
VISIBILITY = {"hidden", "after_due_date", "after_published", "visible"}
FORMATS = {"text", "html", "simple_format", "md", "ansi"}
TEST_KEYS = {
    "score": float,
    "max_score": float,
    "status": {"passed", "failed"},
    "name": str,
    "name_format": FORMATS,
    "number": str,
    "output": str,
    "output_format": FORMATS,
    "tags": list,
    "visibility": VISIBILITY,
    "extra_data": dict,
}
RESULT_KEYS = {
    "score": float,
    "execution_time": float,
    "output": str,
    **dict.fromkeys(("output_format", "test_output_format", "test_name_format"), FORMATS),
    **dict.fromkeys(("visibility", "stdout_visibility"), VISIBILITY),
    "extra_data": dict,
    "tests": list,
    "leaderboard": list,
}


def check_keys(data, permitted):
    assert data.keys() <= permitted.keys()
    for key, value in data.items():
        kind = permitted[key]
        assert value in kind if isinstance(kind, set) else isinstance(value, (int, float) if kind is float else kind)


def test_the_gradescope_file_follows_its_specification(plan):
    flights = [result(seed=0), result(seed=1, passed=(False, False), error=EVIL, names=("forward", EVIL))]
    data = gradescope.content(plan, flights)
    check_keys(data, RESULT_KEYS)
    texts = [data["output"], *(one[key] for one in data["tests"] for key in ("name", "output"))]
    assert [escaped(one) for one in texts] == texts and escaped(EVIL) in texts
    for one in data["tests"]:
        check_keys(one, TEST_KEYS)
        assert 0 <= one["score"] <= one["max_score"]
    assert "score" in data and len(data["tests"]) == 3


# Jenkins' schema of JUnit's XML (xunit-plugin, junit-10.xsd): allowed attributes, required attributes, children.
SUITE_KEYS = "name tests failures errors group time skipped timestamp hostname id package file log url"
JUNIT = {
    "testsuites": ("name time tests failures errors", "", "testsuite"),
    "testsuite": (SUITE_KEYS, "name tests failures errors", "testsuite properties testcase system-out system-err"),
    "testcase": ("name time classname group", "name", "skipped error failure system-out system-err"),
    "error": ("type message", "", ""),
    "failure": ("type message", "", ""),
}


def test_the_junit_file_follows_its_schema(plan):
    flights = [result(seed=0), result(seed=1, passed=(True, False)), result("b.py", error=EVIL, passed=(False,))]
    tried = ("tried to move Drone at 1.00 s (sim.setObjectPosition)",)
    flights.append(replace(result("c.py"), tried=tried, passed=False))
    root = ElementTree.fromstring(junit.text(plan, flights))
    assert root.tag == "testsuites" and {one.tag for one in root.iter()} == {*JUNIT}
    for one in root.iter():
        permitted, mandatory, inside = (words.split() for words in JUNIT[one.tag])
        assert {*mandatory} <= one.attrib.keys() <= {*permitted} and {child.tag for child in one} <= {*inside}
        if "time" in one.attrib:
            assert re.fullmatch(r"\d*(\.\d*)?", one.get("time"))


def test_the_marks_file_can_be_imported_by_moodle(tmp_path):
    submissions = [
        Submission("a.py", (Person("Ada Lovelace", "7"),)),
        Submission("b.py", (Person("=Bo", id="8", email="b@x"), Person("Che"))),
        Submission("c.py"),
        Submission("not flown.py"),
    ]
    names = names_of(submissions)
    flights = [result("a.py"), result("b.py", passed=(True, False)), result("b.py", 1), result("c.py", error="a\nb")]
    marks.write(submissions, group_by_script(flights, names), tmp_path / "m.csv")
    ada, bo, che, script = csv.DictReader((tmp_path / "m.csv").read_text().splitlines())
    # Moodle's importer requires the columns Identifier, Grade, and Last modified (grade).
    assert (ada["Identifier"], ada["Grade"], ada["Last modified (grade)"]) == ("Participant 7", "3", "-")
    assert (bo["Full name"], bo["ID number"], bo["Email address"], bo["Grade"]) == ("'=Bo", "8", "b@x", "2.5")
    assert bo["Maximum Grade"] == "3" and bo["Feedback comments"] == "1 of 2 flights passed; failed: no_contact in 1"
    assert (che["Full name"], che["Grade"], script["Full name"]) == ("Che", "2.5", "c.py")
    assert script["Feedback comments"] == "0 of 1 flights passed; ended by an error: 1"


def test_marks_show_the_error_if_nothing_was_flown(plan, tmp_path):
    why = "[load] /class/b.py:1: SyntaxError: invalid syntax\x1b[31m"
    broken = [result_of(plan, "/class/b.py", seed, {}, why) for seed in range(3)]
    later = [result("c.py", seed, (False, True), error="[actuation] c.py:4: boom") for seed in range(3)]
    no_script = "'d': holds no child script"
    none = [result_of(plan, "/class/d", seed, {}, no_script) for seed in range(3)]
    bos = Submission("/class/b.py", (Person("Bo"),))
    submissions = [bos, Submission("c.py"), Submission("/class/d", error=no_script)]
    marks.write(submissions, group_by_script([*broken, *later, *none]), tmp_path / "m.csv")
    bo, che, du = (row["Feedback comments"] for row in csv.DictReader((tmp_path / "m.csv").read_text().splitlines()))
    assert bo.startswith("not flown: [load] b.py:1: SyntaxError: invalid syntax") and "failed" not in bo
    assert du == "not flown: 'd': holds no child script"
    assert "not flown" not in che and "failed: forward in 3" in che and "ended by an error: 3" in che


def test_a_plan_without_a_title_is_shown_by_its_name(tmp_path):
    plan = read_plan(tmp_path, PLAN.replace("title: Hover & <b>more</b>\n", ""))
    assert table.text(plan, [result()]).startswith("steps\n")
