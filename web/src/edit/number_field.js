// A field for a number: taken when it is entered, put back where it is none; arrow keys step it.
import { create } from "../dom.js";

export const shown = (value, digits = 4) => (Number.isFinite(value) ? String(Number(value.toFixed(digits))) : "");
const fine = (value, digits) => (value && Math.abs(value) < 0.1 ? String(Number(value.toPrecision(digits))) : shown(value, digits));

// `take(value)` gets a new number, `wrong(line)` what is said of a bad one. The element's `fill(value)` shows one,
// unless somebody writes there. `isFine` shows small numbers, too; `mayBeEmpty`: nothing is null.
export function numberField(label, { take, wrong, digits = 4, step = 0.1, low, high, isWhole = false, isFine = false, mayBeEmpty = false, ...more }) {
  const asText = (value) => (isFine ? fine : shown)(value, digits);
  const field = create("input", { type: "text", inputMode: "decimal", autocomplete: "off", spellcheck: false, "aria-label": label, ...more });
  let holds, taken; // the number that is told, and the text that has been taken since
  const written = () => field.value.trim().replace(",", ".");
  const counts = () => taken ?? asText(holds);
  const isNew = () => written() !== counts();
  field.fill = (value) => {
    const isWritten = document.activeElement === field && isNew();
    holds = value;
    taken = undefined;
    if (!isWritten) field.value = asText(value);
  };
  const enter = () => {
    if (!isNew()) return; // the browser itself tells of a change after Enter
    const text = written();
    const isNothing = text === "" && mayBeEmpty;
    const value = text === "" ? NaN : Number(text);
    const isIn = Number.isFinite(value) && !(value < low) && !(value > high) && !(isWhole && value % 1);
    if (isNothing || isIn) {
      taken = text;
      return void take(isNothing ? null : value);
    }
    wrong(`${label} = ${field.value.slice(0, 40)}: must be a ${isWhole ? "whole " : ""}number${range(low, high)}`);
    field.value = counts();
  };
  field.onchange = enter;
  field.onfocus = () => field.select();
  field.onkeydown = (event) => {
    const way = { ArrowUp: 1, ArrowDown: -1 }[event.key];
    if (way && Number.isFinite(holds)) {
      event.preventDefault();
      field.value = asText(Number(field.value) + way * step);
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
