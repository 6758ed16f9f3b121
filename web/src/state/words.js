// What the page says about what is true, and what its buttons can do. All functions take the facts of the store.
import { NO_SIMULATION, NOT_STARTED, UNKNOWN } from "./store.js";

export const SILENCE = 3; // s after which the page says that nothing comes; the cockpit's heartbeat comes every second

const nameOf = (file) => file.split("/").pop();
const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);

// ---- the connection

const quietFor = (now) => (now.connection === "connected" ? (now.at - now.heard) / 1000 : 0);

export const isReachable = (now) => now.connection === "connected" && quietFor(now) <= SILENCE;

const isThere = ({ status, hasEnded }) => status !== UNKNOWN && status !== NO_SIMULATION && !hasEnded;
const isFrozen = (now) => now.silent > SILENCE;

// Whether the simulator answers, so that its buttons can do something.
export const answers = (now) => isReachable(now) && now.hasMaster && isThere(now) && !isFrozen(now);

// The banner over the scene: "" while what the scene shows is what happens.
export function bannerWords(now) {
  const { connection, since, at } = now;
  if (connection === "connecting") return at - since > SILENCE * 1000 ? "Connecting to the cockpit ..." : "";
  if (connection === "refused") return "The cockpit was started again and does not know this page. Open the address that it has printed in the terminal.";
  if (connection === "lost") return `No connection to the cockpit for ${Math.round((at - since) / 1000)} s: reconnecting. What you write is kept here until then.`;
  if (!isReachable(now)) return `No data from the cockpit for ${Math.round(quietFor(now))} s: it is stopped, or the network is slow.`;
  if (!now.hasMaster) return "The ROS master does not answer: waiting for it.";
  if (now.hasEnded || (now.status === NO_SIMULATION && now.hadSimulation)) return "The simulator has ended: start it again.";
  if (now.status === NO_SIMULATION) return "There is no simulator yet: waiting for one.";
  if (isFrozen(now)) return `No data from the simulator for ${Math.round(now.silent)} s: its process is stopped, or the network is slow.`;
  return "";
}

// ---- the flight

// The breakpoint at which the flight is paused, null if it is not.
export const pauseOf = (now) => (now.connection === "connected" && now.status === "paused" ? now.reached : null);

const isFailed = (now) => now.flight === "script failed";

export function statusWords(now) {
  if (now.connection === "lost" || now.connection === "refused") return "No connection";
  if (isThere(now) && !answers(now)) return "No answer";
  const says = now.status === "flying" && now.flight && !now.flight.startsWith("unknown") ? now.flight : now.status;
  return capital(now.status === "stopped" && isFailed(now) ? now.flight : says);
}

const DEAF = "This script does not listen to commands: its flight is in the script. Stage 6 of the tutorial does, and pilot.py.";

// A script that is stopped listens to nothing, whichever it is.
export const deafWords = (now) => (answers(now) && !now.hears_commands && now.status !== "stopped" ? DEAF : "");

export const paceWords = (now) => (answers(now) && Number(now.pace) ? `${Number(now.pace).toFixed(2)} ×` : "");

export function diagnosisWords(now) {
  if (!answers(now)) return "The simulator does not answer; this is what it said last.";
  return now.warnings.length ? "" : "Nothing is wrong.";
}

// What the script that the simulator has does, beside the button that would fly the open one.
export function flyingWords(now) {
  if (!now.flown || !answers(now)) return { text: "", is: "" };
  const is = isFailed(now) ? "failed" : now.status;
  const does = { failed: "has failed", flying: "flies", paused: "is paused", stopped: "is stopped" }[is] ?? is;
  return { text: now.flown === now.open.script ? does : `${now.flown} ${does}`, is };
}

function failureWords({ failure, open }) {
  const place = failure.file === open.file ? `line ${failure.line}` : `${nameOf(failure.file)}, line ${failure.line}`;
  return `${failure.phase}, ${place}: ${failure.said}`;
}

// The line of the console about what keeps the script from flying; its place is a link. Other errors are in the log.
export const consoleWords = ({ failure }) =>
  failure?.phase === NOT_STARTED ? `error: [load] ${failure.file}:${failure.line}: ${failure.said}` : "";

function pauseWords({ file, line, time }, open) {
  return `paused at line ${line}${file === open.file ? "" : ` of ${nameOf(file)}`}, t = ${time.toFixed(2)} s`;
}

// The line below the script: { text, bad }. An action that has just failed comes first, then the script's error.
export function saidWords(now) {
  const { message, failure } = now;
  const pause = pauseOf(now);
  if (message?.bad) return message;
  if (failure) return { text: failureWords(now), bad: true };
  if (pause) return { text: pauseWords(pause, now.open), bad: false };
  return message ?? { text: "", bad: false };
}

// The lines of the open file that are marked: where it failed, and where it is paused; 0 for none.
export function markedLines(now) {
  const pause = pauseOf(now);
  const { failure, open } = now;
  return {
    failed: failure?.file === open.file && failure.phase !== NOT_STARTED ? failure.line : 0,
    paused: pause?.file === open.file ? pause.line : 0,
  };
}

// ---- buttons

const OF_SIMULATOR = [
  "sim-pause", "sim-step", "sim-restart", "sim-stop", "snapshot", "restore", "takeoff", "land", "go-home", "reset",
  "speed", "scene-choice", "vehicle", "run",
];

// Whether each button, by its id, can do anything.
export function abilities(now) {
  const can = answers(now);
  return {
    ...Object.fromEntries(OF_SIMULATOR.map((id) => [id, can])),
    "sim-start": can && now.status !== "flying",
    grade: isReachable(now) && !now.isGrading,
    more: isReachable(now),
  };
}
