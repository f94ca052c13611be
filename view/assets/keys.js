/** Keys, and the dialog that tells them. */

import { byId, element } from "./format.js";

/**
 * Connects keys with what they do.
 * @param {any} app
 */
export function listenToKeys(app) {
  const { heights, measure, overlays, picture, pixelAtCentre } = app;
  const finding = (by) => () => app.findings?.step(by);
  const press = (id) => () => byId(id).click();
  /** @type {[string[], string, () => void][]} keys, what they do */
  const table = [
    [["ArrowUp"], "layer above", () => heights.step(1)],
    [["ArrowDown"], "layer below", () => heights.step(-1)],
    [["PageUp"], "ten layers up", () => heights.step(10)],
    [["PageDown"], "ten layers down", () => heights.step(-10)],
    [["Home"], "lowest layer", () => heights.to(0)],
    [["End"], "highest layer", () => heights.to(Infinity)],
    [["g"], "type a layer or height", () => byId("layer").select()],
    [["n"], "next finding up", finding(1)],
    [["p"], "next finding down", finding(-1)],
    [["+", "="], "zoom in", () => picture.zoomBy(1.5)],
    [["-"], "zoom out", () => picture.zoomBy(1 / 1.5)],
    [["0"], "whole layer", () => picture.home()],
    [["1"], "one screen pixel for a pixel", () => picture.lookAt(picture.centre, 1)],
    [["ArrowLeft"], "move left", () => picture.pan(-0.15, 0)],
    [["ArrowRight"], "move right", () => picture.pan(0.15, 0)],
    [["Shift+ArrowUp"], "move up", () => picture.pan(0, -0.15)],
    [["Shift+ArrowDown"], "move down", () => picture.pan(0, 0.15)],
    [["Enter"], "tell the pixel in the middle, with the focus on the picture", null],
    [["m"], "measure", () => measure.toggle()],
    [["Escape"], "end measuring", () => measure.toggle(false)],
    [["o"], "overlays on or off", () => overlays.toggleAll()],
    [["c"], "copy a link to this view", press("link")],
    [["d"], "download the picture", press("download")],
    [["?"], "these keys", () => byId("help").showModal()],
  ];
  const actions = new Map(table.flatMap(([keys, , act]) => keys.map((key) => [key, act])));
  document.addEventListener("keydown", (event) => {
    const act = actions.get(nameOf(event));
    if (!act || isElsewhere(event)) return;
    event.preventDefault();
    act();
  });
  picture.canvas.addEventListener("keydown", (event) => event.key === "Enter" && pixelAtCentre());
  giveFocusBack(picture.canvas);
  byId("keys").addEventListener("click", () => byId("help").showModal());
  byId("help-keys").replaceChildren(...table.flatMap(([keys, what]) => row(keys[0], what)));
}

/**
 * Gives the focus back to the picture once a field or a list has what it was asked for: it would take all
 * further keys. Who chooses from a list by keys goes on in it.
 * @param {HTMLElement} canvas
 */
function giveFocusBack(canvas) {
  let byKeys = false;
  document.addEventListener("mousedown", () => (byKeys = false), true);
  document.addEventListener("keydown", ({ key, target }) => {
    byKeys = target instanceof HTMLSelectElement;
    if (!takesKeys(target)) return;
    // The form reads its field first, and a field that loses the focus reports its change.
    if (key === "Enter" || key === "Escape") setTimeout(() => canvas.focus());
  }, true);
  document.addEventListener("change", ({ target }) => {
    if (target instanceof HTMLSelectElement && !byKeys) canvas.focus();
  });
}

/** Whether an element takes all keys while it has the focus. */
function takesKeys(target) {
  return target instanceof HTMLSelectElement ||
    (target instanceof HTMLInputElement && !["checkbox", "range"].includes(target.type));
}

/** Whether a key is for what has the focus: a field, a list, or the dialog. */
function isElsewhere(event) {
  if (event.ctrlKey || event.altKey || event.metaKey || byId("help").open) return true;
  const { target } = event;
  if (target.id === "slider") return false;
  const moves = event.key.startsWith("Arrow") || ["Home", "End", "PageUp", "PageDown"].includes(event.key);
  if (target instanceof HTMLInputElement && target.type === "range") return moves;
  return takesKeys(target) && event.key !== "Escape";
}

function nameOf({ key, shiftKey }) {
  return shiftKey && key.startsWith("Arrow") ? `Shift+${key}` : key.length === 1 ? key.toLowerCase() : key;
}

const SIGNS = { ArrowUp: "↑", ArrowDown: "↓", ArrowLeft: "←", ArrowRight: "→", PageUp: "Page ↑", PageDown: "Page ↓" };

function row(key, what) {
  const term = element("dt");
  const sign = (part) => element("kbd", SIGNS[part] ?? part);
  term.append(...(key === "+" ? [sign(key)] : key.split("+").flatMap((part) => [sign(part), " "])));
  return [term, element("dd", what)];
}
