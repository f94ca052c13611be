/** Puts the page together: what is viewed is the state, and the parts follow it. */

import { get, showOnly } from "./api.js";
import { numberCopies } from "./copies.js";
import { Findings } from "./findings.js";
import { aspectOf, byId, count, element, mm, pitchOf, resolution } from "./format.js";
import { Heights } from "./heights.js";
import { listenToKeys } from "./keys.js";
import { Marks } from "./marks.js";
import { Measure } from "./measure.js";
import { Overlays } from "./overlays.js";
import { Picture } from "./picture.js";
import { Pixel, tellLayer } from "./pixel.js";
import { Play } from "./play.js";
import { listenToShare } from "./share.js";
import { SolidPanel } from "./solid_panel.js";
import { State, fromHash, linkAddress } from "./state.js";
import { Swipe } from "./swipe.js";
import { Work } from "./work.js";

/** Tells what went wrong, until something else is shown. */
function fail(error) {
  byId("message").textContent = error.message;
  byId("message").hidden = false;
}

/** Tells something in the live region, which screen readers speak. */
function say(text) {
  byId("live").textContent = text;
}

async function start() {
  const session = await get("/api/session");
  showOnly(session.number);
  if (session.work) new Work(fail);
  if (!session.stacks.length) {
    document.body.classList.add("empty");
    byId("nothing").hidden = false;
    return;
  }
  const tables = await Promise.all(session.stacks.map((_, stack) => get(`/api/stacks/${stack}/layers`)));
  const state = new State();
  state.set(fromHash(location.hash, session));
  const unit = session.stacks[0].width;
  const picture = new Picture(byId("sheets"), { tile: session.tile, unit });
  const app = {
    session,
    state,
    picture,
    fail,
    say,
    columnsOf: (stack) => tables[stack],
    get columns() {
      return tables[state.view.stack];
    },
    /** The width and height of the present layer. */
    size: () => ["width", "height"].map((side) => app.columns[side][state.view.layer]),
    /** The width and height of a pixel of the present stack in millimetres, if they are known. */
    get pitch() {
      return pitchOf(session.stacks[state.view.stack].dpi);
    },
  };
  app.redraw = () => picture.refresh("findings");
  app.overlays = new Overlays(app, () => show(app));
  app.marks = new Marks(app);
  app.heights = new Heights(app);
  app.play = new Play(app);
  app.pixel = new Pixel(app);
  app.measure = new Measure(app);
  const choose = (at) => (app.measure.isOn ? app.measure.choose(at) : app.pixel.choose(at));
  picture.onClick(choose);
  app.pixelAtCentre = () => choose(picture.centre);
  numberCopies(app);
  if (session.findings) app.findings = new Findings(app);
  app.swipe = new Swipe(app);
  app.solid = new SolidPanel(app);
  listenToKeys(app);
  listenToShare(app);
  linkAddress(state, session);
  connect(app);
}

/** Lets the picture follow the state, and the state the picture. */
function connect(app) {
  const { picture, session, state } = app;
  const stacks = session.stacks.map((stack, index) => Object.assign(element("option", stack.name), { value: index }));
  byId("stack").replaceChildren(...stacks);
  byId("stack").addEventListener("change", ({ target }) => {
    const stack = Number(target.value);
    // The other stack's layer at this height, if it has one.
    const layer = (stack < 2 ? app.columns.partner[state.view.layer] : null) ?? state.view.layer;
    state.set({ stack, layer: Math.min(layer, session.stacks[stack].layers - 1) });
  });
  byId("zoom-in").addEventListener("click", () => picture.zoomBy(1.5));
  byId("zoom-out").addEventListener("click", () => picture.zoomBy(1 / 1.5));
  byId("whole").addEventListener("click", () => picture.home());
  picture.addEventListener("failed", ({ detail }) => fail(detail));
  let placed = false;
  picture.addEventListener("shown", () => {
    if (!placed) place(app);
    placed = true;
    tellShown(app);
  });
  picture.addEventListener("view", () => {
    if (placed) state.set({ centre: picture.centre, zoom: picture.zoom });
  });
  state.on(["stack", "layer", "overlays", "threshold"], () => show(app));
  let isBoth = state.view.swipe != null;
  state.on(["swipe"], () => {
    if (isBoth !== (state.view.swipe != null)) show(app);
    isBoth = state.view.swipe != null;
  });
  state.on(["stack", "layer"], () => app.findings?.mark());
  state.on(["stack"], () => tellStack(app));
  addEventListener("hashchange", () => place(app));
  tellStack(app);
  app.heights.update();
  show(app);
}

/** Brings the place of the state to the picture, if it has one. */
function place({ picture, state }) {
  const { centre, zoom } = state.view;
  if (centre && zoom) picture.lookAt(centre, zoom);
}

function tellStack({ session, state }) {
  const stack = session.stacks[state.view.stack];
  document.title = `${stack.name} – LAMP`;
  byId("stack").value = state.view.stack;
  const [side] = pitchOf(stack.dpi) ?? [];
  const size = side ? `, ${mm(stack.width * side)} wide at ${resolution(stack.dpi)}` : "";
  const part = stack.part ? `${stack.part}: ` : "";
  byId("facts").textContent =
    `${part}${count(stack.layers)} layers of ${count(stack.width)} x ${count(stack.height)} px${size}. ${stack.end ?? ""}`;
}

/** Shows the layer of the state with its overlays; the next one is expected in the same direction. */
function show({ columns, columnsOf, overlays, picture, session, state }) {
  byId("message").hidden = true;
  const { stack, layer, swipe, threshold } = state.view;
  const sheetOf = (stack, layer, [left, top] = [0, 0]) => {
    const { gray, height, width } = columnsOf(stack);
    const aspect = aspectOf(session.stacks[stack].dpi);
    const sheet = { stack, layer, kind: "layer", width: width[layer], height: height[layer], aspect, left, top };
    return { ...sheet, threshold: gray[layer] ? threshold : null };
  };
  const sheets = (layer) => {
    const sheet = sheetOf(stack, layer);
    const over = state.view.overlays.map((kind) => ({ ...sheet, kind, threshold: null }));
    const partner = swipe != null && stack < 2 ? columns.partner[layer] : null;
    const other = partner == null ? [] : [sheetOf(1 - stack, partner, columns.shift[layer])];
    return [sheet, ...over, ...other];
  };
  if (layer !== shownLayer) direction = Math.sign(layer - shownLayer);
  shownLayer = layer;
  const next = layer + direction;
  const isThere = next >= 0 && next < columns.index.length;
  picture.show({ sheets: sheets(layer), opacity: { ...overlays.opacity }, next: isThere ? sheets(next) : [] });
}

let shownLayer = 0;
let direction = 1;
let asked = new AbortController();

/** Tells about the layer that has come; the server then expects its neighbours. */
async function tellShown({ fail, picture, play, say, state }) {
  const { stack, layer } = state.view;
  asked.abort();
  asked = new AbortController();
  // The panels below move when the facts come.
  byId("layer-facts").ariaBusy = "true";
  try {
    const facts = await get(`/api/stacks/${stack}/layers/${layer}`, asked.signal);
    tellLayer(facts);
    byId("layer-facts").ariaBusy = "false";
    picture.canvas.setAttribute("aria-label", `Layer picture: ${facts.name}`);
    if (!play.isOn) say(facts.name);
  } catch (error) {
    if (error.name !== "AbortError") fail(error);
  }
}

start().catch(fail);
