// The log panel: the simulation's diagnostics, and its log, in which repeats are counted.
import { Console } from "./console.js";
import { at, create } from "./dom.js";

export class Log {
  /** @param {import("./board.js").Board} board */
  constructor(board) {
    this.lines = new Console(at("log-lines"));
    board.on("diagnosis", (all) => this.show(all));
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
  }
}
