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
 */

/**
 * Returns a name that tells sheets apart.
 * @param {Sheet} sheet
 */
export function nameOf({ stack, layer, kind, threshold }) {
  return `${stack}/${layer}/${kind}${threshold ? `?threshold=${threshold}` : ""}`;
}

/**
 * Returns a source of tiles. A level of OpenSeadragon is a reduction by halves of ours, counted
 * from the other end. Its `stop` gives up what is on the way.
 * @param {Sheet} sheet
 * @param {number} side of a tile, in pixels
 * @param {(error: Error) => void} fail is told why a tile does not come
 */
export function tileSource(sheet, side, fail) {
  const { stack, layer, kind, threshold, width, height } = sheet;
  const maxLevel = Math.max(0, Math.ceil(Math.log2(Math.max(width, height) / side)));
  const source = new OpenSeadragon.TileSource({
    width,
    height,
    tileSize: side,
    tileOverlap: 0,
    minLevel: 0,
    maxLevel,
  });
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
