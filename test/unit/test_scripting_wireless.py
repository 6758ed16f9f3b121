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
    local data, sender, header, name = %s
    if not data then break end
    local at = sim.getObjectName(sim.getObjectAssociatedWithScript(sender)) .. header .. name .. data .. ' '
    local own = sim.getObjectName(sim.getObjectAssociatedWithScript(sim.handle_self))
    sim.setStringSignal(own, (sim.getStringSignal(own) or '') .. at)
  end
end
"""
ALL = "sim.receiveData()"


@pytest.fixture(name="heard")
def _heard(tmp_path, new_simulation):
    """Give a function that lets Sender call something in its first step; it returns what the others have heard."""

    def heard(call, asks=ALL, steps=3, before=""):
        texts = {"Sender": f"function sysCall_actuation() if not sent then sent = true {call} end end"}
        texts |= {name: RECEIVER % asks for name in ("Below", "Beside", "Above")}
        entries = []
        for name, text in texts.items():
            path = tmp_path / f"{name}.lua"
            path.write_text(before + text, encoding="utf-8")
            entries.append({"object": name, "script": str(path)})
        signals = new_simulation({"scene": {"objects": OBJECTS, "scripts": entries}}, steps).context.signals
        return [signals.get(str, name) for name in ("Below", "Beside", "Above")]

    return heard


GOT = "Sender3pingx "


@pytest.mark.parametrize(
    ("reach", "hears"),
    [
        ("", [GOT, GOT, GOT]),
        (", sim.handle_self, 2.5", [None, None, GOT]),
        (", sim.handle_self, 3.05", [GOT, GOT, GOT]),
        (", sim.handle_default, 6", [GOT, GOT, None]),  # from the world's origin
        (", sim.handle_self, 100, 1", [GOT, GOT, None]),  # flat
        (", sim.handle_self, 100, math.pi, 1", [GOT, GOT, None]),  # ahead
        (", sim.handle_self, 100, math.pi, 0.01", [GOT, None, None]),
    ],
)
def test_who_is_in_reach_hears_it_once(heard, reach, hears):
    assert heard(f"sim.sendData(sim.handle_all, 3, 'ping', 'x'{reach})") == hears


@pytest.mark.parametrize(
    ("target", "hears"),
    [
        ("sim.handle_tree", [GOT, None, None]),
        ("sim.handle_chain", [None, None, None]),
        ("sim.getScriptHandle('Beside')", [None, GOT, None]),
    ],
)
def test_who_is_meant(heard, target, hears):
    assert heard(f"sim.sendData({target}, 3, 'ping', 'x')") == hears


@pytest.mark.parametrize(
    ("asks", "hears"),
    [
        ("simReceiveData(3)", GOT),
        ("simReceiveData(4)", None),
        ("simReceiveData(-1, 'ping')", GOT),
        ("simReceiveData(3, 'pong')", None),
        ("simReceiveData(nil, 'ping', sim.handle_default)", GOT),
    ],
)
def test_what_is_asked_for(heard, asks, hears):
    assert heard("simSendData(sim_handle_all, 3, 'ping', 'x')", asks)[0] == hears


def test_it_can_be_looked_at_first(heard):
    two = "sim.sendData(sim.handle_all, 3, 'ping', 'x') sim.sendData(sim.handle_all, 3, 'ping', 'y')"
    asks = "(function() if not looked then looked = true return sim.receiveData(3, 'ping', sim.handle_self, 1) end"
    assert heard(two, f"{asks} return sim.receiveData() end)()")[0] == "Sender3pingy Sender3pingx Sender3pingy "


def test_it_persists_for_so_long(heard):
    late = "(function() if sim.getSimulationTime() > 0.3 then return sim.receiveData() end end)()"
    assert heard("sim.sendData(sim.handle_all, 3, 'ping', 'x')", late, 10)[0] is None
    call = "sim.sendData(sim.handle_all, 3, 'ping', 'x', sim.handle_self, 100, math.pi, 2 * math.pi, 1)"
    assert heard(call, late, 10)[0] == GOT


def test_nobody_hears_himself(heard):
    own = "function sysCall_sensing() if sim.receiveData() then sim.setStringSignal('Below', 'own') end end\n"
    call = "sim.sendData(sim.handle_all, 3, 'ping', 'x')"
    assert heard(f"{call} end end {own} function none() if true then", "nil") == [None] * 3
