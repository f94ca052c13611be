/** Plays the layers upward, each for as long as the speed says and at least until it has come. */

import { byId } from "./format.js";

/** Plays while it is switched on. */
export class Play {
  #app;
  #timer = 0;
  #due = 0;

  constructor(app) {
    this.#app = app;
    byId("play").addEventListener("click", () => this.toggle());
    app.picture.addEventListener("shown", () => this.isOn && this.#wait());
    app.picture.addEventListener("failed", () => this.toggle(false));
  }

  /** Whether layers follow each other. */
  get isOn() {
    return byId("play").getAttribute("aria-pressed") === "true";
  }

  /** Starts from this layer, or from the lowest if this is the highest; or stops. */
  toggle(on = !this.isOn) {
    clearTimeout(this.#timer);
    byId("play").setAttribute("aria-pressed", `${on}`);
    byId("play").textContent = on ? "■ Stop" : "▶ Play";
    if (!on) return;
    if (this.#isAtTheTop) this.#app.heights.to(0);
    this.#step();
  }

  /** Goes to the next faster speed (1), or the next slower one (-1). */
  faster(by) {
    const speeds = byId("speed");
    const last = speeds.options.length - 1;
    speeds.selectedIndex = Math.max(0, Math.min(last, speeds.selectedIndex + by));
    this.#app.say(speeds.selectedOptions[0].title);
  }

  get #isAtTheTop() {
    return this.#app.state.view.layer === this.#app.columns.index.length - 1;
  }

  #step() {
    if (this.#isAtTheTop) return this.toggle(false);
    this.#due = performance.now() + 1000 / Number(byId("speed").value);
    this.#app.heights.step(1);
  }

  #wait() {
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.#step(), Math.max(0, this.#due - performance.now()));
  }
}
