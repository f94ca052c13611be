/** Turns, moves and zooms a camera about a point by pointers, wheel and keys. */

const LOWEST = 0.05;

/** The camera's place on a sphere about a target; z is up. */
export class Orbit {
  #camera;
  #draw;
  #pointers = new Map();

  /**
   * @param {any} camera of three.js
   * @param {HTMLElement} element
   * @param {{target: any, distance: number}} start
   * @param {() => void} draw is called after each change
   */
  constructor(camera, element, { target, distance }, draw) {
    this.#camera = camera;
    this.#draw = draw;
    this.target = target;
    this.distance = distance;
    this.around = -Math.PI / 4;
    this.down = Math.PI / 3;
    element.addEventListener("pointerdown", (event) => {
      element.setPointerCapture(event.pointerId);
      this.#pointers.set(event.pointerId, event);
    });
    element.addEventListener("pointermove", (event) => this.#drag(event, element.clientHeight));
    for (const end of ["pointerup", "pointercancel"]) {
      element.addEventListener(end, (event) => this.#pointers.delete(event.pointerId));
    }
    element.addEventListener("contextmenu", (event) => event.preventDefault());
    element.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(event.deltaY / 600));
    }, { passive: false });
    this.#place();
  }

  /** Turns by angles, in radians. */
  turn(around, down) {
    this.around += around;
    this.down = Math.min(Math.PI - LOWEST, Math.max(LOWEST, this.down + down));
    this.#place();
  }

  /** Goes nearer or farther. */
  zoom(factor) {
    this.distance *= factor;
    this.#place();
  }

  /** Moves the target along the screen, by parts of the screen's height. */
  move(right, up) {
    const { matrix } = this.#camera;
    const side = this.distance * 2 * Math.tan((this.#camera.fov * Math.PI) / 360);
    const axis = (number) => this.target.clone().setFromMatrixColumn(matrix, number);
    this.target.addScaledVector(axis(0), -right * side).addScaledVector(axis(1), up * side);
    this.#place();
  }

  #drag(event, height) {
    const before = this.#pointers.get(event.pointerId);
    if (!before) return;
    const [right, down] = [event.clientX - before.clientX, event.clientY - before.clientY];
    const others = [...this.#pointers.values()].filter((one) => one.pointerId !== event.pointerId);
    this.#pointers.set(event.pointerId, event);
    if (others.length) {
      const apart = (one) => Math.hypot(one.clientX - others[0].clientX, one.clientY - others[0].clientY);
      this.zoom(apart(before) / Math.max(1, apart(event)));
      this.move(right / height / 2, down / height / 2);
    } else if (event.buttons & 2 || event.shiftKey) {
      this.move(right / height, down / height);
    } else {
      this.turn((-right / height) * Math.PI, (-down / height) * Math.PI);
    }
  }

  #place() {
    const { around, distance, down, target } = this;
    const flat = distance * Math.sin(down);
    this.#camera.position.set(
      target.x + flat * Math.cos(around),
      target.y + flat * Math.sin(around),
      target.z + distance * Math.cos(down),
    );
    this.#camera.near = distance / 100;
    this.#camera.far = distance * 10;
    this.#camera.updateProjectionMatrix();
    this.#camera.lookAt(target);
    this.#camera.updateMatrix();
    this.#draw();
  }
}
