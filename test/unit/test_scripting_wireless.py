"""sendData and receiveData: wireless messages between scripts."""

import pytest

OBJECTS = [
    {"name": "Sender", "kind": "dummy", "position": [0, 0, 5]},
    {"name": "Below", "kind": "dummy", "parent": "Sender", "position": [3, 0, 0]},
    {"name": "Beside", "kind": "dummy", "position": [3, 0.1, 5]},
    {"name": "Above", "kind": "dummy", "position": [0, 0.1, 7]},
]
RECEIVER = """
local names = {}
function sysCall_sensing()
  while true do
    local data, sender, header, name = ASKS
    if not data then break end
    local at = sim.getObjectName(sim.getObjectAssociatedWithScript(sender)) .. header .. name .. data .. ' '
    local own = sim.getObjectName(sim.getObjectAssociatedWithScript(sim.handle_self))
    sim.setStringSignal(own, (sim.getStringSignal(own) or '') .. at)
  end
end
"""
SENDER = """
local calls, step = {CALLS}, 0
function sysCall_actuation()
  step = step + 1
  if step % STEPS == 1 then calls[(step - 1) / STEPS + 1]() end
end
"""
ALL = "sim.receiveData()"


@pytest.fixture(name="heard")
def _heard(tmp_path, new_simulation):
    """Return a generator function that runs a call in Sender every few steps and yields what each receiver got."""

    def heard(calls, receive=ALL, steps=3, before=""):
        functions = ", ".join(f"function() {call} end" for call in calls)
        texts = {"Sender": SENDER.replace("CALLS", functions).replace("STEPS", str(steps))}
        names = "Below", "Beside", "Above"
        texts |= {name: RECEIVER.replace("ASKS", receive) for name in names}
        entries = []
        for name, text in texts.items():
            path = tmp_path / f"{name}.lua"
            path.write_text(before + text, encoding="utf-8")
            entries.append({"object": name, "script": str(path)})
        simulation = new_simulation({"scene": {"objects": OBJECTS, "scripts": entries}})
        signals = simulation.context.signals
        for _ in calls:
            for _ in range(steps):
                simulation.step()
            yield [signals.get(str, name) for name in names]
            for name in names:
                signals.forget(str, name)

    return heard


RECEIVED = "Sender3pingx "
PING = "sim.sendData({}, 3, 'ping', 'x'{})"


def test_addressed_receivers_in_reach_get_a_message_once(heard):
    expected = {
        PING.format("sim.handle_tree", ""): [RECEIVED, None, None],
        PING.format("sim.handle_chain", ""): [None, None, None],
        PING.format("sim.getScriptHandle('Beside')", ""): [None, RECEIVED, None],
        PING.format("sim.handle_all", ""): [RECEIVED, RECEIVED, RECEIVED],
        PING.format("sim.handle_all", ", sim.handle_self, 2.5"): [None, None, RECEIVED],
        PING.format("sim.handle_all", ", sim.handle_self, 3.05"): [RECEIVED, RECEIVED, RECEIVED],
        PING.format("sim.handle_all", ", sim.handle_default, 6"): [RECEIVED, RECEIVED, None],  # from the world's origin
        PING.format("sim.handle_all", ", sim.handle_self, 100, 1"): [RECEIVED, RECEIVED, None],  # flat
        PING.format("sim.handle_all", ", sim.handle_self, 100, math.pi, 1"): [RECEIVED, RECEIVED, None],  # ahead
        PING.format("sim.handle_all", ", sim.handle_self, 100, math.pi, 0.01"): [RECEIVED, None, None],
    }
    assert dict(zip(expected, heard(list(expected)))) == expected


def test_receiver_selects_messages_by_id_and_header(heard):
    expected = {
        "simReceiveData(3)": RECEIVED,
        "simReceiveData(4)": None,
        "simReceiveData(-1, 'ping')": RECEIVED,
        "simReceiveData(3, 'pong')": None,
        "simReceiveData(nil, 'ping', sim.handle_default)": RECEIVED,
    }
    receive = "".join(f" elseif turn == {number} then return {variant}" for number, variant in enumerate(expected))
    turn = "math.floor(simGetSimulationTime() / 0.15 + 0.01)"  # three steps each
    receive = f"(function() local turn = {turn} if turn < 0 then{receive} end end)()"
    calls = ["simSendData(sim_handle_all, 3, 'ping', 'x')"] * len(expected)
    assert [below for below, _, _ in heard(calls, receive)] == list(expected.values())


def test_message_can_be_read_without_removing_it(heard):
    both = "sim.sendData(sim.handle_all, 3, 'ping', 'x') sim.sendData(sim.handle_all, 3, 'ping', 'y')"
    receive = "(function() if not looked then looked = true return sim.receiveData(3, 'ping', sim.handle_self, 1) end"
    ((below, _, _),) = heard([both], f"{receive} return sim.receiveData() end)()")
    assert below == "Sender3pingy Sender3pingx Sender3pingy "


def test_message_persists_for_the_given_time(heard):
    late = "(function() if sim.getSimulationTime() % 0.5 > 0.3 then return sim.receiveData() end end)()"
    calls = [PING.format("sim.handle_all", more) for more in ("", ", sim.handle_self, 100, math.pi, 2 * math.pi, 1")]
    assert [below for below, _, _ in heard(calls, late, 10)] == [None, RECEIVED]


def test_sender_does_not_receive_its_own_message(heard):
    own = "function sysCall_sensing() if sim.receiveData() then sim.setStringSignal('Below', 'own') end end\n"
    assert list(heard([PING.format("sim.handle_all", "")], "nil", before=own)) == [[None] * 3]
