// The replay of a graded flight in the scene: drone, path and boxes around the flight's objects, with a slider for the time.
import * as THREE from "three";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { at } from "./dom.js";
import { ACCENT } from "./scene/looks.js";
import { FREE } from "./scene/view.js";

const WIDTH = 3; // px, of the path
const BOX = 0x364fc7;
const NEAR = 0.5; // m, radius around the drone that the camera shows
const EDGES = [0, 1, 2, 3, 4, 5, 6, 7].flatMap((corner) => [1, 2, 4].filter((side) => !(corner & side)).map((side) => [corner, corner | side]));

// Return the value in a file of a report. The report's page loads the file as a script: report.NAME = {...};
async function valueOf(address) {
  const answer = await fetch(address);
  if (!answer.ok) throw new Error("the recording of this flight is gone: grade the script again");
  const text = await answer.text();
  return JSON.parse(text.slice(text.indexOf("{"), text.lastIndexOf("}") + 1));
}

export class Replay {
  /**
   * @param {import("./scene/scene.js").Scene} scene
   * @param {import("./state/store.js").Store} store
   */
  constructor(scene, store) {
    this.scene = scene;
    this.store = store;
    this.flight = null;
    this.latestAddress = ""; // the address of the flight that was requested last
    this.starts = 0;
    this.second = 0; // s, the time that is shown
    this.ghost = this.group = new THREE.Group(); // the drone, and everything that is drawn for the flight
    /** @type {{ view: string, focus: HTMLElement | null }} */
    this.before = { view: FREE, focus: null };
    this.asked = 0; // the animation frame that is requested during playback
    at("replay-play").onclick = () => this.play(!this.isPlaying);
    at("replay-time").oninput = () => (this.play(false), this.show(at("replay-time").valueAsNumber));
    at("replay-close").onclick = () => this.close();
    window.addEventListener("keydown", (event) => event.key === "Escape" && !event.defaultPrevented && !event.target?.closest?.("dialog") && this.close());
    store.on(({ starts }) => starts !== this.starts && this.close());
  }

  // Show a flight of a report at `second`, s; `folder` is the folder of the report's page.
  async open(folder, flight, seed, second) {
    const address = `${folder}flights/${flight}.js`;
    this.latestAddress = address;
    if (this.flight?.address !== address) {
      const figures = await valueOf(address);
      const { boxes } = figures.scene ?? (await valueOf(`${folder}files/scene.js`));
      if (address !== this.latestAddress) return; // another flight has been requested meanwhile
      this.close();
      this.begin({ address, seed, ...figures }, boxes);
    }
    this.show(second);
    this.frame();
  }

  begin(flight, boxes) {
    const { scene } = this;
    this.flight = flight;
    this.starts = this.store.now.starts;
    this.before = { view: scene.view.name, focus: document.activeElement };
    this.ghost = ghostOf(scene);
    this.group = new THREE.Group().add(this.ghost, pathOf(flight), outlines(boxes));
    scene.world.add(this.group);
    const slider = at("replay-time");
    Object.assign(slider, { min: flight.t[0], max: flight.t.at(-1), step: 0.05 });
    at("replay").hidden = false;
    document.body.classList.add("replaying");
    scene.turn(FREE);
    scene.replay = this;
    scene.rearrange();
    slider.focus();
  }

  close() {
    if (!this.flight) return;
    this.play(false);
    this.flight = this.scene.replay = null;
    this.group.removeFromParent();
    this.group.traverse((one) => one instanceof THREE.Mesh && one.userData.isOwn && one.geometry.dispose());
    at("replay").hidden = true;
    document.body.classList.remove("replaying");
    this.scene.turn(this.before.view);
    this.scene.rearrange();
    this.before.focus?.focus();
  }

  // Move the drone to its pose at `second`, s, and the camera by the same distance.
  show(second) {
    const { t, x, y, z, roll, pitch, yaw } = this.flight;
    const next = t.findIndex((one) => one >= second);
    const row = next < 0 ? t.length - 1 : next;
    const place = new THREE.Vector3(x[row], y[row], z[row]);
    this.scene.view.center.add(place.clone().sub(this.ghost.position));
    this.ghost.position.copy(place);
    this.ghost.rotation.set(roll[row], pitch[row], yaw[row], "ZYX");
    this.second = t[row];
    at("replay-time").value = t[row];
    at("replay-time").setAttribute("aria-valuetext", `${t[row].toFixed(2)} s`);
    at("replay-text").textContent = `Replay, seed ${this.flight.seed}: ${t[row].toFixed(2)} s`;
    this.scene.change();
  }

  frame() {
    this.scene.view.lookAt(this.ghost.position, NEAR);
    this.scene.change();
  }

  play(on) {
    this.isPlaying = on;
    at("replay-play").setAttribute("aria-pressed", String(on));
    cancelAnimationFrame(this.asked);
    if (!on) return;
    if (this.second >= this.flight.t.at(-1)) this.show(this.flight.t[0]);
    const began = performance.now() - 1000 * this.second;
    const go = (now) => {
      this.show((now - began) / 1000);
      if (this.second >= this.flight.t.at(-1)) return this.play(false);
      this.asked = requestAnimationFrame(go);
    };
    this.asked = requestAnimationFrame(go);
  }
}

// Return the scene's drone in one color, or a sphere if the scene has no drone.
function ghostOf(scene) {
  const paint = new THREE.MeshLambertMaterial({ color: ACCENT, transparent: true, opacity: 0.8, side: THREE.DoubleSide });
  const ghost = new THREE.Group();
  const base = scene.baseOf(scene.vehicle);
  scene.world.updateMatrixWorld();
  const back = base?.matrixWorld.clone().invert();
  for (const mesh of base ? scene.meshesOf(scene.vehicle) : []) {
    const part = new THREE.Mesh(mesh.geometry, paint);
    part.matrixAutoUpdate = false;
    part.matrix.multiplyMatrices(back, mesh.matrixWorld);
    ghost.add(part);
  }
  if (!base) ghost.add(own(new THREE.Mesh(new THREE.SphereGeometry(0.15), paint)));
  return ghost;
}

function own(object) {
  object.userData.isOwn = true; // close() disposes its geometry
  object.raycast = () => {}; // the pointer does not hit it
  return object;
}

function lines(points, look) {
  return own(new LineSegments2(new LineSegmentsGeometry().setPositions(points), new LineMaterial(look)));
}

function pathOf({ t, x, y, z }) {
  const points = [];
  for (let row = 1; row < t.length; row++) points.push(x[row - 1], y[row - 1], z[row - 1], x[row], y[row], z[row]);
  return lines(points, { color: ACCENT, linewidth: WIDTH });
}

// Return the edges of boxes around the objects of the flight's scene, which may differ from the scene that is shown.
function outlines(boxes) {
  const points = boxes.flatMap(({ corners }) => EDGES.flatMap(([from, to]) => [...corners[from], ...corners[to]]));
  return points.length ? lines(points, { color: BOX, linewidth: 1 }) : new THREE.Group();
}
