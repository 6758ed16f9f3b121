"""The report in a browser: opened from a file, played, scrubbed, and compared with the table of the flight."""

import io
import json
import shutil
from urllib.parse import quote, urlsplit

import numpy as np
import pytest
from graded import EVIL, PLAN, SCENE, place, read_plan, result, write_table
from PIL import Image

from drone_sim.grading.outputs.html import report

HUB = (255, 90, 0)  # RGB colour of the drone's middle on the canvas
TOLERANCE = 2.0  # px


@pytest.fixture(name="report", scope="module")
def _report(tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    plan = read_plan(folder, scene=SCENE)
    table = write_table(folder / "t.csv")
    results = [
        result("good.py", 0),
        result("good.py", 1, (True, False)),
        result("bad.py", 0, (False, False)),
        result("evil.py", error=EVIL, names=(EVIL, EVIL), passed=(True, False)),
    ]
    report.write(plan, results, lambda one: None if one.error else table, folder / "out")
    return folder / "out"


def open_flight(page, report, script, flight=1):
    page.goto((report / "index.html").as_uri())
    page.click(f"text={script}")
    page.click(f"nav a:nth-of-type({flight})")
    key = page.locator(f"nav a:nth-of-type({flight})").get_attribute("data-key")
    page.wait_for_selector(f"#stage[data-shown='{key}']")


def drone(page):
    """Return the position of the drone's middle on the canvas, from the top left, px."""
    picture = np.asarray(Image.open(io.BytesIO(page.locator("#canvas").screenshot())).convert("RGB")).astype(int)
    rows, columns = np.nonzero(np.abs(picture - HUB).max(axis=2) < 8)
    assert len(rows) > 20
    return np.array([columns.mean() + 0.5, rows.mean() + 0.5])


def expected(page, time, axes):
    """Return the canvas position of the table's place at a time in a top (x, y) or side (x, z) view, px."""
    canvas = page.locator("#canvas")
    scale = float(canvas.get_attribute("data-scale"))
    target = [float(word) for word in canvas.get_attribute("data-target").split()]
    box = canvas.bounding_box()
    right, up = (scale * (place(time)[axis] - target[axis]) for axis in axes)
    return np.array([box["width"] / 2 + right, box["height"] / 2 - up])


def scrub(page, time):
    page.locator("#scrub").evaluate(
        "(slider, time) => { slider.value = time; slider.dispatchEvent(new Event('input')); }", time
    )


def test_the_replay_shows_the_drone_at_the_place_in_the_table(page, report):
    open_flight(page, report, "good.py")
    for view, axes in (("top", (0, 1)), ("side", (0, 2))):
        page.click(f"[data-view={view}]")
        positions = []
        for time in (1.025, 3.5):
            scrub(page, time)
            positions.append(drone(page))
            assert np.abs(positions[-1] - expected(page, time, axes)).max() < TOLERANCE, f"{view}, at {time} s"
        assert np.abs(positions[0] - positions[1]).max() > 30
    assert page.troubles == []


def test_play_runs_to_the_end_and_pause_stops_it(page, report):
    open_flight(page, report, "good.py")
    display = page.locator("#time")
    assert display.inner_text() == "0.00 / 4.00 s"
    page.select_option("#speed", "10")
    page.click("#play")
    page.wait_for_function("document.getElementById('time').textContent === '4.00 / 4.00 s'")
    page.wait_for_function("document.getElementById('play').textContent === '▶'")
    page.select_option("#speed", "0.25")
    page.click("#play")
    page.wait_for_function("!document.getElementById('time').textContent.startsWith('0.00')")
    page.click("#play")
    before = display.inner_text()
    assert 0 < float(before.split()[0]) < 4
    page.evaluate("new Promise(requestAnimationFrame)")
    assert display.inner_text() == before
    assert page.troubles == []


def test_a_failure_is_marked_and_a_click_on_its_time_seeks_to_it(page, report):
    open_flight(page, report, "good.py", 2)
    assert page.locator("#marks i").count() == 1
    assert page.locator("#plots path title").first.text_content() == "no_contact failed at 1.50 s"
    page.click(".chosen .failed .when")
    assert page.locator("#time").inner_text().startswith("1.50")
    assert page.locator("#plots figcaption").first.inner_text().split("\n")[0].startswith("place [m]")
    assert f"z {place(1.5)[2]:.2f}" in page.locator("#plots figcaption").first.inner_text()
    assert page.troubles == []


def test_names_and_errors_are_text_and_a_missing_table_is_reported(page, report):
    open_flight(page, report, "evil.py")
    assert "<script>alert(1)</script>" in page.locator(".chosen .error").inner_text()
    assert page.locator("#note").inner_text() == "no table of this flight was kept"
    assert not page.locator("#replay").is_visible()
    assert page.locator(".chosen .failed").count() == 1
    assert page.troubles == []


ATTACKS = (
    *('<script>hit("script")</script>', '"><img src=x onerror=hit("img")>', "'><svg onload=hit('svg')>"),
    *('</script><script>hit("end")</script>', "</title></style></textarea><script>hit('title')</script>"),
    *("javascript:hit('address')", '" autofocus onfocus="hit(1)" x="', "{{ 7 * 7 }}{% raw %}", "${hit('template')}"),
    *("--><script>hit('comment')</script>", "\0<script>hit('nul')</script>", "\u2028hit('line')//", "../../../x"),
)


@pytest.fixture(name="attacked", scope="module")
def _attacked(tmp_path_factory):
    """A report in which all external texts are attacks: names, errors, criteria, objects, sources."""
    folder = tmp_path_factory.mktemp("attacked")
    title, *objects = map(json.dumps, (ATTACKS[0], *(one for one in ATTACKS if one.isprintable() and len(one) < 64)))
    boxes = [f"  - {{name: {one}, shape: box, size: [1, 1, 1], position: [0, 0, 1]}}\n" for one in objects]
    plan = read_plan(folder, PLAN.replace("Hover & <b>more</b>", title), f"objects:\n{''.join(boxes)}")
    table = write_table(folder / "t.csv")
    names = {f"{number}.py": one for number, one in enumerate(ATTACKS)}
    results = [result(script, 0, (False, False), None, {"x": one}, (one, f"{one} 2")) for script, one in names.items()]
    results += [result(script, 1, (False, False), one, {}, (one, f"{one} 2")) for script, one in names.items()]
    text = "\n".join(f"x = sim.getObjectPosition(h, -1)[0]{' * x + 1' * number}" for number in range(20))
    sources = {script: "\n".join([*ATTACKS, text]) for script in list(names)[:3]}
    tables = lambda one: None if one.error else table  # noqa: E731
    report.write(plan, results, tables, folder / "out", names, sources)
    return folder / "out"


def test_code_in_untrusted_text_does_not_run_in_a_report(page, attacked):
    page.add_init_script("window.hits = []; window.hit = (how) => window.hits.push(how)")
    files = [*attacked.rglob("*.html")]
    assert len(files) == 1 + 3 * len(ATTACKS) + 3  # for each script a page and the cards of two flights
    for file in files:
        for fragment in ("", "#0", "#1", f"#{quote(ATTACKS[1])}"):
            page.goto(f"{file.as_uri()}{fragment}")
        if "scripts" in file.parts and file.name == "index.html":
            page.click("nav a:nth-of-type(1)")
            page.wait_for_selector("#stage[data-shown='0']")
            assert page.locator("#marks i").count() == 2
        assert page.evaluate("window.hits") == [] and page.locator("img, svg[onload], [onfocus]").count() == 0
        links = page.locator("a").evaluate_all("all => all.map(a => a.href)")
        assert {urlsplit(one).scheme for one in links} <= {"file"}
    page.goto((attacked / "index.html").as_uri())
    display = page.locator("body").inner_text()
    assert all(one in display for one in ATTACKS[:6])
    assert not any("49" in cell for cell in page.locator("td.script").all_inner_texts())
    page.click("th:has-text('script')")
    assert page.evaluate("window.hits") == [] and page.troubles == []


def test_a_click_on_a_heading_sorts_the_scripts(page, report):
    page.goto((report / "index.html").as_uri())
    names = page.locator("#scripts tbody td.script")
    page.click("th:has-text('points')")
    assert names.all_inner_texts()[0] == "bad.py"
    page.click("th:has-text('points')")
    assert names.all_inner_texts()[-1] == "bad.py"
    page.click("th:has-text('script')")
    assert names.all_inner_texts() == ["bad.py", "evil.py", "good.py"]
    assert page.troubles == []


def test_a_students_folder_works_without_the_rest_of_the_report(page, report, tmp_path):
    (folder,) = (report / "scripts").glob("*-good")
    shutil.copytree(folder, tmp_path / "handed on")
    page.goto((tmp_path / "handed on/index.html").as_uri())
    page.wait_for_selector("#stage[data-shown='0']")
    assert page.locator("#plots svg").count() and page.troubles == []
