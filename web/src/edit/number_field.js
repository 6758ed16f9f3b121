// Field for a number or for arithmetic; an entry that is neither is reset. Arrow keys step the number, and so does a
// sideways drag: the values of a drag are sent at intervals, and are a single step of undo.
import { create } from "../dom.js";
import { compute } from "./compute.js";
import { follow } from "./follow.js";

const PIXELS = 8; // of a drag per step
const PERIOD = 120; // ms between two values of a drag that are sent

export const shown = (value, digits = 4) => (Number.isFinite(value) ? String(Number(value.toFixed(digits))) : "");
const fine = (value, digits) => (value && Math.abs(value) < 0.1 ? String(Number(value.toPrecision(digits))) : shown(value, digits));

/**
 * @typedef {HTMLInputElement & { fill: (value: unknown) => void, isDragged: boolean }} NumberField
 * @typedef {{ take: (value: number | null, merge?: string) => unknown, wrong: (line: string) => void, undo: (merge: string) => unknown,
 *   digits?: number, step?: number, low?: number | null, high?: number | null,
 *   isWhole?: boolean, isFine?: boolean, mayBeEmpty?: boolean, title?: string }} NumberOptions
 */

// Return the field. It calls `take(value)` with a new number, `wrong(line)` with a message on a bad entry; in a drag,
// `take(value, merge)` with the key of the drag, and `undo(merge)` if the drag is cancelled. The element's `fill(value)` shows
// a value, unless the user is writing. `isFine` shows small numbers with `digits` significant digits; `mayBeEmpty`: empty is null.
/**
 * @param {string} label
 * @param {NumberOptions} options
 */
export function numberField(label, { take, wrong, undo, digits = 4, step = 0.1, low, high, isWhole = false, isFine = false, mayBeEmpty = false, ...more }) {
  const asText = (value) => (isFine ? fine : shown)(value, digits);
  const field = /** @type {NumberField} */ (create("input", { type: "text", inputMode: "decimal", autocomplete: "off", spellcheck: false, "aria-label": label, ...more }));
  let filled, entered; // the number of the last fill(), and the text that was entered since
  const typed = () => field.value.trim().replace(",", ".");
  const currentText = () => entered ?? asText(filled);
  const isNew = () => typed() !== currentText();
  field.fill = (value) => {
    const isInUse = field.isDragged || (document.activeElement === field && isNew());
    filled = value;
    entered = undefined;
    if (!isInUse) field.value = asText(value);
  };
  const enter = () => {
    if (!isNew()) return; // after Enter, the browser sends a change event for the same entry
    const text = typed();
    const isEmpty = text === "" && mayBeEmpty;
    const value = text === "" ? NaN : compute(text);
    const isValid = Number.isFinite(value) && value >= (low ?? -Infinity) && value <= (high ?? Infinity) && !(isWhole && value % 1);
    if (isEmpty || isValid) {
      entered = isEmpty ? "" : asText(value);
      field.value = entered;
      return void take(isEmpty ? null : value);
    }
    wrong(`${label} = ${field.value.slice(0, 40)}: must be a ${isWhole ? "whole " : ""}number${range(low, high)}`);
    field.value = currentText();
  };
  field.onchange = enter;
  const clamp = (value) => Math.min(high ?? Infinity, Math.max(low ?? -Infinity, value));
  drag(field, { value: () => filled, limit: (value) => Number(asText(clamp(value))), asText, take, undo, step });
  field.onfocus = () => field.select();
  field.onkeydown = (event) => {
    const direction = { ArrowUp: 1, ArrowDown: -1 }[event.key];
    if (direction && Number.isFinite(filled)) {
      event.preventDefault();
      const value = compute(typed());
      field.value = asText((Number.isFinite(value) ? value : filled) + direction * step);
      enter();
    }
    if (event.key === "Enter") enter();
    if (event.key !== "Escape") return;
    field.value = currentText();
    field.blur();
    event.stopPropagation();
  };
  return field;
}

function range(low, high) {
  const ends = [low === undefined || low === null ? "" : ` from ${low}`, high === undefined || high === null ? "" : ` to ${high}`];
  return ends.join("");
}

// Let a click focus the field, and a drag change its value.
function drag(field, { value, limit, asText, take, undo, step }) {
  field.onmousedown = (event) => document.activeElement === field || event.preventDefault(); // up() focuses it after a click
  field.onpointerdown = (event) => {
    if (event.button || field.disabled || document.activeElement === field) return;
    const from = value();
    const merge = `number-${Math.random().toString(36).slice(2)}`;
    let latest = from, sent = from, timer;
    const send = async () => {
      while (latest !== sent) await take((sent = latest), merge);
      timer = undefined;
    };
    const move = (moved) => {
      const steps = Math.trunc((moved.clientX - event.clientX) / PIXELS);
      field.isDragged ||= steps !== 0 && Number.isFinite(from);
      if (!field.isDragged) return;
      latest = limit(from + steps * step);
      field.value = asText(latest);
      timer ??= setTimeout(send, PERIOD);
    };
    const up = (_, isCancelled) => {
      const { isDragged } = field;
      field.isDragged = false;
      clearTimeout(timer);
      if (isCancelled && sent !== from) undo(merge);
      else if (isCancelled) field.fill(value());
      else if (isDragged) send();
      else field.focus();
    };
    follow(event, move, up);
  };
}
