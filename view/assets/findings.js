/** The list of findings, and the way from one to the next. */

import { poll } from "./api.js";
import { byId, element } from "./format.js";

/** So many findings are listed at a time. */
const PAGE = 200;

/** Findings of the first stack. */
export class Findings extends EventTarget {
  #app;
  /** @type {any[]} worst first */
  list = [];
  #listed = 0;
  /** @type {number | null} the one that was gone to */
  current = null;

  constructor(app) {
    super();
    this.#app = app;
    byId("findings").hidden = false;
    byId("next-finding").addEventListener("click", () => this.step(1));
    byId("previous-finding").addEventListener("click", () => this.step(-1));
    byId("more-findings").addEventListener("click", () => this.#listMore());
    poll("/api/findings", (state) => this.#take(state)).catch(app.fail);
  }

  /** The line of a finding. */
  text(id) {
    return this.list[id]?.text;
  }

  /** Goes to the next finding up (1) or down (-1) from this layer. */
  step(by) {
    const { layer } = this.#app.state.view;
    const ordered = [...this.list].sort((a, b) => by * (a.layer - b.layer || a.id - b.id));
    const here = ordered.findIndex(({ id }) => id === this.current);
    const after = ordered.find((finding) => by * (finding.layer - layer) > 0);
    const follow = here >= 0 && ordered[here].layer === layer ? ordered[here + 1] : after;
    if (follow) this.show(follow);
    else this.#app.say(`There is no finding ${by > 0 ? "above" : "below"}.`);
  }

  /** Goes to a finding: its layer, its place, and its overlay. */
  show(finding) {
    this.current = finding.id;
    const { overlays, picture, state } = this.#app;
    state.set({ stack: 0, layer: finding.layer });
    overlays.set("findings", true);
    this.mark();
    if (finding.box) picture.fit(finding.box);
    for (const button of byId("findings-list").querySelectorAll("button")) {
      button.setAttribute("aria-current", `${button.dataset.id === `${finding.id}`}`);
    }
    this.#app.say(`${finding.kind.replaceAll("-", " ")}: ${finding.text}`);
    this.dispatchEvent(new Event("change"));
  }

  /** Draws the rectangle of the current finding, where it is in the layer that is viewed. */
  mark() {
    const { marks, state } = this.#app;
    const finding = this.list.find(({ id }) => id === this.current);
    const { stack, layer } = state.view;
    const isHere = finding && stack === 0 && finding.layer <= layer && layer <= finding.last_layer;
    marks.setBox("finding", isHere ? finding.box : null);
  }

  #take(state) {
    const words = {
      running: state.of ? `Looking: ${state.done} of ${state.of} layers.` : "Looking …",
      failed: state.message ?? "They could not be found.",
      ready: state.list.length ? `${state.list.length}, the worst first.` : "Nothing was found.",
    };
    byId("findings-state").textContent = words[state.status] ?? "";
    if (state.status !== "ready") return;
    this.list = state.list;
    this.#listMore();
    this.#app.heights.mark([...new Set(this.list.map((finding) => finding.layer))]);
    this.#app.redraw();
    this.dispatchEvent(new Event("change"));
  }

  #listMore() {
    const next = this.list.slice(this.#listed, this.#listed + PAGE);
    this.#listed += next.length;
    byId("findings-list").append(...next.map((finding) => this.#row(finding)));
    byId("more-findings").hidden = this.#listed >= this.list.length;
  }

  #row(finding) {
    const { kind, text, layer } = finding;
    const place = text.startsWith("layer") ? "" : `layer ${this.#app.columnsOf(0).index[layer]}, `;
    const button = element("button", `${kind.replaceAll("-", " ")}: ${place}${text}`);
    button.dataset.id = finding.id;
    button.addEventListener("click", () => this.show(finding));
    const row = element("li");
    row.append(button);
    return row;
  }
}
