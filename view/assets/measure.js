/** A measure between two points, which snap to edges. */

import { get } from "./api.js";
import { byId, length, mm } from "./format.js";

/** Points snap to edges within so many screen pixels. */
const SNAP = 12;

/** Measures while it is switched on. */
export class Measure {
  #app;
  #points = [];

  constructor(app) {
    this.#app = app;
    byId("measure").addEventListener("click", () => this.toggle());
    app.state.on(["stack"], () => this.#clear());
    // Crosses are as large at any zoom.
    app.picture.addEventListener("view", () => this.#points.length && this.#draw());
  }

  /** Whether clicks set points. */
  get isOn() {
    return byId("measure").getAttribute("aria-pressed") === "true";
  }

  /** Starts a measure, or ends it and removes its line. */
  toggle(on = !this.isOn) {
    byId("measure").setAttribute("aria-pressed", `${on}`);
    byId("picture").classList.toggle("measuring", on);
    byId("length").hidden = !on;
    this.#clear();
  }

  /** Sets the next point at a place of the image. */
  async choose([x, y]) {
    const { picture, state } = this.#app;
    const { stack, layer } = state.view;
    const radius = SNAP / picture.zoom;
    const path = `/api/stacks/${stack}/layers/${layer}/edge?x=${x}&y=${y}&radius=${radius}`;
    const edge = await get(path).catch(this.#app.fail);
    if (!edge || !this.isOn) return;
    const point = edge.x == null ? [x, y] : [edge.x, edge.y];
    this.#points = this.#points.length === 1 ? [this.#points[0], point] : [point];
    this.#show();
  }

  #clear() {
    this.#points = [];
    this.#show();
  }

  #draw() {
    const { marks, picture } = this.#app;
    const [arm, down] = [7 / picture.zoom, 7 / picture.zoom / picture.aspect];
    const cross = ([x, y]) => [[[x - arm, y], [x + arm, y]], [[x, y - down], [x, y + down]]];
    const line = this.#points.length === 2 ? [this.#points] : [];
    marks.set("measure", [...this.#points.flatMap(cross), ...line]);
  }

  #show() {
    this.#draw();
    const [a, b] = this.#points;
    const [wide, high] = this.#app.pitch ?? [];
    const apart = (axis) => Math.abs(b[axis] - a[axis]);
    // Of pixels that are not square, only millimetres add up.
    const across = () =>
      wide === high ? length(Math.hypot(apart(0), apart(1)), wide) : mm(Math.hypot(apart(0) * wide, apart(1) * high));
    byId("length-text").textContent = b
      ? `${across()}: ${length(apart(0), wide)} along x, ${length(apart(1), high)} along y`
      : `Click ${a ? "the second" : "the first"} point, or press Enter for the middle. Points snap to edges.`;
  }
}
