// What the simulation says of itself: why it does not fly, and its log, with counts instead of repeats.
import { Console } from "./console.js";
import { at, create } from "./dom.js";

const DEAF = "This script does not listen to commands: its flight is in the script. Stage 6 of the tutorial does, and pilot.py.";

export class Log {
  constructor(board) {
    this.lines = new Console(at("log-lines"));
    board.on("diagnosis", (all) => this.show(all));
    board.on("hears_commands", (hears) => {
      for (const id of ["deaf", "sheet-deaf"]) {
        at(id).hidden = hears;
        at(id).textContent = at(id).title = hears ? "" : DEAF;
      }
      document.body.classList.toggle("deaf", !hears);
    });
  }

  begin(lines) {
    this.lines.clear();
    for (const line of lines) this.lines.add(line);
  }

  add(line) {
    this.lines.add(line);
  }

  show(all) {
    const row = ({ of, said, wrong }) =>
      create("li", { className: wrong ? "wrong" : "" }, create("b", { textContent: `${of}: ` }), said);
    at("diagnosis").replaceChildren(...all.map(row));
    at("diagnosis-says").textContent = all.some((one) => one.wrong) ? "" : "Nothing is wrong.";
  }
}
