"""Services that a script offers: answered at the beginning of a step, refused when the script has ended."""

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
  return {success = request.data, message = 'step ' .. (steps or 0) .. ', count ' .. count}
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
    return {'success': request['data'], 'message': f'step {self.steps}, count {self.count}'}
def number(_request):
    return 7
def broken(_request):
    raise RuntimeError('no')
"""


class Ros:
    """A backend that offers services to this process."""

    def __init__(self):
        self.callbacks = {}

    def serve(self, name, kind, ask):
        if kind == "no/Type":
            raise ValueError("service type 'no/Type' is not installed")
        self.callbacks[name] = ask
        return lambda: self.callbacks.pop(name)

    def call_service(self, name, request=None):
        """Call a service in another thread, as rospy does; return the thread and a list for the answer or error."""
        answers, ask = [], self.callbacks[name]

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
def run_script(new_simulation):
    def fly(**script):
        ros = Ros()
        simulation = new_simulation(**script, backend=ros)
        ros.buses = [simulation.drone.bus]
        return simulation, ros

    return fly


@pytest.fixture(name="served", params=[{"lua": LUA}, {"python": PYTHON}], ids=["lua", "python"])
def _served(request, run_script):
    return run_script(**request.param)


def answer_of(simulation, pending_call):
    thread, answers = pending_call
    assert not answers, "the script answers at the beginning of a step"
    try:
        simulation.step()
    finally:
        thread.join(10)
    return answers[0]


def test_a_request_is_answered_at_the_beginning_of_the_next_step(served):
    simulation, ros = served
    simulation.step()
    answer = answer_of(simulation, ros.call_service("/drone/count", {"data": True}))
    assert answer == {"success": True, "message": "step 1, count 1"}
    assert answer_of(simulation, ros.call_service("/mute")) == {}, "every field keeps its default"


def test_a_snapshot_with_a_waiting_request_can_be_restored(served):
    simulation, ros = served
    pending_call = ros.call_service("/drone/count", {"data": True})
    saved_state = simulation.snapshot()
    assert answer_of(simulation, pending_call)["message"] == "step 0, count 1"
    simulation.restore(saved_state)
    simulation.step()
    # The restored script has answered the waiting request once more.
    assert answer_of(simulation, ros.call_service("/drone/count", {"data": True}))["message"] == "step 1, count 2"


def test_an_invalid_response_is_refused_and_logged(served, caplog):
    simulation, ros = served
    with caplog.at_level(logging.ERROR):
        answer = answer_of(simulation, ros.call_service("/drone/number"))
    assert (
        answer == caplog.messages[-1] == "the callback of a service must return a table of the response's fields, not 7"
    )
    simulation.step()


def test_a_failing_callback_ends_the_script_and_refuses_the_request(served):
    simulation, ros = served
    pending_call = ros.call_service("/drone/broken")
    with pytest.raises(ScriptError, match=r"\[broken\] .*no"):
        answer_of(simulation, pending_call)
    assert pending_call[1][0].startswith("[broken] ") and pending_call[1][0].endswith("no")


def test_a_waiting_request_is_refused_when_the_simulation_stops(served):
    simulation, ros = served
    thread, answers = ros.call_service("/drone/count", {"data": True})
    ask = ros.callbacks["/drone/count"]
    simulation.stop()
    thread.join(10)
    assert answers == ["the script ended before it answered"] and not ros.callbacks
    with pytest.raises(Unanswered, match="no longer"):
        ask(None, dict)


def test_a_request_that_times_out_is_refused_and_abandoned():
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
def test_invalid_arguments_of_advertise_service_are_refused(run_script, arguments, said):
    text = f"function sysCall_init() simROS.advertiseService({arguments}) end function counted() end"
    with pytest.raises(ScriptError, match=said):
        run_script(lua=text)


def test_a_service_handle_is_shut_down_once_and_only_as_a_service(run_script):
    text = """function sysCall_init()
      server = simROS.advertiseService('a', 'std_srvs/Empty', 'f')
      assert(not pcall(simROS.shutdownSubscriber, server))
      simROS.shutdownServiceServer(server)
      assert(not pcall(simROS.shutdownServiceServer, server))
      simROS.advertiseService('a', 'std_srvs/Empty', 'f')
    end
    function f() end"""
    _, ros = run_script(lua=text)
    assert set(ros.callbacks) == {"/drone/a"}
