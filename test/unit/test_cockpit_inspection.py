"""ScriptInspector, which passes variables and breakpoints between simulation and browsers, without either of them."""

import json

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from std_msgs.msg import String

from drone_sim.ros.cockpit.editor import inspection
from drone_sim.ros.cockpit.editor.inspection import ScriptInspector
from drone_sim.ros.cockpit.editor.script_store import ScriptStore


class Topic:
    """A publisher or subscriber without ROS that records what is published."""

    there = None

    def __init__(self, name, _kind, callback=None, **_options):
        self.name, self.callback, self.published = name, callback, []
        Topic.there[name] = self

    def publish(self, text):
        self.published.append(json.loads(text))

    def unregister(self):
        del Topic.there[self.name]
        self.callback = None  # as rospy does

    def get_num_connections(self):
        return 1


@pytest.fixture(name="now")
def _now(monkeypatch):
    """The time of the monotonic clock, in a list; topics need no ROS."""
    now = [100.0]
    monkeypatch.setattr(inspection.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(Topic, "there", {})
    monkeypatch.setattr(inspection.rospy, "Publisher", Topic)
    monkeypatch.setattr(inspection.rospy, "Subscriber", Topic)
    return now


@pytest.fixture(name="told")
def _told():
    return []


@pytest.fixture(name="inspector")
def _inspector(tmp_path, now, told):
    (tmp_path / "a.py").write_text("x = 1\n")
    return ScriptInspector("/sim", ScriptStore(tmp_path, {}), told.append)


def ask(inspector, **message):
    return inspector.answers["inspect"]({"page": "one", **message})


def listens(topic):
    return f"/sim/{topic}" in Topic.there


def test_breakpoints_of_all_pages_are_published_and_removed_with_their_page(inspector, now, tmp_path):
    ask(inspector, breakpoints={"mine/a.py": [3, 1], "mine/gone.py": [1]})
    ask(inspector, page="two", breakpoints={"mine/a.py": [2, 3]})
    inspector.update(True)
    published = Topic.there["/sim/breakpoints"].published
    file = str(tmp_path / "a.py")
    assert published == [{file: [1, 3]}, {file: [1, 2, 3]}] and listens("variables") and listens("names"), "immediately"
    ask(inspector, page="two", breakpoints={})
    assert published[2:] == [{file: [1, 3]}]
    now[0] += 100.0
    inspector.update(True)
    assert published[3:] == [{}] and not listens("variables") and not listens("names")


def test_topics_are_subscribed_only_while_a_page_needs_them(inspector, now, told):
    ask(inspector, looks=False)
    inspector.update(True)
    assert not listens("variables") and listens("names") and not listens("breakpoints")
    ask(inspector, looks=True)
    inspector.update(True)
    take = Topic.there["/sim/variables"].callback
    now[0] += 5.0
    inspector.update(True)
    take(String(json.dumps({"state": "paused"})))  # rospy's thread had already fetched the callback
    assert not listens("variables") and told == [{"variables": None}]
    inspector.update(False)
    assert not listens("names")


def test_variables_in_flight_are_sent_only_to_pages_that_follow_them_live(inspector, told):
    ask(inspector, looks=True)
    inspector.update(True)

    def publish_state(state):
        Topic.there["/sim/variables"].callback(String(data=json.dumps({"state": state})))
        return [sent_message["variables"]["state"] for sent_message in told]

    for state in ("flying", "paused", "flying", "flying", "flying"):
        said = publish_state(state)
    assert said[1:] == ["paused", "flying"], "changes of the state are sent"
    ask(inspector, looks=True, live=True)
    assert publish_state("flying")[3:] == ["flying"]
    for nonsense in ("[1]", "{", "[" * 100_000, "x" * (1 << 21)):
        Topic.there["/sim/variables"].callback(String(data=nonsense))
    assert len(told) == 4


def test_names_of_objects_and_parameters_reach_the_page(inspector):
    assert ask(inspector) == {"objects": [], "parameters": []}
    inspector.update(True)
    for names in ({"objects": ["Floor"], "parameters": ["Kz"]}, {"objects": [1]}, []):
        Topic.there["/sim/names"].callback(String(data=json.dumps(names)))
    assert ask(inspector) == {"objects": ["Floor"], "parameters": ["Kz"]}


@pytest.mark.parametrize(
    ("message", "said"),
    [
        ({"page": ""}, "needs a page"),
        ({"page": "x" * 41}, "needs a page"),
        ({"breakpoints": []}, "must be a mapping"),
        ({"breakpoints": {"mine/a.py": [1.5]}}, "lines"),
        ({"breakpoints": {"mine/a.py": list(range(501))}}, "at most 500"),
    ],
)
def test_an_invalid_request_is_refused(inspector, message, said):
    with pytest.raises(ValueError, match=said):
        ask(inspector, **message)
