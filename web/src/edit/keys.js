// The keys of editing: none of them flies. Letters with Ctrl, digits, and few others; the help sheet lists them. A digit is
// the key in its place: on a French keyboard, that key alone writes & or é.
const isWriting = (target) => target.closest?.("input:not([type=checkbox], [type=range]), textarea, select, article, [contenteditable], dialog");

export const KEYS = {
  "1": "translate", "2": "rotate", "3": "scale", "4": "frame",
  g: "grid", m: "measure", b: "floor", delete: "remove", f2: "rename",
  "ctrl+c": "copy", "ctrl+d": "duplicate", "ctrl+z": "undo", "ctrl+y": "redo", "ctrl+shift+z": "redo",
  "ctrl+a": "all", "ctrl+g": "group", "ctrl+s": "save", "ctrl+o": "open", "ctrl+f": "find",
};
const ANYWHERE = ["save"]; // also while one writes in a field

// `acts` by their names; `isOn()` tells whether one edits; `isAway(target)` whether the keys are somebody else's.
// `paste(text)` gets what Ctrl+V brings, which only its own event has in every browser.
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
    if (act === "copy" && String(window.getSelection())) return; // marked text is copied
    event.preventDefault();
    if (!event.repeat || act === "undo" || act === "redo") acts[act]();
  });
}
