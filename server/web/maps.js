// What the program knows, over the picture: maps of the service, and the picture with and without objects.
const APART_MS = 200; // the service draws no more
const RETRY_MS = 500;

const wait = (ms) => new Promise((resolve) => { setTimeout(resolve, ms); });

export class Maps {
  constructor() {
    this.select = document.getElementById("map");
    this.canvas = document.getElementById("map-view");
    this.divider = document.getElementById("divider");
    this.legends = document.querySelectorAll("[data-map]");
    this.missing = document.getElementById("map-missing");
    this.shown = null; // the newest map, an ImageBitmap
    this.running = false;
    this.select.onchange = () => this.choose();
    this.divider.oninput = () => this.draw();
    document.addEventListener("visibilitychange", () => this.run());
    this.choose(); // a browser may have kept the choice
  }

  get name() { return this.select.value; }
  get compares() { return this.name === "before-after"; }

  choose() {
    this.shown = null;
    this.canvas.hidden = true;
    this.divider.hidden = true;
    this.missing.hidden = true;
    delete this.canvas.dataset.sequence;
    for (const legend of this.legends) legend.hidden = legend.dataset.map !== this.name;
    this.run();
  }

  async run() {
    if (this.running) return;
    this.running = true;
    while (this.name && !document.hidden) {
      const next = wait(APART_MS);
      await (await this.fetch() ? next : wait(RETRY_MS));
    }
    this.running = false;
  }

  /** False where there is no map. */
  async fetch() {
    const name = this.name;
    try {
      const reply = await fetch(`maps/${name}.jpg`, { cache: "no-store" });
      const map = reply.ok ? await createImageBitmap(await reply.blob()) : null;
      if (name !== this.name) return true;
      this.missing.hidden = map !== null || this.shown !== null;
      if (!map) return false;
      this.shown?.close();
      this.shown = map;
      this.canvas.dataset.sequence = reply.headers.get("X-Sequence");
      this.draw();
      return true;
    } catch {
      return false; // the connection is lost, which the page says elsewhere
    }
  }

  /** As wide as the picture, which the canvas shows whole in its middle (object-fit: contain). */
  placeDivider(aspect) {
    const { width, height } = this.canvas.getBoundingClientRect();
    const shown = Math.min(width, height * aspect);
    Object.assign(this.divider.style, { width: `${shown}px`, left: `${(width - shown) / 2}px` });
  }

  draw() {
    if (!this.shown) return;
    const { canvas, shown } = this;
    const width = this.compares ? shown.width / 2 : shown.width;
    if (canvas.width !== width || canvas.height !== shown.height) Object.assign(canvas, { width, height: shown.height });
    canvas.hidden = false;
    this.divider.hidden = !this.compares;
    this.placeDivider(width / shown.height);
    const context = canvas.getContext("2d");
    context.drawImage(shown, 0, 0);
    if (!this.compares) return;
    const line = Math.round(this.divider.value / 100 * width);
    if (line < width) context.drawImage(shown, width + line, 0, width - line, shown.height, line, 0, width - line, shown.height);
    context.fillStyle = "#f0b060";
    context.fillRect(line - 1, 0, 2, shown.height);
  }
}
