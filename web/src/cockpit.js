// The page around the scene: held keys, the script in an editor, and what floats over the scene. The rest is viser's.
import { Editor } from "./editor.js";
import { Flying } from "./flying.js";
import { Windows } from "./windows.js";
import { Wire } from "./wire.js";

const at = (id) => document.getElementById(id);

function show({ saved, said, bad = false, scripts, script }) {
  if (saved !== undefined) {
    at("saved").textContent = saved;
    at("saved").classList.toggle("bad", bad);
  }
  if (said !== undefined) {
    at("said").textContent = said;
    at("said").classList.toggle("bad", bad);
  }
  if (scripts) at("script").replaceChildren(...scripts.map((name) => new Option(name, name)));
  if (script) at("script").value = script;
}

function told(message) {
  if (message.windows) windows.show(message.windows);
  if (message.pictures) windows.showPictures(message.pictures);
  if (message.failure) {
    const { file, line, said, phase } = message.failure;
    show({ said: `${phase}, line ${line}: ${said}`, bad: true });
    if (file.endsWith(editor.script.split("/").pop())) editor.mark({ line, said });
  }
}

async function opened() {
  wire.ask("windows").then(told, () => {});
  const flown = await editor.list();
  if (!editor.script) await editor.open(flown);
  show({ said: "" });
}

function closed() {
  windows.clear();
  show({ said: "the cockpit's node does not answer", bad: true });
}

const tell = (error) => show({ said: error.message, bad: true });
const wire = new Wire(told, (data) => windows.picture(data), () => opened().catch(tell), closed);
const windows = new Windows(at("windows"), wire);
const editor = new Editor(at("text"), (...question) => wire.ask(...question), show);
const flying = new Flying(
  (command) => wire.hold(command),
  ({ vx, vy, vz, wz }) => {
    const [x, y, z, turn] = [vx, vy, vz, wz].map((value) => (value < 0 ? "" : "+") + value.toFixed(2));
    at("command").textContent = `vx ${x}  vy ${y}  vz ${z} m/s  wz ${turn} rad/s`;
  },
);

at("script").onchange = () => editor.open(at("script").value).catch(tell);
at("run").onclick = () => editor.run().catch(tell);
at("revert").onclick = () => editor.revert().catch(tell);
at("toggle").onclick = () => {
  const wide = document.body.classList.toggle("wide");
  at("toggle").setAttribute("aria-expanded", String(!wide));
};
window.addEventListener("keydown", (event) => {
  if (event.key === "Enter" && event.ctrlKey) editor.run().catch(tell);
});
window.addEventListener("beforeunload", (event) => editor.dirty && event.preventDefault());
flying.listenTo(window);
at("scene").addEventListener("load", () => flying.listenTo(at("scene").contentWindow));
flying.stick(at("left"), "wz", "vz");
flying.stick(at("right"), "vy", "vx");
