// Conditions derived from the store's facts: whether the cockpit can be reached, and whether the simulator answers.
/** @typedef {import("./store.js").Facts} Facts */

export const NO_SIMULATION = "no simulation";
export const UNKNOWN = ""; // the status before the cockpit has sent it
export const SILENCE = 3; // s without a message after which the cockpit counts as unreachable; it sends a heartbeat every second

/** @param {Facts} now */
export const secondsOfSilence = (now) => (now.connection === "connected" ? (now.at - now.heard) / 1000 : 0);

/** @param {Facts} now */
export const isReachable = (now) => now.connection === "connected" && secondsOfSilence(now) <= SILENCE;

/** @param {Facts} now */
export const hasSimulator = ({ status, hasEnded }) => status !== UNKNOWN && status !== NO_SIMULATION && !hasEnded;

// Return whether the simulator answers, so that its buttons have an effect.
/** @param {Facts} now */
export const answers = (now) => isReachable(now) && now.hasMaster && hasSimulator(now) && !now.isFrozen;
