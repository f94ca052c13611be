/** The layer picture: OpenSeadragon, with sheets that are swapped when all of the next have come. */

import { nameOf, tileSource } from "./source.js";

/** A layer that takes longer than this is given up for the next one that is wanted. */
const PATIENCE_MS = 150;

/** The largest zoom, in screen pixels for a pixel. */
export const MAX_ZOOM = 40;

/** Events: `view` when place or zoom change, `shown` when a scene has come, `failed`. */
export class Picture extends EventTarget {
  #viewer;
  #side;
  #unit;
  /** @type {Map<string, any>} OpenSeadragon's images by the names of their sheets */
  #items = new Map();
  #wanted = null;
  #shown = null;
  #since = 0;
  #busySince = 0;
  #loading = null;

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
    for (const name of ["update-viewport", "resize"]) {
      this.#viewer.addHandler(name, () => this.#moved());
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

  /** Zoom: screen pixels for a pixel. */
  get zoom() {
    const { viewport } = this.#viewer;
    return (viewport.getContainerSize().x * viewport.getZoom(true)) / this.#unit;
  }

  /** @returns {[number, number]} column and row in the middle */
  get centre() {
    const { x, y } = this.#viewer.viewport.getCenter(true);
    return [x * this.#unit, y * this.#unit];
  }

  /** Returns the place on the screen of a place in the image. */
  toScreen([x, y]) {
    const point = new OpenSeadragon.Point(x / this.#unit, y / this.#unit);
    const place = this.#viewer.viewport.pixelFromPoint(point, true);
    return [place.x, place.y];
  }

  /** Returns the place in the image of a place on the screen. */
  fromScreen([x, y]) {
    const point = this.#viewer.viewport.pointFromPixel(new OpenSeadragon.Point(x, y), true);
    return [point.x * this.#unit, point.y * this.#unit];
  }

  /** Brings a place of the image to the middle, with a zoom. */
  lookAt([x, y], zoom) {
    const { viewport } = this.#viewer;
    const target = (zoom * this.#unit) / viewport.getContainerSize().x;
    viewport.zoomTo(target, null, true);
    viewport.panTo(new OpenSeadragon.Point(x / this.#unit, y / this.#unit), true);
    viewport.applyConstraints(true);
  }

  /** Shows a rectangle of the image, `[left, top, right, bottom]`, with room around it. */
  fit([left, top, right, bottom]) {
    const [width, height] = [right - left, bottom - top];
    const screen = this.#viewer.viewport.getContainerSize();
    const zoom = Math.min(screen.x / width, screen.y / height) / 3;
    this.lookAt([left + width / 2, top + height / 2], Math.min(zoom, MAX_ZOOM / 2));
  }

  /** Shows the whole layer. */
  home() {
    this.#viewer.viewport.goHome();
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
   * Shows a scene as soon as all of it has come; until then the one before stays.
   * @param {{sheets: import("./source.js").Sheet[], opacity: Record<string, number>}} scene
   *     the layer first, then its overlays; how opaque each kind is
   */
  show(scene) {
    this.#wanted = scene;
    if (!this.#loading) this.#loadWanted();
    else if (performance.now() - this.#since > PATIENCE_MS) this.#loading.abort();
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
    const added = scene.sheets.filter((sheet) => !this.#items.has(nameOf(sheet)));
    const items = await Promise.all(added.map((sheet) => this.#add(sheet, isFirst)));
    const all = Promise.all(items.map((item) => this.#loaded(item)));
    const stopped = new Promise((stop) => signal.addEventListener("abort", () => stop("stopped")));
    if ((await Promise.race([all, stopped])) !== "stopped") return true;
    for (const sheet of added) this.#remove(nameOf(sheet));
    return false;
  }

  async #add(sheet, isFirst) {
    const fail = (error) => this.dispatchEvent(new CustomEvent("failed", { detail: error }));
    const source = tileSource(sheet, this.#side, fail);
    if (!isFirst) source.minLevel = this.#levelOf(source);
    const item = await new Promise((success, error) => {
      this.#viewer.addTiledImage({
        tileSource: source,
        width: sheet.width / this.#unit,
        index: sheet.kind === "layer" ? 0 : undefined,
        opacity: 0,
        preload: true,
        success: (event) => success(event.item),
        error,
      });
    });
    item.addHandler("fully-loaded-change", () => this.#tellBusy());
    this.#items.set(nameOf(sheet), item);
    return item;
  }

  /** The level that the present zoom needs: until it has come, coarser ones would only delay it. */
  #levelOf(source) {
    const reduction = Math.max(0, Math.floor(-Math.log2(this.zoom)));
    return Math.max(0, source.maxLevel - reduction - 1);
  }

  #loaded(item) {
    return new Promise((loaded) => (this.#hasAll(item) ? loaded() : item.whenFullyLoaded(loaded)));
  }

  /** Whether an image has all tiles that the screen shows. Beside the screen, none are loaded. */
  #hasAll(item) {
    const seen = this.#viewer.viewport.getBoundsWithMargins().intersection(item.getBounds());
    return !seen || item.getFullyLoaded();
  }

  #reveal(scene) {
    const names = new Set(scene.sheets.map(nameOf));
    for (const sheet of scene.sheets) {
      const item = this.#items.get(nameOf(sheet));
      item.source.minLevel = 0;
      item.setOpacity(scene.opacity[sheet.kind] ?? 1);
    }
    for (const name of [...this.#items.keys()]) if (!names.has(name)) this.#remove(name);
    this.#shown = scene;
  }

  #remove(name) {
    const item = this.#items.get(name);
    item.source.stop();
    this.#viewer.world.removeItem(item);
    this.#items.delete(name);
  }

  /** Tells whether tiles are still to come, and how long the last ones took. */
  #tellBusy() {
    const isBusy = this.#loading != null || [...this.#items.values()].some((item) => !this.#hasAll(item));
    const wasBusy = this.canvas.getAttribute("aria-busy") === "true";
    if (isBusy && !wasBusy) this.#busySince = performance.now();
    if (wasBusy && !isBusy) performance.measure("tiles", { start: this.#busySince });
    this.canvas.setAttribute("aria-busy", `${isBusy}`);
  }

  #moved() {
    // Pixels that are larger than the screen's stay squares.
    this.#viewer.drawer.setImageSmoothingEnabled(this.zoom < 1);
    this.dispatchEvent(new Event("view"));
  }
}

/** Keeps OpenSeadragon from adding a style, which the policy of this page forbids. */
function forbidStyle() {
  const found = document.createElementNS(null, "style");
  found.setAttribute("data-openseadragon-mobile-css", "");
  document.head.append(found);
}
