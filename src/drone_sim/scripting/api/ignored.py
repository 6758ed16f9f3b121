"""`sim` and its plugins: functions that are accepted and ignored, with one log line for each function of a script.

So a script also flies here if it shows something in windows that do not exist here. docs/api.md lists these functions
and their results.
"""

from __future__ import annotations

import ast
import copy
import logging
from collections.abc import Callable, Collection
from typing import Any, NamedTuple

from drone_sim.scripting.api.calls import Function, Module, flat_name
from drone_sim.scripting.script_log import LOG

HANDLE = object()  # means that the function returns a new handle

# Functions by module and by the reason for the log. A number gives the generations of the functions that follow it (-:
# none); a function may have a result.
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
        "linked dummies always hold their bodies together": """
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
    """Functions that are ignored for the same reason: by name, their generations and results."""

    why: str
    functions: dict[str, tuple[str, Any]]


def _group(reason: str, rows: str) -> Group:
    generations, functions = "", dict[str, tuple[str, Any]]()
    for word in rows.split():
        if word == "-" or word.isdigit():
            generations = word.strip("-")
        else:
            name, _, result = word.partition("=")
            value = HANDLE if result == "handle" else ast.literal_eval(result or "None")
            functions[name] = generations, value
    return Group(reason, functions)


MODULES = {module: [_group(*one) for one in groups.items()] for module, groups in _TABLE.items()}
PLUGINS = tuple(name for name in MODULES if name != "sim")


class Ignored:
    """The ignored functions of one script, and its log of ignored calls."""

    def __init__(
        self, script: str, new_handle: Callable[[], int], flat_names: Callable[[], Collection[str]] = frozenset
    ):
        """`script` is the name of the object that it is on; `new_handle` returns an unused handle.

        `flat_names` returns the functions that the script calls by V-REP 3.x names, such as simSetObjectColor.
        """
        self._script = script
        self._new_handle = new_handle
        self._flat_names = flat_names
        self._logged: set[tuple[str, str]] = set()

    def log(self, name: str, what: str, module: str = "sim", level: int = logging.INFO) -> None:
        """Log once that something is ignored, with the function's name in the form that the script uses."""
        if (name, what) not in self._logged:
            self._logged.add((name, what))
            flat = flat_name(module, name)
            written = flat if flat in self._flat_names() else f"{module}.{name}"
            LOG.log(level, "%s: %s (in the script of %s)", written, what, self._script)

    def functions(self, module: str) -> dict[str, Function]:
        """Return the ignored functions of a module by name."""
        return {
            name: self._function(module, name, f"{group.why}; accepted and ignored", *properties)
            for group in MODULES[module]
            for name, properties in group.functions.items()
        }

    def _function(self, module: str, name: str, message: str, generations: str, result: Any) -> Function:
        def call(*_arguments: Any) -> Any:
            self.log(name, message, module)
            return self._new_handle() if result is HANDLE else copy.deepcopy(result)

        call.__name__ = name
        return Module(module)(generations)(call)
