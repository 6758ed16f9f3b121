"""The page's state store (web/src/state), fed with events that are in order, late, duplicated or missing.

The store needs no page and no clock, so it runs in the browser without a simulation.
"""

import json
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

SOURCE = Path(__file__).parents[2] / "web" / "src"
FILE, OTHER = "/scripts/a.py", "/scripts/b.py"
OPEN = ["opened", {"script": "mine/a.py", "file": FILE}]
# Feed [event, content], or [ms] to let time pass, to a new store; return the page's texts after each event.
FEED = """async (events) => {
    const { Store } = await import("http://page.test/state/store.js");
    const words = await import("http://page.test/state/words.js");
    const { Board } = await import("http://page.test/board.js");
    let clock = 1000;
    const store = new Store(() => clock);
    const board = new Board();
    for (const part of ["status", "flight", "master"]) board.on(part, (content) => store.take(part, content));
    const said = () => ({
        said: words.saidWords(store.now).text, banner: words.bannerWords(store.now),
        flying: words.flyingWords(store.now).text,
        is: words.flyingWords(store.now).is, status: words.statusWords(store.now), marked: words.markedLines(store.now),
        can: words.abilities(store.now), notice: store.now.notice?.text ?? "", saved: store.now.saved.text,
        pace: words.paceWords(store.now), diagnosis: words.diagnosisWords(store.now), deaf: words.deafWords(store.now),
        console: words.consoleWords(store.now), connection: store.now.connection,
        message: store.now.message?.kind ?? "",
    });
    return events.map(([event, content]) => {
        if (typeof event === "number") {
            for (let left = event; left > 0; left -= 500) {
                clock += Math.min(left, 500);
                store.take("tick");
            }
        } else if (event === "sleep") {
            clock += content;
            store.take("tick");
        } else if (event === "panel") board.take(content);
        else store.take(event, content);
        return said();
    });
}"""


@pytest.fixture(name="empty_page", scope="module")
def _empty_page(browser):
    """A page without content that can import the modules of web/src."""
    context = browser.new_context()
    page = context.new_page()

    def serve(route):
        path = route.request.url.removeprefix("http://page.test/")
        content = "<!doctype html>" if not path else (SOURCE / path).read_text()
        route.fulfill(body=content, content_type="text/javascript" if path else "text/html")

    page.route("http://page.test/**", serve)
    page.goto("http://page.test/")
    yield page
    context.close()


@pytest.fixture(name="feed", scope="module")
def _feed(empty_page):
    """A function that feeds events to a new store and returns the page's texts after each event."""
    return lambda *events: empty_page.evaluate(FEED, list(events))


def status(is_, version=1):
    return ["panel", {"panel": {"status": is_}, "version": version}]


def flight(is_, version=1):
    return ["panel", {"panel": {"flight": is_}, "version": version}]


def pulse(silent, ended=False):
    return ["pulse", {"silent": silent, "frozen": silent > 5, "ended": ended}]


def reached(line, state="paused"):
    at = {"file": FILE, "line": line, "time": 1.5} if line else {}
    return ["variables", {"state": state, "reached": at, "time": 1.5, "scripts": []}]


def failure(line=5, shown="ZeroDivisionError", phase="actuation", file=FILE):
    return ["failure", {"file": file, "line": line, "said": shown, "phase": phase}]


CONNECTED = [["connected"], OPEN, ["flown", "mine/a.py"]]


def last(feed, *events):
    return feed(*CONNECTED, *events)[-1]


# ---- pauses


def test_a_new_flight_state_ends_a_pause_without_an_event_of_the_variables(feed):
    paused = last(feed, status("paused"), reached(63))
    assert paused["said"] == "paused at line 63, t = 1.50 s" and paused["marked"]["paused"] == 63
    resumed = last(feed, status("paused"), reached(63), ["variables", None], status("flying", 2))
    assert resumed["said"] == "" and resumed["marked"]["paused"] == 0
    assert last(feed, status("paused"), reached(63), ["lost"])["marked"]["paused"] == 0


@pytest.mark.parametrize("events", [[status("paused"), reached(3)], [reached(3), status("paused")]])
def test_a_pause_and_its_breakpoint_may_arrive_in_either_order(feed, events):
    assert last(feed, *events)["marked"]["paused"] == 3


def test_a_late_breakpoint_event_is_not_shown_in_the_next_pause(feed):
    late = [status("paused"), status("flying", 2), reached(3), [3000], status("paused", 3)]
    assert last(feed, *late)["said"] == ""


# ---- errors of scripts


def test_a_fixed_syntax_error_is_replaced_by_the_next_one(feed):
    first = {"line": 5, "said": "SyntaxError: invalid syntax", "severity": "error"}
    syntax_error = failure(5, first["said"], "not started")
    assert last(feed, syntax_error)["said"] == "not started, line 5: SyntaxError: invalid syntax"
    other = {"line": 29, "said": "SyntaxError: '(' was never closed", "severity": "error"}
    moved = last(feed, syntax_error, ["checked", {"file": FILE, "found": [other]}])
    assert moved["said"] == "not started, line 29: SyntaxError: '(' was never closed"
    assert last(feed, syntax_error, ["checked", {"file": OTHER, "found": []}])["said"] != "", "a check of another file"
    assert moved["console"] == f"error: [load] {FILE}:29: SyntaxError: '(' was never closed"
    mended = last(feed, syntax_error, ["checked", {"file": FILE, "found": []}])
    assert mended["said"] == mended["console"] == ""


@pytest.mark.parametrize("end", [["run"], ["started"], ["moved", 0]])
def test_a_flight_error_ends_with_the_next_start_or_a_fix_of_its_line(feed, end):
    assert last(feed, failure())["said"] == "actuation, line 5: ZeroDivisionError"
    assert last(feed, failure(), ["moved", 7])["marked"]["failed"] == 7
    assert last(feed, failure(), end)["said"] == ""


def test_a_fixed_error_reappears_only_if_it_is_reported_again_later(feed):
    assert last(feed, failure(), ["moved", 0], failure())["said"] == ""
    assert last(feed, failure(), ["moved", 0], [6000], failure())["said"] != ""


def test_without_a_start_event_some_seconds_of_flight_end_an_error(feed):
    events = [status("stopped"), failure(), [1000], status("flying", 2), [1000], [1000], [2000]]
    shown = [one["said"] for one in feed(*CONNECTED, *events)]
    assert shown[-2] != "" and shown[-1] == ""
    crashed = [status("flying"), [4000], failure(), [10_000]]
    assert last(feed, *crashed)["said"] != "", "an object's script failed, and the flight continues"


def test_an_error_names_its_file_and_follows_a_rename(feed):
    assert last(feed, failure(file=OTHER))["said"] == "actuation, b.py, line 5: ZeroDivisionError"
    renamed = last(feed, failure(), ["renamed", {"script": "mine/c.py", "file": "/scripts/c.py"}])
    assert renamed["said"] == "actuation, line 5: ZeroDivisionError" and renamed["marked"]["failed"] == 5


def test_the_state_of_the_script_is_shown_beside_run(feed):
    assert last(feed, status("flying"))["flying"] == "flies"
    assert last(feed, status("flying"), ["flown", "mine/bad.py"])["flying"] == "mine/bad.py flies"
    assert last(feed, status("flying"), ["flown", ""])["status"] == "Running", "the scene has no vehicle"
    failed = last(feed, ["flown", "mine/bad.py"], status("stopped"), flight("script failed"))
    assert (failed["flying"], failed["is"], failed["status"]) == ("mine/bad.py has failed", "failed", "Script failed")
    assert last(feed, status("paused"))["flying"] == "is paused"
    silent, ended = pulse(6), pulse(6, ended=True)
    assert last(feed, status("flying"), silent)["status"] == "No answer"
    for nothing in (["lost"], ["refused"], status("no simulation", 2), silent, ended):
        assert last(feed, status("flying"), nothing)["flying"] == ""


# ---- messages and the events that end them


MESSAGES = json.loads("[" + ",".join(
    f'"{line.split(":")[0].strip()}"'
    for line in (SOURCE / "state" / "messages.js").read_text().splitlines()
    if "ends:" in line
) + "]")  # fmt: skip


@pytest.mark.parametrize("kind", MESSAGES)
def test_every_message_ends_with_each_of_its_events(feed, kind):
    contents = {"opened": OPEN[1], "failure": failure()[1], "flown": "mine/b.py", "saved": "saved as mine/a.py"}
    ends = next(line for line in (SOURCE / "state" / "messages.js").read_text().splitlines() if f" {kind}:" in line)
    names = ends.partition("ends: [")[2].partition("]")[0].replace("...LEFT", '"opened", "run"')
    events = json.loads(f"[{names}]")
    assert events
    for event in events:
        after = {"stopped": status("stopped"), "unanswered": pulse(6)}.get(event, [event, contents.get(event)])
        shown = feed(*CONNECTED, status("flying", 0), ["say", {"kind": kind, "text": "words"}], after)
        assert shown[-2]["message"] == kind and shown[-1]["message"] == "", event


@pytest.mark.parametrize("end", [["lost"], pulse(6), pulse(6, ended=True), status("no simulation", 2)])
def test_a_refusal_disappears_when_the_simulator_stops_answering(feed, end):
    refused = ["say", {"kind": "refused", "text": "the simulator refused it"}]
    shown = [one["said"] for one in feed(*CONNECTED, status("flying"), refused, end)]
    assert shown[-2] != "" and shown[-1] == ""


def test_a_notice_expires_and_an_error_notice_ends_with_the_next_start(feed):
    good, bad = ["notice", {"text": "paused", "bad": False}], ["notice", {"text": "step: failed", "bad": True}]
    assert last(feed, good, [5000])["notice"] == "paused" and last(feed, good, [7000])["notice"] == ""
    assert last(feed, bad, [60_000])["notice"] == "step: failed"
    assert last(feed, bad, ["run"])["notice"] == "" and last(feed, bad, ["started"])["notice"] == ""


# ---- the connection


def test_the_banner_names_the_process_that_does_not_answer(feed):
    flying = [["heard"], status("flying")]
    assert last(feed, *flying)["banner"] == ""
    assert last(feed, *flying, [4000])["banner"].startswith("No data from the cockpit for 4 s")
    assert last(feed, *flying, pulse(6.2))["banner"].startswith("No data from the simulator for 6 s")
    assert last(feed, *flying, pulse(4.2))["banner"] == "", "the simulator may be busy"
    assert last(feed, *flying, ["lost"], [12_000])["banner"].startswith("No connection to the cockpit for 12 s")
    assert "Open the address" in last(feed, *flying, ["lost"], ["refused"])["banner"]
    ended = "The simulator has ended: start it again."
    assert last(feed, *flying, pulse(6.2, ended=True))["banner"] == ended
    assert last(feed, *flying, status("no simulation", 2))["banner"] == ended
    assert last(feed, status("no simulation"))["banner"].startswith("There is no simulator yet")
    assert last(feed, *flying, ["lost"], ["connected"])["banner"] == "", "the panel's first update is pending"
    assert "master" in last(feed, *flying, ["panel", {"panel": {"master": False}, "version": 3}])["banner"]


def test_after_a_sleep_the_page_does_not_report_missing_data_at_once(feed):
    assert last(feed, status("flying"), [1000], ["sleep", 60_000])["banner"] == ""
    assert last(feed, status("flying"), ["sleep", 60_000], [4000])["banner"].startswith("No data from the cockpit")


def test_old_values_are_not_shown_while_the_simulator_is_silent(feed):
    events = [status("flying"), ["pace", "0.98"], ["hears_commands", False]]
    shown = last(feed, *events)
    assert shown["pace"].startswith("0.98 ") and shown["deaf"] and shown["diagnosis"] == "Nothing is wrong."
    for dead in (["lost"], [4000], pulse(6), status("no simulation", 2)):
        shown = last(feed, *events, dead)
        assert shown["pace"] == shown["deaf"] == "" and "does not answer" in shown["diagnosis"]
    assert last(feed, *events, status("stopped", 2))["deaf"] == "", "a stopped script cannot listen anyway"


def test_buttons_without_effect_are_disabled(feed):
    flying = status("flying")
    assert last(feed, flying)["can"]["run"] and not last(feed, flying)["can"]["sim-start"]
    for dead in (["lost"], [4000], pulse(6), status("no simulation", 2)):
        can = last(feed, flying, dead)["can"]
        assert not any(can[one] for one in ("run", "sim-pause", "sim-start", "takeoff", "speed", "vehicle")), dead
    assert last(feed, flying, pulse(6))["can"]["grade"], "grading needs only the cockpit"
    assert not last(feed, flying, ["grading", True])["can"]["grade"]


# ---- storage

STORE = """async () => {
    const { keep, kept } = await import("http://page.test/storage.js");
    keep("key", 1);
    localStorage.setItem("drone_sim/key", "2"); // as another tab does
    const ofOtherTab = kept("key");
    const setItem = Storage.prototype.setItem;
    Storage.prototype.setItem = () => { throw new Error("the storage is full"); };
    keep("key", 3);
    Storage.prototype.setItem = setItem;
    return [ofOtherTab, kept("key")];
}"""


def test_values_are_read_from_the_storage_unless_storing_failed(empty_page):
    assert empty_page.evaluate(STORE) == [2, 3]


# ---- any events


STATES = ("flying", "paused", "stopped", "no simulation")
EVENTS = st.one_of(
    st.tuples(st.integers(0, 20_000)),
    st.builds(lambda is_, version: status(is_, version), st.sampled_from(STATES), st.integers(0, 30)),
    st.builds(
        lambda is_, version: flight(is_, version), st.sampled_from(["flying", "script failed"]), st.integers(0, 30)
    ),
    st.builds(reached, st.sampled_from([0, 3, 63]), st.sampled_from(["flying", "paused"])),
    st.builds(failure, st.sampled_from([5, 29]), phase=st.sampled_from(["actuation", "not started"])),
    st.builds(pulse, st.integers(0, 9), st.booleans()),
    st.sampled_from([["variables", None], ["connected"], ["lost"], ["refused"], ["heard"], ["run"], ["answered"]]),
    st.sampled_from([["started"], ["edited"], ["saving"], OPEN, ["opened", {"script": "mine/b.py", "file": OTHER}]]),
    st.sampled_from([["flown", "mine/a.py"], ["flown", "mine/b.py"], ["moved", 0], ["moved", 9], ["saved", "saved"]]),
    st.sampled_from([["checked", {"file": FILE, "found": []}], ["notice", {"text": "no", "bad": True}]]),
    st.builds(lambda kind: ["say", {"kind": kind, "text": "words"}], st.sampled_from(MESSAGES)),
).map(list)
MANY_EXAMPLES = settings(
    max_examples=150, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


@MANY_EXAMPLES
@given(st.lists(EVENTS, max_size=40))
def test_the_page_never_contradicts_itself(feed, events):
    for shown in feed(*events) if events else []:
        if shown["marked"]["paused"] or shown["said"].startswith("paused"):
            assert shown["status"] in ("Paused", "No answer")
        if shown["connection"] != "connected":
            assert shown["banner"] or shown["connection"] == "connecting"
            assert not any(shown["can"].values()) and not shown["flying"]
        if shown["banner"]:
            assert not shown["can"]["run"] and not shown["can"]["sim-pause"]
        if shown["can"]["run"]:
            assert shown["banner"] == "" and shown["connection"] == "connected"


@MANY_EXAMPLES
@given(st.lists(EVENTS, max_size=40), st.sampled_from(STATES), st.sampled_from([0, 63]))
def test_after_any_events_a_reconnection_shows_the_current_state(feed, events, is_, line):
    """Earlier events, even if late, duplicated or missing, do not change what the page shows after it reconnects."""
    truth = [["lost"], ["connected"], OPEN, ["run"], status(is_, 100), flight("flying", 100), ["flown", "mine/b.py"]]
    truth += [pulse(0), ["panel", {"panel": {"master": True}, "version": 100}]]
    truth += [reached(line if is_ == "paused" else 0, is_)]
    shown, expected = feed(*events, *truth)[-1], feed(["connected"], status("flying", 0), *truth)[-1]
    ignored = {"notice": "", "banner": ""}  # these depend on whether there was a simulator before
    assert {**shown, **ignored} == {**expected, **ignored} and bool(shown["banner"]) == bool(expected["banner"])


@MANY_EXAMPLES
@given(st.lists(EVENTS, max_size=30), st.data())
def test_a_duplicated_event_does_not_change_the_result(feed, events, data):
    events = [one for one in events if not isinstance(one[0], int)]
    at = data.draw(st.integers(0, len(events)))
    doubled = [*events[:at], *events[max(0, at - 1) : at], *events[at:]]
    if events:
        assert feed(*doubled)[-1] == feed(*events)[-1]


@MANY_EXAMPLES
@given(st.permutations([status("paused", 7), status("flying", 6), status("stopped", 5), flight("flying", 4)]))
def test_the_newest_version_wins_when_parts_arrive_out_of_order(feed, events):
    assert last(feed, *events)["status"] == "Paused"
