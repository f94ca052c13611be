/** The layer picture: OpenSeadragon, with sheets that are swapped when all of the next have come. */

import { nameOf, tileSource } from "./source.js";

/** A layer that takes longer than this is given up for the next one that is wanted. */
const PATIENCE_MS = 150;
/** After so many that were given up, one is waited for: a key held down still shows layers. */
const MOST_GIVEN_UP = 3;

/** What comes next is fetched ahead when nothing has come or moved for so long. */
const STILL_MS = 80;

/** The largest zoom, in screen pixels for the width of a pixel. */
export const MAX_ZOOM = 40;

/** Events: `view` when place or zoom change, `shown` when a scene has come, `failed`. */
export class Picture extends EventTarget {
  #viewer;
  #side;
  #unit;
  #aspect = 1;
  /** @type {Map<string, any>} OpenSeadragon's images by the names of their sheets */
  #items = new Map();
  #wanted = null;
  #shown = null;
  #since = 0;
  #givenUp = 0;
  #still = 0;
  #busySince = 0;
  #loading = null;
  #swipe = null;

  /**
   * @param {HTMLElement} element
   * @param {{tile: number, unit: number}} options side of tiles, and pixels for a unit of the viewport
   */
  constructor(element, { tile, unit }) {
    super();
    this.#side = tile;
    this.#unit = unit;
    forbidStyle();
    this.#viewer = OpenSeadragon({
      element,
      drawer: "canvas",
      showNavigationControl: false,
      showNavigator: true,
      navigatorPosition: "BOTTOM_LEFT",
      navigatorSizeRatio: 0.16,
      maxZoomPixelRatio: MAX_ZOOM,
      minPixelRatio: 0.5,
      immediateRender: true,
      maxTilesPerFrame: 4,
      blendTime: 0,
      animationTime: matchMedia("(prefers-reduced-motion: reduce)").matches ? 0 : 0.3,
      visibilityRatio: 0.2,
      constrainDuringPan: true,
      subPixelRoundingForTransparency: OpenSeadragon.SUBPIXEL_ROUNDING_OCCURRENCES.ALWAYS,
      gestureSettingsMouse: { clickToZoom: false, dblClickToZoom: true },
      gestureSettingsTouch: { clickToZoom: false, dblClickToZoom: true },
      gestureSettingsPen: { clickToZoom: false, dblClickToZoom: true },
    });
    // Keys are the page's, so that they are the same wherever the focus is.
    this.#viewer.addHandler("canvas-key", (event) => (event.preventDefaultAction = true));
    // The navigator would fetch each tile a second time; it takes its own once the layer is shown.
    this.#viewer.navigator.world.addHandler("add-item", ({ item }) => {
      item.setPreload(false);
      item.savedCutOffLevel = 0;
    });
    // Pixels that are larger than the screen's stay sharp. Told before it draws, not after.
    this.#viewer.addHandler("viewport-change", () => {
      this.#viewer.drawer.setImageSmoothingEnabled(this.zoom < 1);
      this.#clip();
    });
    // The canvas on which overlays are drawn first keeps its own setting.
    this.#viewer.addHandler("tile-drawing", ({ context }) => (context.imageSmoothingEnabled = this.zoom < 1));
    for (const name of ["update-viewport", "resize"]) {
      this.#viewer.addHandler(name, () => this.dispatchEvent(new Event("view")));
    }
  }

  /** The element that takes clicks and keys. */
  get canvas() {
    return this.#viewer.canvas;
  }

  /** The sheets' pixels as they are on the screen. */
  get pixels() {
    return this.#viewer.drawer.canvas;
  }

  /**
   * Calls back with the place of each click, in pixels of the image.
   * @param {(at: [number, number]) => void} call
   */
  onClick(call) {
    this.#viewer.addHandler("canvas-click", (event) => {
      if (event.quick) call(this.fromScreen([event.position.x, event.position.y]));
    });
  }

  /** The share of the screen's width where the second stack begins; null: one stack is shown. */
  set swipe(share) {
    this.#swipe = share;
    this.#clip();
  }

  /** Cuts the sheets at the border between the stacks, of which the second is on its right. */
  #clip() {
    const border = this.fromScreen([(this.#swipe ?? 0) * this.#viewer.viewport.getContainerSize().x, 0])[0];
    for (const item of this.#items.values()) {
      const { aspect, height, left, stack, width } = item.sheet;
      const at = Math.max(0, Math.min(width, border - left));
      const [from, to] = this.#swipe == null ? [0, width] : stack === 0 ? [0, at] : [at, width];
      // A clip that is set anew is drawn anew, which would never end.
      if (item.range?.[0] === from && item.range?.[1] === to) continue;
      item.range = [from, to];
      item.setClip(to - from === width ? null : new OpenSeadragon.Rect(from, 0, to - from, height * aspect));
    }
  }

  /** The height of a pixel of what is wanted in widths. */
  get aspect() {
    return this.#aspect;
  }

  /** Zoom: screen pixels for the width of a pixel. */
  get zoom() {
    const { viewport } = this.#viewer;
    return (viewport.getContainerSize().x * viewport.getZoom(true)) / this.#unit;
  }

  /** @returns {[number, number]} column and row in the middle */
  get centre() {
    const { x, y } = this.#viewer.viewport.getCenter(true);
    return [x * this.#unit, (y * this.#unit) / this.#aspect];
  }

  /** Returns the place on the screen of a place in the image. */
  toScreen([x, y]) {
    const place = this.#viewer.viewport.pixelFromPoint(this.#point([x, y]), true);
    return [place.x, place.y];
  }

  /** Returns the place in the image of a place on the screen. */
  fromScreen([x, y]) {
    const point = this.#viewer.viewport.pointFromPixel(new OpenSeadragon.Point(x, y), true);
    return [point.x * this.#unit, (point.y * this.#unit) / this.#aspect];
  }

  /** Returns a place of the image in the viewport. */
  #point([x, y]) {
    return new OpenSeadragon.Point(x / this.#unit, (y * this.#aspect) / this.#unit);
  }

  /** Brings a place of the image to the middle, with a zoom. */
  lookAt([x, y], zoom) {
    const { viewport } = this.#viewer;
    const target = (zoom * this.#unit) / viewport.getContainerSize().x;
    viewport.zoomTo(target, null, true);
    viewport.panTo(this.#point([x, y]), true);
    viewport.applyConstraints(true);
  }

  /** Shows a rectangle of the image, `[left, top, right, bottom]`, with room around it. */
  fit([left, top, right, bottom]) {
    const [width, height] = [right - left, bottom - top];
    const screen = this.#viewer.viewport.getContainerSize();
    const zoom = Math.min(screen.x / width, screen.y / (height * this.#aspect)) / 3;
    this.lookAt([left + width / 2, top + height / 2], Math.min(zoom, MAX_ZOOM / 2));
  }

  /** Shows the whole layer. */
  home() {
    this.#viewer.viewport.goHome();
  }

  /** Shows the whole layer again once the screen has another size, if it is whole now. */
  stayWhole() {
    const { viewport } = this.#viewer;
    const [now, home] = [viewport.getBounds(true), viewport.getHomeBounds()];
    const isWhole = now.width > 0.98 * home.width && now.height > 0.98 * home.height;
    if (isWhole) this.#viewer.addOnceHandler("resize", () => viewport.goHome(true));
  }

  /** Zooms about the middle. */
  zoomBy(factor) {
    this.#viewer.viewport.zoomBy(factor).applyConstraints();
  }

  /** Moves by parts of the screen's width and height. */
  pan(right, down) {
    const { viewport } = this.#viewer;
    const { width, height } = viewport.getBounds();
    viewport.panBy(new OpenSeadragon.Point(right * width, down * height)).applyConstraints();
  }

  /**
   * Shows a scene as soon as all of it has come; until then the one before stays. What comes
   * next is fetched ahead when all is still.
   * @param {{sheets: Sheet[], opacity: Record<string, number>, next: Sheet[]}} scene
   *     the layer first, then its overlays; how opaque each kind is; what is expected to be next
   * @typedef {import("./source.js").Sheet} Sheet
   */
  show(scene) {
    this.#wanted = scene;
    this.#aspect = scene.sheets[0].aspect;
    if (!this.#loading) this.#loadWanted();
    else if (performance.now() - this.#since > PATIENCE_MS && this.#givenUp < MOST_GIVEN_UP) this.#loading.abort();
  }

  /** Fetches the sheets of a kind again. */
  refresh(kind) {
    if (!this.#shown) return;
    const { sheets } = this.#shown;
    for (const sheet of sheets.filter((sheet) => sheet.kind === kind)) this.#remove(nameOf(sheet));
    this.show({ ...this.#wanted });
  }

  async #loadWanted() {
    while (this.#shown !== this.#wanted) {
      const scene = this.#wanted;
      this.#since = performance.now();
      this.#loading = new AbortController();
      this.#tellBusy();
      if (await this.#load(scene, this.#loading.signal)) {
        this.#reveal(scene);
        this.#givenUp = 0;
        performance.measure("scene", { start: this.#since, detail: nameOf(scene.sheets[0]) });
      }
    }
    this.#loading = null;
    this.canvas.dataset.shown = this.#shown.sheets.map(nameOf).join(" ");
    this.#tellBusy();
    this.dispatchEvent(new CustomEvent("shown", { detail: this.#shown }));
  }

  /** Adds what is new in a scene, unseen; returns whether all of it came. */
  async #load(scene, signal) {
    const isFirst = this.#items.size === 0;
    this.#keep(scene, this.#shown);
    const added = scene.sheets.filter((sheet) => !this.#items.has(nameOf(sheet)));
    await Promise.all(added.map((sheet) => this.#add(sheet, isFirst)));
    const all = Promise.all(scene.sheets.map((sheet) => this.#loaded(this.#items.get(nameOf(sheet)))));
    const stopped = new Promise((stop) => signal.addEventListener("abort", () => stop("stopped")));
    if ((await Promise.race([all, stopped])) !== "stopped") return true;
    for (const sheet of added) this.#remove(nameOf(sheet));
    this.#givenUp += 1;
    return false;
  }

  async #add(sheet, isFirst) {
    const source = tileSource(sheet, this.#side, (error) => this.#fail(sheet, error));
    // Until the level that the present zoom needs has come, coarser ones would only delay it.
    const level = isFirst ? 0 : this.#levelOf(source);
    source.getClosestLevel = () => level;
    const item = await new Promise((success, error) => {
      this.#viewer.addTiledImage({
        tileSource: source,
        x: sheet.left / this.#unit,
        y: (sheet.top * sheet.aspect) / this.#unit,
        width: sheet.width / this.#unit,
        index: sheet.kind === "layer" ? 0 : undefined,
        opacity: 0,
        preload: true,
        success: (event) => success(event.item),
        error,
      });
    });
    // Meanwhile what was fetched ahead may have become what is wanted.
    if (this.#items.has(nameOf(sheet))) return this.#viewer.world.removeItem(item);
    item.addHandler("fully-loaded-change", () => this.#tellBusy());
    item.sheet = sheet;
    this.#items.set(nameOf(sheet), item);
    this.#clip();
  }

  /** Tells why a sheet that is wanted does not come. One fetched ahead is tried again once it is. */
  #fail(sheet, error) {
    const isIn = (scene) => scene?.sheets.some((wanted) => nameOf(wanted) === nameOf(sheet));
    if (isIn(this.#wanted)) this.dispatchEvent(new CustomEvent("failed", { detail: error }));
    else if (!isIn(this.#shown) && this.#items.has(nameOf(sheet))) this.#remove(nameOf(sheet));
  }

  /** The level that the present zoom needs. */
  #levelOf(source) {
    const reduction = Math.max(0, Math.floor(-Math.log2(this.zoom)));
    return Math.max(0, source.maxLevel - reduction);
  }

  #loaded(item) {
    return new Promise((loaded) => (this.#hasAll(item) ? loaded() : item.whenFullyLoaded(loaded)));
  }

  /** Whether an image has all tiles that the screen shows. Beside the screen, none are loaded. */
  #hasAll(item) {
    const [from, to] = item.range;
    const seen = this.#viewer.viewport.getBoundsWithMargins().intersection(item.getClippedBounds());
    return from === to || !seen || item.getFullyLoaded();
  }

  #reveal(scene) {
    for (const sheet of scene.sheets) {
      const item = this.#items.get(nameOf(sheet));
      // From now on, coarser levels come first at another zoom.
      item.savedCutOffLevel = 0;
      item.setOpacity(scene.opacity[sheet.kind] ?? 1);
    }
    this.#shown = scene;
    this.#keep(scene);
  }

  /** Removes all sheets but those of scenes. */
  #keep(...scenes) {
    const names = new Set(scenes.flatMap((scene) => scene?.sheets.map(nameOf) ?? []));
    for (const name of [...this.#items.keys()]) if (!names.has(name)) this.#remove(name);
  }

  /** Fetches ahead what is expected next, once nothing else is to come. */
  #expectNext() {
    clearTimeout(this.#still);
    this.#still = setTimeout(() => {
      if (this.#loading || this.#shown !== this.#wanted) return;
      const { next } = this.#shown;
      for (const sheet of next) if (!this.#items.has(nameOf(sheet))) this.#add(sheet, false);
    }, STILL_MS);
  }

  #remove(name) {
    const item = this.#items.get(name);
    item.source.stop();
    this.#viewer.world.removeItem(item);
    this.#items.delete(name);
  }

  /** Tells whether tiles are still to come, and how long the last ones took. */
  #tellBusy() {
    const shown = this.#shown?.sheets.map((sheet) => this.#items.get(nameOf(sheet))) ?? [];
    const isBusy = this.#loading != null || shown.some((item) => item && !this.#hasAll(item));
    const wasBusy = this.canvas.getAttribute("aria-busy") === "true";
    if (isBusy && !wasBusy) {
      this.#busySince = performance.now();
      clearTimeout(this.#still);
      // What was fetched ahead is of another place now, and would come in between.
      if (!this.#loading) queueMicrotask(() => this.#keep(this.#shown, this.#wanted));
    }
    if (wasBusy && !isBusy) {
      performance.measure("tiles", { start: this.#busySince });
      this.#expectNext();
    }
    this.canvas.setAttribute("aria-busy", `${isBusy}`);
  }
}

/** Keeps OpenSeadragon from adding a style, which the policy of this page forbids. */
function forbidStyle() {
  const found = document.createElementNS(null, "style");
  found.setAttribute("data-openseadragon-mobile-css", "");
  document.head.append(found);
}
