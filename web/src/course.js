// The page's part in a course: what a teacher tells all students, and the page on which a teacher only watches.
import { at } from "./dom.js";
import { keep, kept } from "./storage.js";

const PUT_AWAY = "to-all"; // the time of the last message that was put away

// The cockpit refuses everything that such a page would change.
export const isWatching = new URLSearchParams(location.search).has("watch");

export class ToAll {
  // `take(lesson)` begins a task.
  /** @param {import("./board.js").Board} board */
  constructor(board, take) {
    const [words, open, close] = at("to-all").children;
    board.on("to_all", (message) => {
      at("to-all").hidden = !message || message.time === kept(PUT_AWAY, "");
      if (!message) return;
      words.textContent = message.text;
      open.hidden = !message.task;
      open.textContent = `Open ${message.task}`;
      const putAway = () => {
        keep(PUT_AWAY, message.time);
        at("to-all").hidden = true;
      };
      close.onclick = putAway;
      open.onclick = () => {
        putAway();
        take(`tasks/${message.task}`);
      };
    });
  }
}
