/** Numbers as people read them. */

/** A whole number with its thousands apart, as the command line writes it. */
export const count = (value) => Math.round(value).toLocaleString("en");

/** Millimetres, to the micrometre. */
export const mm = (value) => `${value.toFixed(3)} mm`;

/** The width and height of a pixel in millimetres, by dots per inch as a stack has them: a number, or
 * one along x and one along y; null if they are not known. */
export const pitchOf = (dpi) =>
  dpi == null ? null : (Array.isArray(dpi) ? dpi : [dpi, dpi]).map((axis) => 25.4 / axis);

/** The height of a pixel in widths: 1 where pixels are square. */
export function aspectOf(dpi) {
  return Array.isArray(dpi) ? dpi[0] / dpi[1] : 1;
}

/** The resolution as people write it. */
export function resolution(dpi) {
  const um = (axis) => +(25400 / axis).toFixed(4);
  if (Array.isArray(dpi)) return `${um(dpi[0])} x ${um(dpi[1])} µm`;
  return Number.isInteger(dpi) ? `${dpi} dpi` : `${um(dpi)} µm`;
}

/** A length that is given in pixels, also in millimetres where a pixel's side is known. */
export function length(pixels, side) {
  const text = `${+pixels.toFixed(1)} px`;
  return side ? `${mm(pixels * side)} (${text})` : text;
}

/**
 * Fills a list of terms with facts; those that are not known are left out.
 * @param {HTMLElement} list
 * @param {[string, string | null | undefined][]} facts
 */
export function tell(list, facts) {
  const known = facts.filter(([, text]) => text != null && text !== "");
  list.replaceChildren(...known.flatMap(([term, text]) => [element("dt", term), element("dd", text)]));
}

/**
 * Returns a new element with a text.
 * @param {string} name
 * @param {string} [text]
 */
export function element(name, text = "") {
  const made = document.createElement(name);
  made.textContent = text;
  return made;
}

/** Returns the element of the page with an identifier. */
export const byId = (id) => document.getElementById(id);
