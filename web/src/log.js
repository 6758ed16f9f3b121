// What the simulation says of itself: why it does not fly, and its log, with counts instead of repeats.
import { Console } from "./console.js";
import { at, create } from "./dom.js";

const DEAF = "This script does not listen to commands: its flight is in the script. Stage 6 of the tutorial does, and pilot.py.";

export class Log {
  constructor(board) {
    this.lines = new Console(at("log-lines"));
    board.on("diagnosis", (all) => this.show(all));
    for (const part of ["hears_commands", "status"]) board.on(part, () => this.showDeaf(board));
  }

  // A script that is stopped listens to nothing, whichever it is.
  showDeaf(board) {
    const isDeaf = board.get("hears_commands", true) === false && board.get("status", "") !== "stopped";
    for (const id of ["deaf", "sheet-deaf"]) {
      at(id).hidden = !isDeaf;
      at(id).textContent = at(id).title = isDeaf ? DEAF : "";
    }
    document.body.classList.toggle("deaf", isDeaf);
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
