// A script's page: the selection of a flight, and the time in replay and plots.
"use strict";

const get = (id) => document.getElementById(id);
const replay = new Replay(get("canvas"));
const plots = new Plots(get("plots"), (time) => seek(time));
const clock = { time: 0, end: 0, playing: false, last: 0 };
let start = 0; // s, the time at which a flight is shown first

// ---- time

function seek(time) {
  clock.time = Math.min(clock.end, Math.max(0, time));
  get("scrub").value = clock.time;
  get("time").textContent = `${clock.time.toFixed(2)} / ${clock.end.toFixed(2)} s`;
  replay.draw(clock.time);
  plots.show(clock.time);
}

function play(on) {
  clock.playing = on && clock.end > 0;
  get("play").textContent = clock.playing ? "❚❚" : "▶";
  if (!clock.playing) return;
  if (clock.time >= clock.end) seek(0);
  clock.last = performance.now();
  requestAnimationFrame(tick);
}

function tick(now) {
  if (!clock.playing) return;
  seek(clock.time + (Math.max(0, now - clock.last) / 1000) * Number(get("speed").value));
  clock.last = Math.max(now, clock.last);
  clock.time >= clock.end ? play(false) : requestAnimationFrame(tick);
}

get("play").addEventListener("click", () => play(!clock.playing));
get("scrub").addEventListener("input", () => seek(Number(get("scrub").value)));
for (const button of document.querySelectorAll("[data-at]")) {
  button.addEventListener("click", () => {
    play(false);
    seek(Number(button.dataset.at));
  });
}
document.addEventListener("keydown", (event) => {
  if (event.target.closest("input, select, button, a")) return;
  const step = { ArrowLeft: -0.05, ArrowRight: 0.05 }[event.key];
  if (event.key === " ") play(!clock.playing);
  else if (step) seek(clock.time + step);
  else return;
  event.preventDefault();
});

// ---- the view

function choose(name) {
  replay.view.show(name);
  for (const button of document.querySelectorAll("#views button")) {
    button.classList.toggle("chosen", button.dataset.view === name);
  }
  replay.draw(clock.time);
}

for (const button of document.querySelectorAll("#views button")) {
  button.addEventListener("click", () => choose(button.dataset.view));
}
get("canvas").addEventListener("pointerdown", (event) => get("canvas").setPointerCapture(event.pointerId));
get("canvas").addEventListener("pointermove", (event) => {
  if (!event.buttons) return;
  replay.view.turn(-0.008 * event.movementX, 0.008 * event.movementY);
  replay.draw(clock.time);
});
get("canvas").addEventListener("wheel", (event) => {
  event.preventDefault();
  replay.view.zoom = Math.min(20, Math.max(0.2, replay.view.zoom * Math.exp(-0.001 * event.deltaY)));
  replay.draw(clock.time);
}, { passive: false });
window.addEventListener("resize", () => {
  if (!plots.flight) return;
  plots.load(plots.flight);
  seek(clock.time);
});

// ---- the flight

function show(key) {
  play(false);
  for (const section of document.querySelectorAll(".flight")) section.classList.toggle("chosen", section.id === key);
  for (const link of document.querySelectorAll("nav a")) link.classList.toggle("chosen", link.dataset.key === key);
  const { file, note } = get(key).dataset;
  get("note").textContent = note;
  get("replay").hidden = get("plots").hidden = !file;
  if (!file || report.flights[key]) return load(key);
  const script = document.createElement("script");
  script.src = file;
  script.onload = () => load(key);
  script.onerror = () => (get("note").textContent = `${file} is missing`);
  document.body.appendChild(script);
}

function load(key) {
  const flight = report.flights[key];
  if (!get(key).classList.contains("chosen")) return;
  get("stage").dataset.shown = key;
  if (!flight) return;
  clock.end = flight.t[flight.t.length - 1];
  get("scrub").max = clock.end;
  get("marks").replaceChildren(...flight.marks.map((mark) => {
    const tick = document.createElement("i");
    tick.style.left = `${(100 * mark.at) / clock.end}%`;
    tick.title = mark.name;
    return tick;
  }));
  replay.load(flight);
  plots.load(flight);
  seek(start);
}

function follow() {
  const keys = [...document.querySelectorAll(".flight")].map((section) => section.id);
  const [wanted, at] = decodeURIComponent(location.hash.slice(1)).split("@"); // a flight, and a time in it
  start = Number(at) || 0;
  if (keys.length) show(keys.includes(wanted) ? wanted : keys[0]);
}

window.addEventListener("hashchange", follow);
choose("space");
follow();
