// A dialog that asks for some values: texts, numbers, choices.
import { at, create } from "../dom.js";

// Show the dialog. `fields`: { label, value, type: "text", "number" or "choice", choices: [[value, words]], hint, and for
// numbers low, high, step }; the button `verb` calls `act(values)`, and the dialog shows the error that it throws.
export function askFor(title, fields, verb, act) {
  const dialog = at("ask");
  const message = create("p", { className: "said", role: "alert" });
  const inputs = fields.map(inputOf);
  const form = create("form", { method: "dialog" });
  const cancel = create("button", { type: "button", textContent: "Cancel", onclick: () => dialog.close() });
  const rows = fields.map(({ label, hint }, number) => create("label", { title: hint ?? "" }, create("span", { textContent: label }), inputs[number]));
  form.append(create("h2", { textContent: title }), ...rows, message, create("div", { className: "buttons" }, cancel, create("button", { className: "main", textContent: verb })));
  form.onsubmit = async (event) => {
    event.preventDefault();
    try {
      await act(inputs.map((one) => (one.type === "number" ? one.valueAsNumber : one.value.trim())));
      dialog.close();
    } catch (error) {
      message.textContent = error.message;
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
