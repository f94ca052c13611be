/** Tiles of the server for OpenSeadragon. */

import { ask } from "./api.js";

/**
 * @typedef {object} Sheet an image of a layer: itself, or an overlay
 * @property {number} stack
 * @property {number} layer
 * @property {string} kind `layer`, or an overlay's name
 * @property {number | null} threshold
 * @property {number} width in pixels
 * @property {number} height in pixels
 * @property {number} aspect the height of a pixel in widths
 * @property {number} left where it begins in columns of the first sheet
 * @property {number} top where it begins in rows of the first sheet
 */

/**
 * Returns a name that tells sheets apart.
 * @param {Sheet} sheet
 */
export function nameOf({ stack, layer, kind, threshold, left, top }) {
  const place = left || top ? `@${left},${top}` : "";
  return `${stack}/${layer}/${kind}${threshold ? `?threshold=${threshold}` : ""}${place}`;
}

/**
 * Returns a source of tiles. A level of OpenSeadragon is a reduction by halves of ours, counted
 * from the other end. Its `stop` gives up what is on the way.
 * @param {Sheet} sheet
 * @param {number} side of a tile, in pixels
 * @param {(error: Error) => void} fail is told why a tile does not come
 */
export function tileSource(sheet, side, fail) {
  const { stack, layer, kind, threshold, width, height, aspect } = sheet;
  const maxLevel = Math.max(0, Math.ceil(Math.log2(Math.max(width, height) / side)));
  const source = new OpenSeadragon.TileSource({
    width,
    height: height * aspect,
    tileWidth: side,
    tileHeight: side * aspect,
    tileOverlap: 0,
    minLevel: 0,
    maxLevel,
  });
  // Tiles have as many rows as columns, and are drawn higher or lower than wide.
  const boundsOf = source.getTileBounds.bind(source);
  source.getTileBounds = (level, x, y, isSource) => {
    const bounds = boundsOf(level, x, y, isSource);
    if (isSource) bounds.height /= aspect;
    return bounds;
  };
  // By pixels, for a rounded height might have one row of tiles more.
  source.getNumTiles = (level) => {
    const tiles = (pixels) => Math.ceil((source.getLevelScale(level) * pixels) / side);
    return new OpenSeadragon.Point(tiles(width), tiles(height));
  };
  const query = threshold ? `?threshold=${threshold}` : "";
  const stop = new AbortController();
  source.getTileUrl = (level, x, y) =>
    `/tiles/${stack}/${layer}/${kind}/${maxLevel - level}/${x}/${y}.png${query}`;
  source.hasTransparency = () => kind !== "layer";
  source.downloadTileStart = async (job) => {
    const own = new AbortController();
    job.userData.stop = own;
    try {
      const file = await (await ask(job.src, AbortSignal.any([stop.signal, own.signal]))).blob();
      job.finish(await createImageBitmap(file), null, "imageBitmap");
    } catch (error) {
      if (error.name === "AbortError") return forget(job);
      fail(error);
      job.fail(error.message);
    }
  };
  source.downloadTileAbort = (job) => job.userData.stop.abort();
  source.stop = () => stop.abort();
  return source;
}

/** Ends a job without the failure that OpenSeadragon would print as an error. */
function forget(job) {
  clearTimeout(job.jobId);
  job.jobId = null;
}
