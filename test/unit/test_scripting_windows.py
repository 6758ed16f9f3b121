"""Floating views, dialogs and consoles of scripts: their state and the user's answers."""

import json
import re

import pytest

from drone_sim.files.resources import package_path
from drone_sim.scripting.api.windows import MOST, Dialog, Windows, read_answer

SCRIPT = """
def sysCall_init():
    self.view = sim.floatingViewAdd(0.9, 0.9, 0.2, 0.2, 0)
    sim.adjustView(self.view, sim.getObjectHandle('FrontVision'), 64)
    sim.floatingViewAdd(0.7, 0.9, 0.2, 0.2, 0)
    self.asked = sim.displayDialog('Land?', '<b>now</b>', sim.dlgstyle_yes_no, False)
    self.input = sim.displayDialog('Height', 'm', sim.dlgstyle_input, False, '0.8')
    sim.displayDialog('Wait', 'modal', sim.dlgstyle_ok_cancel, True)
    self.console = sim.auxiliaryConsoleOpen('Said', 3, 4)
    self.results = []

def sysCall_actuation():
    asked, answered = sim.getDialogResult(self.asked), sim.getDialogResult(self.input)
    self.results.append((asked, answered, sim.getDialogInput(self.input)))
    sim.auxiliaryConsolePrint(self.console, f'step {len(self.results)}\\n')
    sim.setStringSignal('results', repr(self.results[-1]))
    if sim.getInt32Signal('close'):
        sim.floatingViewRemove(self.view)
        sim.endDialog(self.input)
        sim.auxiliaryConsoleShow(self.console, False)
"""


@pytest.fixture(name="fly")
def _fly(tmp_path, new_simulation):
    def fly(text, name="script.py"):
        (tmp_path / name).write_text(text, encoding="utf-8")
        return new_simulation(script=str(tmp_path / name))

    return fly


def handles(simulation, kind):
    return [item["handle"] for item in simulation.windows.state()[kind]]


def result(simulation):
    simulation.step()
    return simulation.context.signals.get(str, "results")


def test_user_sees_the_windows_and_answers_the_dialogs(fly):
    simulation = fly(SCRIPT)
    windows = simulation.windows
    windows.readers.add(lambda: True)
    state = windows.state()
    assert [(item["sensor"], item["label"]) for item in state["views"]] == [("FrontVision", "FrontVision")]
    land, height, wait = state["dialogs"]
    assert (land["title"], land["text"], land["buttons"], land["typed"]) == ("Land?", "<b>now</b>", ("yes", "no"), None)
    assert (height["buttons"], height["typed"]) == (("ok",), "0.8")
    assert wait["buttons"] == (), "a modal dialog counts as answered: nothing waits for it"
    assert result(simulation) == repr((0, 0, ""))
    changes = windows.changes
    windows.answer(land["handle"], "no")
    windows.answer(height["handle"], "ok", "1.5")
    assert windows.changes > changes and len(windows.state()["dialogs"]) == 1
    assert result(simulation) == repr((4, 1, "1.5"))
    with pytest.raises(ValueError, match="no open dialog with the handle"):
        windows.answer(land["handle"], "yes")
    for _ in range(5):
        simulation.step()
    assert windows.state()["consoles"][0]["lines"] == ["step 6", "step 7", ""]
    json.dumps(windows.state())


def test_dialogs_without_a_reader_are_answered_with_ok(fly):
    simulation = fly(SCRIPT)
    assert result(simulation) == repr((1, 1, ""))
    assert [item["title"] for item in simulation.windows.state()["dialogs"]] == ["Wait"]


def test_unknown_button_is_refused(fly):
    simulation = fly(SCRIPT)
    with pytest.raises(ValueError, match="'Land\\?' has no button 'maybe', but yes and no"):
        simulation.windows.answer(handles(simulation, "dialogs")[0], "maybe")


def test_script_closes_its_windows_and_a_restore_reopens_them(fly):
    simulation = fly(SCRIPT)
    simulation.windows.readers.add(lambda: True)
    before, snapshot = simulation.windows.state(), simulation.snapshot()
    simulation.context.signals.set(int, "close", 1)
    simulation.step()
    assert [len(item) for item in simulation.windows.state().values()] == [0, 2, 0]
    simulation.restore(snapshot)
    assert simulation.windows.state() == before


def test_example_in_the_docs_shows_a_dialog_and_prints(fly):
    text = (package_path() / "docs" / "scripts.md").read_text(encoding="utf-8").partition("## Windows")[2]
    simulation = fly(re.findall(r"```python\n(.*?)```", text, re.DOTALL)[0])
    windows = simulation.windows
    windows.readers.add(lambda: True)
    simulation.step()
    windows.answer(handles(simulation, "dialogs")[0], "ok", "1.5")
    simulation.step()
    state = windows.state()
    assert (len(state["views"]), state["dialogs"], state["consoles"][0]["lines"]) == (1, [], ["asked for 1.5 m", ""])


def test_stop_closes_all_windows(fly):
    simulation = fly(SCRIPT)
    changes = simulation.windows.changes
    simulation.stop()
    assert simulation.windows.state() == {"views": [], "dialogs": [], "consoles": []}
    assert simulation.windows.changes > changes


def test_number_and_size_of_windows_are_limited():
    windows = Windows()
    for handle in range(1000):
        windows.add_view(handle)
        windows.aim(handle, "FrontVision", "label" * 1000)
        windows.add_dialog(handle, Dialog("title" * 1000, "text" * 10_000, ("ok",), "typed" * 10_000))
        windows.add_console(handle, "title" * 1000, 10**9)
        for _ in range(20):
            windows.print(handle, "line" * 1000 + "\n" * 20)
    assert [len(item) for item in (windows.views, windows.dialogs, windows.consoles)] == [MOST] * 3
    assert min(windows.dialogs) == 1000 - MOST, "the oldest are removed first"
    assert len(json.dumps(windows.state())) < 700_000


@pytest.mark.parametrize(
    "wrong",
    [None, [], "x", {}, {"handle": "1", "button": "ok"}, {"handle": 1}, {"handle": 1, "button": "ok", "typed": 3}],
)
def test_malformed_answer_is_refused(wrong):
    with pytest.raises(ValueError, match="answer"):
        read_answer(wrong)
    assert read_answer({"handle": 1, "button": "ok", "typed": None}) == (1, "ok", "")
