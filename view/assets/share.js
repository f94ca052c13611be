/** A link to the view, and the picture as a file. */

import { byId, element } from "./format.js";
import { toHash } from "./state.js";

/**
 * Connects the buttons.
 * @param {any} app
 */
export function listenToShare(app) {
  byId("link").addEventListener("click", async () => {
    const link = location.origin + location.pathname + toHash(app.state.view);
    try {
      await navigator.clipboard.writeText(link);
      app.say("The link is in the clipboard. It works in this browser while the viewer runs.");
    } catch {
      history.replaceState(null, "", toHash(app.state.view));
      app.say("This browser lets no page copy: the link is the page's address.");
    }
  });
  byId("download").addEventListener("click", () => app.picture.pixels.toBlob((file) => save(file, app)));
}

function save(file, { columns, session, state }) {
  const { stack, layer } = state.view;
  const name = session.stacks[stack].name.replace(/\.[^.]*$/, "");
  const link = element("a");
  link.href = URL.createObjectURL(file);
  link.download = `${name}-layer-${columns.index[layer]}.png`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
