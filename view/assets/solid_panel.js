/** The panel of the part in 3D: loads what it needs when it is opened. */

import { ask, get, poll } from "./api.js";
import { byId, pitchOf } from "./format.js";

/** Shows the part of the first stack, its layer and findings. */
export class SolidPanel {
  #app;
  #solid = null;
  #places = null;

  constructor(app) {
    this.#app = app;
    const panel = byId("solid");
    panel.addEventListener("toggle", () => panel.open && this.#open(), { once: true });
    app.state.on(["stack", "layer"], () => this.#update());
    byId("cut").addEventListener("change", () => this.#update());
  }

  async #open() {
    const tell = (text) => (byId("solid-state").textContent = text);
    try {
      if (!hasWebGl()) return tell("This browser shows no 3D: it has no WebGL, or it is switched off.");
      tell("Making the surface …");
      let last;
      await poll("/api/surface", (state) => {
        last = state;
        if (state.of) tell(`Making the surface: ${state.done} of ${state.of} layers.`);
      });
      if (last.status !== "ready") return tell(last.message ?? "There is no surface.");
      const surface = await (await ask("/api/surface.bin")).arrayBuffer();
      const { Solid } = await import("./solid.js");
      this.#places = await placesOf(this.#app.columnsOf(0));
      this.#solid = new Solid(byId("solid-view"), surface);
      tell("");
      this.#listen();
      this.#mark();
      this.#update();
    } catch (error) {
      tell(error.message);
    }
  }

  #listen() {
    const { element, orbit } = this.#solid;
    let pressed = [0, 0];
    element.addEventListener("pointerdown", ({ clientX, clientY }) => (pressed = [clientX, clientY]));
    element.addEventListener("click", (event) => {
      if (Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > 4) return;
      const marker = this.#solid.markerAt(event);
      if (marker != null) this.#app.findings.show(this.#marked[marker]);
    });
    const keys = {
      ArrowLeft: () => orbit.turn(0.1, 0),
      ArrowRight: () => orbit.turn(-0.1, 0),
      ArrowUp: () => orbit.turn(0, 0.1),
      ArrowDown: () => orbit.turn(0, -0.1),
      "+": () => orbit.zoom(0.8),
      "-": () => orbit.zoom(1.25),
    };
    element.addEventListener("keydown", (event) => {
      if (!keys[event.key]) return;
      keys[event.key]();
      event.preventDefault();
      event.stopPropagation();
    });
    this.#app.findings?.addEventListener("change", () => this.#mark());
  }

  /** The findings that have a place. */
  get #marked() {
    return (this.#app.findings?.list ?? []).filter((finding) => finding.at);
  }

  #mark() {
    const marked = this.#marked;
    this.#solid.setMarkers(marked.map(({ at, layer }) => this.#places.point(at, layer)));
    this.#solid.choose(marked.findIndex(({ id }) => id === this.#app.findings.current));
  }

  #update() {
    const { stack, layer } = this.#app.state.view;
    if (this.#solid && stack === 0) this.#solid.setPlane(this.#places.top(layer), byId("cut").checked);
  }
}

/** Asks on a canvas of its own: three.js would print an error. */
function hasWebGl() {
  return document.createElement("canvas").getContext("webgl2") != null;
}

/** Returns where pixels and layers are in the surface's coordinates, as the server makes them. */
async function placesOf(columns) {
  const first = await get("/api/stacks/0/layers/0");
  const scaled = first.dpi != null && columns.z_um.every((z) => z != null);
  const [wide, high] = scaled ? pitchOf(first.dpi) : [1, 1];
  const rows = columns.height.reduce((most, height) => Math.max(most, height), 0);
  const [left, upper] = (scaled && first.origin_mm) || [0, rows * high];
  const bottom = (layer) => (scaled ? columns.z_um[layer] / 1000 : layer);
  const thickness = (layer) => (scaled ? (columns.thickness_um[layer] ?? 0) / 1000 : 1);
  const top = (layer) => bottom(layer) + thickness(layer);
  return { top, point: ([x, y], layer) => [left + x * wide, upper - y * high, top(layer)] };
}
