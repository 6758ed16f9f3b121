// The main module of the page: creates scene, editor, lesson, panels, windows and manual control, and connects them.
import { Teleop, nameKeys } from "./teleop.js";
import { Desk } from "./desk.js";
import { isWatching } from "./course.js";
import { at } from "./dom.js";
import { Lesson } from "./lesson.js";
import { Scripts } from "./scripts.js";
import { Panels } from "./panels.js";
import { Replay } from "./replay.js";
import { Scene } from "./scene/scene.js";
import { putInto } from "./snippets.js";
import { split } from "./split.js";
import { Windows } from "./windows.js";
import { PageSocket } from "./socket.js";
import { show as showFacts } from "./state/show.js";
import { Store } from "./state/store.js";
import { abilities } from "./state/words.js";

const LINE_FEED = 10;

const store = new Store();

document.body.classList.toggle("watching", isWatching);

function show({ lists, script, of, question }) {
  if (lists) offer(lists);
  if (script) at("script").value = script;
  if (of !== undefined) lesson.has(script, of);
  if (question !== undefined) ask(question);
}

function offer({ groups, lessons, folder }) {
  const optionGroups = groups.map(({ name, scripts }) => {
    const group = document.createElement("optgroup");
    group.label = name === "mine" ? `mine: ${folder}` : name;
    group.append(...scripts.map((one) => new Option(one, one)));
    return group;
  });
  at("script").replaceChildren(...optionGroups);
  lesson.offer(lessons);
}

// Show a question above the script, with a button for each answer; null hides it.
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

const tell = (error) => store.say("trouble", error.message);

/** @param {wire.Told} message */
function handleMessage(message) {
  panels.told(message);
  if (message.windows) windows.show(message.windows);
  if (message.pictures) windows.showPictures(message.pictures);
  if (message.failure) store.take("failure", message.failure);
  if (message.log) desk.console.add(message.log);
  if (message.variables !== undefined) desk.take(message.variables);
}

// Handle a binary message: a header, which is a line of JSON, and the data of a scene or a camera picture.
/** @param {ArrayBuffer} data */
function handleBytes(data) {
  const bytes = new Uint8Array(data);
  const end = bytes.indexOf(LINE_FEED);
  const header = JSON.parse(new TextDecoder().decode(bytes.subarray(0, end)));
  const content = bytes.subarray(end + 1);
  if ("scene" in header) scene.take(header, content);
  else windows.picture(header, content);
}

const run = () => fly(true);
async function fly(mayAsk) {
  if (!abilities(store.now).run) return;
  desk.console.begin();
  try {
    const leaves = await scripts.run(lesson.name, mayAsk);
    if (leaves) askWhere(leaves);
    else ask(null);
  } catch (error) {
    tell(error);
  }
}
function askWhere(scene) {
  const go = ["Leave my scene", () => fly(false)];
  const stay = ["Fly in my scene, close the text", () => lesson.take("").then(run)];
  ask({ said: `This text flies in ${scene}, not in your scene.`, choices: [go, stay] });
}
const open = (script) => scripts.open(script).catch(tell);
const put = (code) => {
  try {
    store.say("inserted", putInto(scripts.editor.view, scripts.is.script, code));
    return true;
  } catch (error) {
    tell(error);
    return false;
  }
};

const beginTutorial = () => {
  const text = lesson.all.find((one) => !one.task && one.script);
  if (text) open(text.script);
};
// Start a task. After a start by keyboard, the focus moves to the task's text, so that the next Tab continues there.
const beginTask = async (name, byKey) => {
  await lesson.take(name);
  if (byKey) at("lesson-body").focus();
};
const scene = new Scene(at("scene"), { say: (message) => socket.say(message) });
window.scene = scene; // for debugging in the browser's console, and for tests
const replay = new Replay(scene, store);
const panels = new Panels({
  store,
  socket: () => socket,
  scene: () => scene,
  go: { tutorial: beginTutorial, tasks: () => lesson.all.filter((one) => one.task), take: beginTask },
  open,
  goTo: (file, line) => scripts.goTo(file, line).catch((error) => panels.notice.say(error.message, true)),
});
const lesson = new Lesson(
  {
    choice: at("lesson"), before: at("before"), after: at("after"), fold: at("fold"),
    body: at("lesson-body"), start: at("start"), flies: at("flies"), text: at("lesson-text"),
    grade: at("grade"), handIn: at("hand-in"), graded: at("graded"),
  },
  store,
  (ask, more) => socket.ask(ask, more),
  { open, put, run, save: () => scripts.save(), replay: (...flight) => replay.open(...flight).catch(tell) },
);
const socket = new PageSocket(store, {
  tell: handleMessage,
  picture: handleBytes,
  open: () => {
    panels.connected().catch(tell);
    socket.ask("windows").then(handleMessage, () => {}); // after an error, the cockpit sends them once it is ready
    scripts.connected().catch(tell);
    desk.connected().catch(tell);
    lesson.connected();
  },
  close: () => {
    panels.lost();
    windows.clear();
  },
});
const windows = new Windows(at("windows"), socket, panels.notice);
const desk = new Desk(socket, store, show);
const scripts = new Scripts(at("text"), socket, store, { show }, (name) => lesson.follow(name), desk.known, () => desk.look());
desk.serve(scripts);
scripts.onRun = run;
const teleop = new Teleop(
  (command) => socket.hold(command),
  ({ vx, vy, vz, wz }) => {
    const [x, y, z, turn] = [vx, vy, vz, wz].map((value) => (value < 0 ? "" : "+") + value.toFixed(2));
    at("command").textContent = `vx ${x}  vy ${y}  vz ${z} m/s  wz ${turn} rad/s`;
  },
);

store.on(showFacts);
at("script").onchange = () => open(at("script").value);
at("run").onclick = run;
window.addEventListener("keydown", (event) => {
  if (event.defaultPrevented || !(event.ctrlKey || event.metaKey)) return;
  if (event.key === "Enter") run();
  if (event.key !== "s") return;
  event.preventDefault(); // the browser would save the page
  scripts.save().catch(tell);
});
window.addEventListener("beforeunload", (event) => scripts.drafts.isSafe(scripts.is.script) || event.preventDefault());
split(at("beside"), "--editor", "x", 300, () => Math.max(300, window.innerWidth - 320), (event) => window.innerWidth - event.clientX);
const lessonTop = () => at("lesson-body").getBoundingClientRect().top;
split(at("under"), "--lesson", "y", 60, () => window.innerHeight - 260, (event) => event.clientY - lessonTop());
teleop.listenTo(window);
nameKeys(document.querySelectorAll(".flight-keys kbd"));
teleop.stick(at("left"), "wz", "vz");
teleop.stick(at("right"), "vy", "vx");
