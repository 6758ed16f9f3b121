"""The tree of objects when models are added and removed."""

import pytest

from drone_sim.mechanics import frames
from drone_sim.mechanics.object_names import NO_SUFFIX, plain, split, suffixed
from drone_sim.mechanics.object_tree import PARENT, WORLD, ObjectTree


def at(x, y, z):
    return frames.from_euler((x, y, z), (0, 0, 0))


def add_model(objects, suffix=""):
    drone, also, base, target = (f"{name}{suffix}" for name in ("Drone", "Quadricopter", "base", "target"))
    return [
        objects.add(drone, None, at(1, 0, 0), alias="Quadcopter", also=(also,)),
        objects.add(base, drone, at(0, 0, 1), alias="base"),
        objects.add(target, base, alias="target"),
    ]


@pytest.fixture(name="objects")
def _objects():
    objects = ObjectTree()
    objects.add("Floor")
    return objects


def names(objects):
    return [objects[handle].name for handle in objects]


@pytest.mark.parametrize("name, suffix, shown", [("a", NO_SUFFIX, "a"), ("a", 0, "a#0"), ("a b#c", 12, "a b#c#12")])
def test_suffixes(name, suffix, shown):
    assert (suffixed(name, suffix), split(shown), plain(shown)) == (shown, (name, suffix), name)


def test_copies_share_aliases(objects):
    roots = [add_model(objects, suffix)[0] for suffix in ("", "#0", "#1")]
    assert objects[roots[1]].names == ("Drone#0", "Quadricopter#0")
    assert [objects.path(root) for root in roots] == [f"/Quadcopter[{index}]" for index in range(3)]
    assert all(objects[root].is_called("Quadricopter") for root in roots)
    assert [objects.is_copied(name) for name in ("Drone", "base", "Floor", "Drone#0")] == [True, True, False, False]


def test_a_name_cannot_be_used_twice(objects):
    with pytest.raises(ValueError, match="Floor"):
        objects.add("Ceiling", also=("Floor",))
    assert names(objects) == ["Floor"] and "Ceiling" not in objects


def test_removal_frees_the_names_but_not_the_handles(objects):
    first, second, third = (add_model(objects, suffix) for suffix in ("", "#0", "#1"))
    objects.remove(second)
    assert names(objects) == ["Floor", "Drone", "base", "target", "Drone#1", "base#1", "target#1"]
    with pytest.raises(ValueError, match=f"no object with the handle {second[0]}"):
        objects[second[0]]
    with pytest.raises(ValueError, match="no object named 'base#0'; near names are"):
        objects.handle("base#0")
    assert min(add_model(objects, "#0")) > max(first + third)
    assert objects.is_copied("base")


def test_children_of_a_removed_object_stay_where_they_are(objects):
    model, stone = add_model(objects), objects.add("stone", None, at(5, 0, 0))
    objects.set_parent(model[2], WORLD, True)
    objects.set_parent(stone, model[1], True)
    objects[model[0]].local = at(1, 2, 0)
    objects.remove(model)
    assert names(objects) == ["Floor", "stone"]
    assert objects[stone].parent is None and frames.position(objects.matrix(stone)) == (5, 2, 0)


def test_removing_the_parent_of_a_body_does_not_move_the_body(objects):
    class MovingBody:
        matrix = at(1, 2, 3)

        def move(self, pose):
            raise AssertionError("it was stopped")

    model, ball = add_model(objects), objects.add("ball", body=MovingBody())
    objects.set_parent(ball, model[0], True)
    objects.remove(model)
    assert frames.position(objects.matrix(ball)) == (1, 2, 3)


def test_repeated_moves_in_its_own_frame_do_not_distort_an_object(objects):
    """Rounding errors of the rotation must not accumulate."""
    ball = objects.add("ball", None, frames.from_euler((0, 0, 0), (0.3, -0.7, 1.1)))
    ahead = frames.rotate(objects.matrix(ball), (0.01, 0, 0))
    for _ in range(200):
        objects.set_position(ball, ball, (0.01, 0, 0))
    assert frames.position(objects.matrix(ball)) == pytest.approx([200 * one for one in ahead], abs=1e-9)
    turn = frames.multiply(objects.matrix(ball), frames.invert(objects.matrix(ball)))
    assert turn == pytest.approx(at(0, 0, 0), abs=1e-9)


def test_a_position_set_in_another_frame_keeps_the_orientation(objects):
    drone, base, _ = add_model(objects)
    objects.set_matrix(drone, WORLD, frames.from_euler((1, 0, 0), (0, 0, 1.5)))
    turn = frames.to_euler(objects.turn(base))
    objects.set_position(base, PARENT, (0, 2, 0))
    assert frames.to_euler(objects.turn(base)) == pytest.approx(turn)
    assert frames.position(objects.matrix(base, drone)) == pytest.approx((0, 2, 0), abs=1e-12)


def test_a_part_of_a_model_stays_a_part_under_any_parent(objects):
    root, base, target = add_model(objects)
    objects.set_parent(target, WORLD, True)
    objects.set_parent(objects.handle("Floor"), root, True)
    assert [objects[one].is_part_of(objects[root]) for one in (root, base, target, 0)] == [True, True, True, False]


def test_restoring_a_state_ignores_objects_added_or_removed_since(objects):
    (first, *_), second = add_model(objects), add_model(objects, "#0")
    stone = objects.add("stone", None, at(5, 0, 0))
    objects.set_parent(stone, second[0], True)
    restore = objects.save_state()
    objects.set_parent(stone, WORLD, True)
    objects.remove(second)
    third, *_ = add_model(objects, "#0")
    for root, x in ((first, 7), (third, 8)):
        objects[root].local = at(x, 0, 0)
    objects[stone].local = at(9, 0, 0)
    restore()
    assert [frames.position(objects.matrix(one))[0] for one in (first, third, stone)] == [1, 8, 9]
