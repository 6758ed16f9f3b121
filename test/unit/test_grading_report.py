"""Files of the HTML report; test/web opens it in a browser."""

import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from flown_signals import criterion, flown, times
from graded import EVIL, SCENE, place, read_plan, result, write_table

from drone_sim.grading.criteria import KINDS
from drone_sim.grading.outputs.html import report
from drone_sim.grading.outputs.html.charts import HEIGHT, SIDE, WIDTH, chart_of
from drone_sim.offline.recording import COLUMNS


class Page(HTMLParser):
    """Tags, links and text of an HTML page."""

    def __init__(self, path):
        super().__init__()
        self.tags, self.links, self.text = [], [], ""
        self.feed(path.read_text())

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.links += [value for key, value in attributes if key in ("href", "src", "data-file") and value]

    def handle_data(self, data):
        self.text += data


@pytest.fixture(name="report", scope="module")
def _report(tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    plan = read_plan(folder, scene=SCENE)
    table = write_table(folder / "t.csv")
    results = [
        result("a/my.py", 0, (True, False)),
        result("a/my.py", 1),
        result("a/<img src=x>.py", error=EVIL, names=(EVIL, EVIL)),
    ]
    report.write(plan, results, lambda one: table if one.seed == 0 and not one.error else None, folder / "out")
    return folder / "out"


def test_every_link_points_to_a_file_of_the_report(report):
    pages = [*report.glob("*.html"), *report.glob("scripts/*/*.html")]
    assert len(pages) == 3
    for page in pages:
        for link in Page(page).links:
            file = link.partition("#")[0]
            assert link.startswith(("data:,", "#")) or (page.parent / file).is_file(), f"{page}: {link}"


def test_html_in_names_and_errors_is_escaped(report):
    pages = {report / "index.html": 1, **dict.fromkeys(report.glob("scripts/*/*.html"), 5)}
    for page, scripts in pages.items():
        tags = Page(page).tags
        assert (tags.count("script"), tags.count("img")) == (scripts, 0)
    assert "<script>alert(1)</script>" in Page(report / "index.html").text


def test_control_characters_are_shown_as_escape_sequences(report):
    for path in (one for one in report.rglob("*") if one.is_file()):
        assert not re.search("[\0-\x08\x0b-\x1f\x7f-\x9f\u202e]", path.read_text(encoding="utf-8")), path
    assert r"\x1b[31m\x07\x00\x9b\u202e\ud800" in Page(report / "index.html").text


def test_the_data_of_a_flight_match_its_table(report):
    (file,) = report.glob("scripts/*/flights/*.js")
    name, _, figures = file.read_text().partition(" = ")
    assert name == 'report.flights["0"]'
    figures = json.loads(figures.rstrip(";\n"))
    assert figures["marks"] == [{"name": "no_contact", "at": 1.5}]
    assert (figures["t"][20], *(figures[axis][20] for axis in "xyz")) == pytest.approx((1, *place(1)), abs=1e-4)


def test_scene_objects_become_boxes_at_their_poses(report):
    scene = json.loads(next(report.glob("scripts/*/files/scene.js")).read_text().partition(" = ")[2].rstrip(";\n"))
    gate, pole = scene["boxes"]
    assert gate["name"] == "<i>Gate</i>"
    assert gate["corners"][0] == pytest.approx([1.9, -0.5, 0])
    assert gate["corners"][7] == pytest.approx([2.1, 0.5, 2])
    assert pole["corners"][7][2] == pytest.approx(2.5)


def test_the_index_page_has_a_ranking_histogram_and_similar_scripts(tmp_path):
    text = "\n".join(f"x = sim.getObjectPosition(h, -1)[0]{' * x + 1' * number}" for number in range(20))
    other = "# <b>\x0c\x85\u2028\r\n" + text.replace("x", "y").replace("\n", "\r\n")  # \x0c and \x85 end no line
    scripts = {"a.py": text, "b.py": other, "c.py": "def sysCall_init(): pass"}
    results = [result("a.py"), result("b.py", passed=(False, True)), result("c.py", passed=(False, False))]
    report.write(read_plan(tmp_path), results, lambda _: None, tmp_path / "out", {"b.py": "Ada"}, scripts)
    index = Page(tmp_path / "out/index.html")
    text = "".join(index.text.split())
    assert all(said in text for said in ("1a.py1/1", "2Ada0/1", "3c.py0/1"))  # rank, script, passed
    assert all(said in text for said in ("2.7to31", "0.9to1.21", "0to0.31"))  # points, scripts
    assert "similar/1.html" in index.links
    comparison = Page(tmp_path / "out/similar/1.html")
    assert comparison.tags.count("pre") == 2 and comparison.tags.count("b") == 0 and comparison.tags.count("span") == 41
    assert "# <b>\\x0c\\x85\u2028\ny = sim.getObjectPosition" in comparison.text


def test_folder_names_keep_the_letters_of_the_student_s_name(tmp_path):
    names = {
        "1.py": "Kurt Go\u0308del",
        "2.py": "\u674e \u660e",
        "3.py": "Dr. J. No",
        "4.py": "\u0905\u092e\u093f\u0924",
        "5.py": "a/../<b>\x1b",
    }
    report.write(read_plan(tmp_path), [result(one) for one in names], lambda _: None, tmp_path / "out", names)
    found = sorted(one.name for one in (tmp_path / "out/scripts").iterdir())
    assert found[:4] == ["01-Kurt_G\xf6del", "02-\u674e_\u660e", "03-Dr_J_No", "04-\u0905\u092e\u093f\u0924"]
    assert re.fullmatch(r"05-[\w-]+", found[4])
    index = Page(tmp_path / "out/index.html")
    assert all(
        (tmp_path / "out" / one).is_file() for one in index.links if one.startswith("scripts/") and "#" not in one
    )


def test_a_report_overwrites_only_an_earlier_report(tmp_path):
    plan = read_plan(tmp_path)
    report.write(plan, [result("a.py"), result("b.py")], lambda _: None, tmp_path / "out")
    report.write(plan, [result("c.py")], lambda _: None, tmp_path / "out")
    assert [one.name for one in (tmp_path / "out/scripts").iterdir()] == ["01-c"]
    with pytest.raises(ValueError, match="has other files"):
        report.check(tmp_path)
    with pytest.raises(ValueError, match="is a file"):
        report.check(tmp_path / "steps.yaml")
    with pytest.raises(OSError, match="no such folder"):
        report.check(tmp_path / "no" / "out")


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("nonsense\n", "a table of `fly --csv` begins with"),
        (",".join(COLUMNS) + "\n", "nothing was flown"),
        (",".join(COLUMNS) + "\n1,2\n", "line 2: has 2 of"),
        (",".join(COLUMNS) + "\n" + ",".join(["nan"] * len(COLUMNS)) + "\n", "line 2: must hold numbers below"),
    ],
)
def test_an_unusable_table_is_reported_on_the_page(tmp_path, text, said):
    (tmp_path / "t.csv").write_text(text)
    report.write(read_plan(tmp_path), [result()], lambda _: tmp_path / "t.csv", tmp_path / "out")
    (page,) = tmp_path.glob("out/scripts/*/index.html")
    assert said in page.read_text()


def test_a_long_flight_is_thinned(tmp_path):
    table = write_table(tmp_path / "t.csv", 301)
    report.write(read_plan(tmp_path), [result()], lambda _: table, tmp_path / "out")
    (page,), (figures,) = tmp_path.glob("out/scripts/*/index.html"), tmp_path.glob("out/scripts/*/flights/*.js")
    assert "one row in 2 is shown" in page.read_text()
    assert json.loads(figures.read_text().partition(" = ")[2].rstrip(";\n"))["t"][:3] == [0, 0.1, 0.2]


# ---- charts of a result card


T = times()
SCENE_DATA = {
    "floor": 10,
    "boxes": [
        {
            "name": "Wall",
            "object": "Wall",
            "corners": [[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)],
            "color": [1, 0, 0],
        }
    ],
}


def chart(columns, at=None, **values):
    return chart_of(criterion(**values), flown(T, **columns).columns, SCENE_DATA, at)


def points(text):
    return np.array([[float(number) for number in pair.split(",")] for pair in text.split()])


def test_a_drift_is_drawn_from_above_with_the_allowed_circle_and_the_place_where_it_failed():
    drawn = chart({"x": 0.2 * T}, at=T[-1], kind="drift", at_most=0.5)
    (x, y, radius), line = drawn.circles[0], points(drawn.flown)
    assert tuple(line[0]) == pytest.approx((x, y), abs=0.1) and tuple(line[-1]) == pytest.approx(drawn.failed, abs=0.1)
    metre = (line[-1, 0] - line[0, 0]) / (0.2 * (T[-1] - T[0]))  # px
    assert radius == pytest.approx(0.5 * metre, rel=0.02)
    assert ((line >= 0) & (line <= SIDE)).all() and drawn.objects[0][1] == "rgb(255 0 0)"


def test_a_bound_is_drawn_over_time_within_its_interval():
    values = {"kind": "stays", "of": "z", "after": 1.0, "until": 3.0, "at_least": 0.9, "at_most": 1.1}
    drawn = chart({"z": 1 + 0.0 * T}, **values)
    (top, height), line = drawn.bands[0], points(drawn.flown)
    assert drawn.failed is None and np.ptp(line[:, 1]) == 0
    assert line[0, 1] == pytest.approx(top + height / 2, abs=0.2) and ((line >= 0) & (line <= (WIDTH, HEIGHT))).all()
    assert [text for *_, text in drawn.labels] == ["0.9", "1.1", "1 s", "3 s"]


def test_a_path_is_drawn_as_a_corridor_and_places_as_circles():
    path = chart({"x": T}, kind="path", along=[[0, 0, 1], [1, 0, 1]], at_most=0.3)
    assert len(points(path.corridor[0])) == 2 and path.corridor[1] > 0
    assert len(chart({"x": T}, kind="reach", places=[[1, 0, 1], [2, 0, 1], "Gate"], within=0.5).circles) == 2
    wall = chart({"x": T}, kind="reach", places=["/Wall"], within=0.1)
    assert wall.circles[0][:2] == pytest.approx(points(wall.objects[0][0]).mean(axis=0), abs=0.1)
    assert chart({}, kind="no_contact") is None


@pytest.mark.parametrize("kind", KINDS)
def test_every_criterion_has_a_hint_that_is_a_sentence(kind):
    assert kind.model_fields["hint"].default.endswith((".", "?"))
