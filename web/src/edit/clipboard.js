// Copy and paste of objects by the system's clipboard. They are YAML there, as in a scene file, so that they can be copied
// to and from another scene, page or editor.
const MOST = 4e6; // characters, limit for a paste

export class Clipboard {
  /** @param {import("./edit.js").Edit} edit */
  constructor(edit) {
    this.edit = edit;
  }

  async copy() {
    const { edit } = this;
    const objects = edit.selected.filter((one) => edit.objects.get(one));
    if (!objects.length) return edit.wrong("Nothing is selected: click on what is to be copied.");
    try {
      const { text } = await edit.ask("objects_text", { objects });
      await write(text);
      edit.notice.say(edit.named("copied:", objects));
    } catch (error) {
      edit.wrong(error.message);
    }
  }

  paste(text) {
    const { edit } = this;
    if (!text.trim()) return edit.wrong("There is no text on the clipboard: copy objects first, or YAML as in a scene file.");
    if (text.length > MOST) return edit.wrong(`What is on the clipboard has ${text.length} characters: ${MOST} are pasted at most.`);
    return edit.make([{ do: "paste", text }], "Paste", true);
  }

  // Paste without Ctrl+V, as by the menu. The browser may ask the user for permission to read the clipboard, or refuse.
  async ask() {
    try {
      await this.paste(await navigator.clipboard.readText());
    } catch {
      this.edit.wrong("The browser does not let the page read the clipboard: press Ctrl+V.");
    }
  }
}

// Write a text to the clipboard. Without https, a page from another machine can do this only during a copy event.
async function write(text) {
  if (navigator.clipboard) return navigator.clipboard.writeText(text);
  const fill = (event) => {
    event.preventDefault();
    event.clipboardData.setData("text/plain", text);
  };
  document.addEventListener("copy", fill, { once: true });
  const isDone = document.execCommand("copy");
  document.removeEventListener("copy", fill);
  if (!isDone) throw new Error("The browser does not let the page copy.");
}
