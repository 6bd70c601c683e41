// The statistics panel.
import { say } from "./messages.js";
import { number, text } from "./text.js";

const $ = (id) => document.getElementById(id);
const ms = (value) => (value === undefined ? "–" : number(value, value < 10 ? 1 : 0));
const list = (entries) => entries.map(([key, value]) => `${key} ${value}`).join(", ");

export class Panel {
  constructor() {
    this.shown = [];
    this.bytes = [];
    setInterval(() => this.tick(), 500);
  }

  connection(state) {
    const words = { connecting: text("connection.connecting"), open: text("connection.open"), lost: text("connection.lost") };
    $("connection").dataset.state = state;
    say($("connection"), words[state]);
    // Until there is a connection again, also while trying.
    if (state !== "connecting") $("lost").hidden = state === "open";
  }

  received(byteCount) { this.bytes.push([performance.now(), byteCount]); }
  picture() { this.shown.push(performance.now()); }

  tick() {
    const since = performance.now() - 2000;
    this.shown = this.shown.filter((time) => time > since);
    this.bytes = this.bytes.filter(([time]) => time > since);
    $("shown-fps").textContent = text("stream.fps", { count: number(this.shown.length / 2, 1) });
    const bits = this.bytes.reduce((sum, [, count]) => sum + 8 * count, 0) / 2;
    $("rate").textContent = `${number(bits / 1e6, 2)} Mbit/s`;
  }

  stats(stats) {
    $("made-fps").textContent = text("stream.fps", { count: number(stats.fps, 1) });
    $("viewers").textContent = number(stats.clients);
    const { capture_to_ack: endToEnd, ...stages } = stats.stage_ms;
    if (endToEnd) $("end-to-end").textContent = `${ms(endToEnd.mean)} ms`; // below 1 Hz, some seconds have none
    $("stages").tBodies[0].replaceChildren(...Object.entries(stages).map(([name, time]) => {
      const row = document.createElement("tr");
      for (const text of [name.replaceAll("_", " "), ms(time.mean), ms(time.p95)]) {
        row.insertCell().textContent = text;
      }
      return row;
    }));
    const drops = Object.entries(stats.drops ?? {}).filter(([, count]) => count > 0);
    $("drops").textContent = drops.length ? text("stages.dropped", { list: list(drops) }) : "";
    $("plan").textContent = text("stages.plan", { list: list(Object.entries(stats.plan ?? {})) });
    $("learning").hidden = !(stats.scene?.learning ?? false);
    $("picture").dataset.settled = stats.scene?.settled ?? false;
  }
}
