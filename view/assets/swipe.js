/** Two stacks in one picture: the first on the left of a border that can be moved, the second on the right. */

import { byId } from "./format.js";
import { isSwipe } from "./state.js";

/** The border between two stacks. */
export class Swipe {
  #app;
  #border = byId("swipe");

  constructor(app) {
    this.#app = app;
    const { session, state } = app;
    byId("compare").hidden = !session.comparable;
    byId("compare").addEventListener("click", () => this.toggle());
    for (const side of [0, 1]) this.#border.children[side].textContent = session.stacks[side]?.name ?? "";
    this.#border.addEventListener("pointerdown", ({ pointerId }) => this.#border.setPointerCapture(pointerId));
    this.#border.addEventListener("pointermove", (event) => {
      if (event.buttons & 1) this.#to((event.clientX - byId("picture").offsetLeft) / byId("picture").clientWidth);
    });
    this.#border.addEventListener("keydown", (event) => {
      const by = { ArrowLeft: -0.02, ArrowRight: 0.02 }[event.key];
      if (!by) return;
      this.#to(state.view.swipe + by);
      event.preventDefault();
      event.stopPropagation();
    });
    state.on(["swipe"], () => this.#show());
    this.#show();
  }

  /** Shows both stacks, or one alone. */
  toggle() {
    const { session, state } = this.#app;
    if (session.comparable) state.set({ swipe: state.view.swipe ? null : 0.5 });
  }

  #to(share) {
    if (isSwipe(share, this.#app.session)) this.#app.state.set({ swipe: share });
  }

  #show() {
    const { swipe } = this.#app.state.view;
    byId("compare").setAttribute("aria-pressed", `${swipe != null}`);
    this.#border.hidden = swipe == null;
    this.#border.style.left = `${100 * (swipe ?? 0.5)}%`;
    this.#border.ariaValueNow = `${Math.round(100 * (swipe ?? 0.5))}`;
    this.#app.picture.swipe = swipe;
  }
}
