// The display of the store's facts. No other code changes the lines, badges and buttons that depend on them.
import { at } from "../dom.js";
import { answers } from "./facts.js";
import {
  abilities, bannerWords, deafWords, diagnosisWords, flyingWords, paceWords, pauseOf, saidWords, statusWords,
} from "./words.js";

/** @typedef {import("./store.js").Facts} Facts */

// Parts of the page, other than single buttons, that are disabled while no simulator answers.
const PARTS_OF_SIMULATOR = /** @type {const} */ (["build-bar", "shelf", "tune-groups", "left", "right"]);

function write(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

// Make an element focusable if its text is higher than itself, so that keys can scroll it.
function makeScrollable(element) {
  element.tabIndex = element.scrollHeight > element.clientHeight + 1 ? 0 : -1;
}

function showLine(element, { text, bad }) {
  if (element.textContent === text && element.classList.contains("bad") === Boolean(bad)) return;
  write(element, text);
  element.classList.toggle("bad", Boolean(bad));
  makeScrollable(element);
}

/** @param {Facts} now */
function showFlying(now) {
  const { text, is } = flyingWords(now);
  write(at("flying"), text);
  at("flying").dataset.is = is;
  at("flying").classList.toggle("is-shown", now.flown === now.open.script);
  write(at("flown"), text && now.flown);
  at("flown").dataset.is = is;
  at("flown").title = text && `The script of the drone: ${is}`;
}

/** @param {Facts} now */
function showStatus(now) {
  const pause = pauseOf(now);
  write(at("status"), statusWords(now));
  at("status").dataset.is = answers(now) ? now.status : "no simulation";
  at("status").title = pause ? `Paused by the breakpoint at line ${pause.line} of ${pause.file}` : "";
  const { warnings } = now;
  const hasWarnings = warnings.length > 0 && answers(now);
  at("why").hidden = !hasWarnings;
  write(at("why"), warnings.length === 1 ? "1 warning" : `${warnings.length} warnings`);
  at("why").title = `${warnings.join("\n")}\n(opens the log)`;
  at("state").classList.toggle("wrong", hasWarnings);
  at("sim-pause").setAttribute("aria-pressed", String(now.status === "paused"));
}

const withoutNumbers = (text) => text.replace(/\d+/g, "");

/** @param {Facts} now */
function showFlight(now) {
  const deaf = deafWords(now);
  for (const id of /** @type {const} */ (["deaf", "sheet-deaf"])) {
    at(id).hidden = !deaf;
    write(at(id), deaf);
    at(id).title = deaf;
  }
  document.body.classList.toggle("deaf", Boolean(deaf));
  write(at("pace"), paceWords(now));
  write(at("diagnosis-says"), diagnosisWords(now));
}

/** @param {Facts} now */
function showBanner(now) {
  const words = bannerWords(now);
  // A screen reader reads the banner once, not whenever its count of seconds changes.
  const isNew = withoutNumbers(words) !== withoutNumbers(at("banner").textContent);
  at("banner").setAttribute("aria-live", isNew ? "assertive" : "off");
  write(at("banner"), words);
  at("banner").hidden = !words;
  document.body.classList.toggle("outdated", Boolean(words)); // the scene may differ from the simulation
}

/** @param {Facts} now */
function showNotice({ notice }) {
  showLine(at("notice-text"), notice ?? { text: "", bad: false });
  at("notice").classList.toggle("bad", Boolean(notice?.bad));
  at("notice").classList.toggle("empty", !notice);
}

/** @param {Facts} now */
function showButtons(now) {
  for (const [id, can] of Object.entries(abilities(now))) {
    const button = at(/** @type {"run"} */ (id)); // or a <select>
    if (button.disabled === can) button.disabled = !can;
  }
  for (const id of PARTS_OF_SIMULATOR) at(id).inert = !answers(now);
}

/** @param {Facts} now */
export function show(now) {
  showBanner(now);
  showStatus(now);
  showFlight(now);
  showFlying(now);
  showLine(at("said"), saidWords(now));
  showLine(at("saved"), now.saved);
  showNotice(now);
  showButtons(now);
}
