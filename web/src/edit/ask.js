// A small window that asks for some values: names, numbers, one of several.
import { at, create } from "../dom.js";

// `fields`: { label, value, type: "text", "number" or "choice", choices: [[value, words]], hint }; `act(values)` does
// what is asked for, and what it throws is told in the window. `verb` is on the button.
export function askFor(title, fields, verb, act) {
  const dialog = at("ask");
  const said = create("p", { className: "said", role: "alert" });
  const inputs = fields.map(inputOf);
  const form = create("form", { method: "dialog" });
  const cancel = create("button", { type: "button", textContent: "Cancel", onclick: () => dialog.close() });
  const rows = fields.map(({ label, hint }, number) => create("label", { title: hint ?? "" }, create("span", { textContent: label }), inputs[number]));
  form.append(create("h2", { textContent: title }), ...rows, said, create("div", { className: "buttons" }, cancel, create("button", { className: "main", textContent: verb })));
  form.onsubmit = async (event) => {
    event.preventDefault();
    try {
      await act(inputs.map((one) => (one.type === "number" ? one.valueAsNumber : one.value.trim())));
      dialog.close();
    } catch (error) {
      said.textContent = error.message;
      inputs[0]?.focus();
    }
  };
  dialog.replaceChildren(form);
  dialog.setAttribute("aria-label", title);
  dialog.showModal();
  inputs[0]?.focus();
  inputs[0]?.select?.();
}

function inputOf({ label, value, type = "text", choices, low, high, step }) {
  if (type === "choice") {
    const select = create("select", { "aria-label": label }, ...choices.map(([one, words]) => new Option(words, one)));
    select.value = value;
    return select;
  }
  const more = type === "number" ? { min: low, max: high, step: step ?? "any" } : { maxLength: 200, spellcheck: false, autocomplete: "off" };
  return create("input", { "aria-label": label, type, value, ...more, required: true });
}
