// Messages whose records in Python are plain mappings, so that their types are written here; the others are in
// generated.d.ts. "src/..." names the file that sends or reads them, in src/drone_sim/.
declare namespace wire {
  // ---- questions, each with what it needs and its answer; a refused question has `error` and `kind` instead

  interface Nothing {}

  interface EditAnswer { revision: number; said: string; until_stop: boolean; handles?: number[]; text?: string; file?: string }
  interface Done { said: string; done?: boolean }
  interface ScriptFile { script: string; file: string; version: string; lesson: string }
  interface OpenedScript extends ScriptFile { text: string }
  interface Lesson {
    lesson: string; title: string; task: string; script: string; hands_in: boolean;
    summary?: string; difficulty?: string; time?: string; // of a task
  }
  interface Scripts { groups: { name: string; scripts: string[] }[]; flown: string; digest: string; folder: string; lessons: Lesson[] }
  interface Grade {
    problem: string; // why nothing was graded; then there is nothing else
    points: number; of: number; cards: string[]; page: string;
    flights: { seed: number; passed: boolean; points: number; of: number }[];
  }
  interface Model { model: string; title: string; picture: string; op: Operation }
  type ApiFunction = [
    module: string, name: string, flat: string, generations: string, parameters: string, sentence: string, page: string, isIgnored: boolean,
  ];

  interface Questions {
    // editor/scene_backend.py
    tree: [Nothing, { tree: TreeChange }];
    edit: [Edit, EditAnswer];
    undo: [{ merge?: string }, EditAnswer];
    redo: [{ merge?: string }, EditAnswer];
    properties: [Nothing, { types: Record<string, Property[]> }];
    models: [Nothing, { groups: { name: string; models: Model[] }[] }];
    upload_model: [{ name: string; content: string }, { model: Operation }];
    scene_files: [Nothing, { folder: string; recent: string[]; own: string[]; package: string[]; file: string; draft: OfferedDraft | null }];
    new_scene: [Nothing, EditAnswer];
    open_scene: [{ file: string }, EditAnswer];
    save_scene: [{ file?: string; over?: boolean }, EditAnswer];
    save_model: [{ object: number | string; file: string }, EditAnswer];
    scene_text: [Nothing, EditAnswer];
    objects_text: [{ objects: TextOf["text_of"] }, EditAnswer];
    write_scene_text: [{ text: string; revision?: number }, EditAnswer];
    draft: [Draft, EditAnswer];
    // editor/backend.py
    api: [Nothing, { functions: ApiFunction[]; constants: Record<string, unknown> }];
    check: [{ text: string; lua: boolean }, { found: Finding[]; unchecked?: string }];
    scripts: [Nothing, Scripts];
    open: [{ script: string }, OpenedScript];
    look: [{ script: string }, { version: string; digest: string; flown: string }];
    save: [{ script: string; text: string; version: string; draft?: string }, ScriptFile & { changed?: boolean }];
    save_as: [{ name: string; text: string }, ScriptFile];
    keep: [{ script: string; text: string; mine: boolean }, OpenedScript & { other: string }];
    rename: [{ script: string; name: string }, ScriptFile];
    duplicate: [{ script: string; text: string }, ScriptFile];
    delete: [{ script: string }, Nothing];
    "bring back": [{ script: string }, ScriptFile];
    locate: [{ file: string }, { script: string }];
    revert: [{ script: string }, { text: string }];
    lesson: [{ lesson: string }, { lesson: string; text: string; folder: string; script: string; flies: string }];
    run: [{ script: string; lesson: string; may_ask: boolean }, { done: boolean; said: string; failure: ScriptFailure | null; leaves?: string }];
    grade: [{ script: string; lesson: string }, { number: number }];
    "hand in": [{ script: string; lesson: string }, { time: string; digest: string }];
    graded: [{ number: number }, Grade | { flights: number; seeds: number }];
    // editor/inspection.py
    inspect: [{ page: string; breakpoints: Record<string, number[]>; looks: boolean; live: boolean }, { objects: string[]; parameters: string[] }];
    // panel/
    panel: [Nothing, { panel: Partial<Panel>; version: number; lines: string[] }];
    call: [{ call: string }, Done];
    request: [{ request: string }, Done];
    speed: [{ factor: number }, Done];
    scene: [{ scene: string }, Done];
    vehicle: [{ vehicle: string }, Done];
    tune: [{ name: string; value: any }, Done & { value: any }]; // a value of the field's kind
    plots: [{ charts: Record<string, [run: number, time: number]> }, { charts: Record<string, Rows> }];
    windows: [Nothing, { windows: Windows; pictures: string[] }];
    answer: [{ handle: number; button: string; typed: string }, Nothing];
    camera: [{ topic: string; on: boolean }, Partial<Done>];
    overlay: [{ topic: string; overlay: string; on: boolean }, Nothing];
  }

  /** Asks the node; the promise fails with its error. */
  type Ask = <Name extends keyof Questions>(ask: Name, more?: Questions[Name][0]) => Promise<Questions[Name][1]>;

  // ---- what the node tells by itself: one of the keys, and `version` with `panel`

  interface Told {
    panel?: Partial<Panel>;
    version?: number;
    log?: string;
    pulse?: { silent: number; frozen: boolean; ended: boolean };
    failure?: ScriptFailure;
    variables?: Variables | null;
    windows?: Windows;
    pictures?: string[]; // topics
    tree?: TreeChange;
  }

  /** The parts of the panels: panel/ and classroom.py. */
  interface Panel {
    status: string;
    flight: string;
    master: boolean;
    hears_commands: boolean;
    pace: string;
    speed: number;
    scenes: { all: string[]; now: string };
    vehicles: { all: string[]; now: string };
    diagnosis: { of: string; said: string; wrong: boolean }[];
    cameras: { topic: string; name: string }[];
    charts: Chart[];
    tuning: { group: string; fields: Field[] }[];
    values: Record<string, any>; // of the fields, each of its kind
    to_all: Message | null;
  }

  interface Chart { chart: string; title: string; unit: string; lines: string[]; least: [number, number] | null }
  interface Rows { run: number; rows: [time: number, ...values: (number | null)[]][] } // s; null is a gap
  interface Field {
    name: string; kind: "double" | "int" | "bool" | "str"; low: number | null; high: number | null; words: string[]; unit: string; hint: string;
  }

  interface Windows {
    views: { handle: number; sensor: string; label: string; topic?: string }[];
    dialogs: { handle: number; title: string; text: string; buttons: string[]; typed: string | null }[];
    consoles: { handle: number; title: string; lines: string[] }[];
  }

  type Variable = [name: string, type: string, value: string, inside: Variable[]];
  type Scopes = [scope: string, rows: Variable[]][];
  interface Variables {
    time: number;
    state: string;
    reached: { file: string; line: number; time: number; scopes: Scopes } | { file?: undefined };
    scripts: { name: string; file: string; scopes: Scopes }[];
  }

  /** The header of a picture: panel/cameras.py. */
  interface Picture {
    picture: string; name: string; note: string; // the topic; captions
    step?: number; overlays?: string[]; // of a camera with truth
    boxes?: { name: string; box: [number, number, number, number]; color: string }[];
    legend?: { name: string; color: string }[];
  }

  /** A marker with its arrays, which come after the message of the scene. */
  interface Marker extends MarkerMessage { id: number; points?: Float32Array; colors?: Float32Array }

  // ---- what the page says without an answer

  type Said =
    | { hold: Command }
    | { shown: string }
    | { follow_tree: boolean }
    | { drag: "start" | "move" | "end"; server: string; name: string; pose: number[] }
    | { push: string; ray: number[]; newtons: number };
}
