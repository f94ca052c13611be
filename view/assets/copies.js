/** The numbers of copies, over the picture while copies have colors. */

import { get } from "./api.js";

/**
 * Shows the numbers while the overlay is on.
 * @param {any} app
 */
export function numberCopies(app) {
  /** @type {Map<number, Promise<any[]>>} copies by stack, asked for when they are first shown */
  const asked = new Map();
  const show = async () => {
    const { overlays, stack } = app.state.view;
    if (!overlays.includes("copies")) return app.marks.setLabels([]);
    if (!asked.has(stack)) asked.set(stack, get(`/api/stacks/${stack}/copies`));
    const copies = await asked.get(stack).catch(app.fail);
    if (!copies || app.state.view.stack !== stack) return;
    app.marks.setLabels(copies.map(({ number, box }) => ({ text: `${number}`, box })));
  };
  app.state.on(["overlays", "stack"], show);
  show();
}
