// The objects under mouse, fingers and keys. One finger moves an object at its height, two fingers turn it.
import { cornersOf, pixelOf, pointOnPlane } from "./camera.js";

const STEP_M = 0.01;
const TURN_DEGREES = 5;
const SLACK_PX = 8; // of the screen: a tap that moves less moves nothing
const REACH = 0.12; // of the picture's width: how far from an object a tap still means it
const NAMED_MS = 2000;

const $ = (id) => document.getElementById(id);
/** The name of a key, whether or not capitals are locked. */
export const keyOf = (event) => (event.key.length === 1 ? event.key.toLowerCase() : event.key);
const degrees = (angle) => ((((angle + 180) % 360) + 360) % 360) - 180;

/** From a pixel to the smallest rectangle that holds all of these; 0 inside. */
function distanceToAll([u, v], pixels) {
  const outside = (at, all) => Math.max(Math.min(...all) - at, 0, at - Math.max(...all));
  return Math.hypot(outside(u, pixels.map((p) => p[0])), outside(v, pixels.map((p) => p[1])));
}

export class PictureControls {
  constructor(canvas, controls) {
    this.canvas = canvas;
    this.controls = controls;
    this.pointers = new Map(); // by id: where on the screen, in the order in which they came down
    canvas.onpointerdown = (event) => this.down(event);
    canvas.onpointermove = (event) => this.moved(event);
    canvas.onpointerup = canvas.onpointercancel = (event) => this.up(event);
    canvas.addEventListener("wheel", (event) => {
      if (!controls.current || event.ctrlKey) return;
      event.preventDefault();
      controls.turn(event.deltaY > 0 ? -TURN_DEGREES : TURN_DEGREES);
    }, { passive: false });
    canvas.onkeydown = (event) => this.key(event);
  }

  /** Of the camera's picture, in pixels; a stream may have fewer. */
  get size() { return this.controls.size ?? [this.canvas.width, this.canvas.height]; }

  /** Of the canvas on the screen: its picture's left and top edge, and its scale. */
  frame() {
    const box = this.canvas.getBoundingClientRect();
    const [width, height] = this.size;
    const scale = Math.min(box.width / width, box.height / height); // object-fit: contain
    return { left: box.left + (box.width - width * scale) / 2, top: box.top + (box.height - height * scale) / 2, scale };
  }

  pixel({ x, y }) {
    const { left, top, scale } = this.frame();
    return [(x - left) / scale - 0.5, (y - top) / scale - 0.5];
  }

  /** Where the ray through a point of the screen is as high as the chosen object; null where there is no such place. */
  meet(at) {
    const { camera, T_tag_camera, current } = this.controls;
    if (!camera || !T_tag_camera || !current) return null;
    return pointOnPlane(camera, T_tag_camera, ...this.pixel(at), current.position_m[2]);
  }

  /** The index of the visible object that a tap there means; -1 if it means none. */
  objectAt(at) {
    const { camera, T_tag_camera, objects } = this.controls;
    if (!camera || !T_tag_camera) return -1;
    const pixel = this.pixel(at);
    const found = objects.map((object, index) => {
      const pixels = cornersOf(object).map((corner) => pixelOf(camera, T_tag_camera, corner));
      const far = Math.hypot(...object.position_m.map((value, i) => value - T_tag_camera[i][3]));
      return { index, far, away: object.visible && pixels.every(Boolean) ? distanceToAll(pixel, pixels) : Infinity };
    });
    const [nearest] = found.sort((a, b) => a.away - b.away || a.far - b.far); // of those there, the one in front
    return nearest?.away < REACH * this.size[0] ? nearest.index : -1;
  }

  down(event) {
    if (event.button !== 0) return;
    const at = { x: event.clientX, y: event.clientY };
    if (this.controls.awaitsTap) return this.put(at);
    if (this.pointers.size === 0) this.choose(this.objectAt(at));
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, at);
    this.grip();
  }

  put(at) {
    const [u, v] = this.pixel(at);
    const [width, height] = this.size;
    if (u < 0 || v < 0 || u > width - 1 || v > height - 1) return;
    this.controls.putOnPixel(u, v);
  }

  /** Begins a movement with the fingers that are down now. */
  grip() {
    const [one, other] = this.pointers.values();
    const { current } = this.controls;
    this.held = null;
    if (!one || !current) return;
    const met = this.meet(one);
    const offset = met && [current.position_m[0] - met[0], current.position_m[1] - met[1]];
    this.held = { from: one, begun: false, offset, yaw: current.yaw_degrees, angle: other && this.angle() };
  }

  /** From the first finger to the second, degrees, clockwise on the screen. */
  angle() {
    const [one, other] = this.pointers.values();
    return (Math.atan2(other.y - one.y, other.x - one.x) * 180) / Math.PI;
  }

  moved(event) {
    if (!this.pointers.has(event.pointerId)) return;
    const at = { x: event.clientX, y: event.clientY };
    this.pointers.set(event.pointerId, at);
    if (!this.held) return;
    if (this.pointers.size > 1) this.twist();
    else this.drag(at);
  }

  twist() {
    const { held } = this;
    const angle = this.angle();
    held.yaw = degrees(held.yaw - degrees(angle - held.angle)); // seen from above, z towards the viewer
    held.angle = angle;
    this.controls.change({ yaw_degrees: held.yaw });
  }

  drag(at) {
    const { held } = this;
    held.begun ||= Math.hypot(at.x - held.from.x, at.y - held.from.y) > SLACK_PX;
    const met = held.begun && held.offset && this.meet(at);
    if (met) this.controls.change({ position_m: [met[0] + held.offset[0], met[1] + held.offset[1], this.controls.current.position_m[2]] });
  }

  up(event) {
    if (this.pointers.delete(event.pointerId)) this.grip();
  }

  /** Chooses an object and shows its name beside it. */
  choose(index) {
    if (index < 0 || index === this.controls.index) return;
    this.controls.choose(index);
    const { camera, T_tag_camera, current } = this.controls;
    const at = current && camera && T_tag_camera && pixelOf(camera, T_tag_camera, current.position_m);
    if (!at) return;
    const { left, top, scale } = this.frame();
    const view = $("view").getBoundingClientRect();
    $("chosen").textContent = current.name;
    $("chosen").style.left = `${left - view.left + at[0] * scale}px`;
    $("chosen").style.top = `${top - view.top + at[1] * scale}px`;
    $("chosen").hidden = false;
    clearTimeout(this.named);
    this.named = setTimeout(() => { $("chosen").hidden = true; }, NAMED_MS);
  }

  chooseNext() {
    const { objects, index } = this.controls;
    const after = [...objects.keys()].map((i) => (index + 1 + i) % objects.length);
    this.choose(after.find((i) => objects[i].visible) ?? -1);
  }

  key(event) {
    const { controls } = this;
    const action = {
      ArrowLeft: () => controls.move(-STEP_M, 0), ArrowRight: () => controls.move(STEP_M, 0),
      ArrowUp: () => controls.move(0, STEP_M), ArrowDown: () => controls.move(0, -STEP_M),
      q: () => controls.turn(TURN_DEGREES), e: () => controls.turn(-TURN_DEGREES), n: () => this.chooseNext(),
    }[keyOf(event)];
    if (!action || !controls.current || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    action();
  }
}
