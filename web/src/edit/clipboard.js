// Copy and paste by the system's clipboard: objects are YAML there, as in a scene file, for another scene, another page or
// an editor, and from one.
const MOST = 4e6; // characters that the node is asked to paste

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

  // Without the key, a browser may ask whether the page may see the clipboard, or not give it.
  async ask() {
    try {
      await this.paste(await navigator.clipboard.readText());
    } catch {
      this.edit.wrong("The browser does not let the page read the clipboard: press Ctrl+V.");
    }
  }
}

// Of a page that came from another machine without https, browsers take a text only while a copy is under way.
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
