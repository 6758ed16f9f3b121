// A field for a number, or for arithmetic: taken when it is entered, put back where it is none. Arrow keys step it, and so
// does the mouse that drags it sideways: then others see each value, and all together are one step of undo.
import { create } from "../dom.js";
import { compute } from "./compute.js";
import { follow } from "./follow.js";

const PIXELS = 8; // of a drag, for one step
const SAID = 120; // ms between two values of a drag that are taken

export const shown = (value, digits = 4) => (Number.isFinite(value) ? String(Number(value.toFixed(digits))) : "");
const fine = (value, digits) => (value && Math.abs(value) < 0.1 ? String(Number(value.toPrecision(digits))) : shown(value, digits));

/**
 * @typedef {HTMLInputElement & { fill: (value: unknown) => void, isDragged: boolean }} NumberField
 * @typedef {{ take: (value: number | null, merge?: string) => unknown, wrong: (line: string) => void, undo: (merge: string) => unknown,
 *   digits?: number, step?: number, low?: number | null, high?: number | null,
 *   isWhole?: boolean, isFine?: boolean, mayBeEmpty?: boolean, title?: string }} NumberOptions
 */

// `take(value)` gets a new number, `wrong(line)` what is said of a bad one. While it is dragged, `take(value, merge)` gets
// values with the key of the drag, and `undo(merge)` takes them back if the drag is cancelled. The element's `fill(value)` shows one,
// unless somebody writes there. `isFine` shows small numbers, too; `mayBeEmpty`: nothing is null.
/**
 * @param {string} label
 * @param {NumberOptions} options
 */
export function numberField(label, { take, wrong, undo, digits = 4, step = 0.1, low, high, isWhole = false, isFine = false, mayBeEmpty = false, ...more }) {
  const asText = (value) => (isFine ? fine : shown)(value, digits);
  const field = /** @type {NumberField} */ (create("input", { type: "text", inputMode: "decimal", autocomplete: "off", spellcheck: false, "aria-label": label, ...more }));
  let holds, taken; // the number that is told, and the text that has been taken since
  const written = () => field.value.trim().replace(",", ".");
  const counts = () => taken ?? asText(holds);
  const isNew = () => written() !== counts();
  field.fill = (value) => {
    const isWritten = field.isDragged || (document.activeElement === field && isNew());
    holds = value;
    taken = undefined;
    if (!isWritten) field.value = asText(value);
  };
  const enter = () => {
    if (!isNew()) return; // the browser itself tells of a change after Enter
    const text = written();
    const isNothing = text === "" && mayBeEmpty;
    const value = text === "" ? NaN : compute(text);
    const isIn = Number.isFinite(value) && value >= (low ?? -Infinity) && value <= (high ?? Infinity) && !(isWhole && value % 1);
    if (isNothing || isIn) {
      taken = isNothing ? "" : asText(value);
      field.value = taken;
      return void take(isNothing ? null : value);
    }
    wrong(`${label} = ${field.value.slice(0, 40)}: must be a ${isWhole ? "whole " : ""}number${range(low, high)}`);
    field.value = counts();
  };
  field.onchange = enter;
  const clamp = (value) => Math.min(high ?? Infinity, Math.max(low ?? -Infinity, value));
  drag(field, { value: () => holds, limit: (value) => Number(asText(clamp(value))), asText, take, undo, step });
  field.onfocus = () => field.select();
  field.onkeydown = (event) => {
    const way = { ArrowUp: 1, ArrowDown: -1 }[event.key];
    if (way && Number.isFinite(holds)) {
      event.preventDefault();
      field.value = asText(compute(written()) + way * step);
      enter();
    }
    if (event.key === "Enter") enter();
    if (event.key !== "Escape") return;
    field.value = counts();
    field.blur();
    event.stopPropagation();
  };
  return field;
}

function range(low, high) {
  const ends = [low === undefined || low === null ? "" : ` from ${low}`, high === undefined || high === null ? "" : ` to ${high}`];
  return ends.join("");
}

// A press focuses the field; a drag takes other values.
function drag(field, { value, limit, asText, take, undo, step }) {
  field.onmousedown = (event) => document.activeElement === field || event.preventDefault(); // no focus before it is known which
  field.onpointerdown = (event) => {
    if (event.button || field.disabled || document.activeElement === field) return;
    const from = value();
    const merge = `number-${Math.random().toString(36).slice(2)}`;
    let now = from, told = from, telling;
    const tell = async () => {
      while (now !== told) await take((told = now), merge);
      telling = undefined;
    };
    const move = (moved) => {
      const steps = Math.trunc((moved.clientX - event.clientX) / PIXELS);
      field.isDragged ||= steps !== 0 && Number.isFinite(from);
      if (!field.isDragged) return;
      now = limit(from + steps * step);
      field.value = asText(now);
      telling ??= setTimeout(tell, SAID);
    };
    const up = (_, isCancelled) => {
      const { isDragged } = field;
      field.isDragged = false;
      clearTimeout(telling);
      if (isCancelled && told !== from) undo(merge);
      else if (isCancelled) field.fill(value());
      else if (isDragged) tell();
      else field.focus();
    };
    follow(event, move, up);
  };
}
