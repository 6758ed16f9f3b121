// The list of messages from the simulation and its script. Repeats are counted, and places in scripts are links.
const MOST = 200; // lines
const RECENT = 5; // last lines; a repeat of one of these is counted, not added
const PLACE = /(\/[^\s:]+\.(?:py|lua)):(\d+)/;
const OF_TIME = /^(?:warning: step late by|(?:paused|stopped\b[^:]*): \/clock)/;

export class Console {
  // `goTo(file, line)` shows a line of a script.
  constructor(list, goTo) {
    this.list = list;
    this.goTo = goTo;
    this.current = ""; // the line that showCurrent has shown
  }

  add(line) {
    const same = line.startsWith("warning: ") ? line.replace(/\d+/g, "0") : line; // ignores the numbers in "step late by 80 ms (3 so far)"
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

  // Show a line about a condition that still holds, in place of the one before; "" removes it. Return whether one appeared.
  showCurrent(line) {
    const before = this.current;
    if (line === before) return false;
    for (const item of [...this.list.children]) if (item.same === before) item.remove();
    this.current = line;
    if (line) this.add(line);
    return !before;
  }

  // Return the parts of a line; a place in a script becomes a button that goes there.
  parts(line) {
    const match = PLACE.exec(line);
    if (!match) return [line];
    const [place, file, number] = match;
    const button = Object.assign(document.createElement("button"), {
      textContent: `${file.split("/").pop()}:${number}`,
      title: `Go to line ${number} of ${file}`,
      className: "place",
      onclick: () => this.goTo(file, Number(number)),
    });
    return [line.slice(0, match.index), button, line.slice(match.index + place.length)];
  }

  // Show or hide the messages about late steps and the clock.
  showTime(on) {
    this.list.classList.toggle("without-time", !on);
  }

  clear() {
    this.list.replaceChildren();
  }

  // Empty the list before another flight.
  begin() {
    this.clear();
    this.current = "";
  }
}
