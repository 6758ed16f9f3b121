// The page's facts. Every line, badge, colour and button is derived from them (see words.js), and only events change
// them. This module uses neither the page nor a clock of its own, so that a test can send events in any order.
import { NO_SIMULATION, UNKNOWN, answers } from "./facts.js";
import { MESSAGES } from "./messages.js";

export const NOT_STARTED = "not started"; // the phase of an error that kept the script from starting
const TOGETHER = 2000; // ms within which a breakpoint and its pause are reported, in either order
const DOUBLED = 5000; // ms within which a failure may be reported twice: as a reply and from the simulator's log
const SETTLED = 3000; // ms of flight after which an older failure is over, though no start was reported
const BLOCKED = 2000; // ms between two ticks; if there are more, the page or its computer was suspended
const READ = 6000; // ms after which a notice disappears; an error stays

/**
 * @typedef {{ file: string, line: number, time: number, told: number }} Reached
 * @typedef {wire.ScriptFailure & { told: number }} Failure
 * @typedef {{ kind: keyof typeof MESSAGES, text: string, bad: boolean }} Message
 * @typedef {{ text: string, bad: boolean, told: number }} Notice
 */
const BEGINNING = {
  at: 0, // ms, when the last event came
  connection: "connecting", // or connected, lost, refused (the cockpit does not know this tab)
  since: 0, // ms, of the connection
  heard: 0, // ms, when the last message of the cockpit came
  ticked: 0, // ms, when the clock last ticked
  silent: 0, // s, since the simulator last published anything
  isFrozen: false, // whether it has been silent for longer than a busy simulator is
  hasEnded: false, // whether the simulator's process has ended
  hasMaster: true,
  status: UNKNOWN, // or no simulation, flying, paused, stopped
  statusSince: 0,
  flight: "", // what the drone does
  hadSimulation: false, // whether there was a simulator since this page was opened
  hearsCommands: true, // whether the drone's script does
  pace: "", // the actual speed, compared with real time
  warnings: /** @type {string[]} */ ([]), // the texts of what is wrong in /diagnostics
  reached: /** @type {Reached | null} */ (null), // the breakpoint that paused the flight: { file, line, time (s), told (ms) }
  flown: /** @type {string | null} */ (null), // the simulator's script, "" if there is no vehicle
  open: { script: "", file: "" }, // the file in the editor
  failure: /** @type {Failure | null} */ (null), // the last error of a script: { file, line, said, phase, told (ms) }
  mended: /** @type {{ key: string, at: number } | null} */ (null), // the failure that the user has mended, so that a late repetition does not bring it back
  message: /** @type {Message | null} */ (null), // below the script: { kind, text, bad }
  saved: { text: "", bad: false }, // whether the file is on the disk
  notice: /** @type {Notice | null} */ (null), // over the scene: { text, bad, told (ms) }
  starts: 0, // of flights, since the page was opened
  edits: 0, // of the user, since the page was opened
  isGrading: false,
};

/** @typedef {typeof BEGINNING} Facts */

export const isSyntaxError = ({ said }) => /^syntax ?error/i.test(said);
const keyOf = (failure) => failure && `${failure.file}:${failure.said}`;
const isDoubled = (now, failure) => keyOf(now.failure) === keyOf(failure) && now.at - now.failure.told < DOUBLED;
const isMended = ({ mended, at }, failure) => mended && mended.key === keyOf(failure) && at - mended.at < DOUBLED;

/**
 * What each event changes. `now` has the time of the event.
 * @satisfies {Record<string, (now: Facts, content: any) => Partial<Facts>>}
 */
const EVENTS = {
  // ---- the connection to the cockpit
  connected: (now) => ({ connection: "connected", since: now.at, heard: now.at, silent: 0, isFrozen: false, hasEnded: false, hasMaster: true }),
  lost: (now) => ({ ...left(now, "lost"), status: UNKNOWN, flight: "", warnings: [], reached: null }),
  refused: (now) => ({ ...left(now, "refused"), status: UNKNOWN, flight: "", warnings: [], reached: null }),
  heard: (now) => ({ heard: now.at }),
  tick: (now) => ({ ticked: now.at, ...awoken(now), ...settled(now), ...(isRead(now) ? { notice: null } : {}) }),

  // ---- the simulator
  /** @type {(now: Facts, pulse: NonNullable<wire.Told["pulse"]>) => Partial<Facts>} */
  pulse: (now, { silent, frozen, ended }) => ({ silent, isFrozen: frozen, hasEnded: ended }),
  master: (now, hasMaster) => ({ hasMaster }),
  flight: (now, flight) => ({ flight }),
  hears_commands: (now, hearsCommands) => ({ hearsCommands }),
  pace: (now, pace) => ({ pace }),
  warnings: (now, warnings) => ({ warnings }),
  status(now, status) {
    if (status === now.status) return {};
    const reached = status === "paused" && now.reached && now.at - now.reached.told < TOGETHER ? now.reached : null;
    return { status, statusSince: now.at, reached, hadSimulation: now.hadSimulation || ![NO_SIMULATION, UNKNOWN].includes(status) };
  },
  // The variables of scripts; null after nobody has watched them for some time, which does not change the flight.
  /** @type {(now: Facts, variables: wire.Variables | null) => Partial<Facts>} */
  variables(now, variables) {
    if (variables === null) return {};
    const { reached, state } = variables;
    if (!reached?.file || state !== "paused") return { reached: null };
    return { reached: { file: reached.file, line: reached.line, time: reached.time, told: now.at } };
  },

  // ---- flights of scripts
  flown: (now, flown) => ({ flown }),
  run: () => ({ failure: null, mended: null, notice: null }),
  answered: () => ({}), // the simulator has replied to Run
  // From the simulator's log, so in the right order with its failures.
  started: (now) => ({ starts: now.starts + 1, failure: null, mended: null, notice: now.notice?.bad ? null : now.notice }),
  /** @type {(now: Facts, failure: wire.ScriptFailure) => Partial<Facts>} */
  failure: (now, failure) => (isMended(now, failure) || isDoubled(now, failure) ? {} : { failure: { ...failure, told: now.at } }),

  // ---- the file in the editor
  opened: (now, open) => ({ open, saved: { text: "", bad: false } }),
  // The same text in another file, such as the user's copy of a script of the package: a failure goes with it.
  renamed: (now, open) => ({ open, failure: now.failure?.file === now.open.file ? { ...now.failure, file: open.file } : now.failure }),
  edited: (now) => ({ edits: now.edits + 1 }),
  saved: (now, text) => ({ saved: { text, bad: false } }),
  unsaved: (now, text) => ({ saved: { text, bad: true } }),
  saving: () => ({ saved: { text: "...", bad: false } }),
  // The line of the failure has moved; 0 if the user has changed that line.
  moved(now, line) {
    if (!now.failure || now.failure.file !== now.open.file) return {};
    if (line) return { failure: { ...now.failure, line } };
    return { failure: null, mended: { key: keyOf(now.failure), at: now.at } };
  },
  // The editor has checked the open file: a syntax error that kept it from starting is gone, or replaced by another one.
  checked(now, { file, found }) {
    if (now.failure?.phase !== NOT_STARTED || now.failure.file !== file) return {};
    const error = found.find(isSyntaxError);
    return { failure: error ? { ...now.failure, line: error.line, said: error.said } : null };
  },

  // ---- messages
  say: (now, { kind, text }) => ({ message: text ? { kind, text, bad: Boolean(MESSAGES[kind].bad) } : null }),
  notice: (now, { text, bad }) => ({ notice: text ? { text, bad, told: now.at } : null }),
  grading: (now, isGrading) => ({ isGrading }),
};

// Events that follow from a change of the facts. They end messages.
function consequences(before, after) {
  const isStopped = after.status === "stopped" && before.status !== "stopped";
  const isUnanswered = answers(before) && !answers(after);
  return [...(isStopped ? ["stopped"] : []), ...(isUnanswered ? ["unanswered"] : [])];
}

// The loss began with the first event; failed attempts to connect again do not change its time.
function left(now, connection) {
  return { connection, since: now.connection === "connected" || now.connection === "connecting" ? now.at : now.since };
}

// A suspended page receives nothing, which does not mean that the cockpit is silent.
const awoken = ({ at, ticked }) => (ticked && at - ticked > BLOCKED ? { heard: at } : {});

const isRead = ({ at, notice }) => notice && !notice.bad && at - notice.told > READ;

// A flight that began after a failure and continues shows that the failure is over.
function settled({ at, status, statusSince, flight, failure }) {
  const isOver = failure && status === "flying" && failure.told < statusSince && at - statusSince > SETTLED && flight !== "script failed";
  return isOver ? { failure: null } : {};
}

export class Store {
  // `clock` returns ms.
  constructor(clock = () => performance.now()) {
    this.clock = clock;
    /** @type {Facts} */
    this.now = { ...BEGINNING, at: clock() };
    /** @type {((now: Facts) => void)[]} */
    this.listeners = [];
  }

  /**
   * Calls `show` with the facts, now and after every event.
   * @param {(now: Facts) => void} show
   */
  on(show) {
    this.listeners.push(show);
    show(this.now);
  }

  /**
   * @param {keyof typeof EVENTS} event
   * @param {any} [content] as the event needs it
   */
  take(event, content) {
    const before = this.now;
    const now = { ...before, at: this.clock() };
    const changed = { ...now, ...EVENTS[event](now, content) };
    const ends = before.message && event !== "say" ? MESSAGES[before.message.kind].ends : [];
    const isOver = [event, ...consequences(before, changed)].some((one) => ends.includes(one));
    this.now = isOver ? { ...changed, message: null } : changed;
    if (event === "heard") return; // it comes with every picture; the next tick shows it
    for (const show of this.listeners) show(this.now);
  }

  /**
   * @param {keyof typeof MESSAGES} kind
   * @param {string} text
   */
  say(kind, text) {
    this.take("say", { kind, text });
  }
}
