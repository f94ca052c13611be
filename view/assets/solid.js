/** The part in 3D, with the current layer as a plane in it. Loaded when it is first shown. */

import * as THREE from "./three.module.min.js";
import { Orbit } from "./orbit.js";

const HEAD_BYTES = 16;
const COLOURS = { part: 0xb9c4cf, plane: 0x2f8fff, frame: 0xffffff, finding: 0x990066, chosen: 0xff7799 };

/**
 * Reads a surface as the server writes it.
 * @param {ArrayBuffer} bytes
 */
export function readSurface(bytes) {
  const head = new DataView(bytes);
  const magic = String.fromCharCode(...new Uint8Array(bytes, 0, 4));
  if (magic !== "LSRF" || head.getUint32(4, true) !== 1) throw new Error("The surface is of another version.");
  const [vertices, triangles] = [head.getUint32(8, true), head.getUint32(12, true)];
  const geometry = new THREE.BufferGeometry();
  const floats = (index) => new Float32Array(bytes, HEAD_BYTES + 12 * vertices * index, 3 * vertices);
  geometry.setAttribute("position", new THREE.BufferAttribute(floats(0), 3));
  geometry.setAttribute("normal", new THREE.BufferAttribute(floats(1), 3));
  const corners = new Uint32Array(bytes, HEAD_BYTES + 24 * vertices, 3 * triangles);
  geometry.setIndex(new THREE.BufferAttribute(corners, 1));
  geometry.computeBoundingBox();
  return geometry;
}

/** A canvas with the part, drawn when something changes. */
export class Solid {
  #renderer;
  #scene = new THREE.Scene();
  #camera = new THREE.PerspectiveCamera(35, 1, 1, 10);
  #material = new THREE.MeshStandardMaterial({ color: COLOURS.part, roughness: 0.75, side: THREE.DoubleSide });
  #cut = new THREE.Plane(new THREE.Vector3(0, 0, -1), 0);
  #part;
  #plane;
  #frame;
  #markers = null;
  #box;
  #due = false;

  /**
   * @param {HTMLElement} parent
   * @param {ArrayBuffer} surface
   * @throws {Error} where the browser has no WebGL
   */
  constructor(parent, surface) {
    const geometry = readSurface(surface);
    this.#renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true, preserveDrawingBuffer: true });
    this.#renderer.localClippingEnabled = true;
    this.#box = geometry.boundingBox;
    this.#part = new THREE.Mesh(geometry, this.#material);
    this.#scene.add(this.#part, this.#camera);
    this.#scene.add(new THREE.HemisphereLight(0xffffff, 0x5a6068, 1.6));
    const lamp = new THREE.DirectionalLight(0xffffff, 1.8);
    lamp.position.set(1, 1, 1);
    this.#camera.add(lamp);
    this.#camera.up.set(0, 0, 1);
    this.#addPlane();
    const { domElement } = this.#renderer;
    domElement.tabIndex = 0;
    domElement.setAttribute("role", "application");
    domElement.setAttribute("aria-label", "Part in 3D: arrows turn it, plus and minus zoom");
    parent.replaceChildren(domElement);
    const [target, size] = [new THREE.Vector3(), new THREE.Vector3()];
    this.#box.getCenter(target);
    const distance = 1.7 * this.#box.getSize(size).length();
    this.orbit = new Orbit(this.#camera, domElement, { target, distance }, () => this.#draw());
    new ResizeObserver(() => this.#resize(parent)).observe(parent);
    this.#resize(parent);
  }

  /** The canvas. */
  get element() {
    return this.#renderer.domElement;
  }

  /**
   * Puts the plane of the layer at a height, and cuts the part there if wished.
   * @param {number} z
   * @param {boolean} isCut
   * @param {[number, number, number][]} frame corners of what the picture shows of the layer
   */
  setPlane(z, isCut, frame) {
    this.#plane.position.z = z;
    this.#frame.geometry.setFromPoints(frame.map((corner) => new THREE.Vector3(...corner)));
    this.#cut.constant = z;
    const planes = isCut ? [this.#cut] : null;
    if ((planes == null) !== (this.#material.clippingPlanes == null)) this.#material.needsUpdate = true;
    this.#material.clippingPlanes = planes;
    this.#draw();
  }

  /**
   * Marks places.
   * @param {[number, number, number][]} places
   */
  setMarkers(places) {
    if (this.#markers) this.#scene.remove(this.#markers);
    const side = this.#box.getSize(new THREE.Vector3()).length() / 90;
    const ball = new THREE.SphereGeometry(side, 12, 8);
    const material = new THREE.MeshBasicMaterial({ depthTest: false, transparent: true });
    this.#markers = new THREE.InstancedMesh(ball, material, places.length);
    this.#markers.renderOrder = 2;
    places.forEach((place, index) => {
      this.#markers.setMatrixAt(index, new THREE.Matrix4().makeTranslation(...place));
    });
    this.#scene.add(this.#markers);
    this.choose(null);
  }

  /** Shows which marker is the current one. */
  choose(chosen) {
    for (let index = 0; index < (this.#markers?.count ?? 0); index++) {
      const colour = index === chosen ? COLOURS.chosen : COLOURS.finding;
      this.#markers.setColorAt(index, new THREE.Color(colour));
    }
    if (this.#markers?.instanceColor) this.#markers.instanceColor.needsUpdate = true;
    this.#draw();
  }

  /**
   * Returns the marker at a place of the canvas, if there is one.
   * @param {PointerEvent} event
   */
  markerAt(event) {
    return this.#markers && (this.#ray(event).intersectObject(this.#markers)[0]?.instanceId ?? null);
  }

  /**
   * Returns the place of the part that is seen at a place of the canvas, if there is one.
   * @param {PointerEvent} event
   * @returns {[number, number, number] | undefined}
   */
  placeAt(event) {
    const isCut = this.#material.clippingPlanes != null;
    const hits = this.#ray(event).intersectObject(this.#part);
    return hits.find(({ point }) => !isCut || point.z <= this.#cut.constant)?.point.toArray();
  }

  #ray({ offsetX, offsetY }) {
    const { clientWidth, clientHeight } = this.element;
    const at = new THREE.Vector2((2 * offsetX) / clientWidth - 1, 1 - (2 * offsetY) / clientHeight);
    const ray = new THREE.Raycaster();
    ray.setFromCamera(at, this.#camera);
    return ray;
  }

  #addPlane() {
    const size = this.#box.getSize(new THREE.Vector3());
    const shape = new THREE.PlaneGeometry(1.15 * size.x, 1.15 * size.y);
    const look = { color: COLOURS.plane, transparent: true, opacity: 0.4, side: THREE.DoubleSide, depthWrite: false };
    this.#plane = new THREE.Mesh(shape, new THREE.MeshBasicMaterial(look));
    this.#box.getCenter(this.#plane.position);
    this.#plane.renderOrder = 1;
    const line = new THREE.LineBasicMaterial({ color: COLOURS.frame, depthTest: false, transparent: true });
    this.#frame = new THREE.LineLoop(new THREE.BufferGeometry(), line);
    this.#frame.renderOrder = 2;
    this.#frame.frustumCulled = false;
    this.#scene.add(this.#plane, this.#frame);
  }

  #resize({ clientWidth, clientHeight }) {
    if (!clientWidth || !clientHeight) return;
    this.#renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    this.#renderer.setSize(clientWidth, clientHeight);
    this.#camera.aspect = clientWidth / clientHeight;
    this.#camera.updateProjectionMatrix();
    this.#draw();
  }

  #draw() {
    if (this.#due) return;
    this.#due = true;
    requestAnimationFrame(() => {
      this.#due = false;
      this.#renderer.render(this.#scene, this.#camera);
    });
  }
}
