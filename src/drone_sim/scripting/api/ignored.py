"""`sim` and its plugins: functions that are accepted and ignored; the log says so once for each function of a script.

So a script that shows something to a person also flies here, where nobody looks. docs/api.md lists every one of
these functions, with what it returns.
"""

from __future__ import annotations

import ast
import copy
import logging
from collections.abc import Callable, Collection
from typing import Any, NamedTuple

from drone_sim.scripting.api.calls import Function, Module, flat_name
from drone_sim.scripting.script_log import LOG

_HELD = ("setLinkDummy",)  # without which bodies that belong together fall apart: a warning
HANDLE = object()  # a new handle of something that is not there

# By module and the reason, as the log says it: behind the generations that have them (-: none) functions that do
# nothing, each with what it returns, if anything.
_TABLE = {
    "sim": {
        "particles are not simulated one by one": """
            345 addParticleObjectItem removeParticleObject addParticleObject=handle
        """,
        "CoppeliaSim's window does not exist here: use the cockpit or rviz": """
            345 cameraFitToView setNavigationMode setPage removeBanner refreshDialogs getNavigationMode=0 getPage=0
                addBanner=handle announceSceneContentChange=0
        """,
        "colors come from the scene file and the URDF": """
            345 setShapeTexture setLightParameters getShapeTextureId=-1
            5 setObjectColor getObjectColor=(0,[0.0,0.0,0.0])
        """,
        "the cockpit draws the streams of graphs as they are": """
            45 setGraphStreamTransformation addGraphCurve=handle
            345 handleGraph
        """,
        "user interfaces of V-REP 3.x are not supported": """
            3 setUIButtonLabel setUIButtonColor setUIButtonProperty setUIProperty setUISlider setUIPosition removeUI
                getUIHandle=handle createUI=handle createUIButton=0 getUIEventButton=-1 getUIButtonProperty=0
                getUIProperty=0 getUISlider=0 getUIButtonLabel='' getUIPosition=[0,0]
            - setUIButtonTexture
        """,
        "there is no window to select objects or press keys in": """
            345 addObjectToSelection removeObjectFromSelection getObjectSelection=[]
                getSimulatorMessage=(-1,[0,0,0,0],[])
            5 setObjectSel getObjectSel=[]
            35 getObjectLastSelection=-1
        """,
        "the scene file sets the properties of objects": """
            345 setObjectProperty setObjectSpecialProperty setModelProperty setExplicitHandling getObjectProperty=0
                getObjectSpecialProperty=0 getModelProperty=0 getExplicitHandling=0
            - setModelBase
        """,
        "the simulation does this itself, in V-REP's order": """
            345 setThreadIsFree setScriptAttribute registerScriptFunction auxFunc resumeThreads
                launchThreadedChildScripts handleSimulationStart handleSensingStart handleMechanism handleCollision
                handleDistance handleMill resetCollision resetDistance resetMill resetMilling handleChildScripts=0
                handleDynamics=0 getRealTimeSimulation=1 getScriptAttribute=0 handleCustomizationScripts=0
                handleAddOnScripts=0 handleEmbeddedScripts=0 handleSimulationScripts=0 handleJointMotion=0
                handleSandboxScript=0 openModule=0 handleModule=0 closeModule=0
            3 handleVarious handleJoint handlePath handleChildScript=0 handleSensingChildScripts=0
            - adjustRealTimeTimer handleIkGroup isRealTimeSimulationStepNeeded=1
        """,
        "propellers are rigidly attached, and nothing breaks": """
            345 breakForceSensor
        """,
        "dummies cannot be linked to each other": """
            345 setLinkDummy getLinkDummy=-1
            - setDummyLinkType getDummyLinkType=0
        """,
        "a picture always shows what the sensor sees: publish your own picture instead": """
            345 setVisionSensorCharImage setVisionSensorImage resetVisionSensor
            5 setVisionSensorImg
        """,
    },
    "simUI": {
        "scripts have no windows here: use rqt or rviz": """
            345 colorDialog inputDialog destroy setPosition setSize setTitle setEnabled setWindowEnabled show hide
                setLabelText setButtonText setSliderValue setSpinboxValue setCheckboxValue setRadiobuttonValue
                setComboboxItems setComboboxSelectedIndex setEditValue setCurrentTab setCurrentEditWidget setImageData
                setWidgetVisibility setProgress setStyleSheet setText appendText adjustSize addCurve
                addCurveTimePoints addCurveXYPoints clearCurve removeCurve replot setPlotRanges setPlotLabels
                rescaleAxes rescaleAxesAll setMouseOptions setLegendVisibility setRowCount setColumnCount setItem
                setItemEditable clearTable create=handle getPosition=(0,0) getSize=(0,0) getSliderValue=0
                getSpinboxValue=0 getCheckboxValue=0 getRadiobuttonValue=0 getComboboxSelectedIndex=0 getEditValue=''
                getCurrentTab=0 getCurrentEditWidget='' getTitle='' isVisible=False fileDialog=[] msgBox=0
        """,
    },
}


class Group(NamedTuple):
    """Functions that do nothing for one reason, by name: the generations that have each, and what it returns."""

    why: str
    functions: dict[str, tuple[str, Any]]


def _group(why: str, rows: str) -> Group:
    generations, functions = "", dict[str, tuple[str, Any]]()
    for word in rows.split():
        if word == "-" or word.isdigit():
            generations = word.strip("-")
        else:
            name, _, returned = word.partition("=")
            value = HANDLE if returned == "handle" else ast.literal_eval(returned or "None")
            functions[name] = generations, value
    return Group(why, functions)


MODULES = {module: [_group(*one) for one in groups.items()] for module, groups in _TABLE.items()}
PLUGINS = tuple(name for name in MODULES if name != "sim")


class Ignored:
    """The functions of one script that do nothing, and what says so."""

    def __init__(
        self, script: str, new_handle: Callable[[], int], flat_names: Callable[[], Collection[str]] = frozenset
    ):
        """`script`: the name of the object that it is on; `new_handle` gives a handle that nothing else has.

        `flat_names` returns the functions that the script calls by their names of 3.x, such as simSetObjectColor.
        """
        self._script = script
        self._new_handle = new_handle
        self._flat_names = flat_names
        self._said: set[tuple[str, str]] = set()

    def say(self, name: str, what: str, module: str = "sim", level: int = logging.INFO) -> None:
        """Write to the log, once, that something is ignored, with the function's name as the script writes it."""
        if (name, what) not in self._said:
            self._said.add((name, what))
            flat = flat_name(module, name)
            written = flat if flat in self._flat_names() else f"{module}.{name}"
            LOG.log(level, "%s: %s (in the script of %s)", written, what, self._script)

    def functions(self, module: str) -> dict[str, Function]:
        """Return every one of them in a module, by name."""
        return {
            name: self._function(module, name, f"{group.why}; accepted and ignored", *one)
            for group in MODULES[module]
            for name, one in group.functions.items()
        }

    def _function(self, module: str, name: str, said: str, generations: str, returned: Any) -> Function:
        level = logging.WARNING if name in _HELD else logging.INFO

        def call(*_arguments: Any) -> Any:
            self.say(name, said, module, level)
            return self._new_handle() if returned is HANDLE else copy.deepcopy(returned)

        call.__name__ = name
        return Module(module)(generations)(call)
