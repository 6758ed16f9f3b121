// Written by web/make_types.py: do not edit. Types of the messages that have records in Python, and of the elements in
// index.html. `any` is a value of a scene file, which the simulator checks.
declare namespace wire {
  type Operation = Add | AddModel | AddSign | AddVehicle | Remove | Move | Rename | Reparent | Set | Scale | Copy | Paste | Group | Ungroup | AttachScript | DetachScript;
  /** Add entries as in a scene file, under unused names; the first entry's lowest point is put at `position`. */
  interface Add {
    do: "add";
    objects: Array<Record<string, any>>;
    scripts?: Array<Record<string, any>>;
    position?: [number, number, number] | null;
    yaw?: number;
  }
  /** Add a model of the package by name, or a file, with its origin at `position` in the world. */
  interface AddModel {
    do: "add_model";
    model: string;
    position?: [number, number, number];
    yaw?: number;
  }
  /** Add a sign with a text, standing at `position`; its image is written beside the scene file. */
  interface AddSign {
    do: "add_sign";
    text: string;
    position?: [number, number, number];
    yaw?: number;
  }
  /** Add a vehicle with its equipment at `position`, raised by `height` (m). */
  interface AddVehicle {
    do: "add_vehicle";
    type?: string;
    name?: string;
    position: [number, number, number];
    height?: number;
    yaw?: number;
    values?: Record<string, any>;
  }
  /** Remove objects; their children stay, except those of models. With `below`, all descendants are removed. */
  interface Remove {
    do: "remove";
    objects: Array<number | string>;
    below?: boolean;
  }
  /** Move an object relative to the world, its parent or another object; omitted values stay the same. */
  interface Move {
    do: "move";
    object: number | string;
    position?: [number, number, number] | null;
    rpy?: [number, number, number] | null;
    quaternion?: [number, number, number, number] | null;
    relative_to?: number | string;
  }
  /** Rename an object and reset its alias. */
  interface Rename {
    do: "rename";
    object: number | string;
    name: string;
  }
  /** Set the parent (-1: the world); `keep`: the pose in the world, or relative to the parent. */
  interface Reparent {
    do: "reparent";
    objects: Array<number | string>;
    parent?: number | string;
    keep?: "pose" | "relative";
  }
  /** Set keys of the object's entry in the scene file; null restores the default. */
  interface Set {
    do: "set";
    object: number | string;
    values: Record<string, any>;
  }
  /** Scale objects along their own axes. */
  interface Scale {
    do: "scale";
    objects: Array<number | string>;
    factors: [number, number, number];
  }
  /** Copy objects with their descendants in a row, in a grid or in place; `counts` includes the originals. */
  interface Copy {
    do: "copy";
    objects: Array<number | string>;
    counts?: [number, number, number];
    steps?: [number, number, number];
  }
  /** Add the objects and vehicles of a text as from `text_of`, under unused names, moved off occupied positions. */
  interface Paste {
    do: "paste";
    text: string;
  }
  /** Group objects into a model below a new dummy, or into one rigid shape. */
  interface Group {
    do: "group";
    objects: Array<number | string>;
    name?: string;
    as?: "model" | "shape";
  }
  /** Split a rigid shape into its parts, or a model into independent objects. */
  interface Ungroup {
    do: "ungroup";
    object: number | string;
  }
  /** Attach a script to an object; without a file, create one from V-REP's template. */
  interface AttachScript {
    do: "attach_script";
    object: number | string;
    script?: string;
    language?: "lua" | "python";
    parameters?: Record<string, any>;
  }
  /** Detach the script of an object; its file stays. */
  interface DetachScript {
    do: "detach_script";
    object: number | string;
  }
  /** Execute operations atomically; consecutive edits with the same `merge` key are one step of undo. */
  interface Edit {
    edit: Array<Operation>;
    name?: string;
    merge?: string;
  }
  /** Undo the last step, or the one with this `merge` key even if others have edited since. */
  interface Undo {
    undo: true;
    merge?: string;
  }
  /** Redo the step that was undone last. */
  interface Redo {
    redo: true;
  }
  /** Get the scene as text of a scene file. */
  interface Text {
    text: true;
  }
  /** Get objects with their descendants, and vehicles, as text of a scene file. */
  interface TextOf {
    text_of: Array<number | string>;
  }
  /** Replace the scene by that of a text; refused if the scene has changed since `revision`. */
  interface Write {
    write: string;
    revision?: number | null;
  }
  /** Open a new scene: a floor without vehicles. */
  interface New {
    new: true;
  }
  /** Open the scene of a file. */
  interface Open {
    open: string;
  }
  /** Write the scene to its file, or to another one, which becomes its file. */
  interface Save {
    save: true | string;
  }
  /** Write an object and its descendants to a model file. */
  interface SaveModel {
    save_model: number | string;
    file: string;
  }
  /** Open (`take`) or discard (`drop`) the unsaved changes of an earlier node. */
  interface Draft {
    draft: "take" | "drop";
  }
  /** A row; only that of a vehicle itself has these keys. */
  interface Row {
    handle: number;
    name: string;
    alias: string;
    kind: string;
    type: string;
    parent: number;
    model: boolean;
    script: string;
    pose: Array<number>;
    position: Array<number>;
    rpy: Array<number>;
    values: Record<string, any>;
    vehicle: string;
    of: "scene" | "vehicle" | "floor";
    root?: boolean;
    own_script?: string;
  }
  /** A key with the values that it may have; the mount of a camera or sensor has only the description. */
  interface Property {
    key: string;
    kind: "number" | "numbers" | "list" | "switch" | "text" | "file" | "choice" | "color" | "other";
    what: string;
    count?: number | null;
    whole?: boolean;
    choices?: Array<string> | null;
    least?: number | null;
    most?: number | null;
    unit?: string;
    default?: boolean | number | string | Array<number> | null;
  }
  /** A draft as windows show it. */
  interface OfferedDraft {
    file: string;
    saved: number;
  }
  /** The state of the editor for windows. */
  interface EditorState {
    revision: number;
    file: string;
    new: boolean;
    modified: boolean;
    read_only: boolean;
    state: string;
    undo: string;
    redo: string;
    draft: OfferedDraft | null;
  }
  /** A message of ~scene_objects. */
  interface TreeChange {
    revision: number;
    file: string;
    new: boolean;
    modified: boolean;
    read_only: boolean;
    state: string;
    undo: string;
    redo: string;
    draft: OfferedDraft | null;
    version: number;
    since: number | null;
    objects: Array<Row>;
    gone: Array<number>;
  }
  /** A marker for the browsers. */
  interface MarkerMessage {
    kind: string;
    layer: string;
    ns: string;
    frame: string;
    color?: Array<number>;
    scale?: Array<number>;
    text?: string;
    mesh?: string;
    own?: boolean;
    lit?: boolean;
    id?: number;
    arrays?: Array<["points" | "colors", number]>;
  }
  /** The changes of the scene since the browser's version. */
  interface SceneMessage {
    scene: number;
    whole: boolean;
    frames: Array<[number, string, number]>;
    markers: Array<MarkerMessage>;
    gone: Array<number>;
    moved: Array<number>;
    placed: Array<number>;
  }
  /** Velocities forward, left and up (m/s), and yaw rate to the left (rad/s). */
  interface Command {
    vx: number;
    vy: number;
    vz: number;
    wz: number;
  }
  /** Where a script failed: phase or callback, file, line (from 1); and the error. The page gets these keys. */
  interface ScriptFailure {
    phase: string;
    file: string;
    line: number;
    said: string;
  }
  /** A mistake in a script: line and first column (from 1), column after the last one (0: end of line), a sentence. */
  interface Finding {
    line: number;
    column: number;
    end: number;
    said: string;
    severity: string;
  }
  /** Words of a teacher to all students, about a task or none (''), and about a scene file or none. */
  interface Message {
    time: string;
    text: string;
    task: string;
    scene: string;
  }
}

/** The elements of index.html by their ids. */
interface PageElements {
  "toolbar": HTMLElementTagNameMap["header"];
  "home": HTMLElementTagNameMap["button"];
  "sim-start": HTMLElementTagNameMap["button"];
  "sim-pause": HTMLElementTagNameMap["button"];
  "sim-step": HTMLElementTagNameMap["button"];
  "sim-restart": HTMLElementTagNameMap["button"];
  "sim-stop": HTMLElementTagNameMap["button"];
  "state": HTMLElementTagNameMap["div"];
  "status": HTMLElementTagNameMap["span"];
  "why": HTMLElementTagNameMap["button"];
  "flown": HTMLElementTagNameMap["output"];
  "watching": HTMLElementTagNameMap["span"];
  "toolbar-more": HTMLElementTagNameMap["button"];
  "speed": HTMLElementTagNameMap["select"];
  "pace": HTMLElementTagNameMap["output"];
  "scene-choice": HTMLElementTagNameMap["select"];
  "vehicle-part": HTMLElementTagNameMap["label"];
  "vehicle": HTMLElementTagNameMap["select"];
  "takeoff": HTMLElementTagNameMap["button"];
  "land": HTMLElementTagNameMap["button"];
  "go-home": HTMLElementTagNameMap["button"];
  "reset": HTMLElementTagNameMap["button"];
  "snapshot": HTMLElementTagNameMap["button"];
  "restore": HTMLElementTagNameMap["button"];
  "photo": HTMLElementTagNameMap["button"];
  "video": HTMLElementTagNameMap["button"];
  "places": HTMLElementTagNameMap["div"];
  "toggle": HTMLElementTagNameMap["button"];
  "stage": HTMLElementTagNameMap["main"];
  "scene": HTMLElementTagNameMap["div"];
  "banner": HTMLElementTagNameMap["div"];
  "to-all": HTMLElementTagNameMap["div"];
  "windows": HTMLElementTagNameMap["div"];
  "enlarged": HTMLElementTagNameMap["div"];
  "build-bar": HTMLElementTagNameMap["div"];
  "scene-menu-open": HTMLElementTagNameMap["button"];
  "scene-file": HTMLElementTagNameMap["span"];
  "scene-modified": HTMLElementTagNameMap["span"];
  "scene-menu": HTMLElementTagNameMap["div"];
  "handles-frame": HTMLElementTagNameMap["select"];
  "edit-menu-open": HTMLElementTagNameMap["button"];
  "edit-menu": HTMLElementTagNameMap["div"];
  "until-stop": HTMLElementTagNameMap["span"];
  "shelf": HTMLElementTagNameMap["section"];
  "models-find": HTMLElementTagNameMap["input"];
  "models": HTMLElementTagNameMap["div"];
  "side": HTMLElementTagNameMap["aside"];
  "rail": HTMLElementTagNameMap["nav"];
  "panel": HTMLElementTagNameMap["section"];
  "side-edge": HTMLElementTagNameMap["div"];
  "panel-title": HTMLElementTagNameMap["h2"];
  "other-side": HTMLElementTagNameMap["button"];
  "fold-side": HTMLElementTagNameMap["button"];
  "view-panel": HTMLElementTagNameMap["div"];
  "views": HTMLElementTagNameMap["div"];
  "shown": HTMLElementTagNameMap["div"];
  "push-text": HTMLElementTagNameMap["output"];
  "push": HTMLElementTagNameMap["input"];
  "objects": HTMLElementTagNameMap["select"];
  "cameras-panel": HTMLElementTagNameMap["div"];
  "camera-list": HTMLElementTagNameMap["div"];
  "plots-panel": HTMLElementTagNameMap["div"];
  "plot-choice": HTMLElementTagNameMap["details"];
  "plot-list": HTMLElementTagNameMap["div"];
  "plot-charts": HTMLElementTagNameMap["div"];
  "tune-panel": HTMLElementTagNameMap["div"];
  "tune-filter": HTMLElementTagNameMap["input"];
  "tune-groups": HTMLElementTagNameMap["div"];
  "edit-panel": HTMLElementTagNameMap["div"];
  "draft": HTMLElementTagNameMap["div"];
  "tree-find": HTMLElementTagNameMap["input"];
  "tree": HTMLElementTagNameMap["div"];
  "under-tree": HTMLElementTagNameMap["div"];
  "of-selected": HTMLElementTagNameMap["div"];
  "selected": HTMLElementTagNameMap["span"];
  "selected-type": HTMLElementTagNameMap["small"];
  "nothing": HTMLElementTagNameMap["p"];
  "pose": HTMLElementTagNameMap["div"];
  "align": HTMLElementTagNameMap["div"];
  "properties": HTMLElementTagNameMap["div"];
  "attached": HTMLElementTagNameMap["div"];
  "attached-none": HTMLElementTagNameMap["div"];
  "attached-one": HTMLElementTagNameMap["div"];
  "attached-open": HTMLElementTagNameMap["button"];
  "detach": HTMLElementTagNameMap["button"];
  "log-panel": HTMLElementTagNameMap["div"];
  "diagnosis-says": HTMLElementTagNameMap["p"];
  "diagnosis": HTMLElementTagNameMap["ul"];
  "log-lines": HTMLElementTagNameMap["ol"];
  "replay": HTMLElementTagNameMap["div"];
  "replay-play": HTMLElementTagNameMap["button"];
  "replay-time": HTMLElementTagNameMap["input"];
  "replay-text": HTMLElementTagNameMap["output"];
  "replay-close": HTMLElementTagNameMap["button"];
  "left": HTMLElementTagNameMap["div"];
  "right": HTMLElementTagNameMap["div"];
  "notice": HTMLElementTagNameMap["div"];
  "notice-text": HTMLElementTagNameMap["span"];
  "editor": HTMLElementTagNameMap["section"];
  "beside": HTMLElementTagNameMap["div"];
  "script": HTMLElementTagNameMap["select"];
  "flying": HTMLElementTagNameMap["output"];
  "run": HTMLElementTagNameMap["button"];
  "more": HTMLElementTagNameMap["button"];
  "menu": HTMLElementTagNameMap["div"];
  "file-new-python": HTMLElementTagNameMap["button"];
  "file-new-lua": HTMLElementTagNameMap["button"];
  "file-as": HTMLElementTagNameMap["button"];
  "file-rename": HTMLElementTagNameMap["button"];
  "file-duplicate": HTMLElementTagNameMap["button"];
  "file-download": HTMLElementTagNameMap["button"];
  "file-upload": HTMLElementTagNameMap["button"];
  "file-revert": HTMLElementTagNameMap["button"];
  "file-delete": HTMLElementTagNameMap["button"];
  "as-form": HTMLElementTagNameMap["form"];
  "as-label": HTMLElementTagNameMap["span"];
  "name": HTMLElementTagNameMap["input"];
  "as-cancel": HTMLElementTagNameMap["button"];
  "name-said": HTMLElementTagNameMap["p"];
  "pick": HTMLElementTagNameMap["input"];
  "question": HTMLElementTagNameMap["div"];
  "lesson": HTMLElementTagNameMap["select"];
  "before": HTMLElementTagNameMap["button"];
  "after": HTMLElementTagNameMap["button"];
  "fold": HTMLElementTagNameMap["button"];
  "lesson-body": HTMLElementTagNameMap["article"];
  "flies": HTMLElementTagNameMap["p"];
  "start": HTMLElementTagNameMap["button"];
  "grade": HTMLElementTagNameMap["button"];
  "hand-in": HTMLElementTagNameMap["button"];
  "graded": HTMLElementTagNameMap["div"];
  "lesson-text": HTMLElementTagNameMap["div"];
  "under": HTMLElementTagNameMap["div"];
  "text": HTMLElementTagNameMap["div"];
  "said": HTMLElementTagNameMap["output"];
  "over-below": HTMLElementTagNameMap["div"];
  "below": HTMLElementTagNameMap["section"];
  "below-head": HTMLElementTagNameMap["div"];
  "below-tabs": HTMLElementTagNameMap["div"];
  "tab-console": HTMLElementTagNameMap["button"];
  "tab-variables": HTMLElementTagNameMap["button"];
  "late": HTMLElementTagNameMap["input"];
  "clear": HTMLElementTagNameMap["button"];
  "live": HTMLElementTagNameMap["input"];
  "fold-below": HTMLElementTagNameMap["button"];
  "console-part": HTMLElementTagNameMap["div"];
  "console": HTMLElementTagNameMap["ol"];
  "variables": HTMLElementTagNameMap["div"];
  "variables-of": HTMLElementTagNameMap["p"];
  "variables-body": HTMLElementTagNameMap["div"];
  "foot": HTMLElementTagNameMap["div"];
  "saved": HTMLElementTagNameMap["span"];
  "help": HTMLElementTagNameMap["span"];
  "scene-text": HTMLElementTagNameMap["section"];
  "scene-text-title": HTMLElementTagNameMap["b"];
  "scene-text-close": HTMLElementTagNameMap["button"];
  "scene-text-question": HTMLElementTagNameMap["div"];
  "scene-text-editor": HTMLElementTagNameMap["div"];
  "scene-text-said": HTMLElementTagNameMap["output"];
  "keys": HTMLElementTagNameMap["p"];
  "deaf": HTMLElementTagNameMap["p"];
  "command": HTMLElementTagNameMap["output"];
  "help-open": HTMLElementTagNameMap["button"];
  "sheet": HTMLElementTagNameMap["dialog"];
  "help-close": HTMLElementTagNameMap["button"];
  "sheet-title": HTMLElementTagNameMap["h2"];
  "sheet-deaf": HTMLElementTagNameMap["p"];
  "ask": HTMLElementTagNameMap["dialog"];
  "start-page": HTMLElementTagNameMap["dialog"];
  "start-close": HTMLElementTagNameMap["button"];
  "start-title": HTMLElementTagNameMap["h1"];
  "start-question": HTMLElementTagNameMap["p"];
  "start-choices": HTMLElementTagNameMap["div"];
  "gallery": HTMLElementTagNameMap["section"];
  "gallery-back": HTMLElementTagNameMap["button"];
  "gallery-tasks": HTMLElementTagNameMap["div"];
  "go-on": HTMLElementTagNameMap["button"];
  "go-on-name": HTMLElementTagNameMap["b"];
}
