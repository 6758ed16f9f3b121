// What is true now. This is the only owner: every line, badge, colour and button of the page reads it (words.js says
// how), and only events change it. Nothing here knows the page or a clock, so that a test can feed events in any order.
import { MESSAGES } from "./messages.js";

export const NO_SIMULATION = "no simulation";
export const UNKNOWN = ""; // the status before the cockpit has told it
const TOGETHER = 2000; // ms within which the news of a breakpoint and the news of its pause arrive, in either order
const DOUBLED = 5000; // ms within which a failure may be told twice: as an answer and from the simulator's log
const SETTLED = 3000; // ms of flight after which an older failure is over, though the start was not told
const BLOCKED = 2000; // ms between two ticks after which the page itself, or its computer, has slept
const READ = 6000; // ms for which a notice can be read; an error stays

const BEGINNING = {
  at: 0, // ms, when the last event came
  connection: "connecting", // or connected, lost, refused (the cockpit does not know this tab)
  since: 0, // ms, of the connection
  heard: 0, // ms, when the cockpit last said anything
  ticked: 0, // ms, when the clock last ticked
  silent: 0, // s, since the simulator last said anything
  hasEnded: false, // whether the simulator's process has ended
  hasMaster: true,
  status: UNKNOWN, // or no simulation, flying, paused, stopped
  statusSince: 0,
  flight: "", // what the drone does
  hadSimulation: false, // since this page was opened
  hears_commands: true, // whether the script of the drone does
  pace: "", // the actual speed, compared with real time
  warnings: [], // what /diagnostics finds wrong
  reached: null, // the breakpoint that paused the flight: { file, line, time (s), told (ms) }
  flown: "", // the script that the simulator has
  open: { script: "", file: "" }, // the file in the editor
  failure: null, // the last error of a script: { file, line, said, phase, told (ms) }
  mended: null, // the failure that the user has mended, so that a late repetition does not bring it back
  message: null, // below the script: { kind, text, bad }
  saved: { text: "", bad: false }, // whether the file is on the disk
  notice: null, // over the scene: { text, bad, told (ms) }
  edits: 0, // of the user, since the page was opened
  isGrading: false,
};

export const isSyntaxError = ({ said }) => /^syntax ?error/i.test(said);
const keyOf = (failure) => failure && `${failure.file}:${failure.said}`;
const isDoubled = (now, failure) => keyOf(now.failure) === keyOf(failure) && now.at - now.failure.told < DOUBLED;
const isMended = ({ mended, at }, failure) => mended && mended.key === keyOf(failure) && at - mended.at < DOUBLED;

// What each event changes. `now` has the time of the event.
const EVENTS = {
  // ---- the connection to the cockpit
  connected: (now) => ({ connection: "connected", since: now.at, heard: now.at, silent: 0, hasEnded: false, hasMaster: true }),
  lost: (now) => ({ ...left(now, "lost"), status: UNKNOWN, flight: "", warnings: [], reached: null }),
  refused: (now) => ({ ...left(now, "refused"), status: UNKNOWN, flight: "", warnings: [], reached: null }),
  heard: (now) => ({ heard: now.at }),
  tick: (now) => ({ ticked: now.at, ...awoken(now), ...settled(now), ...(isRead(now) ? { notice: null } : {}) }),

  // ---- the simulator
  pulse: (now, { silent, ended }) => ({ silent, hasEnded: ended }),
  master: (now, hasMaster) => ({ hasMaster }),
  flight: (now, flight) => ({ flight }),
  hears_commands: (now, hears_commands) => ({ hears_commands }),
  pace: (now, pace) => ({ pace }),
  warnings: (now, warnings) => ({ warnings }),
  status(now, status) {
    if (status === now.status) return {};
    const reached = status === "paused" && now.reached && now.at - now.reached.told < TOGETHER ? now.reached : null;
    return { status, statusSince: now.at, reached, hadSimulation: now.hadSimulation || ![NO_SIMULATION, UNKNOWN].includes(status) };
  },
  stopped: () => ({}), // ends messages; the status has said it
  // What scripts hold; null if nobody looks any more, which says nothing of the flight.
  variables(now, variables) {
    if (variables === null) return {};
    const { file, line, time } = variables.reached ?? {};
    return { reached: file && variables.state === "paused" ? { file, line, time, told: now.at } : null };
  },

  // ---- flights of scripts
  flown: (now, flown) => ({ flown }),
  run: () => ({ failure: null, mended: null, notice: null }),
  answered: () => ({}), // by the simulator, to Run
  // The simulator's log says so, in the order of its failures.
  started: (now) => ({ failure: null, mended: null, notice: now.notice?.bad ? null : now.notice }),
  failure: (now, failure) => (isMended(now, failure) || isDoubled(now, failure) ? {} : { failure: { ...failure, told: now.at } }),

  // ---- the file in the editor
  opened: (now, open) => ({ open, saved: { text: "", bad: false } }),
  // The same text in another file, such as the user's copy of a script of the package: a failure goes with it.
  renamed: (now, open) => ({ open, failure: now.failure?.file === now.open.file ? { ...now.failure, file: open.file } : now.failure }),
  edited: (now) => ({ edits: now.edits + 1 }),
  saved: (now, text) => ({ saved: { text, bad: false } }),
  unsaved: (now, text) => ({ saved: { text, bad: true } }),
  saving: () => ({ saved: { text: "...", bad: false } }),
  // The line of the failure has moved, or is 0 because the user has written that line anew.
  moved(now, line) {
    if (!now.failure || now.failure.file !== now.open.file) return {};
    if (line) return { failure: { ...now.failure, line } };
    return { failure: null, mended: { key: keyOf(now.failure), at: now.at } };
  },
  // The editor has checked the open file: a syntax error that kept it from flying is gone, or another one stands there.
  checked(now, { file, found }) {
    if (now.failure?.phase !== NOT_STARTED || now.failure.file !== file) return {};
    const error = found.find(isSyntaxError);
    return { failure: error ? { ...now.failure, line: error.line, said: error.said } : null };
  },

  // ---- what is said
  say: (now, { kind, text }) => ({ message: text ? { kind, text, bad: Boolean(MESSAGES[kind].bad) } : null }),
  notice: (now, { text, bad }) => ({ notice: text ? { text, bad, told: now.at } : null }),
  grading: (now, isGrading) => ({ isGrading }),
};

export const NOT_STARTED = "not started"; // the phase of an error that kept the script from flying

// The time of a loss is that of the first one: further attempts fail, too.
function left(now, connection) {
  return { connection, since: now.connection === "connected" || now.connection === "connecting" ? now.at : now.since };
}

// While the page slept it could not hear anything: that is no silence of the cockpit.
const awoken = ({ at, ticked }) => (ticked && at - ticked > BLOCKED ? { heard: at } : {});

const isRead = ({ at, notice }) => notice && !notice.bad && at - notice.told > READ;

// A flight that has begun after a failure, and goes on, shows that the failure is over.
function settled({ at, status, statusSince, flight, failure }) {
  const isOver = failure && status === "flying" && failure.told < statusSince && at - statusSince > SETTLED && flight !== "script failed";
  return isOver ? { failure: null } : {};
}

export class Store {
  // `clock` returns ms.
  constructor(clock = () => performance.now()) {
    this.clock = clock;
    this.now = { ...BEGINNING, at: clock() };
    this.listeners = [];
  }

  // Calls `show` with what is true, now and after every event.
  on(show) {
    this.listeners.push(show);
    show(this.now);
  }

  take(event, content) {
    const now = { ...this.now, at: this.clock() };
    const changed = { ...now, ...EVENTS[event](now, content) };
    const ends = now.message && event !== "say" && MESSAGES[now.message.kind].ends.includes(event);
    this.now = ends ? { ...changed, message: null } : changed;
    if (event === "heard") return; // with every picture; the next tick shows it
    for (const show of this.listeners) show(this.now);
    if (event === "status" && content === "stopped" && now.status !== "stopped") this.take("stopped");
  }

  say(kind, text) {
    this.take("say", { kind, text });
  }
}
