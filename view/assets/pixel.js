/** What is known of the layer and of a pixel. */

import { get } from "./api.js";
import { byId, count, length, mm, tell } from "./format.js";

/** Tells about the layer and a chosen pixel. */
export class Pixel {
  #app;
  /** @type {[number, number] | null} */
  #at = null;
  #asked = new AbortController();

  constructor(app) {
    this.#app = app;
    app.state.on(["stack", "layer", "threshold"], () => this.#ask());
  }

  /** Tells about the pixel at a place of the image, if there is one. */
  choose([x, y]) {
    const at = [Math.floor(x), Math.floor(y)];
    const size = this.#app.size();
    const within = at.every((value, axis) => value >= 0 && value < size[axis]);
    this.#at = within ? at : null;
    this.#ask();
  }

  async #ask() {
    this.#asked.abort();
    this.#asked = new AbortController();
    const { marks, state } = this.#app;
    marks.setBox("pixel", this.#at && [...this.#at, this.#at[0] + 1, this.#at[1] + 1]);
    byId("pixel-hint").hidden = this.#at != null;
    if (!this.#at) return tell(byId("pixel"), []);
    const { stack, layer, threshold } = state.view;
    const [x, y] = this.#at;
    const query = `x=${x}&y=${y}${threshold ? `&threshold=${threshold}` : ""}`;
    const path = `/api/stacks/${stack}/layers/${layer}/pixel?${query}`;
    try {
      this.#show(x, y, await get(path, this.#asked.signal));
    } catch (error) {
      if (error.name !== "AbortError") this.#app.fail(error);
    }
  }

  #show(x, y, pixel) {
    const { copy, component, level, white } = pixel;
    const named = (id) => this.#app.findings?.text(id) ?? `${id}`;
    tell(byId("pixel"), [
      ["Column, row", `${x}, ${y}`],
      ["Place", pixel.x_mm == null ? null : `x ${mm(pixel.x_mm)}, y ${mm(pixel.y_mm)}`],
      ["Colour", `${white ? "white (cured)" : "black"}, level ${level}`],
      ["Copy", copy && `${copy.number} of ${copy.of} of ${copy.part}, pixel ${copy.x}, ${copy.y}`],
      ["Component", component && `${count(component.area_px)} px, ${extent(component.box, this.#app.pitch)}`],
      ["Findings", pixel.findings.map(named).join("; ")],
    ]);
  }
}

function extent([left, top, right, bottom], pitch) {
  const [wide, high] = pitch ?? [];
  return `${length(right - left, wide)} by ${length(bottom - top, high)}`;
}

/**
 * Tells what is known of a layer.
 * @param {any} layer
 */
export function tellLayer(layer) {
  const rows = (bands) => bands.reduce((sum, [first, end]) => sum + end - first, 0);
  const changed = (bands) => (bands.length ? `${rows(bands)} rows` : null);
  tell(byId("layer-facts"), [
    ["Number", `${layer.index}`],
    ["z", layer.z_um == null ? null : mm(layer.z_um / 1000)],
    ["Thickness", layer.thickness_um == null ? null : `${layer.thickness_um} µm`],
    ["Exposure", layer.exposure_ms == null ? null : `${layer.exposure_ms} ms`],
    ["Size", `${count(layer.width)} x ${count(layer.height)} px`],
    ["Exposed", layer.exposed_px == null ? null : `${count(layer.exposed_px)} px`],
    ["Stray", changed(layer.stray_rows)],
    ["Fixed", changed(layer.fixed)],
  ]);
}
