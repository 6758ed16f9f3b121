"""`sim` and its plugins: what is accepted and ignored, which the log says once for each function of a script.

A script that shows something to a person flies here as it does where somebody looks. docs/api.md lists every one of
these functions, with what it returns.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from drone_sim.scripting.api.calls import Api, Function
from drone_sim.scripting.script_log import LOG

HANDLE = object()  # a new handle of something that is not there


class Group(NamedTuple):
    """Functions, by name with what each returns, and why they do nothing."""

    why: str
    functions: Mapping[str, Any]


def _nothing(*names: str) -> dict[str, Any]:
    return dict.fromkeys(names)


_PARTICLES = Group(
    "particles are not simulated one by one",
    {"addParticleObject": HANDLE, **_nothing("addParticleObjectItem", "removeParticleObject")},
)
_VIEWS = Group(
    "there is no window of CoppeliaSim's; rviz and rosrun drone_sim view look",
    {
        "getNavigationMode": 0,
        "getPage": 0,
        "addBanner": HANDLE,
        **_nothing("cameraFitToView", "setNavigationMode", "setPage", "removeBanner", "refreshDialogs"),
        "announceSceneContentChange": 0,
    },
)
_COLORS = Group(
    "colours are those of the scene file and the URDF",
    {
        "getShapeColor": (0, [0.0, 0.0, 0.0]),
        "getObjectColor": (0, [0.0, 0.0, 0.0]),
        "getShapeTextureId": -1,
        **_nothing("setShapeColor", "setObjectColor", "setShapeTexture", "setLightParameters"),
    },
)
_GRAPHS = Group(
    "there are no graphs; rqt_plot and rosrun drone_sim fly draw them",
    {
        "addGraphStream": HANDLE,
        "addGraphDataStream": HANDLE,
        "addGraphCurve": HANDLE,
        **_nothing("setGraphStreamValue", "setGraphUserData", "setGraphStreamTransformation", "destroyGraphCurve"),
        **_nothing("handleGraph", "resetGraph"),
    },
)
_BUTTONS = Group(
    "there are no user interfaces of V-REP 3.x",
    {
        "getUIHandle": HANDLE,
        "createUI": HANDLE,
        "createUIButton": 0,
        "getUIEventButton": -1,
        "getUIButtonProperty": 0,
        "getUIProperty": 0,
        "getUISlider": 0,
        "getUIButtonLabel": "",
        "getUIPosition": [0, 0],
        **_nothing("setUIButtonLabel", "setUIButtonColor", "setUIButtonProperty", "setUIProperty", "setUISlider"),
        **_nothing("setUIPosition", "setUIButtonTexture", "removeUI"),
    },
)
_SELECTION = Group(
    "nobody selects anything here, and no key is pressed",
    {
        "getObjectSelection": [],
        "getObjectSel": [],
        "getObjectLastSelection": -1,
        "getSimulatorMessage": -1,
        **_nothing("addObjectToSelection", "removeObjectFromSelection", "setObjectSel"),
    },
)
_FLAGS = Group(
    "what an object is stands in the scene file",
    {
        "getObjectProperty": 0,
        "getObjectSpecialProperty": 0,
        "getModelProperty": 0,
        "getExplicitHandling": 0,
        **_nothing("setObjectProperty", "setObjectSpecialProperty", "setModelProperty", "setExplicitHandling"),
        **_nothing("setModelBase"),
    },
)
_ORDER = Group(
    "the simulation does this itself, in V-REP's order",
    {
        "handleChildScripts": 0,
        "handleChildScript": 0,
        "handleSensingChildScripts": 0,
        "handleDynamics": 0,
        "getRealTimeSimulation": 1,
        "isRealTimeSimulationStepNeeded": 1,
        **_nothing("adjustRealTimeTimer", "setThreadIsFree"),
        "getScriptAttribute": 0,
        **_nothing("setScriptAttribute", "registerScriptFunction", "auxFunc"),
        **_nothing("resumeThreads", "launchThreadedChildScripts", "setSimulationTimeStep"),
        **dict.fromkeys(("handleCustomizationScripts", "handleAddOnScripts", "handleSandboxScript"), 0),
        **dict.fromkeys(("openModule", "handleModule", "closeModule"), 0),
        **_nothing("handleSimulationStart", "handleSensingStart", "handleVarious", "handleJoint", "handlePath"),
        **_nothing("handleIkGroup", "handleMechanism", "handleCollision", "handleDistance", "handleMill"),
        **_nothing("resetCollision", "resetDistance", "resetMill", "resetMilling"),
    },
)
_RIGID = Group(
    "propellers are rigidly attached, and nothing breaks",
    {"breakForceSensor": None, "readForceSensor": 0},
)
_LINKS = Group(
    "dummies are not linked to each other: what hangs on a link does not hang here",
    {"setLinkDummy": None, "setDummyLinkType": None, "getLinkDummy": -1, "getDummyLinkType": 0},
)
_PICTURES = Group(
    "a picture is what the sensor sees; publish another one instead",
    _nothing("setVisionSensorCharImage", "setVisionSensorImage", "setVisionSensorImg", "resetVisionSensor"),
)
_SERVER = Group(
    "the legacy remote API is not served; remote_api:=true serves the ZeroMQ one",
    _nothing("extRemoteApiStart"),
)

SIM = (_PARTICLES, _VIEWS, _COLORS, _GRAPHS, _BUTTONS, _SELECTION, _FLAGS, _ORDER, _RIGID, _LINKS, _PICTURES, _SERVER)

_UI = Group(
    "there are no windows of scripts; rqt and rviz have what one needs",
    {
        "create": HANDLE,
        "getPosition": (0, 0),
        "getSize": (0, 0),
        "getSliderValue": 0,
        "getSpinboxValue": 0,
        "getCheckboxValue": 0,
        "getRadiobuttonValue": 0,
        "getComboboxSelectedIndex": 0,
        "getEditValue": "",
        "getCurrentTab": 0,
        "getCurrentEditWidget": "",
        "getTitle": "",
        "isVisible": False,
        "colorDialog": None,
        "fileDialog": [],
        "inputDialog": None,
        "msgBox": 0,
        **_nothing("destroy", "setPosition", "setSize", "setTitle", "setEnabled", "setWindowEnabled", "show", "hide"),
        **_nothing("setLabelText", "setButtonText", "setSliderValue", "setSpinboxValue", "setCheckboxValue"),
        **_nothing("setRadiobuttonValue", "setComboboxItems", "setComboboxSelectedIndex", "setEditValue"),
        **_nothing("setCurrentTab", "setCurrentEditWidget", "setImageData", "setWidgetVisibility", "setProgress"),
        **_nothing("setStyleSheet", "setText", "appendText", "adjustSize"),
        **_nothing("addCurve", "addCurveTimePoints", "addCurveXYPoints", "clearCurve", "removeCurve", "replot"),
        **_nothing(
            "setPlotRanges", "setPlotLabels", "rescaleAxes", "rescaleAxesAll", "setMouseOptions", "setLegendVisibility"
        ),
        **_nothing("setRowCount", "setColumnCount", "setItem", "setItemEditable", "clearTable"),
    },
)
MODULES = {
    "simUI": (_UI,),
    "simRemoteApi": (Group(_SERVER.why, {"start": None, "stop": None, "status": -1, "reset": None}),),
}


class Ignored:
    """The functions of one script that do nothing, and what says so."""

    def __init__(self, script: str, new_handle: Callable[[], int]):
        """Take the name of the object that the script is on, and what gives a handle that nothing else has."""
        self._script = script
        self._new_handle = new_handle
        self._said: set[tuple[str, str]] = set()

    def say(self, name: str, what: str) -> None:
        """Write to the log that something is ignored, once."""
        if (name, what) not in self._said:
            self._said.add((name, what))
            LOG.info("sim.%s: %s (in the script of %s)", name, what, self._script)

    def functions(self) -> dict[str, Function]:
        """Return every one of them in `sim`, by name."""
        return self._functions(SIM, "sim")

    def modules(self) -> dict[str, Api]:
        """Return the plugins that do nothing, by name."""
        return {name: Api(name, self._functions(groups, name), {}) for name, groups in MODULES.items()}

    def _functions(self, groups: tuple[Group, ...], module: str) -> dict[str, Function]:
        return {
            name: self._function(module, name, group.why, gives)
            for group in groups
            for name, gives in group.functions.items()
        }

    def _function(self, module: str, name: str, why: str, gives: Any) -> Function:
        def call(*_arguments: Any) -> Any:
            if (module, name) not in self._said:
                self._said.add((module, name))
                LOG.info("%s.%s: %s; accepted and ignored (in the script of %s)", module, name, why, self._script)
            return self._new_handle() if gives is HANDLE else copy.copy(gives)

        return call
