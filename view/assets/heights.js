/** Layers by number and height: slider, strip of area over z, field. */

import { byId } from "./format.js";

/** Returns the layer that a text names: a number of a layer, or a height as `12.3mm`. */
export function layerOf(text, columns) {
  const height = /^\s*(\d+(?:[.,]\d+)?)\s*(mm|um|µm)\s*$/i.exec(text);
  const last = columns.index.length - 1;
  if (height) {
    const um = Number(height[1].replace(",", ".")) * (height[2].toLowerCase() === "mm" ? 1000 : 1);
    const above = columns.z_um.findLastIndex((z) => z != null && z <= um + 1e-6);
    return columns.z_um.some((z) => z != null) ? Math.max(0, above) : null;
  }
  if (!/^\s*\d+\s*$/.test(text)) return null;
  const named = columns.index.indexOf(Number(text));
  return named >= 0 ? named : Math.min(Number(text), last);
}

/** Slider, strip, buttons and field. */
export class Heights {
  #app;
  #slider = byId("slider");
  #field = byId("layer");
  #strip = byId("strip");
  /** @type {number[]} layers where findings begin */
  #marked = [];

  constructor(app) {
    this.#app = app;
    const { state } = app;
    this.#slider.addEventListener("input", () => state.set({ layer: Number(this.#slider.value) }));
    byId("up").addEventListener("click", () => this.step(1));
    byId("down").addEventListener("click", () => this.step(-1));
    byId("go").addEventListener("submit", (event) => {
      event.preventDefault();
      this.#go();
    });
    const pick = (event) => event.buttons & 1 && this.#pick(event.offsetY);
    this.#strip.addEventListener("pointerdown", pick);
    this.#strip.addEventListener("pointermove", pick);
    state.on(["stack", "layer"], () => this.update());
    new ResizeObserver(() => this.#draw()).observe(this.#strip);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.#draw());
  }

  /** Goes up or down by so many layers. */
  step(by) {
    this.to(this.#app.state.view.layer + by);
  }

  /** Goes to a layer, or to the nearest one that there is. */
  to(layer) {
    const last = this.#app.columns.index.length - 1;
    this.#app.state.set({ layer: Math.max(0, Math.min(last, layer)) });
  }

  /** Marks layers in the strip. */
  mark(layers) {
    this.#marked = layers;
    this.#draw();
  }

  /** Shows the layer of the state. */
  update() {
    const { columns, state } = this.#app;
    const { layer } = state.view;
    this.#slider.max = columns.index.length - 1;
    this.#slider.value = layer;
    const z = columns.z_um[layer];
    const height = z == null ? "" : `, z ${(z / 1000).toFixed(3)} mm`;
    this.#slider.setAttribute("aria-valuetext", `Layer ${columns.index[layer]}${height}`);
    if (document.activeElement !== this.#field) this.#field.value = columns.index[layer];
    this.#draw();
  }

  #go() {
    const layer = layerOf(this.#field.value, this.#app.columns);
    const why = layer == null ? "Type a layer's number, or a height as 12.3mm" : "";
    this.#field.setCustomValidity(why);
    this.#field.reportValidity();
    this.#field.addEventListener("input", () => this.#field.setCustomValidity(""), { once: true });
    if (layer != null) {
      this.to(layer);
      this.#field.select();
    }
  }

  #pick(y) {
    const layers = this.#app.columns.index.length;
    this.to(Math.floor((1 - y / this.#strip.clientHeight) * layers));
  }

  /** Draws the area of each row of screen pixels: the largest of its layers. */
  #draw() {
    const { columns, state } = this.#app;
    const scale = devicePixelRatio;
    const width = (this.#strip.width = this.#strip.clientWidth * scale);
    const height = (this.#strip.height = this.#strip.clientHeight * scale);
    const pen = this.#strip.getContext("2d");
    const ink = getComputedStyle(document.documentElement);
    const layers = columns.index.length;
    const most = columns.exposed_px.reduce((most, area) => Math.max(most, area ?? 0), 1);
    const rowOf = (layer) => height * (1 - layer / layers);
    pen.fillStyle = ink.getPropertyValue("--table");
    const areas = new Float64Array(Math.ceil(height));
    columns.exposed_px.forEach((area, layer) => {
      const from = Math.max(0, Math.floor(rowOf(layer + 1)));
      const to = Math.min(areas.length, Math.max(from + 1, Math.floor(rowOf(layer))));
      for (let row = from; row < to; row++) areas[row] = Math.max(areas[row], area ?? 0);
    });
    areas.forEach((area, row) => pen.fillRect(width, row, (-area / most) * width, 1));
    pen.fillStyle = ink.getPropertyValue("--warn");
    for (const layer of this.#marked) pen.fillRect(0, rowOf(layer + 0.5) - scale, 8 * scale, 2 * scale);
    pen.fillStyle = ink.getPropertyValue("--accent");
    pen.fillRect(0, rowOf(state.view.layer + 0.5) - scale, width, 2 * scale);
  }
}
