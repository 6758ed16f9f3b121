// The store of the page's state, called facts. Every line, badge, color and button is derived from the facts (see words.js),
// and only events change them. The module does not use the page, and its clock is a parameter, so that a test can send any events.
import { NO_SIMULATION, UNKNOWN, answers } from "./facts.js";
import { MESSAGES } from "./messages.js";

export const NOT_STARTED = "not started"; // the phase of an error that kept the script from starting
const TOGETHER = 2000; // ms between the reports of a breakpoint and of its pause, which come in either order
const DOUBLED = 5000; // ms within which a failure may be reported twice: as a reply and from the simulator's log
const SETTLED = 3000; // ms of flight after which an older failure counts as over, even if no start was reported
const BLOCKED = 2000; // ms; a longer time between two ticks means that the page or its computer was suspended
const READ = 6000; // ms after which a notice disappears; an error stays

/**
 * @typedef {{ file: string, line: number, time: number, told: number }} Reached
 * @typedef {wire.ScriptFailure & { told: number }} Failure
 * @typedef {{ kind: keyof typeof MESSAGES, text: string, bad: boolean }} Message
 * @typedef {{ text: string, bad: boolean, told: number }} Notice
 */
const INITIAL_FACTS = {
  at: 0, // ms, time of the last event
  connection: "connecting", // or connected, lost, refused (the cockpit does not know this tab)
  since: 0, // ms, start of the current state of the connection
  heard: 0, // ms, time of the cockpit's last message
  ticked: 0, // ms, time of the last tick
  silent: 0, // s since the simulator's last message
  isFrozen: false, // whether the simulator has been silent for longer than a busy simulator can be
  hasEnded: false, // whether the simulator's process has ended
  hasMaster: true,
  status: UNKNOWN, // or no simulation, flying, paused, stopped
  statusSince: 0,
  flight: "", // what the drone does, or "script failed"
  hadSimulation: false, // whether there has been a simulator since this page was opened
  hearsCommands: true, // whether the drone's script listens to commands
  pace: "", // the actual speed relative to real time
  warnings: /** @type {string[]} */ ([]), // the texts of problems in /diagnostics
  reached: /** @type {Reached | null} */ (null), // the breakpoint that paused the flight: { file, line, time (s), told (ms) }
  flown: /** @type {string | null} */ (null), // the simulator's script, "" if there is no vehicle
  open: { script: "", file: "" }, // the file in the editor
  failure: /** @type {Failure | null} */ (null), // the last error of a script: { file, line, said, phase, told (ms) }
  mended: /** @type {{ key: string, at: number } | null} */ (null), // a failure whose line the user edited; a late repeat is ignored
  message: /** @type {Message | null} */ (null), // below the script: { kind, text, bad }
  saved: { text: "", bad: false }, // whether the file is on the disk
  notice: /** @type {Notice | null} */ (null), // over the scene: { text, bad, told (ms) }
  starts: 0, // number of flights since the page was opened
  edits: 0, // number of the user's edits since the page was opened
  isGrading: false,
};

/** @typedef {typeof INITIAL_FACTS} Facts */

export const isSyntaxError = ({ said }) => /^syntax ?error/i.test(said);
const keyOf = (failure) => failure && `${failure.file}:${failure.said}`;
const isDoubled = (now, failure) => keyOf(now.failure) === keyOf(failure) && now.at - now.failure.told < DOUBLED;
const isMended = ({ mended, at }, failure) => mended && mended.key === keyOf(failure) && at - mended.at < DOUBLED;

/**
 * The changes that each event makes. `now.at` is the time of the event.
 * @satisfies {Record<string, (now: Facts, content: any) => Partial<Facts>>}
 */
const EVENTS = {
  // ---- the connection to the cockpit
  connected: (now) => ({ connection: "connected", since: now.at, heard: now.at, silent: 0, isFrozen: false, hasEnded: false, hasMaster: true }),
  lost: (now) => ({ ...disconnected(now, "lost"), status: UNKNOWN, flight: "", warnings: [], reached: null }),
  refused: (now) => ({ ...disconnected(now, "refused"), status: UNKNOWN, flight: "", warnings: [], reached: null }),
  heard: (now) => ({ heard: now.at }),
  tick: (now) => ({ ticked: now.at, ...afterSuspension(now), ...afterRecovery(now), ...(isRead(now) ? { notice: null } : {}) }),

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
  // The variables of scripts; null after no page has shown them for some time, which does not change the flight.
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
  // Read from the simulator's log, as failures are, so that both come in the right order.
  started: (now) => ({ starts: now.starts + 1, failure: null, mended: null, notice: now.notice?.bad ? null : now.notice }),
  /** @type {(now: Facts, failure: wire.ScriptFailure) => Partial<Facts>} */
  failure: (now, failure) => (isMended(now, failure) || isDoubled(now, failure) ? {} : { failure: { ...failure, told: now.at } }),

  // ---- the file in the editor
  opened: (now, open) => ({ open, saved: { text: "", bad: false } }),
  // The open text is now in another file, such as the user's copy of a script of the package. Its failure moves with it.
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
  // The editor has checked the open file: a syntax error that kept it from starting is removed, or replaced by another one.
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

// Return the events that follow from a change of the facts. They end messages.
function consequences(before, after) {
  const isStopped = after.status === "stopped" && before.status !== "stopped";
  const isUnanswered = answers(before) && !answers(after);
  return [...(isStopped ? ["stopped"] : []), ...(isUnanswered ? ["unanswered"] : [])];
}

// Return the facts of a lost connection. Failed attempts to connect again do not change the time of the loss.
function disconnected(now, connection) {
  return { connection, since: now.connection === "connected" || now.connection === "connecting" ? now.at : now.since };
}

// Return the facts after a suspension of the page. It received nothing meanwhile, but the cockpit was not silent.
const afterSuspension = ({ at, ticked }) => (ticked && at - ticked > BLOCKED ? { heard: at } : {});

const isRead = ({ at, notice }) => notice && !notice.bad && at - notice.told > READ;

// Return the facts without a failure if a flight has begun after it and continues: the failure is over.
function afterRecovery({ at, status, statusSince, flight, failure }) {
  const isOver = failure && status === "flying" && failure.told < statusSince && at - statusSince > SETTLED && flight !== "script failed";
  return isOver ? { failure: null } : {};
}

export class Store {
  // `clock()` returns the time, ms.
  constructor(clock = () => performance.now()) {
    this.clock = clock;
    /** @type {Facts} */
    this.now = { ...INITIAL_FACTS, at: clock() };
    /** @type {((now: Facts) => void)[]} */
    this.listeners = [];
  }

  /**
   * Calls `show` with the facts, now and after every event except "heard".
   * @param {(now: Facts) => void} show
   */
  on(show) {
    this.listeners.push(show);
    show(this.now);
  }

  /**
   * @param {keyof typeof EVENTS} event
   * @param {any} [content] of the event, see EVENTS
   */
  take(event, content) {
    const before = this.now;
    const now = { ...before, at: this.clock() };
    const changed = { ...now, ...EVENTS[event](now, content) };
    const ends = before.message && event !== "say" ? MESSAGES[before.message.kind].ends : [];
    const isOver = [event, ...consequences(before, changed)].some((one) => ends.includes(one));
    this.now = isOver ? { ...changed, message: null } : changed;
    if (event === "heard") return; // it comes with every message; listeners see it at the next tick
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
