/** The table of findings, its filters, and the way from one to the next. */

import { poll } from "./api.js";
import { byId, count, element, mm, pitchOf } from "./format.js";

/** So many findings are listed at a time. */
const PAGE = 200;

/** Findings of the first stack. */
export class Findings extends EventTarget {
  #app;
  /** @type {any[]} worst first */
  #all = [];
  /** @type {any[]} those that the filters leave, in the order of the table */
  list = [];
  #listed = 0;
  /** @type {{by: string, down: boolean} | null} the column that sorts; null: worst first */
  #order = null;
  /** @type {number | null} the one that was gone to */
  current = null;

  constructor(app) {
    super();
    this.#app = app;
    byId("findings").hidden = false;
    byId("next-finding").addEventListener("click", () => this.step(1));
    byId("previous-finding").addEventListener("click", () => this.step(-1));
    byId("more-findings").addEventListener("click", () => this.#listMore());
    byId("findings-filters").addEventListener("input", () => this.#choose());
    byId("findings-filters").addEventListener("submit", (event) => event.preventDefault());
    // The fields are empty only after the event.
    byId("findings-filters").addEventListener("reset", () => setTimeout(() => this.#choose()));
    for (const head of byId("findings-list").querySelectorAll("th")) {
      head.querySelector("button").addEventListener("click", () => this.#sortBy(head.dataset.by));
    }
    byId("findings-list").addEventListener("click", ({ target }) => {
      const rows = target.closest("tbody");
      if (rows) this.show(this.#all[rows.dataset.id]);
    });
    poll("/api/findings", (state) => this.#take(state)).catch(app.fail);
  }

  /** The line of a finding. */
  text(id) {
    return this.#all[id]?.text;
  }

  /** Goes to the next finding up (1) or down (-1) from this layer, among those of the table. */
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
    this.#markRow();
    this.#app.say(`${wordsOf(finding.kind)}: ${finding.text}`);
    this.dispatchEvent(new Event("change"));
  }

  /** Draws the rectangle of the current finding, where it is in the layer that is viewed. */
  mark() {
    const { marks, state } = this.#app;
    const finding = this.#all[this.current];
    const { stack, layer } = state.view;
    const isHere = finding && stack === 0 && finding.layer <= layer && layer <= finding.last_layer;
    marks.setBox("finding", isHere ? finding.box : null);
  }

  #take(state) {
    const words = {
      running: state.of ? `Looking: ${count(state.done)} of ${count(state.of)} layers.` : "Looking …",
      failed: state.message ?? "They could not be found.",
      ready: "Nothing was found.",
    };
    byId("findings-state").textContent = words[state.status] ?? "";
    byId("work-found").hidden = state.status !== "ready";
    byId("work-found").textContent = `Findings: ${state.list?.length || "none"}`;
    if (state.status !== "ready" || !state.list.length) return;
    const pitch = pitchOf(this.#app.session.stacks[0].dpi);
    this.#all = state.list.map((finding) => ({ ...finding, size: sizeOf(finding.box, pitch) }));
    byId("size-unit").textContent = pitch ? "mm" : "px";
    byId("findings-body").hidden = false;
    this.#offerKinds();
    this.#choose();
    this.#app.redraw();
  }

  #offerKinds() {
    const counts = new Map();
    for (const { kind } of this.#all) counts.set(kind, (counts.get(kind) ?? 0) + 1);
    const options = [...counts].map(([kind, number]) =>
      Object.assign(element("option", `${wordsOf(kind)} (${count(number)})`), { value: kind }),
    );
    byId("filter-kind").append(...options);
  }

  /** Lists the findings that the filters leave. */
  #choose() {
    const { index } = this.#app.columnsOf(0);
    const limit = (id, none) => (byId(id).value === "" ? none : Number(byId(id).value));
    const kind = byId("filter-kind").value;
    const [from, to] = [limit("filter-from", -Infinity), limit("filter-to", Infinity)];
    const least = limit("filter-size", 0);
    this.list = this.#all.filter(
      (one) =>
        (!kind || one.kind === kind) && index[one.last_layer] >= from && index[one.layer] <= to && one.size >= least,
    );
    if (this.#order) {
      const { by, down } = this.#order;
      const order = by === "kind" ? (a, b) => a.kind.localeCompare(b.kind) : (a, b) => a[by] - b[by];
      this.list.sort((a, b) => (down ? -1 : 1) * order(a, b));
    }
    this.#listed = 0;
    for (const rows of [...byId("findings-list").tBodies]) rows.remove();
    this.#listMore();
    const all = this.#all.length;
    const number = this.list.length === all ? count(all) : `${count(this.list.length)} of ${count(all)}`;
    const findings = all === 1 ? "finding" : "findings";
    byId("findings-state").textContent = `${number} ${findings}${this.#order ? "" : ", the worst first"}.`;
    this.#app.heights.mark([...new Set(this.list.map(({ layer }) => layer))]);
    this.dispatchEvent(new Event("change"));
  }

  /** Sorts by a column: upward, downward, and then the worst first again. */
  #sortBy(by) {
    const down = this.#order?.by === by && !this.#order.down;
    this.#order = this.#order?.by === by && this.#order.down ? null : { by, down };
    for (const head of byId("findings-list").querySelectorAll("th")) {
      const sorts = head.dataset.by === this.#order?.by;
      head.ariaSort = sorts ? (down ? "descending" : "ascending") : "none";
    }
    this.#choose();
  }

  #listMore() {
    const next = this.list.slice(this.#listed, this.#listed + PAGE);
    this.#listed += next.length;
    byId("findings-list").append(...next.map((finding) => this.#rows(finding)));
    byId("more-findings").hidden = this.#listed >= this.list.length;
    this.#markRow();
  }

  #rows({ id, kind, about, layer, last_layer: last, z_mm: z, size }) {
    const { index } = this.#app.columnsOf(0);
    const pitch = pitchOf(this.#app.session.stacks[0].dpi);
    const name = element("td");
    name.append(element("button", wordsOf(kind)));
    const layers = element("td", layer === last ? `${index[layer]}` : `${index[layer]}–${index[last]}`);
    const length = size ? (pitch ? mm(size) : `${size} px`) : "";
    const first = element("tr");
    first.append(name, layers, element("td", length));
    const facts = element("td", [z == null ? "" : `z ${mm(z)}`, about].filter(Boolean).join(", "));
    facts.colSpan = 3;
    const second = element("tr");
    second.append(facts);
    const rows = element("tbody");
    rows.dataset.id = id;
    rows.append(first, second);
    return rows;
  }

  #markRow() {
    for (const rows of byId("findings-list").tBodies) {
      rows.ariaCurrent = `${rows.dataset.id === `${this.current}`}`;
    }
  }
}

/** The name of a kind as people read it. */
const wordsOf = (kind) => kind.replaceAll("-", " ");

/** The longer side of a rectangle: millimetres if they are known, or else pixels; 0 without a place. */
function sizeOf(box, pitch) {
  if (!box) return 0;
  const [left, top, right, bottom] = box;
  const [wide, high] = pitch ?? [1, 1];
  return Math.max((right - left) * wide, (bottom - top) * high);
}
