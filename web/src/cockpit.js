// The page around the scene: held keys, the script in an editor with its text, and what floats over the scene. The rest
// is viser's, in the frame.
import { Teleop } from "./teleop.js";
import { Console } from "./console.js";
import { Lesson } from "./lesson.js";
import { Scripts } from "./scripts.js";
import { split } from "./split.js";
import { Windows } from "./windows.js";
import { PageSocket } from "./socket.js";

const at = (id) => document.getElementById(id);

// Does something with the scene's window, which may have been there before this script.
function inScene(act) {
  const frame = at("scene");
  if (frame.contentDocument.readyState === "complete" && frame.contentWindow.location.href !== "about:blank") act(frame.contentWindow);
  frame.addEventListener("load", () => act(frame.contentWindow));
}

function show({ saved, said, bad = false, lists, script, of, question, flown }) {
  if (flown !== undefined) at("flown").textContent = flown && `${flown} flies`;
  if (saved !== undefined) {
    at("saved").textContent = saved;
    at("saved").classList.toggle("bad", bad);
  }
  if (said !== undefined) {
    at("said").textContent = said;
    at("said").classList.toggle("bad", bad);
  }
  if (lists) offer(lists);
  if (script) at("script").value = script;
  if (of !== undefined) lesson.has(script, of);
  if (question !== undefined) ask(question);
}

function offer({ groups, lessons, folder }) {
  const made = groups.map(({ name, scripts }) => {
    const group = document.createElement("optgroup");
    group.label = name === "mine" ? `mine: ${folder}` : name;
    group.append(...scripts.map((one) => new Option(one, one)));
    return group;
  });
  at("script").replaceChildren(...made);
  lesson.offer(lessons);
}

// A question above the text, with an answer for each button.
function ask(question) {
  at("question").hidden = !question;
  if (!question) return;
  const buttons = question.choices.map(([label, action]) => {
    const button = document.createElement("button");
    button.textContent = label;
    button.onclick = () => action().catch(tell);
    return button;
  });
  at("question").replaceChildren(question.said, " ", ...buttons);
}

const tell = (error) => show({ said: error.message, bad: true });

function told(message) {
  if (message.windows) windows.show(message.windows);
  if (message.pictures) windows.showPictures(message.pictures);
  if (message.failure) scripts.fail(message.failure);
  if (message.log) log.add(message.log);
}

// viser paints everything, shadows too, with whatever the browser has.
function paintsInSoftware() {
  const gl = document.createElement("canvas").getContext("webgl2");
  const names = gl?.getExtension("WEBGL_debug_renderer_info");
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(names ? gl.getParameter(names.UNMASKED_RENDERER_WEBGL) : "");
}

const run = () => {
  log.clear();
  return scripts.run(lesson.name).catch(tell);
};
const open = (script) => scripts.open(script).catch(tell);

const lesson = new Lesson(
  {
    choice: at("lesson"), before: at("before"), after: at("after"), fold: at("fold"),
    body: at("lesson-body"), start: at("start"), flies: at("flies"), text: at("lesson-text"),
    grade: at("grade"), graded: at("graded"),
  },
  (...question) => socket.ask(...question),
  open,
  () => scripts.save(),
);
let isLost = false;
const socket = new PageSocket(
  told,
  (data) => windows.picture(data),
  () => {
    if (isLost) show({ said: "" });
    isLost = false;
    if (paintsInSoftware()) socket.ask("spare").catch(tell);
    socket.ask("windows").then(told, () => {}); // told anyway, once the node is ready
    scripts.connected().catch(tell);
  },
  () => {
    isLost = true;
    windows.clear();
    show({ said: "the cockpit's node does not answer; what you write is kept here until it does. Started anew, it has a new address.", bad: true });
  },
);
const log = new Console(at("console"));
const windows = new Windows(at("windows"), socket);
const scripts = new Scripts(at("text"), socket, { show }, (name) => lesson.go(name));
scripts.onRun = run;
const teleop = new Teleop(
  (command) => socket.hold(command),
  ({ vx, vy, vz, wz }) => {
    const [x, y, z, turn] = [vx, vy, vz, wz].map((value) => (value < 0 ? "" : "+") + value.toFixed(2));
    at("command").textContent = `vx ${x}  vy ${y}  vz ${z} m/s  wz ${turn} rad/s`;
  },
);

at("script").onchange = () => open(at("script").value);
at("run").onclick = run;
at("revert").onclick = () => scripts.revert().catch(tell);
at("as").onclick = () => {
  at("as-form").hidden = !at("as-form").hidden;
  at("name").value = scripts.is.script.split("/").pop();
  if (!at("as-form").hidden) at("name").select();
};
at("as-form").onsubmit = (event) => {
  event.preventDefault();
  scripts.saveAs(at("name").value.trim()).then(() => (at("as-form").hidden = true)).catch(tell);
};
at("name").onkeydown = (event) => {
  if (event.key === "Escape") at("as-form").hidden = true;
};
at("toggle").onclick = () => {
  const wide = document.body.classList.toggle("wide");
  at("toggle").setAttribute("aria-expanded", String(!wide));
};
window.addEventListener("keydown", (event) => {
  if (event.defaultPrevented || !(event.ctrlKey || event.metaKey)) return;
  if (event.key === "Enter") run();
  if (event.key !== "s") return;
  event.preventDefault(); // the browser would save the page
  scripts.save().catch(tell);
});
at("help-open").onclick = () => at("sheet").showModal();
at("help-close").onclick = () => at("sheet").close();
const letGo = (event) => event.key === "Escape" && socket.ask("let go").catch(tell);
window.addEventListener("keydown", letGo);
inScene((scene) => scene.addEventListener("keydown", letGo));
window.addEventListener("beforeunload", (event) => scripts.drafts.isSafe(scripts.is.script) || event.preventDefault());
split(at("beside"), "--editor", "x", 300, () => window.innerWidth - 320, (event) => window.innerWidth - event.clientX);
const above = () => at("lesson-body").getBoundingClientRect().top;
split(at("under"), "--lesson", "y", 60, () => window.innerHeight - 260, (event) => event.clientY - above());
teleop.listenTo(window);
inScene((scene) => teleop.listenTo(scene));
teleop.stick(at("left"), "wz", "vz");
teleop.stick(at("right"), "vy", "vx");
