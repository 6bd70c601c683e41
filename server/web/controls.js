// Controls of the objects: the panel, and what is sent when it or the picture changes them.
import { Gallery } from "./gallery.js";
import { announce } from "./messages.js";
import { PictureControls } from "./picture.js";
import { number, text } from "./text.js";

const OPAQUE = { emission: [0, 0, 0], transmission: 0, ior: 1.5, thin_walled: false, attenuation_color: [1, 1, 1], attenuation_distance_m: 1,
  clearcoat: 0, clearcoat_roughness: 0 };
const MATERIALS = {
  own: null,
  plaster: { ...OPAQUE, base_color: [0.78, 0.76, 0.72], metallic: 0, roughness: 1, specular: 0 },
  terracotta: { ...OPAQUE, base_color: [0.55, 0.2, 0.1], metallic: 0, roughness: 1, specular: 0 },
  jade: { ...OPAQUE, base_color: [0.1, 0.36, 0.18], metallic: 0, roughness: 0.3, specular: 1 },
  gold: { ...OPAQUE, base_color: [1.0, 0.77, 0.34], metallic: 1, roughness: 0.3, specular: 1 },
  steel: { ...OPAQUE, base_color: [0.56, 0.57, 0.58], metallic: 1, roughness: 0.45, specular: 1 },
  lamp: { ...OPAQUE, base_color: [0.8, 0.8, 0.8], metallic: 0, roughness: 1, specular: 0, emission: [4, 2.8, 1.5] },
  glass: { ...OPAQUE, base_color: [1, 1, 1], metallic: 0, roughness: 0, specular: 1, transmission: 1 },
};
const MESSAGES_A_SECOND = 30;

const $ = (id) => document.getElementById(id);

export class Controls {
  /** send(message) sends to the server */
  constructor(send) {
    this.permitted = true;
    this.send = (message) => { if (this.permitted) send(message); };
    this.objects = [];
    this.camera = null;
    this.size = null;
    this.T_tag_camera = null;
    this.pending = null;
    this.gallery = new Gallery($("gallery"), () => this.show());
    this.bind();
  }

  get index() { return this.gallery.index; }
  get current() { return this.permitted ? this.objects[this.index] : undefined; }

  hello(message) {
    this.camera = message.camera ?? null;
    this.size = message.width ? [message.width, message.height] : null; // the camera's; pictures may be smaller
    this.permitted = message.permissions?.includes("control") ?? true;
    $("object-panel").hidden = message.objects.length === 0 || !this.permitted;
    this.gallery.fill(message.objects);
    $("only").hidden = message.objects.length < 2;
    this.state(message.objects);
  }

  state(objects) {
    this.objects = objects;
    this.show();
  }

  pose(T_tag_camera) { this.T_tag_camera = T_tag_camera; }

  /** Chooses an object by its place in the list. */
  choose(index) {
    this.gallery.index = index;
    this.show();
    if (this.current) announce(text("object.chosen", this.current));
  }

  show() {
    this.gallery.show(this.objects);
    const object = this.current;
    if (!object) return;
    $("visible").checked = object.visible;
    if (document.activeElement !== $("yaw")) $("yaw").value = object.yaw_degrees;
    $("yaw-value").textContent = `${number(object.yaw_degrees)}°`;
    ["x", "y", "z"].forEach((axis, i) => {
      if (document.activeElement !== $(axis)) $(axis).value = object.position_m[i].toFixed(3);
    });
    $("material").value = nameOf(object.material);
    this.showVariants(object.variants);
    this.showAnimation(object.animation);
  }

  showVariants(variants) {
    $("variant-panel").hidden = !variants;
    if (!variants) return;
    const names = [...$("variant").options].slice(1).map((option) => option.text);
    if ($("variant").options.length === 0 || names.join("\n") !== variants.names.join("\n")) {
      const all = variants.names.map((name, i) => new Option(name, i));
      $("variant").replaceChildren(new Option(text("variant.default"), ""), ...all);
    }
    $("variant").selectedIndex = variants.name === null ? 0 : 1 + variants.names.indexOf(variants.name);
  }

  showAnimation(animation) {
    $("animation-panel").hidden = !animation;
    if (!animation) return;
    const names = [...$("animation").options].map((option) => option.value);
    if (names.join("\n") !== animation.names.join("\n")) {
      $("animation").replaceChildren(...animation.names.map((name) => new Option(name, name)));
    }
    $("animation").value = animation.name;
    $("animation-playing").checked = animation.playing;
    $("animation-loop").checked = animation.loop;
  }

  /** Sends a change of the selected object's animation. */
  animate(values) {
    if (!this.current?.animation) return;
    Object.assign(this.current.animation, values);
    this.flush(); // after what was changed before
    this.send({ type: "object", index: this.current.index, animation: values });
  }

  /** Sends a change of the selected object; changes in quick succession are merged into fewer messages. */
  change(values) {
    if (!this.current) return;
    Object.assign(this.current, values);
    this.show();
    const index = this.current.index;
    if (this.pending && this.pending.index === index) {
      Object.assign(this.pending, values);
      return;
    }
    this.flush();
    this.pending = { type: "object", index, ...values };
    setTimeout(() => this.flush(), 1000 / MESSAGES_A_SECOND);
  }

  /** Shows the selected object and hides all others. */
  showOnly() {
    this.flush(); // what was changed before
    for (const object of this.objects) {
      const visible = object === this.current;
      if (object.visible === visible) continue;
      object.visible = visible;
      this.send({ type: "object", index: object.index, visible });
    }
    this.show();
  }

  flush() {
    if (this.pending) this.send(this.pending);
    this.pending = null;
  }

  move(dx, dy) {
    const [x, y, z] = this.current.position_m;
    this.change({ position_m: [x + dx, y + dy, z] });
  }

  turn(degrees) {
    const turned = this.current.yaw_degrees + degrees;
    this.change({ yaw_degrees: ((turned + 540) % 360) - 180 });
  }

  bind() {
    $("visible").onchange = () => this.change({ visible: $("visible").checked });
    $("only").onclick = () => this.showOnly();
    $("yaw").oninput = () => this.change({ yaw_degrees: Number($("yaw").value) });
    $("material").onchange = () => {
      if ($("material").value in MATERIALS) this.change({ material: MATERIALS[$("material").value] });
    };
    $("variant").onchange = () => {
      const variants = this.current?.variants;
      if (!variants) return;
      variants.name = $("variant").value === "" ? null : variants.names[Number($("variant").value)];
      this.flush(); // after what was changed before
      this.send({ type: "object", index: this.current.index, variant: variants.name });
    };
    $("animation").onchange = () => this.animate({ name: $("animation").value });
    $("animation-playing").onchange = () => this.animate({ playing: $("animation-playing").checked });
    $("animation-loop").onchange = () => this.animate({ loop: $("animation-loop").checked });
    $("animation-start").onclick = () => this.animate({ playing: true, at_s: 0 });
    for (const [i, axis] of ["x", "y", "z"].entries()) {
      $(axis).onchange = () => {
        const value = $(axis).valueAsNumber;
        if (!Number.isFinite(value)) return this.show();
        const position_m = [...this.current.position_m];
        position_m[i] = value;
        this.change({ position_m });
      };
    }
    $("reset").onclick = () => {
      if (!this.current) return;
      this.pending = null; // what was changed before
      this.send({ type: "object", index: this.current.index, reset: true });
    };
    $("put").onclick = () => this.awaitTap(!this.awaitsTap);
    new PictureControls($("picture"), this);
  }

  /** Whether the next tap on the picture puts the object there. */
  awaitTap(on) { $("put").setAttribute("aria-pressed", String(on)); }
  get awaitsTap() { return $("put").getAttribute("aria-pressed") === "true"; }

  putOnPixel(u, v) {
    if (!this.current) return;
    this.awaitTap(false);
    this.flush(); // what was changed before
    this.send({ type: "object", index: this.current.index, on_pixel: [u, v] });
  }
}

function nameOf(material) {
  if (material !== null && Object.values(material).includes(null)) return "set"; // partly the model's own
  const same = (a, b) => a.every((value, i) => Math.abs(value - b[i]) < 1e-4);
  const list = (m) => [...m.base_color, m.metallic, m.roughness, m.specular, ...m.emission, m.transmission, m.ior,
    Number(m.thin_walled), ...m.attenuation_color, m.attenuation_distance_m, m.clearcoat, m.clearcoat_roughness];
  const found = Object.entries(MATERIALS).find(([, m]) => (m === null ? material === null : material !== null && same(list(m), list(material))));
  return found ? found[0] : "set";
}
