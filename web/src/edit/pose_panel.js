// Panel for position (m) and orientation (degrees), relative to the world or to the parent, as in V-REP's dialogs.
import { create } from "../dom.js";
import { keep, kept } from "../storage.js";
import { numberField } from "./number_field.js";
import { matrixOfNumbers, numbersOf, seenFrom } from "./poses.js";
import { FRAMES_OF_NUMBERS } from "./frames.js";

const AXES = [["X", "x"], ["Y", "y"], ["Z", "z"]];
const ANGLES = [["Alpha", "α"], ["Beta", "β"], ["Gamma", "γ"]];

export class PosePanel {
  /**
   * @param {HTMLElement} element
   * @param {import("./edit.js").Edit} edit
   */
  constructor(element, edit) {
    this.edit = edit;
    /** @type {number[]} */
    this.numbers = []; // of the pose at the start of a drag, with the changes of the drag
    this.relative = create("select", { "aria-label": "Relative to", title: "The axes and origin of the numbers" });
    this.relative.append(...Object.entries(FRAMES_OF_NUMBERS).map(([value, words]) => new Option(words, value)));
    this.relative.value = kept("edit/relative", "world");
    this.relative.onchange = () => {
      keep("edit/relative", this.relative.value);
      this.fill();
    };
    this.fields = [...AXES.map(([name]) => this.field(name, "m", 4, 0.1)), ...ANGLES.map(([name]) => this.field(name, "degrees", 3, 15))];
    const row = (words, unit, from) => {
      const cells = [...(from ? ANGLES : AXES)].map(([, sign], at) => create("label", {}, create("span", { textContent: sign }), this.fields[from + at]));
      return create("div", { className: "triple" }, create("span", { className: "what" }, words, create("small", { textContent: ` ${unit}` })), ...cells);
    };
    const title = "About its own x, then y, then z: V-REP's Euler angles. A scene file's rpy turns about the parent's axes";
    const turn = row("Orientation", "°", 3);
    turn.title = title;
    element.append(create("div", { className: "line" }, "Relative to", this.relative), row("Position", "m", 0), turn);
    edit.on("objects", () => this.fill());
    edit.on("selection", () => this.fill());
  }

  field(name, unit, digits, step) {
    const number = () => this.fields.indexOf(field);
    const wrong = (line) => this.edit.wrong(line);
    const field = numberField(`${name}, ${unit}`, { take: (value, merge) => this.take(number(), value, merge), undo: (merge) => this.edit.undo("undo", merge), wrong, digits, step });
    return field;
  }

  get one() {
    return this.edit.objects.get(this.edit.last);
  }

  get frame() {
    return this.edit.frameOf(this.edit.last, this.relative.value);
  }

  fill() {
    const { one } = this;
    const numbers = one ? numbersOf(seenFrom(this.frame, one.matrix)) : [];
    const isFixed = !one || !this.edit.mayMove(one.handle);
    this.fields.forEach((field, at) => {
      field.fill(numbers[at]);
      field.disabled = isFixed;
      field.title = isFixed ? "Where a part of a vehicle sits is written in the text" : "";
    });
  }

  // Change one number of the pose. The others keep all their digits; in a drag, they stay as at its start.
  take(number, value, merge) {
    const { one } = this;
    if (!one) return; // the object was removed during the drag
    if (!merge || merge !== this.merge) this.numbers = numbersOf(seenFrom(this.frame, one.matrix));
    this.merge = merge;
    this.numbers[number] = value;
    return this.edit.place(new Map([[one.handle, this.frame.clone().multiply(matrixOfNumbers(this.numbers))]]), undefined, merge);
  }
}
