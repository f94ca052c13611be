/** What is drawn over the picture: marks on pixels, the grid of pixels, the scale. */

import { byId } from "./format.js";

/** From this zoom on, pixels have a grid. */
const GRID_ZOOM = 12;

/** The room that a letter of a label takes, in screen pixels. */
const LABEL_PX = 12;

const SVG = "http://www.w3.org/2000/svg";

/** Lines over the picture. A set of lines has a name, and is drawn white on black. */
export class Marks {
  #app;
  #svg = byId("marks");
  /** @type {Map<string, [number, number][][]>} lines of points, in pixels of the image */
  #lines = new Map();
  #labels = [];

  constructor(app) {
    this.#app = app;
    app.picture.addEventListener("view", () => this.draw());
  }

  /** Sets the lines of a name. */
  set(name, lines) {
    this.#lines.set(name, lines);
    this.draw();
  }

  /** Sets a rectangle, `[left, top, right, bottom]`, or none. */
  setBox(name, box) {
    if (!box) return this.set(name, []);
    const [left, top, right, bottom] = box;
    const corners = [[left, top], [right, top], [right, bottom], [left, bottom], [left, top]];
    this.set(name, [corners]);
  }

  /**
   * Sets texts in the middle of rectangles; those that have no room are left out.
   * @param {{text: string, box: [number, number, number, number]}[]} labels
   */
  setLabels(labels) {
    this.#labels = labels;
    this.draw();
  }

  /** Draws all for the present place and zoom. */
  draw() {
    const { picture } = this.#app;
    const place = (point) => picture.toScreen(point).map((at) => at.toFixed(1)).join(" ");
    const path = (lines) => lines.map((line) => `M${line.map(place).join("L")}`).join("");
    const drawn = [path([...this.#lines.values()].flat())];
    const paths = [line("grid", path(this.#grid())), line("under", drawn), line("", drawn)];
    this.#svg.replaceChildren(...paths, ...this.#texts());
    this.#scale();
  }

  #texts() {
    const { picture } = this.#app;
    const { clientWidth, clientHeight } = this.#svg;
    const placed = this.#labels.map(({ text, box: [left, top, right, bottom] }) => {
      const [low, high] = [picture.toScreen([left, top]), picture.toScreen([right, bottom])];
      return { text, width: high[0] - low[0], at: low.map((start, axis) => (start + high[axis]) / 2) };
    });
    const isSeen = ({ text, width, at: [x, y] }) =>
      width > LABEL_PX * text.length && x > 0 && y > 0 && x < clientWidth && y < clientHeight;
    return placed.filter(isSeen).map(({ text, at: [x, y] }) => {
      const made = document.createElementNS(SVG, "text");
      made.setAttribute("x", x.toFixed(1));
      made.setAttribute("y", y.toFixed(1));
      made.textContent = text;
      return made;
    });
  }

  #grid() {
    const { picture, size } = this.#app;
    if (picture.zoom < GRID_ZOOM) return [];
    const { clientWidth, clientHeight } = this.#svg;
    const [left, top] = picture.fromScreen([0, 0]).map((at) => Math.max(0, Math.floor(at)));
    const end = picture.fromScreen([clientWidth, clientHeight]);
    const [right, bottom] = end.map((at, axis) => Math.min(size()[axis], Math.ceil(at)));
    const lines = [];
    for (let x = left; x <= right; x++) lines.push([[x, top], [x, bottom]]);
    for (let y = top; y <= bottom; y++) lines.push([[left, y], [right, y]]);
    return lines;
  }

  /** Draws a bar of a round length of 60 to 150 screen pixels. */
  #scale() {
    const { picture } = this.#app;
    const [side] = this.#app.pitch ?? [];
    const pitch = side ?? 1;
    const most = (150 / picture.zoom) * pitch;
    const ten = 10 ** Math.floor(Math.log10(most));
    const round = [5, 2, 1].map((digit) => digit * ten).find((length) => length <= most);
    const bar = byId("scale");
    bar.style.width = `${(round / pitch) * picture.zoom}px`;
    const millimetres = round < 0.1 ? `${+(round * 1000).toPrecision(1)} µm` : `${+round.toPrecision(1)} mm`;
    bar.firstElementChild.textContent = side ? millimetres : `${+round.toPrecision(1)} px`;
  }
}

function line(name, path) {
  const made = document.createElementNS(SVG, "path");
  made.setAttribute("class", name);
  made.setAttribute("d", path);
  return made;
}
