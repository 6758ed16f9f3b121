"""Services that a script offers: answered in its turn, refused where it has none any more."""

import logging
import threading

import pytest

from drone_sim.scripting.api.service_servers import ServiceServer, Unanswered
from drone_sim.scripting.errors import ScriptError

LUA = """
function sysCall_init()
  count = 0
  server = simROS.advertiseService('count', 'std_srvs/SetBool', 'counted')
  simExtRosInterface_advertiseService('/mute', 'std_srvs/Empty', function() end)
  simROS.advertiseService('number', 'std_srvs/Trigger', 'number')
  simROS.advertiseService('broken', 'std_srvs/Trigger', 'broken')
end
function sysCall_actuation() steps = (steps or 0) + 1 end
function counted(request)
  if request.data then count = count + 1 end
  return {success = request.data, message = 'step ' .. (steps or 0)}
end
function number() return 7 end
function broken() error('no') end
"""
PYTHON = """
def sysCall_init():
    self.count, self.steps = 0, 0
    self.server = simROS.advertiseService('count', 'std_srvs/SetBool', counted)
    simROS.advertiseService('/mute', 'std_srvs/Empty', lambda _: None)
    simROS.advertiseService('number', 'std_srvs/Trigger', 'number')
    simROS.advertiseService('broken', 'std_srvs/Trigger', 'broken')
def sysCall_actuation():
    self.steps += 1
def counted(request):
    self.count += request['data']
    return {'success': request['data'], 'message': f'step {self.steps}'}
def number(_request):
    return 7
def broken(_request):
    raise RuntimeError('no')
"""


class Ros:
    """A backend that offers services to this process."""

    def __init__(self):
        self.asks, self.made = {}, []

    def serve(self, name, kind, ask):
        if kind == "no/Type":
            raise ValueError("service type 'no/Type' is not installed")
        self.asks[name] = ask
        return lambda: self.asks.pop(name)

    def asking(self, name, request=None):
        """Ask in a thread of its own, as rospy does; return what the answer, or why there is none, comes in."""
        answers, ask = [], self.asks[name]

        def run():
            try:
                answers.append(ask(request, lambda fields: fields))
            except Unanswered as error:
                answers.append(str(error))

        thread = threading.Thread(target=run)
        thread.start()
        while not any(one.messages for bus in self.buses for one in bus._subscriptions.values()):
            thread.join(0.001)
        return thread, answers


@pytest.fixture
def flying(new_simulation):
    def fly(**script):
        ros = Ros()
        simulation = new_simulation(**script, backend=ros)
        ros.buses = [simulation.drone.bus]
        return simulation, ros

    return fly


@pytest.fixture(name="served", params=[{"lua": LUA}, {"python": PYTHON}], ids=["lua", "python"])
def _served(request, flying):
    return flying(**request.param)


def answer_of(simulation, asked):
    thread, answers = asked
    assert not answers, "the script is asked in its turn"
    try:
        simulation.step()
    finally:
        thread.join(10)
    return answers[0]


def test_a_request_is_answered_at_the_beginning_of_the_next_step(served):
    simulation, ros = served
    simulation.step()
    answer = answer_of(simulation, ros.asking("/drone/count", {"data": True}))
    assert answer == {"success": True, "message": "step 1"}
    assert answer_of(simulation, ros.asking("/mute")) == {}, "every field keeps its default"


def test_a_snapshot_keeps_the_request_that_waits(served):
    simulation, ros = served
    asked = ros.asking("/drone/count", {"data": True})
    kept = simulation.snapshot()
    assert answer_of(simulation, asked)["message"] == "step 0"
    simulation.restore(kept)
    simulation.step()
    assert answer_of(simulation, ros.asking("/drone/count", {"data": True}))["message"] == "step 1"


def test_what_is_no_response_is_refused_and_said(served, caplog):
    simulation, ros = served
    with caplog.at_level(logging.ERROR):
        answer = answer_of(simulation, ros.asking("/drone/number"))
    assert (
        answer == caplog.messages[-1] == "the callback of a service must return a table of the response's fields, not 7"
    )
    simulation.step()


def test_a_callback_that_fails_ends_the_script_and_refuses_who_asked(served):
    simulation, ros = served
    asked = ros.asking("/drone/broken")
    with pytest.raises(ScriptError, match=r"\[broken\] .*no"):
        answer_of(simulation, asked)
    assert asked[1][0].startswith("[broken] ") and asked[1][0].endswith("no")


def test_who_waits_is_refused_when_the_simulation_stops(served):
    simulation, ros = served
    thread, answers = ros.asking("/drone/count", {"data": True})
    ask = ros.asks["/drone/count"]
    simulation.stop()
    thread.join(10)
    assert answers == ["the script ended before it answered"] and not ros.asks
    with pytest.raises(Unanswered, match="no longer"):
        ask(None, dict)


def test_who_waits_in_vain_is_refused_and_the_script_is_not_asked_later():
    waiting = []
    server = ServiceServer(waiting.append, patience=0.0)
    with pytest.raises(Unanswered, match="no answer within 0 s: the simulation is paused, or steps too slowly"):
        server.ask(None, dict)
    assert waiting[0].is_abandoned


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("'count', 'no/Type', 'f'", "'no/Type' is not installed"),
        ("'count', 'Trigger', 'f'", "'Trigger' is not a service type"),
        ("'a b\\n', 'std_srvs/Trigger', 'counted'", "is no name of a service"),
        ("'count', 'std_srvs/Trigger', 'counter'", "no function 'counter' for this callback; near names are counted"),
        ("'count', 'std_srvs/Trigger'", "wrong number of values"),
    ],
)
def test_a_wrong_service_is_one_line(flying, arguments, said):
    text = f"function sysCall_init() simROS.advertiseService({arguments}) end function counted() end"
    with pytest.raises(ScriptError, match=said):
        flying(lua=text)


def test_a_handle_of_a_service_is_no_subscription_and_ends_once(flying):
    text = """function sysCall_init()
      server = simROS.advertiseService('a', 'std_srvs/Empty', 'f')
      assert(not pcall(simROS.shutdownSubscriber, server))
      simROS.shutdownServiceServer(server)
      assert(not pcall(simROS.shutdownServiceServer, server))
      simROS.advertiseService('a', 'std_srvs/Empty', 'f')
    end
    function f() end"""
    _, ros = flying(lua=text)
    assert set(ros.asks) == {"/drone/a"}
