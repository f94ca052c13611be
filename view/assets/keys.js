/** Keys, and the dialog that tells them. */

import { byId, element } from "./format.js";

/**
 * Connects keys with what they do.
 * @param {any} app
 */
export function listenToKeys(app) {
  const { heights, measure, overlays, picture, pixelAtCentre, play, solid, swipe } = app;
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
    [[" "], "play the layers, or stop", () => play.toggle()],
    [["."], "play faster", () => play.faster(1)],
    [[","], "play slower", () => play.faster(-1)],
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
    [["3"], "the part in 3D, or hide it", () => solid.toggle()],
    [["s"], "both stacks, with a border to move, or one", () => swipe.toggle()],
    [["m"], "measure", () => measure.toggle()],
    [["Escape"], "end measuring and playing", () => [measure, play].forEach((one) => one.toggle(false))],
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
 * Gives the focus back to the picture once a field has what it was asked for, and after each click: a
 * control would keep keys for itself. Who uses a control by keys goes on in it.
 * @param {HTMLElement} canvas
 */
function giveFocusBack(canvas) {
  const isControl = (target) => target.closest("button, select, input, label, #solid-view, #swipe") != null;
  let byKeys = false;
  document.addEventListener("mousedown", () => (byKeys = false), true);
  document.addEventListener("keydown", ({ key, target }) => {
    byKeys = isControl(target);
    // The form reads its field first, and a field that loses the focus reports its change.
    if (takesKeys(target) && (key === "Enter" || key === "Escape")) setTimeout(() => canvas.focus());
  }, true);
  const back = ({ target }) => {
    const isField = target instanceof HTMLInputElement && takesKeys(target);
    if (!byKeys && isControl(target) && !isField && !byId("help").open) canvas.focus({ preventScroll: true });
  };
  // A list is open from its click to its change.
  document.addEventListener("click", (event) => event.target.closest("select") || back(event));
  document.addEventListener("change", back);
  byId("help").addEventListener("close", () => {
    byKeys = false;
    canvas.focus();
  });
}

/** Whether an element takes all keys while it has the focus. */
function takesKeys(target) {
  return target instanceof HTMLSelectElement ||
    (target instanceof HTMLInputElement && !["checkbox", "range"].includes(target.type));
}

/** Whether a key is for what has the focus: a field, a list, a button, or the dialog. */
function isElsewhere(event) {
  if (event.ctrlKey || event.altKey || event.metaKey || byId("help").open) return true;
  const { target } = event;
  if (target.id === "slider") return false;
  if (event.key === " " && target.matches("button, input[type=checkbox]")) return true;
  const moves = event.key.startsWith("Arrow") || ["Home", "End", "PageUp", "PageDown"].includes(event.key);
  if (target instanceof HTMLInputElement && target.type === "range") return moves;
  return takesKeys(target) && event.key !== "Escape";
}

function nameOf({ key, shiftKey }) {
  return shiftKey && key.startsWith("Arrow") ? `Shift+${key}` : key.length === 1 ? key.toLowerCase() : key;
}

const SIGNS = { " ": "Space", ArrowUp: "↑", ArrowDown: "↓", ArrowLeft: "←", ArrowRight: "→", PageUp: "Page ↑", PageDown: "Page ↓" };

function row(key, what) {
  const term = element("dt");
  const sign = (part) => element("kbd", SIGNS[part] ?? part);
  term.append(...(key === "+" ? [sign(key)] : key.split("+").flatMap((part) => [sign(part), " "])));
  return [term, element("dd", what)];
}
