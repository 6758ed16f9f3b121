"""The charts of a result card: the flown path or column beside what the criterion allows."""

import numpy as np
import pytest
from flown_signals import criterion, flown, times

from drone_sim.grading.criteria import KINDS
from drone_sim.grading.outputs.html.charts import HEIGHT, SIDE, WIDTH, chart_of

T = times()
SCENE = {
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
    return chart_of(criterion(**values), flown(T, **columns).columns, SCENE, at)


def points(text):
    return np.array([[float(number) for number in pair.split(",")] for pair in text.split()])


def test_a_drift_is_drawn_from_above_with_the_allowed_circle_and_the_place_where_it_failed():
    drawn = chart({"x": 0.2 * T}, at=T[-1], kind="drift", at_most=0.5)
    (x, y, radius), way = drawn.circles[0], points(drawn.flown)
    assert tuple(way[0]) == pytest.approx((x, y), abs=0.1) and tuple(way[-1]) == pytest.approx(drawn.failed, abs=0.1)
    metre = (way[-1, 0] - way[0, 0]) / (0.2 * (T[-1] - T[0]))  # px
    assert radius == pytest.approx(0.5 * metre, rel=0.02)
    assert ((way >= 0) & (way <= SIDE)).all() and drawn.objects[0][1] == "rgb(255 0 0)"


def test_a_bound_is_drawn_over_time_in_the_part_that_counts():
    values = {"kind": "stays", "of": "z", "after": 1.0, "until": 3.0, "at_least": 0.9, "at_most": 1.1}
    drawn = chart({"z": 1 + 0.0 * T}, **values)
    (top, height), way = drawn.bands[0], points(drawn.flown)
    assert drawn.failed is None and np.ptp(way[:, 1]) == 0
    assert way[0, 1] == pytest.approx(top + height / 2, abs=0.2) and ((way >= 0) & (way <= (WIDTH, HEIGHT))).all()
    assert [text for *_, text in drawn.labels] == ["0.9", "1.1", "1 s", "3 s"]


def test_a_path_is_a_corridor_and_places_are_circles():
    path = chart({"x": T}, kind="path", along=[[0, 0, 1], [1, 0, 1]], at_most=0.3)
    assert len(points(path.corridor[0])) == 2 and path.corridor[1] > 0
    assert len(chart({"x": T}, kind="reach", places=[[1, 0, 1], [2, 0, 1], "Gate"], within=0.5).circles) == 2
    wall = chart({"x": T}, kind="reach", places=["/Wall"], within=0.1)
    assert wall.circles[0][:2] == pytest.approx(points(wall.objects[0][0]).mean(axis=0), abs=0.1)
    assert chart({}, kind="no_contact") is None


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_says_what_to_try(kind):
    assert kind.model_fields["hint"].default.endswith((".", "?"))
