"""sendData and receiveData: what scripts send to each other without wires."""

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
    """Give a function that lets Sender call something every few steps; it yields what the others have heard by then."""

    def heard(calls, asks=ALL, steps=3, before=""):
        made = ", ".join(f"function() {call} end" for call in calls)
        texts = {"Sender": SENDER.replace("CALLS", made).replace("STEPS", str(steps))}
        names = "Below", "Beside", "Above"
        texts |= {name: RECEIVER.replace("ASKS", asks) for name in names}
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


GOT = "Sender3pingx "
PING = "sim.sendData({}, 3, 'ping', 'x'{})"


def test_who_is_meant_and_in_reach_hears_it_once(heard):
    hears = {
        PING.format("sim.handle_tree", ""): [GOT, None, None],
        PING.format("sim.handle_chain", ""): [None, None, None],
        PING.format("sim.getScriptHandle('Beside')", ""): [None, GOT, None],
        PING.format("sim.handle_all", ""): [GOT, GOT, GOT],
        PING.format("sim.handle_all", ", sim.handle_self, 2.5"): [None, None, GOT],
        PING.format("sim.handle_all", ", sim.handle_self, 3.05"): [GOT, GOT, GOT],
        PING.format("sim.handle_all", ", sim.handle_default, 6"): [GOT, GOT, None],  # from the world's origin
        PING.format("sim.handle_all", ", sim.handle_self, 100, 1"): [GOT, GOT, None],  # flat
        PING.format("sim.handle_all", ", sim.handle_self, 100, math.pi, 1"): [GOT, GOT, None],  # ahead
        PING.format("sim.handle_all", ", sim.handle_self, 100, math.pi, 0.01"): [GOT, None, None],
    }
    assert dict(zip(hears, heard(list(hears)))) == hears


def test_what_is_asked_for(heard):
    hears = {
        "simReceiveData(3)": GOT,
        "simReceiveData(4)": None,
        "simReceiveData(-1, 'ping')": GOT,
        "simReceiveData(3, 'pong')": None,
        "simReceiveData(nil, 'ping', sim.handle_default)": GOT,
    }
    asks = "".join(f" elseif turn == {number} then return {ask}" for number, ask in enumerate(hears))
    turn = "math.floor(simGetSimulationTime() / 0.15 + 0.01)"  # three steps each
    asks = f"(function() local turn = {turn} if turn < 0 then{asks} end end)()"
    calls = ["simSendData(sim_handle_all, 3, 'ping', 'x')"] * len(hears)
    assert [below for below, _, _ in heard(calls, asks)] == list(hears.values())


def test_it_can_be_looked_at_first(heard):
    two = "sim.sendData(sim.handle_all, 3, 'ping', 'x') sim.sendData(sim.handle_all, 3, 'ping', 'y')"
    asks = "(function() if not looked then looked = true return sim.receiveData(3, 'ping', sim.handle_self, 1) end"
    ((below, _, _),) = heard([two], f"{asks} return sim.receiveData() end)()")
    assert below == "Sender3pingy Sender3pingx Sender3pingy "


def test_it_persists_for_so_long(heard):
    late = "(function() if sim.getSimulationTime() % 0.5 > 0.3 then return sim.receiveData() end end)()"
    calls = [PING.format("sim.handle_all", more) for more in ("", ", sim.handle_self, 100, math.pi, 2 * math.pi, 1")]
    assert [below for below, _, _ in heard(calls, late, 10)] == [None, GOT]


def test_nobody_hears_himself(heard):
    own = "function sysCall_sensing() if sim.receiveData() then sim.setStringSignal('Below', 'own') end end\n"
    assert list(heard([PING.format("sim.handle_all", "")], "nil", before=own)) == [[None] * 3]
