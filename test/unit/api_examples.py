"""Examples of every function of the script API: a call in Lua's syntax and its return values.

`NAME` stands for each of the function's names in turn. Tables become lists in Python; a call that needs another syntax
in Python has its own Python text. The return values are a list of zero, one or several values.
"""

import math
from typing import Any, NamedTuple

from pytest import approx

HALF, QUARTER = 2**0.5 / 2, math.pi / 2
TURNED = "{0,-1,0,1, 1,0,0,2, 0,0,1,3}"  # at (1, 2, 3), turned by 90 degrees about z
BACK = [0, 1, 0, -2, -1, 0, 0, 1, 0, 0, 1, -3]
POSE = f"{{1,2,3, 0,0,{HALF},{HALF}}}"
POSE_BACK = [-2, 1, -3, 0, 0, -HALF, HALF]
STRING = "'\\1\\0\\0\\0\\2\\0\\0\\0'"
NO_THREAD = "in sysCall_thread, sysCall_threadmain, or a coroutine"
NO_FUNCTION = "no function 'nothing' for this callback"
ANY = object()  # any value
STEP_STAYS = "`time_step` in the scene file sets it"
NO_SCENE_FILE = "a model must be in the folder of the scene file, but the simulation has no scene file"


class Example(NamedTuple):
    """A call, its return values, and the call in Python if it is not the translation of the call in Lua."""

    call: str
    returns: list[Any]
    python: str = ""


def near(*values: float) -> Any:
    """Return a list of numbers that is compared with a tolerance for rounding errors."""
    return approx(list(values), abs=1e-9)


ALONG_X = near(8e-6, 0, 0, 0, 9.04e-4, 0, 0, 0, 9.04e-4)  # kg m², of a drone without its propellers


# Intensity, red, green and blue of the two pixels (3, 4, 5) and (0, 1, 2).
DARKEST, LIGHTEST, MEAN = ([level / 255 for level in (g, g - 1, g, g + 1)] for g in (1, 4, 2.5))
STATISTICS = approx([*DARKEST, 0.25, *LIGHTEST, 0.75, *MEAN, 0.5])
BOX = [near(1, 1, 1), near(0.5, 0.5, 0.5, 0, 0, 0, 1)]


def _packed(count: int, size: int, name: str) -> list[Example]:
    """Return examples of the functions that pack and unpack numbers of `size` bytes each."""
    return [
        Example(f"sim.pack{name}({{1,2,3}}, 1, 1)", [ANY]),
        Example(f"sim.unpack{name}(sim.pack{name}({{1,2,3}}))", [[1, 2, 3]]),
        Example(f"sim.unpack{name}(sim.pack{name}({{1,2,3}}), 1, {count}, {size})", [[3]]),
    ]


SIM: dict[str, list[Example]] = {
    # ---- names and the tree
    "getObject": [Example("NAME('/Quadcopter/base') == BASE", [True]), Example("NAME('/nothing', NOERROR)", [-1])],
    "getObjectHandle": [
        Example("NAME('Quadricopter_base') == BASE", [True]),
        Example("NAME(sim.handle_self) == DRONE", [True]),
        Example("NAME('nothing@silentError')", [-1]),
    ],
    "getObjectName": [Example("NAME(BASE)", ["Quadricopter_base"])],
    "getObjectAlias": [
        Example("NAME(BASE)", ["base"]),
        Example("NAME(BASE, 0)", ["base[0]"]),
        Example("NAME(BASE, 1)", ["/Quadcopter/base"]),
    ],
    "getNameSuffix": [Example("NAME('Drone#2')", [2, "Drone"])],
    "setNameSuffix": [Example("NAME(-1)", [])],
    "getObjectParent": [Example("NAME(BASE) == DRONE", [True]), Example("NAME(DRONE)", [-1])],
    "setObjectParent": [Example("NAME(TARGET, -1, true)", []), Example("sim.getObjectParent(TARGET)", [-1])],
    "getObjectChild": [Example("NAME(DRONE, 0) == BASE", [True]), Example("NAME(JOINT, 0)", [-1])],
    "getObjectType": [Example("NAME(DRONE) == sim.object_shape_type", [True]), Example("NAME(CAMERA)", [9])],
    "getObjects": [Example("NAME(0, sim.handle_all)", [0]), Example("NAME(1000)", [-1])],
    "getObjectsInTree": [
        Example("NAME(BASE) [FIRST] == BASE", [True]),
        Example("NAME(JOINT, sim.handle_all, 1)", [[]]),
    ],
    "isHandle": [Example("NAME(BASE)", [True]), Example("NAME(1000)", [False])],
    "isHandleValid": [Example("NAME(BASE)", [1]), Example("NAME(1000)", [0])],
    "setLinkDummy": [
        Example("NAME(sim.createDummy(0.01), sim.createDummy(0.01))", []),
        Example("REFUSED(NAME, BASE, -1)", ["only objects of the scene can be changed"]),
    ],
    "getLinkDummy": [Example("NAME(sim.createDummy(0.01))", [-1])],
    "createDummy": [Example("sim.getObjectType(NAME(0.01)) == sim.object_dummy_type", [True])],
    "removeObject": [
        Example("NAME(sim.createDummy(0.01))", [1]),
        Example("REFUSED(NAME, BASE)", ["only objects of the scene can be changed"]),
    ],
    "removeObjects": [Example("NAME({sim.createDummy(0.01, {1, 0, 0}), sim.createDummy(0.02)})", [1])],
    "removeModel": [
        Example("NAME(sim.createDummy(0.01))", [1]),
        Example("REFUSED(NAME, BASE)", ["only objects of the scene can be changed"]),
    ],
    "checkDistance": [
        Example("NAME(FLOOR, DRONE, 0.5)", [0, near(0, 0, 0, 0, 0, 0, 0), [-1, -1]]),
        Example("REFUSED(NAME, DRONE, BASE)", ["'Drone' and 'Quadricopter_base' are parts of one rigid body"]),
    ],
    "checkCollision": [Example("NAME(DRONE, sim.handle_all)", [0, [-1, -1]])],
    # ---- collections
    "createCollection": [Example("NAME(0) >= 700000", [True])],
    "addItemToCollection": [Example("NAME(sim.createCollection(0), sim.handle_tree, DRONE, 0)", [])],
    "addObjectToCollection": [Example("NAME(sim.createCollection(0), DRONE, sim.handle_single, 0)", [1])],
    "getCollectionHandle": [Example("NAME('nothing@silentError')", [-1])],
    "getCollectionName": [Example("NAME(sim.createCollection(0))", [""])],
    "getCollectionObjects": [Example("NAME(sim.createCollection(0))", [[]])],
    "emptyCollection": [Example("NAME(sim.createCollection(0))", [])],
    "destroyCollection": [Example("NAME(sim.createCollection(0))", [])],
    "getObjectUid": [Example("NAME(BASE) == BASE", [True])],
    # ---- poses of objects
    "setObjectPosition": [Example("NAME(TARGET, -1, {1,2,3})", []), Example("NAME(TARGET, {4,5,6}, -1)", [])],
    "getObjectPosition": [Example("NAME(TARGET, -1)", [near(4, 5, 6)])],
    "setObjectOrientation": [Example("NAME(TARGET, -1, {0,0,0.5})", [])],
    "getObjectOrientation": [Example("NAME(TARGET, -1)", [near(0, 0, 0.5)])],
    "setObjectQuaternion": [Example("NAME(TARGET, -1, {0,0,0,1})", [])],
    "getObjectQuaternion": [Example("NAME(TARGET, -1)", [near(0, 0, 0, 1)])],
    "setObjectPose": [Example(f"NAME(TARGET, {POSE}, -1)", [])],
    "getObjectPose": [Example("NAME(TARGET)", [near(1, 2, 3, 0, 0, HALF, HALF)])],
    "setObjectMatrix": [Example(f"NAME(TARGET, -1, {TURNED})", [])],
    "getObjectMatrix": [Example("NAME(TARGET, -1)", [near(0, -1, 0, 1, 1, 0, 0, 2, 0, 0, 1, 3)])],
    "getObjectSizeFactor": [Example("NAME(BASE)", [1])],
    "getObjectSizeValues": [Example("NAME(BASE)", [[1, 1, 1]])],
    # ---- velocities and forces
    "getObjectVelocity": [Example("NAME(DRONE + sim.handleflag_axis)", [near(0, 0, 0), near(0, 0, 0)])],
    "getVelocity": [Example("NAME(DRONE)", [near(0, 0, 0), near(0, 0, 0)])],
    "addForce": [Example("NAME(DRONE, {0,0,0}, {0,0,0})", [])],
    "addForceAndTorque": [Example("NAME(DRONE, {0,0,0}, {0,0,0})", [])],
    "setJointPosition": [Example("NAME(JOINT, 0.5)", [])],
    "getJointPosition": [Example("NAME(JOINT)", [0.5])],
    # ---- joints and paths of the scene
    "getJointType": [Example("NAME(HINGE) == sim.joint_revolute_subtype", [True])],
    "setJointMode": [Example("NAME(HINGE, sim.jointmode_kinematic)", [])],
    "getJointMode": [Example("NAME(HINGE)", [0, 0])],
    "setJointInterval": [Example("NAME(HINGE, false, {-1, 3})", [])],
    "getJointInterval": [Example("NAME(HINGE)", [False, [-1, 3]])],
    "setJointTargetPosition": [Example("NAME(HINGE, 0.5)", []), Example("NAME(JOINT, 1)", [])],
    "getJointTargetPosition": [Example("NAME(HINGE)", [0.5])],
    "setJointTargetVelocity": [Example("NAME(HINGE, 0.1)", []), Example("NAME(JOINT, 300)", [])],
    "getJointTargetVelocity": [Example("NAME(HINGE)", [0.1])],
    "setJointTargetForce": [Example("NAME(HINGE, 2)", []), Example("NAME(JOINT, 1)", [])],
    "getJointTargetForce": [Example("NAME(HINGE)", [2])],
    "setJointForce": [Example("NAME(HINGE, 5)", [])],
    "getJointMaxForce": [Example("NAME(HINGE)", [5])],
    "getJointForce": [Example("NAME(HINGE)", [0])],
    "getJointVelocity": [Example("NAME(HINGE)", [0])],
    "setSphericalJointMatrix": [Example(f"NAME(BALL, {TURNED})", [])],
    "getObjectChildPose": [
        Example("NAME(BALL)", [near(0, 0, 0, 0, 0, HALF, HALF)]),
        Example("NAME(LINE)", [near(0, 0, 0, 0, 0, 0, 1)]),
    ],
    "getJointMatrix": [Example("NAME(BALL)", [near(0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0)])],
    "getPathLength": [Example("NAME(LINE)", [2])],
    "getPositionOnPath": [Example("NAME(LINE, 0.25)", [near(0.5, 0, 0)])],
    "getOrientationOnPath": [Example("NAME(LINE, 0.25)", [near(0, 0, 0)])],
    "setPathPosition": [Example("NAME(LINE, 1.5)", [])],
    "getPathPosition": [Example("NAME(LINE)", [1.5])],
    "getPathLengths": [Example("NAME({0,0,0, 3,4,0}, 3)", [[0, 5], 5])],
    "getPathInterpolatedConfig": [Example("NAME({0,0,0, 3,4,0}, {0,5}, 2.5)", [near(1.5, 2, 0)])],
    "getClosestPosOnPath": [Example("NAME({0,0,0, 3,4,0}, {0,5}, {9,9,9})", [5])],
    "resamplePath": [Example("NAME({0,0,0, 3,4,0}, {0,5}, 3)", [near(0, 0, 0, 1.5, 2, 0, 3, 4, 0)])],
    "getDataOnPath": [Example("NAME(LINE, 0.25)", [0, [0, 0, 0, 0]])],
    "getClosestPositionOnPath": [Example("NAME(LINE, {0.5,3,0})", [approx(0.25)])],
    "createPath": [
        Example("sim.getPathLength(NAME({0,0,0,0,0,0,1, 3,4,0,0,0,0,1}))", [approx(5)]),
        Example("sim.getPathLength(NAME(-1))", [0]),
    ],
    "insertPathCtrlPoints": [Example("NAME(sim.createPath(-1), 0, 0, 1, {1,2,3,0,0,0,1,0,15,0.5,0.5})", [1])],
    "cutPathCtrlPoints": [Example("NAME(sim.createPath(-1), -1, 0)", [1])],
    "resetDynamicObject": [Example("NAME(BASE)", [])],
    "isDynamicallyEnabled": [Example("NAME(BASE)", [True]), Example("NAME(FLOOR)", [False])],
    "getShapeMass": [Example("NAME(DRONE)", [approx(0.12)]), Example("NAME(FLOOR)", [0])],
    "getShapeMassAndInertia": [
        Example("NAME(FLOOR, {1,0,0,5, 0,1,0,0, 0,0,1,0})", [0, [0.0] * 9, near(-5, 0, 0)]),
        Example("NAME(DRONE, sim.getObjectMatrix(DRONE))", [approx(0.12), ALONG_X, near(0, 0, 0)]),
    ],
    "getShapeInertia": [Example("NAME(DRONE)", [ALONG_X, [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]])],
    "getObjectInt32Param": [Example("NAME(DRONE, sim.shapeintparam_static)", [0])],
    "getObjectInt32Parameter": [Example("NAME(DRONE, sim.shapeintparam_static)", [1, 0])],
    "setObjectInt32Param": [Example("NAME(DRONE, sim.shapeintparam_respondable, 1)", [1])],
    "getObjectFloatParam": [Example("NAME(DRONE, sim.shapefloatparam_mass)", [approx(0.12)])],
    "getObjectFloatParameter": [
        Example("NAME(DRONE, sim.shapefloatparam_mass)", [1, approx(0.12)]),
        Example("NAME(sim.createPureShape(0, 8, {1,2,3}, 1), sim.objfloatparam_objbbox_min_z)", [1, approx(-1.5)]),
        Example("NAME(DRONE, sim.jointfloatparam_screw_pitch)", [0, 0.0]),
    ],
    "setObjectFloatParam": [Example("NAME(DRONE, sim.shapefloatparam_mass, 2)", [1])],
    # ---- matrices and poses
    "multiplyVector": [
        Example(f"NAME({TURNED}, {{1,0,0}})", [near(1, 3, 3)]),
        Example(f"NAME({TURNED}, {{1,0,0, 0,1,0}})", [near(1, 3, 3, 0, 2, 3)]),
        Example(f"NAME({POSE}, {{1,0,0, 0,1,0}})", [near(1, 3, 3, 0, 2, 3)]),
        Example(f"NAME({{0,0,{HALF},{HALF}}}, {{1,0,0}})", [near(0, 1, 0)]),
    ],
    "multiplyMatrices": [Example(f"NAME({TURNED}, sim.getMatrixInverse({TURNED}))", [ANY])],
    "buildIdentityMatrix": [Example("NAME()", [[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]])],
    "copyMatrix": [Example(f"NAME({TURNED})", [[0, -1, 0, 1, 1, 0, 0, 2, 0, 0, 1, 3]])],
    "buildMatrix": [Example("NAME({1,2,3}, {0,0,0})", [[1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3]])],
    "buildMatrixQ": [Example("NAME({1,2,3}, {0,0,0,2})", [[1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3]])],
    "getEulerAnglesFromMatrix": [Example(f"NAME({TURNED})", [near(0, 0, QUARTER)])],
    "getQuaternionFromMatrix": [Example(f"NAME({TURNED})", [near(0, 0, HALF, HALF)])],
    "getMatrixInverse": [Example(f"NAME({TURNED})", [near(*BACK)])],
    "invertMatrix": [Example(f"NAME({TURNED})", [near(*BACK)]), Example("INVERTED()", [near(*BACK)])],
    "interpolateMatrices": [
        Example(
            f"sim.getEulerAnglesFromMatrix(NAME(sim.buildIdentityMatrix(), {TURNED}, 0.5))",
            [near(0, 0, 0.7853981633974483)],
        )
    ],
    "getRotationAxis": [
        Example(f"NAME(sim.buildIdentityMatrix(), {TURNED})", [near(0, 0, 1), approx(1.5707963267948966)])
    ],
    "rotateAroundAxis": [
        Example(
            "NAME({1,0,0,2, 0,1,0,0, 0,0,1,0}, {0,0,2}, {1,0,0}, 1.5707963267948966)",
            [near(0, -1, 0, 1, 1, 0, 0, 1, 0, 0, 1, 0)],
        ),
        Example("NAME({2,0,0, 0,0,0,1}, {0,0,2}, {1,0,0}, 1.5707963267948966)", [near(1, 1, 0, 0, 0, HALF, HALF)]),
    ],
    "alphaBetaGammaToYawPitchRoll": [Example("NAME(0.1, 0, 0)", [approx(0), approx(0), approx(0.1)])],
    "yawPitchRollToAlphaBetaGamma": [Example("NAME(0.3, 0, 0)", [approx(0), approx(0), approx(0.3)])],
    "buildPose": [Example("NAME({1,2,3}, {0,0,0})", [near(1, 2, 3, 0, 0, 0, 1)])],
    "multiplyPoses": [Example(f"NAME({POSE}, {{1,0,0, 0,0,0,1}})", [near(1, 3, 3, 0, 0, HALF, HALF)])],
    "invertPose": [Example(f"NAME({POSE})", [near(*POSE_BACK)])],
    "interpolatePoses": [Example("NAME({0,0,0,0,0,0,1}, {2,4,6,0,0,0,1}, 0.5)", [near(1, 2, 3, 0, 0, 0, 1)])],
    "poseToMatrix": [Example(f"NAME({POSE})", [near(0, -1, 0, 1, 1, 0, 0, 2, 0, 0, 1, 3)])],
    "matrixToPose": [Example(f"NAME({TURNED})", [near(1, 2, 3, 0, 0, HALF, HALF)])],
    # ---- numbers and strings
    "boolOr32": [Example("NAME(5, 3)", [7])],
    "boolAnd32": [Example("NAME(5, 3)", [1])],
    "boolXor32": [Example("NAME(5, 3)", [6])],
    "packFloatTable": _packed(1, 4, "FloatTable"),
    "packDoubleTable": _packed(1, 8, "DoubleTable"),
    "packInt32Table": [*_packed(1, 4, "Int32Table"), Example("#NAME({1,2})", [8], "len(NAME([1,2]))")],
    "packUInt32Table": _packed(1, 4, "UInt32Table"),
    "packUInt16Table": _packed(1, 2, "UInt16Table"),
    "packUInt8Table": [*_packed(1, 1, "UInt8Table"), Example("NAME({65,66})", ["AB"])],
    "unpackFloatTable": [Example("NAME(sim.packFloatTable({0.5}))", [[0.5]])],
    "unpackDoubleTable": [Example("NAME(sim.packDoubleTable({0.1}))", [[0.1]])],
    "unpackInt32Table": [Example(f"NAME({STRING})", [[1, 2]])],
    "unpackUInt32Table": [Example(f"NAME({STRING})", [[1, 2]])],
    "unpackUInt16Table": [Example(f"NAME({STRING})", [[1, 0, 2, 0]])],
    "unpackUInt8Table": [Example("NAME('AB')", [[65, 66]])],
    "packTable": [Example("sim.unpackTable(NAME({1,{2,'x'},true}))", [[1, [2, "x"], True]])],
    "unpackTable": [Example("NAME(sim.packTable({1.5}))", [[1.5]])],
    "copyTable": [Example("NAME({1,{2,3}})", [[1, [2, 3]]]), Example("NAME('x')", ["x"])],
    "transformBuffer": [
        Example("sim.unpackFloatTable(NAME('AB', sim.buffer_uint8, 2, 1, sim.buffer_float))", [[131, 133]])
    ],
    "addLog": [Example("NAME(sim.verbosity_scriptinfos, 'a line')", [])],
    "addStatusbarMessage": [Example("NAME('a line')", [])],
    "getScriptHandle": [Example("NAME('Drone') == NAME()", [True])],
    "getObjectAssociatedWithScript": [Example("NAME(sim.handle_self) == DRONE", [True])],
    "setScriptSimulationParameter": [Example("NAME(sim.handle_self, 'gain', '0.5')", [])],
    "getScriptSimulationParameter": [Example("NAME(sim.handle_self, 'gain')", [0.5])],
    "setUserParameter": [Example("NAME(DRONE, 'gain', 0.25)", [])],
    "getUserParameter": [Example("NAME(DRONE, 'gain')", [0.25])],
    "getScript": [Example("NAME(1, DRONE) == sim.getScriptHandle()", [True]), Example("NAME(1, FLOOR)", [-1])],
    "getScriptAssociatedWithObject": [Example("NAME(DRONE) == sim.getScriptHandle()", [True])],
    "getCustomizationScriptAssociatedWithObject": [Example("NAME(DRONE)", [-1])],
    "getScriptName": [Example("NAME(sim.handle_self)", ["Drone"])],
    "getScriptExecutionCount": [Example("NAME()", [0])],
    "callScriptFunction": [Example("REFUSED(NAME, 'nothing', sim.handle_self)", [NO_FUNCTION])],
    "executeScriptString": [Example("NAME('1 + 1', sim.handle_self)", [0, 2])],
    "getScriptFunctions": [Example("NAME(sim.handle_self) ~= nil", [True], "NAME(sim.handle_self) is not None")],
    # ---- threads, in a script without a thread
    "switchThread": [Example("REFUSED(NAME)", [NO_THREAD])],
    "step": [Example("REFUSED(NAME)", [NO_THREAD])],
    "wait": [Example("NAME(0)", [0]), Example("REFUSED(NAME, 1)", [NO_THREAD])],
    "waitForSignal": [Example("NAME('there')", [1])],
    "setThreadSwitchTiming": [Example("NAME(2)", [])],
    "setThreadAutomaticSwitch": [Example("NAME(true)", [0])],
    "getThreadAutomaticSwitch": [Example("NAME()", [True])],
    "setStepping": [Example("NAME(false)", [0])],
    "acquireLock": [Example("NAME()", []), Example("sim.getAutoYield()", [False])],
    "releaseLock": [Example("NAME()", []), Example("sim.getAutoYield()", [True])],
    "getThreadId": [Example("NAME()", [1])],
    "getThreadExitRequest": [Example("NAME()", [False])],
    "setThreadResumeLocation": [Example("NAME(0, 0)", [1])],
    "delegateChildScriptExecution": [Example("NAME()", [1])],
    # ---- motions, which wait for steps, and trajectories, which do not
    "moveToConfig": [Example("REFUSED(NAME, {pos={0}, targetPos={1}})", [NO_THREAD], "REFUSED(NAME, PARAMETERS)")],
    "moveToPose": [
        Example("REFUSED(NAME, {pos={0}})", ["`object` or `pose` must be given"], "REFUSED(NAME, PARAMETERS)")
    ],
    "moveToConfig_init": [Example("NAME({pos={0}, targetPos={1}}).timeLeft", [0], "NAME(PARAMETERS)['timeLeft']")],
    "moveToPose_init": [
        Example("REFUSED(NAME, {pos={0}})", ["`object` or `pose` must be given"], "REFUSED(NAME, PARAMETERS)")
    ],
    "moveToConfig_step": [
        Example(
            "NAME(sim.moveToConfig_init({pos={0}, targetPos={1}}))", [1, ANY], "NAME(sim.moveToConfig_init(PARAMETERS))"
        )
    ],
    "moveToConfig_cleanup": [
        Example("NAME(sim.moveToConfig_init({pos={0}, targetPos={1}}))", [], "NAME(sim.moveToConfig_init(PARAMETERS))")
    ],
    "rmlMoveToJointPositions": [Example("REFUSED(NAME, {HINGE}, -1, {0}, {0}, {1}, {1}, {1}, {0.1})", [NO_THREAD])],
    "rmlMoveToPosition": [
        Example(
            "REFUSED(NAME, TARGET, -1, -1, {0,0,0,0}, {0,0,0,0}, {1,1,1,1}, {1,1,1,1}, {1,1,1,1}, {0,0,1}, {0,0,0,1})",
            [NO_THREAD],
        )
    ],
    "moveToPosition": [Example("REFUSED(NAME, TARGET, -1, {0,0,1}, {0,0,0}, 1)", [NO_THREAD])],
    "moveToObject": [Example("REFUSED(NAME, TARGET, DRONE, 3, 0, 1)", [NO_THREAD])],
    "followPath": [Example("REFUSED(NAME, TARGET, LINE, 3, 0, 1)", [NO_THREAD])],
    "moveToJointPositions": [Example("REFUSED(NAME, {HINGE}, {1}, 1)", [NO_THREAD])],
    "ruckigPos": [Example("NAME(1, 0.001, -1, {0,0,0}, {1,2,10}, {1}, {1,0})", [ANY])],
    "ruckigVel": [Example("NAME(1, 0.001, -1, {0,1,0}, {2,10}, {1}, {3})", [ANY])],
    "ruckigStep": [Example("NAME(sim.ruckigPos(1, 0.001, -1, {0,0,0}, {1,2,10}, {1}, {1,0}), 2)", [1, [1, 0, 0], ANY])],
    "ruckigRemove": [Example("NAME(sim.ruckigPos(1, 0.001, -1, {0,0,0}, {1,2,10}, {1}, {1,0}))", [])],
    # ---- the simulation
    "getSimulationState": [Example("NAME() == sim.simulation_advancing_firstafterstop", [True])],
    "stopSimulation": [Example("NAME()", [1])],
    "getSimulationStopping": [Example("NAME()", [True])],
    "pauseSimulation": [Example("NAME()", [1])],
    "startSimulation": [Example("NAME()", [1]), Example("sim.getSimulationStopping()", [False])],
    "getSimulationTime": [Example("NAME()", [0])],
    "getSimulationTimeStep": [Example("NAME()", [0.05])],
    "getSystemTime": [Example("NAME()", [0])],
    "getSystemTimeInMs": [Example("NAME()", [0]), Example("NAME(-1)", [0])],
    "getModuleName": [Example("NAME(0)", ["RosInterface", 1])],
    "getRandom": [Example("NAME(3) == NAME(3)", [True])],
    "getInt32Param": [Example("NAME(sim.intparam_program_version)", [40600])],
    "setInt32Param": [Example("NAME(sim.intparam_visible_layers, 1)", [])],
    "getFloatParam": [Example("NAME(sim.floatparam_simulation_time_step)", [0.05])],
    "setFloatParam": [
        Example("NAME(sim.floatparam_simulation_time_step, 0.05)", []),
        Example("NAME(sim.floatparam_stereo_distance, 1)", []),
        Example("REFUSED(NAME, sim.floatparam_simulation_time_step, 0.01)", [STEP_STAYS]),
    ],
    "setSimulationTimeStep": [Example("NAME(0.05)", []), Example("REFUSED(NAME, 0.01)", [STEP_STAYS])],
    "getBoolParam": [Example("NAME(sim.boolparam_dynamics_handling_enabled)", [True])],
    "setBoolParam": [Example("NAME(sim.boolparam_display_enabled, false)", [])],
    "getStringParam": [Example("NAME(sim.stringparam_scene_path)", [""])],
    "setStringParam": [Example("NAME(sim.stringparam_video_filename, 'x')", [])],
    "getArrayParam": [Example("NAME(sim.arrayparam_gravity)", [[0, 0, -9.81]])],
    "setArrayParam": [Example("NAME(sim.arrayparam_gravity, {0,0,0})", [])],
    "addGraphStream": [Example("NAME(BASE, 'height', 'm') == NAME(BASE, 'height')", [True])],
    "setGraphStreamValue": [Example("NAME(BASE, sim.addGraphStream(BASE, 's'), 1.5)", [])],
    "setGraphUserData": [Example("NAME(BASE, 's', 1.5)", [])],
    "destroyGraphCurve": [Example("NAME(BASE, sim.addGraphStream(BASE, 's'))", [])],
    "resetGraph": [Example("NAME(BASE)", [])],
    "setFloatSignal": [Example("NAME('f', 1.5)", [])],
    "getFloatSignal": [Example("NAME('f')", [1.5])],
    "clearFloatSignal": [Example("NAME('f')", []), Example("sim.getFloatSignal('f')", [])],
    "setInt32Signal": [Example("NAME('i', 2)", [])],
    "getInt32Signal": [Example("NAME('i')", [2])],
    "clearInt32Signal": [Example("NAME('i')", []), Example("sim.getInt32Signal('i')", [])],
    "setStringSignal": [Example("NAME('n', 2.5)", []), Example("NAME('s', 'text')", [])],
    "getStringSignal": [Example("NAME('n')", ["2.5"]), Example("NAME('s')", ["text"])],
    "clearStringSignal": [Example("NAME('s')", []), Example("sim.getStringSignal('s')", [])],
    "extRemoteApiStart": [Example("NAME(19999)", [-1])],  # no server runs here
    "extRemoteApiStop": [Example("NAME(19999)", [-1])],
    "extRemoteApiReset": [Example("NAME(19999)", [-1])],
    "extRemoteApiStatus": [Example("NAME(19999)", [-1])],
    "tubeOpen": [Example("NAME(0, 'a', 1)", [1]), Example("NAME(0, 'a', 1)", [2])],
    "tubeWrite": [Example("NAME(1, 'x')", [1]), Example("NAME(1, 'y')", [1])],
    "tubeStatus": [Example("NAME(1)", [1, 0, 1])],
    "tubeRead": [Example("NAME(2)", ["y"]), Example("NAME(2)", [])],
    "tubeClose": [Example("NAME(2)", []), Example("sim.tubeStatus(1)", [0, 0, 0])],
    "sendData": [
        Example("NAME(sim.handle_all, 0, 'a', 'x')", [1]),
        Example("NAME(sim.handle_tree, 0, 'a', 'x', TARGET, 5, 1, 2, 10)", [1]),
    ],
    "receiveData": [Example("NAME(0, 'a')", [])],
    "writeCustomDataBlock": [
        Example("NAME(DRONE, 'tag', 0.5)", []),
        Example("sim.readCustomDataBlock(DRONE, 'tag')", ["0.5"]),
        Example("NAME(DRONE, 'tag', 'text')", []),
    ],
    "readCustomDataBlock": [Example("NAME(DRONE, 'tag')", ["text"]), Example("NAME(BASE, 'tag')", [])],
    "readCustomDataBlockTags": [Example("NAME(DRONE)", [["tag"]])],
    "writeCustomTableData": [Example("NAME(BASE, 'table', {1,2})", [])],
    "readCustomTableData": [Example("NAME(BASE, 'table')", [[1, 2]])],
    "persistentDataWrite": [Example("NAME('tag', 'text')", [])],
    "persistentDataRead": [Example("NAME('tag')", ["text"])],
    "getPersistentDataTags": [Example("NAME()", [["tag"]])],
    "setProperty": [Example("NAME(DRONE, 'customData.x', 3)", [])],
    "getProperty": [Example("NAME(DRONE, 'customData.x')", [3]), Example("NAME(DRONE, 'signal.y', NOERROR)", [])],
    "removeProperty": [Example("NAME(DRONE, 'customData.x')", [])],
    # ---- drawings, dialogs and sensors
    "addDrawingObject": [Example("NAME(sim.drawing_spherepts, 0.1, 0, BASE, 10) > 0", [True])],
    "addDrawingObjectItem": [Example("NAME(DRAWN, {1,2,3})", [])],
    "removeDrawingObject": [Example("NAME(DRAWN)", [])],
    "displayDialog": [Example("NAME('title', 'text', sim.dlgstyle_ok, false) > 0", [True])],
    "getDialogResult": [Example("NAME(1) == sim.dlgret_ok", [True])],
    "getDialogInput": [Example("NAME(1)", [""])],
    "auxiliaryConsoleOpen": [Example("NAME('title', 10, 0) > 0", [True])],
    "auxiliaryConsolePrint": [Example("NAME(1, 'a line')", [1])],
    "auxiliaryConsoleShow": [Example("NAME(sim.auxiliaryConsoleOpen('title', 10, 0), false)", [1])],
    "auxiliaryConsoleClose": [Example("NAME(sim.auxiliaryConsoleOpen('title', 10, 0))", [1])],
    "endDialog": [Example("NAME(sim.displayDialog('title', 'text'))", [1]), Example("NAME(-1)", [0])],
    "floatingViewAdd": [Example("NAME(0.9, 0.9, 0.2, 0.2, 0) > 0", [True])],
    "adjustView": [Example("NAME(sim.floatingViewAdd(0.9, 0.9, 0.2, 0.2, 0), CAMERA, 64)", [1])],
    "floatingViewRemove": [Example("NAME(sim.floatingViewAdd(0.9, 0.9, 0.2, 0.2, 0))", [1])],
    "getVisionSensorCharImage": [
        Example("NAME(CAMERA)", ["\0\1\2\3\4\5", 1, 2]),
        Example("NAME(CAMERA + sim.handleflag_greyscale, 0, 1, 1, 1)", ["\3", 1, 1]),
    ],
    "getVisionSensorImg": [
        Example("NAME(CAMERA)", ["\0\1\2\3\4\5", [1, 2]]),
        Example("NAME(CAMERA, 1)", ["\0\3", [1, 2]]),
    ],
    "getVisionSensorImage": [Example("NAME(CAMERA, 0, 0, 1, 1)", [approx([0, 1 / 255, 2 / 255])])],
    "getVisionSensorDepth": [Example("NAME(DEPTH, 1)", [ANY, [2, 1]])],
    "getVisionSensorDepthBuffer": [
        Example("NAME(DEPTH + sim.handleflag_depthbuffermeters)", [[2, 4]]),
        Example("NAME(DEPTH)", [near(0.25, 0.75)]),
    ],
    "getVisionSensorResolution": [Example("NAME(CAMERA)", [[1, 2]])],
    "handleVisionSensor": [
        Example("NAME(DEPTH)", [0, STATISTICS], "NAME(DEPTH)[:2]"),
        Example("NAME(sim.handle_all)", [0], "NAME(sim.handle_all)[0]"),
    ],
    "readVisionSensor": [Example("NAME(DEPTH)", [0, STATISTICS], "NAME(DEPTH)[:2]")],
    "checkVisionSensor": [Example("NAME(DEPTH, FLOOR)", [1, STATISTICS], "NAME(DEPTH, FLOOR)[:2]")],
    "checkVisionSensorEx": [Example("NAME(DEPTH, FLOOR, false)", [near(0.25, 0.75)])],
    "readProximitySensor": [Example("NAME(RANGE)", [-1, 0, [0, 0, 0], -1, [0, 0, 0]])],
    "handleProximitySensor": [Example("NAME(FEELER)", [0, 0, [0, 0, 0], -1, [0, 0, 0]])],
    "checkProximitySensor": [Example("NAME(FEELER, FLOOR)", [0, 0, [0, 0, 0], -1, [0, 0, 0]])],
    "checkProximitySensorEx": [Example("NAME(FEELER, FLOOR, 0, 1, 0)", [0, 0, [0, 0, 0], -1, [0, 0, 0]])],
    "resetProximitySensor": [Example("NAME(FEELER)", [])],
    "readForceSensor": [Example("NAME(GAUGE)", [1, [0, 0, 0], [0, 0, 0]])],
    "readSensor": [Example("NAME(RANGE)", [])],
    # ---- created objects; last, since they stand at the origin
    "createPureShape": [Example("sim.getShapeMass(NAME(0, 8, {0.1,0.1,0.1}, 2))", [2])],
    "createPrimitiveShape": [Example("sim.getShapeMass(NAME(sim.primitiveshape_cuboid, {1,1,1}))", [approx(1000)])],
    "createMeshShape": [
        Example("sim.getShapeBB(NAME(0, 0, {0,0,0, 1,0,0, 0,1,0, 0,0,1}, {0,2,1, 0,1,3, 0,3,2, 1,2,3}))", BOX)
    ],
    "createJoint": [Example("sim.getJointType(NAME(11, 0, 0)) == sim.joint_prismatic_subtype", [True])],
    "createForceSensor": [Example("sim.getObjectType(NAME(0, {0,0,0,0,0}, {0,0,0,0,0}))", [12])],
    "createProximitySensor": [
        Example("sim.getObjectType(NAME(34, 16, 0, {0,0,0,0,0,0,0,0}, {0,2,0,0,0,0,0,0,0,0,0,0,0,0,0}))", [5])
    ],
    "createVisionSensor": [Example("sim.getObjectType(NAME(2, {16,16,0,0}, {0.1,10,1,0,0,0,0,0,0,0,0}))", [9])],
    "copyPasteObjects": [Example("sim.getObjectType(NAME({HINGE}, 0) [FIRST])", [1])],
    "setObjectName": [Example("NAME(HINGE, 'Hinge')", [1])],
    "setObjectAlias": [Example("NAME(HINGE, 'Hinge')", [])],
    "loadModel": [Example("REFUSED(NAME, 'none.yaml')", [NO_SCENE_FILE])],
    "saveModel": [Example("REFUSED(NAME, HINGE, 'none.yaml')", [NO_SCENE_FILE])],
    "setShapeColor": [Example("NAME(sim.createPureShape(0, 0, {1,1,1}, 0), '', 0, {1,0,0})", [1])],
    "getShapeColor": [Example("NAME(sim.createPureShape(0, 0, {1,1,1}, 0), '', 0)", [1, near(0.7, 0.7, 0.7)])],
    "setShapeMassAndInertia": [
        Example("NAME(sim.createPureShape(0, 0, {1,1,1}, 1), 2, {1,0,0, 0,2,0, 0,0,3}, {0,0,0.1})", [1])
    ],
    "setShapeInertia": [
        Example("NAME(sim.createPureShape(0, 0, {1,1,1}, 1), {1,0,0, 0,2,0, 0,0,3}, {1,0,0,0, 0,1,0,0, 0,0,1,0})", [1])
    ],
    "getShapeGeomInfo": [
        Example("NAME(sim.createPureShape(2, 0, {0.2,0.2,3}, 1))", [6, 5, near(0.2, 0.2, 3, 0)]),
        Example("NAME(DRONE)", [0, 0, near(0, 0, 0, 0)]),
    ],
    "setShapeMass": [Example("NAME(sim.createPureShape(0, 0, {1,1,1}, 1), 2)", [])],
    "getShapeBB": [Example("NAME(sim.createPureShape(0, 0, {1,2,3}, 1))", [near(1, 2, 3), near(0, 0, 0, 0, 0, 0, 1)])],
    "setShapeBB": [Example("NAME(sim.createPureShape(0, 0, {1,1,1}, 1), {1,2,3})", [1])],
    "scaleObject": [Example("NAME(sim.createPureShape(0, 0, {1,1,1}, 1), 1, 2, 3)", [])],
    "scaleObjects": [Example("NAME({HINGE}, 1, false)", [])],
    "groupShapes": [
        Example(
            "sim.getShapeMass(NAME({sim.createPureShape(0, 0, {1,1,1}, 1), sim.createPureShape(0, 0, {1,1,1}, 1)}))",
            [2],
        )
    ],
    "ungroupShape": [Example("REFUSED(NAME, FLOOR)", ["only objects of the scene can be changed"])],
}

REMOTE_API = {name: [Example("NAME(19999)", [-1])] for name in ("start", "stop", "reset", "status")}  # no server

# TASK has SPACE, from (0, 0) to (1, 0) with RRTConnect.
_STRAIGHT = near(0, 0, 0.5, 0, 1, 0)
OMPL = {
    "createTask": [Example("NAME('t')", [ANY])],
    "createStateSpace": [
        Example("NAME('p', simOMPL.StateSpaceType.pose2d, TARGET, {-2,-2}, {2,2})", [ANY]),
    ],
    "createStateSpaceForJoint": [Example("NAME('j', HINGE)", [ANY])],
    "setDubinsParams": [Example("NAME(SPACE, 0.5, true)", [], "NAME(SPACE, 0.5, True)")],
    "setStateSpace": [Example("NAME(simOMPL.createTask('u'), {SPACE})", [])],
    "setStateSpaceForJoints": [Example("NAME(simOMPL.createTask('u'), {HINGE})", [])],
    "getStateSpaceDimension": [Example("NAME(TASK)", [2])],
    "setAlgorithm": [Example("NAME(TASK, simOMPL.Algorithm.RRTConnect)", [])],
    "setCollisionPairs": [Example("NAME(TASK, {})", [])],
    "printTaskInfo": [Example("NAME(TASK)", [])],
    "setVerboseLevel": [Example("NAME(TASK, 1)", [])],
    "setStateValidityCheckingResolution": [Example("NAME(TASK, 0.01)", [])],
    "setStateValidationCallback": [Example("NAME(TASK, '')", [])],
    "setStartState": [Example("NAME(TASK, {0,0})", [])],
    "setGoalState": [Example("NAME(TASK, {1,0})", [])],
    "setGoalStates": [Example("NAME(TASK, {{1,0}})", [])],
    "addGoalState": [Example("NAME(TASK, {1,0})", [])],
    "setup": [Example("NAME(TASK)", [])],
    "solve": [Example("NAME(TASK, 4)", [True])],
    "simplifyPath": [Example("NAME(TASK)", [])],
    "interpolatePath": [Example("NAME(TASK, 3)", [])],
    "getPath": [Example("NAME(TASK)", [_STRAIGHT])],
    "hasExactSolution": [Example("NAME(TASK)", [True])],
    "hasApproximateSolution": [Example("NAME(TASK)", [False])],
    "compute": [Example("NAME(TASK, 4, -1, 3)", [True, _STRAIGHT])],
    "isStateValid": [Example("NAME(TASK, {0,1})", [True])],
    "isStateWithinBounds": [Example("NAME(TASK, {0,3})", [False])],
    "writeState": [Example("NAME(TASK, {0,0})", [])],
    "readState": [Example("NAME(TASK)", [near(0, 0)])],
    "getPathStateCount": [Example("NAME(TASK, {0,0, 1,0})", [2])],
    "getPathState": [Example("NAME(TASK, {0,0, 1,0}, 2)", [[1, 0]])],
    "drawPath": [Example("REFUSED(NAME, TASK, {0,0, 1,0})", ["the states of the task have no position in space"])],
    "removeDrawingObjects": [Example("NAME(TASK, {})", [])],
    "destroyStateSpace": [Example("NAME(SPACE)", [])],
    "destroyTask": [Example("NAME(TASK)", [])],
}
