/** What is viewed, in one place, and as the address of a link. */

/**
 * @typedef {object} View
 * @property {number} stack
 * @property {number} layer position in the stack, from 0
 * @property {[number, number] | null} centre column and row in the middle; null: the whole layer
 * @property {number | null} zoom screen pixels for the width of a pixel
 * @property {string[]} overlays
 * @property {number | null} swipe where the second stack begins, as a share of the picture's width
 * @property {number | null} threshold gray levels from this one on are shown as cured
 */

/** The view; `change` events name what changed. */
export class State extends EventTarget {
  /** @type {View} */
  view = { stack: 0, layer: 0, centre: null, zoom: null, overlays: [], swipe: null, threshold: null };

  /** @param {Partial<View>} changes */
  set(changes) {
    const keys = Object.keys(changes).filter(
      (key) => JSON.stringify(this.view[key]) !== JSON.stringify(changes[key]),
    );
    Object.assign(this.view, changes);
    if (keys.length) this.dispatchEvent(new CustomEvent("change", { detail: new Set(keys) }));
  }

  /**
   * Calls back when any of these change.
   * @param {string[]} keys
   * @param {() => void} call
   */
  on(keys, call) {
    this.addEventListener("change", ({ detail }) => {
      if (keys.some((key) => detail.has(key))) call();
    });
  }
}

/**
 * Returns a view as the part of an address after `#`.
 * @param {View} view
 */
export function toHash({ stack, layer, centre, zoom, overlays, swipe, threshold }) {
  const parts = [`stack=${stack}`, `layer=${layer}`];
  if (centre && zoom) {
    parts.push(`at=${centre.map((at) => +at.toFixed(2)).join(",")}`, `zoom=${+zoom.toPrecision(5)}`);
  }
  if (overlays.length) parts.push(`overlays=${overlays.join(",")}`);
  if (swipe) parts.push(`swipe=${+swipe.toFixed(3)}`);
  if (threshold) parts.push(`threshold=${threshold}`);
  return `#${parts.join("&")}`;
}

/**
 * Reads the part of an address after `#`; what is not there or makes no sense is as at the start.
 * @param {string} hash
 * @param {any} session
 * @returns {View}
 */
export function fromHash(hash, session) {
  const fields = new URLSearchParams(hash.slice(1));
  const whole = (key, most) => {
    const value = Number(fields.get(key));
    return Number.isInteger(value) && value >= 0 ? Math.min(value, most) : 0;
  };
  const stack = whole("stack", session.stacks.length - 1);
  const centre = (fields.get("at") ?? "").split(",").map(Number);
  const zoom = Number(fields.get("zoom"));
  const placed = centre.length === 2 && centre.every(Number.isFinite) && zoom > 0 && zoom < 1e6;
  const known = new Set(session.overlays.map((overlay) => overlay.id));
  const first = session.overlays.filter(({ on }) => on).map(({ id }) => id);
  const named = (fields.get("overlays") ?? "").split(",").filter((id) => known.has(id));
  return {
    stack,
    layer: whole("layer", session.stacks[stack].layers - 1),
    centre: placed ? centre : null,
    zoom: placed ? zoom : null,
    // A link without overlays has none; an address without a view starts with those of faults.
    overlays: fields.has("layer") ? named : first,
    swipe: isSwipe(Number(fields.get("swipe")), session) ? Number(fields.get("swipe")) : null,
    threshold: whole("threshold", 255) || null,
  };
}

/** Whether a share of the width lets both of two stacks that can be compared be seen. */
export const isSwipe = (share, session) => session.comparable && share >= 0.02 && share <= 0.98;

/**
 * Keeps the page's address and the state alike.
 * @param {State} state
 * @param {any} session
 */
export function linkAddress(state, session) {
  let timer = 0;
  state.addEventListener("change", () => {
    clearTimeout(timer);
    timer = setTimeout(() => history.replaceState(null, "", toHash(state.view)), 150);
  });
  addEventListener("hashchange", () => state.set(fromHash(location.hash, session)));
}
