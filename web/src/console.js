// What the simulation says, and its script with it, under the script: counts instead of repeats, lines to click.
const MOST = 200; // lines
const RECENT = 5; // lines among which one is sought that says the same
const PLACE = /(\/[^\s:]+\.(?:py|lua)):(\d+)/;
const OF_TIME = /^(?:warning: step late by|(?:paused|stopped\b[^:]*): \/clock)/;

export class Console {
  // `goTo(file, line)` shows a line of a script.
  constructor(list, goTo) {
    this.list = list;
    this.goTo = goTo;
    this.current = ""; // the line that is shown as long as it is true
  }

  add(line) {
    const same = line.startsWith("warning: ") ? line.replace(/\d+/g, "0") : line; // "step late by 80 ms (3 so far)"
    const follows = this.list.scrollTop + this.list.clientHeight >= this.list.scrollHeight - 20;
    let item = [...this.list.children].slice(-RECENT).find((one) => one.same === same);
    if (!item) {
      item = Object.assign(document.createElement("li"), { same, times: 0 });
      this.list.append(item);
    }
    item.times += 1;
    const ofTime = OF_TIME.test(line) ? "of-time" : "";
    item.className = [/^(warning|error): /.exec(line)?.[1] ?? "", ofTime].join(" ").trim();
    item.replaceChildren(...this.parts(line), ...(item.times > 1 ? [`  (${item.times} times)`] : []));
    while (this.list.children.length > MOST) this.list.firstElementChild.remove();
    if (follows) this.list.scrollTop = this.list.scrollHeight;
  }

  // Shows a line only as long as it is true; "" ends it. Returns whether there was none before.
  showCurrent(line) {
    const before = this.current;
    if (line === before) return false;
    for (const item of [...this.list.children]) if (item.same === before) item.remove();
    this.current = line;
    if (line) this.add(line);
    return !before;
  }

  // The place of an error is a button that goes there.
  parts(line) {
    const found = PLACE.exec(line);
    if (!found) return [line];
    const [place, file, number] = found;
    const button = Object.assign(document.createElement("button"), {
      textContent: `${file.split("/").pop()}:${number}`,
      title: `Go to line ${number} of ${file}`,
      className: "place",
      onclick: () => this.goTo(file, Number(number)),
    });
    return [line.slice(0, found.index), button, line.slice(found.index + place.length)];
  }

  // Shows what is said of lateness and clocks, or not.
  showTime(on) {
    this.list.classList.toggle("without-time", !on);
  }

  clear() {
    this.list.replaceChildren();
  }

  // Begins with nothing, for another flight.
  begin() {
    this.clear();
    this.current = "";
  }
}
