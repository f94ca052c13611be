/** Numbers as people read them. */

/** A whole number with its thousands apart. */
export const count = (value) => Math.round(value).toLocaleString("en").replaceAll(",", " ");

/** Millimetres, to the micrometre. */
export const mm = (value) => `${value.toFixed(3)} mm`;

/** A length that is given in pixels, also in millimetres where the resolution is known. */
export function length(pixels, dpi) {
  const text = `${+pixels.toFixed(1)} px`;
  return dpi ? `${mm((pixels * 25.4) / dpi)} (${text})` : text;
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
