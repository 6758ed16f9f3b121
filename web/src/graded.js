// The display of a grade: its progress, the result card of each flight, and the user's best points for each task.
import { create } from "./dom.js";
import { keep, kept } from "./storage.js";

const BEST = "best"; // the storage key of the best grade of each task: { task: { points, of } }

const digits = (points) => String(Number(points.toFixed(2)));

export const bestOf = (task) => kept(BEST, {})[task] ?? null;

export function bestWords(task) {
  const best = bestOf(task);
  return best ? `${digits(best.points)} of ${digits(best.of)} points` : "";
}

export function keepBest(task, { points, of }) {
  const best = bestOf(task);
  if (points === undefined || (best && best.points >= points)) return;
  keep(BEST, { ...kept(BEST, {}), [task]: { points, of } });
}

// Show the progress of a grade: `flights` of `seeds` flights are done; `seeds` is 0 until it is known.
export function showProgress(element, { flights = 0, seeds = 0 }) {
  const words = seeds ? `Flying without pictures: seed ${Math.min(flights, seeds - 1)}, flight ${Math.min(flights + 1, seeds)} of ${seeds}` : "Flying without pictures ...";
  if (element.querySelector(".progress")?.textContent === words) return;
  const bar = seeds ? create("progress", { max: seeds, value: flights, "aria-label": "flights flown" }) : "";
  element.replaceChildren(create("p", { className: "progress" }, words), bar);
}

// Return the card of a flight. `html` comes from the cockpit's own templates, which escape all other text.
function cardOf(html, page, replay) {
  const template = create("template", { innerHTML: html });
  for (const link of template.content.querySelectorAll("a.when")) {
    Object.assign(link, { href: `${page}${link.getAttribute("href")}`, title: "Replay this second in the scene" });
    link.onclick = (event) => {
      if (event.ctrlKey || event.metaKey || event.shiftKey) return; // the report opens in another tab
      event.preventDefault();
      replay(Number(link.dataset.at));
    };
  }
  return template.content;
}

const seedWords = ({ seed, passed, points, of }) => `${passed ? "✓" : "✗"} seed ${seed}: ${digits(points)}/${digits(of)}`;

// Show the flights, and the card of the worst one. `replay(folder, flight, seed, second)` shows a flight in the scene.
/**
 * @param {HTMLElement} element
 * @param {{ script: string, isOld: boolean }} graded
 * @param {wire.Grade} result
 */
export function showGrade(element, { script, isOld }, { problem, points, of, flights = [], cards = [], page = "" }, replay) {
  const old = isOld ? create("p", { className: "progress" }, "The script has been changed since.") : "";
  if (!flights.length) return element.replaceChildren(create("p", { className: "bad" }, problem), old);
  const passed = flights.filter((one) => one.passed).length;
  const sum = `${script}: ${digits(points)} of ${digits(of)} points; ${passed} of ${flights.length} flights passed`;
  const place = create("div");
  const choose = (index) => {
    const folder = page.slice(0, page.lastIndexOf("/") + 1);
    place.replaceChildren(cardOf(cards[index], page, (second) => replay(folder, index, flights[index].seed, second)));
    for (const [at, button] of [...seeds.children].entries()) button.setAttribute("aria-pressed", String(at === index));
  };
  const seeds = create("div", { className: "seeds", role: "group", "aria-label": "Flights" });
  seeds.append(...flights.map((one, index) => create("button", { type: "button", onclick: () => choose(index) }, seedWords(one))));
  const report = create("a", { href: page, target: "_blank" }, "Replay and plots of all flights");
  element.replaceChildren(create("p", {}, sum), old, seeds, place, create("p", {}, report));
  choose(flights.reduce((worst, one, index) => (one.points < flights[worst].points ? index : worst), 0));
}
