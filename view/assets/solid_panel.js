/** The part in 3D beside the layer: loads what it needs when it is first shown. */

import { ask, get, poll } from "./api.js";
import { byId, pitchOf } from "./format.js";

/** Shows the part of the first stack, its layer, what of it the picture shows, and findings. */
export class SolidPanel {
  #app;
  #solid = null;
  #places = null;
  #isAsked = false;

  constructor(app) {
    this.#app = app;
    byId("beside").addEventListener("click", () => this.toggle());
    app.state.on(["stack", "layer"], () => this.#update());
    app.picture.addEventListener("view", () => this.#update());
    byId("cut").addEventListener("change", () => this.#update());
  }

  /** Shows the part, or hides it. */
  toggle() {
    const on = byId("solid").hidden;
    this.#app.picture.stayWhole();
    byId("solid").hidden = !on;
    byId("beside").setAttribute("aria-pressed", `${on}`);
    if (on && !this.#isAsked) this.#open();
    this.#update();
  }

  async #open() {
    this.#isAsked = true;
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
      if (marker != null) return this.#app.findings.show(this.#marked[marker]);
      const place = this.#solid.placeAt(event);
      if (place) this.#goTo(place);
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

  /** Goes to the layer and the pixel of a place on the part. */
  #goTo([x, y, z]) {
    const { picture, pixel, state } = this.#app;
    const layer = this.#places.layerAt(z);
    state.set({ stack: 0, layer });
    const at = this.#places.pixelAt([x, y]);
    picture.lookAt(at, picture.zoom);
    pixel.choose(at);
  }

  /** The findings of the table that have a place. */
  get #marked() {
    return (this.#app.findings?.list ?? []).filter((finding) => finding.at);
  }

  #mark() {
    const marked = this.#marked;
    this.#solid.setMarkers(marked.map(({ at, layer }) => this.#places.point(at, layer)));
    this.#solid.choose(marked.findIndex(({ id }) => id === this.#app.findings.current));
  }

  /** Puts the plane at the layer, with a frame around what the picture shows of it. */
  #update() {
    const { picture, state } = this.#app;
    const { stack, layer } = state.view;
    if (!this.#solid || byId("solid").hidden || stack !== 0) return;
    const size = this.#app.size();
    const { clientWidth, clientHeight } = picture.canvas;
    const seen = [[0, 0], [clientWidth, clientHeight]].map((corner) =>
      picture.fromScreen(corner).map((at, axis) => Math.max(0, Math.min(size[axis], at))),
    );
    const [[left, top], [right, bottom]] = seen;
    const corners = [[left, top], [right, top], [right, bottom], [left, bottom]];
    this.#solid.setPlane(
      this.#places.top(layer),
      byId("cut").checked,
      corners.map((at) => this.#places.point(at, layer)),
    );
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
  return {
    top,
    point: ([x, y], layer) => [left + x * wide, upper - y * high, top(layer)],
    pixelAt: ([x, y]) => [(x - left) / wide, (upper - y) / high],
    /** The layer at a height: the first whose top is not below it. */
    layerAt: (z) => {
      const last = columns.index.length - 1;
      const found = columns.index.findIndex((_, layer) => top(layer) >= z);
      return found < 0 ? last : found;
    },
  };
}
