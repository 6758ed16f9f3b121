// The page's functions for a course: the teacher's message to all students, and the page on which a teacher only watches.
import { at } from "./dom.js";
import { keep, kept } from "./storage.js";

const PUT_AWAY = "to-all"; // the storage key of the time of the last message that the user closed

// Whether this page only watches (`?watch`): the cockpit refuses all its changes.
export const isWatching = new URLSearchParams(location.search).has("watch");

export class ToAll {
  // `take(lesson)` starts a task, `load(scene)` loads a scene of the list.
  /** @param {import("./board.js").Board} board */
  constructor(board, take, load) {
    const [words, task, scene, close] = at("to-all").children;
    board.on("to_all", (message) => {
      at("to-all").hidden = !message || message.time === kept(PUT_AWAY, "");
      if (!message) return;
      words.textContent = message.text;
      const putAway = () => {
        keep(PUT_AWAY, message.time);
        at("to-all").hidden = true;
      };
      const offer = (button, what, open) => {
        button.hidden = !what;
        button.textContent = `Open ${what}`;
        button.onclick = () => {
          putAway();
          open();
        };
      };
      close.onclick = putAway;
      offer(task, message.task, () => take(`tasks/${message.task}`));
      offer(scene, message.scene && `the scene ${message.scene.replace(/\.ya?ml$/, "")}`, () => load(`course/${message.scene}`));
    });
  }
}
