// Keys of edit mode; none of them flies the drone. The help sheet lists them. Digits are recognized by the position of the
// key: on a French keyboard, these keys alone write & or é.
const isWriting = (target) => target.closest?.("input:not([type=checkbox], [type=range]), textarea, select, article, [contenteditable], dialog");

export const KEYS = {
  "1": "translate", "2": "rotate", "3": "scale", "4": "frame",
  g: "grid", m: "measure", b: "floor", delete: "remove", f2: "rename",
  "ctrl+c": "copy", "ctrl+d": "duplicate", "ctrl+z": "undo", "ctrl+y": "redo", "ctrl+shift+z": "redo",
  "ctrl+a": "all", "ctrl+g": "group", "ctrl+s": "save", "ctrl+o": "open", "ctrl+f": "find",
};
const ANYWHERE = ["save"]; // actions whose keys also work in text fields

// Listen for keys. `acts`: actions by name; `isOn()`: whether edit mode is on; `isAway(target)`: whether another part of the
// page has the keys. `paste(text)` gets the text of Ctrl+V from the paste event, the only way that works in every browser.
export function listen(acts, paste, isOn, isAway) {
  window.addEventListener("paste", (event) => {
    if (!isOn() || event.defaultPrevented || isAway(event.target) || isWriting(event.target)) return;
    event.preventDefault();
    paste(event.clipboardData?.getData("text/plain") ?? "");
  });
  window.addEventListener("keydown", (event) => {
    if (!isOn() || event.defaultPrevented || event.altKey || isAway(event.target)) return;
    const ctrl = event.ctrlKey || event.metaKey ? "ctrl+" : "";
    const shift = ctrl && event.shiftKey ? "shift+" : "";
    const [, digit] = /^Digit(\d)$/.exec(event.code) ?? [];
    const act = KEYS[`${ctrl}${shift}${digit ?? event.key.toLowerCase()}`];
    if (!act || (isWriting(event.target) && !ANYWHERE.includes(act))) return;
    if (act === "copy" && String(window.getSelection())) return; // the browser copies the selected text
    event.preventDefault();
    if (!event.repeat || act === "undo" || act === "redo") acts[act]();
  });
}
