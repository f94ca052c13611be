/** Switches of overlays, how opaque each is, and gray levels. */

import { byId, element } from "./format.js";

/** How opaque overlays are at first. */
const OPACITY = 0.85;

/** Overlays that the session has. */
export class Overlays {
  #app;
  /** @type {Record<string, number>} */
  opacity = {};
  /** What `toggleAll` switches on again. */
  #last;

  /** @param {() => void} faded is called when an overlay becomes more or less opaque */
  constructor(app, faded) {
    this.#app = app;
    const { overlays } = app.session;
    this.#last = (overlays.some(({ on }) => on) ? overlays.filter(({ on }) => on) : overlays.slice(0, 1)).map(({ id }) => id);
    byId("overlays").replaceChildren(...app.session.overlays.map((one) => this.#row(one, faded)));
    app.state.on(["overlays"], () => this.#check());
    this.#check();
    this.#gray();
  }

  /** Switches all overlays off, or those on again that were. */
  toggleAll() {
    const { overlays } = this.#app.state.view;
    if (overlays.length) this.#last = overlays;
    this.#app.state.set({ overlays: overlays.length ? [] : this.#last });
  }

  /** Switches an overlay on or off. */
  set(id, on) {
    const chosen = new Set(this.#app.state.view.overlays);
    if (on) chosen.add(id);
    else chosen.delete(id);
    const known = this.#app.session.overlays.map((overlay) => overlay.id);
    this.#app.state.set({ overlays: known.filter((id) => chosen.has(id)) });
  }

  #row({ id, label, colors }, faded) {
    this.opacity[id] = OPACITY;
    const box = Object.assign(element("input"), { type: "checkbox", id: `overlay-${id}` });
    box.addEventListener("change", () => this.set(id, box.checked));
    const swatch = element("span");
    swatch.className = "swatch";
    const stripe = (color, at) => `${color} ${(100 * at) / colors.length}% ${(100 * (at + 1)) / colors.length}%`;
    swatch.style.background = `linear-gradient(90deg, ${colors.map(stripe)})`;
    const name = element("label");
    name.className = "row";
    name.append(box, swatch, label);
    const range = { type: "range", min: 0.1, max: 1, step: 0.05, value: OPACITY };
    const fade = Object.assign(element("input"), range);
    fade.setAttribute("aria-label", `How opaque: ${label}`);
    fade.addEventListener("input", () => {
      this.opacity[id] = Number(fade.value);
      faded();
    });
    const row = element("li");
    row.append(name, fade);
    return row;
  }

  #check() {
    for (const { id } of this.#app.session.overlays) {
      byId(`overlay-${id}`).checked = this.#app.state.view.overlays.includes(id);
    }
  }

  #gray() {
    const { state } = this.#app;
    const [cured, threshold] = [byId("cured"), byId("threshold")];
    const show = () => {
      const { stack, threshold: level } = state.view;
      byId("gray").hidden = !this.#app.session.stacks[stack].gray;
      cured.checked = level != null;
      if (level) threshold.value = level;
    };
    const choose = () => {
      const level = Math.round(Math.max(1, Math.min(255, Number(threshold.value) || 128)));
      state.set({ threshold: cured.checked ? level : null });
    };
    cured.addEventListener("change", choose);
    threshold.addEventListener("change", choose);
    state.on(["stack", "threshold"], show);
    show();
  }
}
