// The texts that describe the store's facts, and which buttons are enabled. Every function takes the facts of the store.
import { NO_SIMULATION, SILENCE, answers, hasSimulator, isReachable, secondsOfSilence } from "./facts.js";
import { NOT_STARTED } from "./store.js";

/** @typedef {import("./store.js").Facts} Facts */

const nameOf = (file) => file.split("/").pop();
const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);

// ---- the connection

// Return the text of the banner over the scene, "" while the scene is up to date.
/** @param {Facts} now */
export function bannerWords(now) {
  const { connection, since, at } = now;
  if (connection === "connecting") return at - since > SILENCE * 1000 ? "Connecting to the cockpit ..." : "";
  if (connection === "refused") return "The cockpit was started again and does not know this page. Open the address that it has printed in the terminal.";
  if (connection === "lost") return `No connection to the cockpit for ${Math.round((at - since) / 1000)} s: reconnecting. What you write is kept here until then.`;
  if (!isReachable(now)) return `No data from the cockpit for ${Math.round(secondsOfSilence(now))} s: it is stopped, or the network is slow.`;
  if (!now.hasMaster) return "The ROS master does not answer: waiting for it.";
  if (now.hasEnded || (now.status === NO_SIMULATION && now.hadSimulation)) return "The simulator has ended: start it again.";
  if (now.status === NO_SIMULATION) return "There is no simulator yet: waiting for one.";
  if (now.isFrozen) return `No data from the simulator for ${Math.round(now.silent)} s: its process is stopped, or the network is slow.`;
  return "";
}

// ---- the flight

// Return the breakpoint at which the flight is paused, null if there is none.
/** @param {Facts} now */
export const pauseOf = (now) => (now.connection === "connected" && now.status === "paused" ? now.reached : null);

/** @param {Facts} now */
const isFailed = (now) => now.flight === "script failed";

/** @param {Facts} now */
export function statusWords(now) {
  if (now.connection === "lost" || now.connection === "refused") return "No connection";
  if (hasSimulator(now) && !answers(now)) return "No answer";
  if (answers(now) && now.status === "flying" && now.flown === "") return "Running"; // there is no vehicle
  const says = now.status === "flying" && now.flight && !now.flight.startsWith("unknown") ? now.flight : now.status;
  return capital(now.status === "stopped" && isFailed(now) ? now.flight : says);
}

const DEAF = "This script does not listen to commands: its flight is in the script. Stage 6 of the tutorial does, and pilot.py.";

// Return a hint if the script ignores commands. A stopped script gets no hint: none listens to commands while it is stopped.
/** @param {Facts} now */
export const deafWords = (now) => (answers(now) && !now.hearsCommands && now.status !== "stopped" ? DEAF : "");

/** @param {Facts} now */
export const paceWords = (now) => (answers(now) && Number(now.pace) ? `${Number(now.pace).toFixed(2)} ×` : "");

/** @param {Facts} now */
export function diagnosisWords(now) {
  if (!answers(now)) return "The simulator does not answer; this is what it said last.";
  return now.warnings.length ? "" : "Nothing is wrong.";
}

// Return the text beside Run: the state of the simulator's script, which may be another one than the open script.
/** @param {Facts} now */
export function flyingWords(now) {
  if (!now.flown || !answers(now)) return { text: "", is: "" };
  const is = isFailed(now) ? "failed" : now.status;
  const does = { failed: "has failed", flying: "flies", paused: "is paused", stopped: "is stopped" }[is] ?? is;
  return { text: now.flown === now.open.script ? does : `${now.flown} ${does}`, is };
}

/** @param {NonNullable<Facts["failure"]>} failure */
function failureWords(failure, open) {
  const place = failure.file === open.file ? `line ${failure.line}` : `${nameOf(failure.file)}, line ${failure.line}`;
  return `${failure.phase}, ${place}: ${failure.said}`;
}

// Return the console's line about the error that kept the script from starting. Other errors are in the log.
/** @param {Facts} now */
export const consoleWords = ({ failure }) =>
  failure?.phase === NOT_STARTED ? `error: [load] ${failure.file}:${failure.line}: ${failure.said}` : "";

function pauseWords({ file, line, time }, open) {
  return `paused at line ${line}${file === open.file ? "" : ` of ${nameOf(file)}`}, t = ${time.toFixed(2)} s`;
}

// Return the line below the script: { text, bad }. The message of a failed action comes first, then the script's error.
/** @param {Facts} now */
export function saidWords(now) {
  const { message, failure } = now;
  const pause = pauseOf(now);
  if (message?.bad) return message;
  if (failure) return { text: failureWords(failure, now.open), bad: true };
  if (pause) return { text: pauseWords(pause, now.open), bad: false };
  return message ?? { text: "", bad: false };
}

// Return the marked lines of the open file: the line that failed, and the line of the pause; 0 if there is none.
/** @param {Facts} now */
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

/**
 * Returns whether each button is enabled, by its id.
 * @returns {Record<string, boolean>}
 * @param {Facts} now
 */
export function abilities(now) {
  const can = answers(now);
  return {
    ...Object.fromEntries(OF_SIMULATOR.map((id) => [id, can])),
    "sim-start": can && now.status !== "flying",
    grade: isReachable(now) && !now.isGrading,
    more: isReachable(now),
  };
}
