// Mouse and touch input on rows of the object tree: a press selects; a drag to another row makes it the selection's parent.
import { create } from "../dom.js";
import { follow } from "./follow.js";
import { WORLD } from "./objects.js";

const DOUBLE = 400; // ms, longest time between the presses of a double click
const FAR = 5; // px of motion that make a press a drag
const EDGE = 24; // px from the upper and lower edge of the tree, where a drag scrolls it
const PACE = 8; // px per event

export class RowDrag {
  // `range(handle)` selects all rows up to that one; `twice()` is called after a double click.
  /**
   * @param {HTMLElement} tree
   * @param {import("./edit.js").Edit} edit
   * @param {(handle: number) => void} range
   * @param {() => void} twice
   */
  constructor(tree, edit, range, twice) {
    this.tree = tree;
    this.edit = edit;
    this.range = range;
    this.twice = twice;
    tree.addEventListener("pointerdown", (event) => this.down(event));
    window.addEventListener("keydown", (event) => event.key === "Escape" && this.end(), true);
  }

  handleAt(element) {
    const row = element?.closest?.("[data-handle]");
    return row && this.tree.contains(row) ? Number(row.dataset.handle) : undefined;
  }

  down(event) {
    if (event.button || event.target.closest("button, input")) return;
    const handle = this.handleAt(event.target);
    if (handle === undefined) return this.edit.select([]);
    const before = this.pressed;
    this.pressed = { handle, time: event.timeStamp };
    const isSecond = before?.handle === handle && event.timeStamp - before.time < DOUBLE;
    this.began = { handle, x: event.clientX, y: event.clientY, isSecond, isDone: false };
    follow(event, (moved) => this.began && this.move(moved, this.began), (ended, isCancelled) => (isCancelled ? this.end() : this.began && this.up(ended, this.began)));
    if (event.shiftKey) this.range(handle);
    else if (event.ctrlKey || event.metaKey) this.edit.toggle(handle);
    else if (!this.edit.has(handle)) this.edit.select([handle]);
    else return;
    this.began.isDone = true; // nothing is left to do at the release
  }

  move(event, { x, y }) {
    if (!this.label) {
      if (Math.hypot(event.clientX - x, event.clientY - y) < FAR || !this.edit.selected.every((one) => this.edit.mayMove(one))) return;
      const names = this.edit.selected.map((one) => this.edit.objects.existing(one).name);
      this.label = create("div", { className: "drag-label", textContent: names.length > 1 ? `${names.length} objects` : names[0] });
      document.body.append(this.label);
    }
    this.label.style.translate = `${event.clientX + 12}px ${event.clientY + 8}px`;
    this.aim(event);
  }

  // Mark the row under the mouse, the possible new parent, and scroll near the edges.
  aim({ clientX, clientY }) {
    const box = this.tree.getBoundingClientRect();
    if (clientY < box.top + EDGE) this.tree.scrollTop -= PACE;
    if (clientY > box.bottom - EDGE) this.tree.scrollTop += PACE;
    const over = document.elementFromPoint(clientX, clientY);
    const handle = this.tree.contains(over) ? this.handleAt(over) ?? WORLD : undefined;
    const isAllowed = handle !== undefined && this.edit.selected.every((one) => this.edit.objects.mayHangOn(one, handle));
    this.to = isAllowed ? handle : undefined;
    for (const row of this.tree.querySelectorAll(".aimed")) row.classList.remove("aimed");
    if (isAllowed && handle !== WORLD) over?.closest("[data-handle]")?.classList.add("aimed");
    this.tree.classList.toggle("aimed", isAllowed && handle === WORLD);
    this.label?.classList.toggle("wrong", !isAllowed);
  }

  up(event, { handle, isDone, isSecond }) {
    const { label, to } = this;
    this.end();
    if (label && to !== undefined) this.edit.hang(to, event.shiftKey);
    else if (!label && !isDone) this.edit.select([handle]);
    if (!label && isSecond) this.twice();
  }

  end() {
    this.label?.remove();
    this.label = this.began = this.to = undefined;
    this.tree.classList.remove("aimed");
    for (const row of this.tree.querySelectorAll(".aimed")) row.classList.remove("aimed");
  }
}
