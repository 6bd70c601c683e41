// The statistics panel.

const $ = (id) => document.getElementById(id);
const ms = (value) => (value === undefined ? "–" : value < 10 ? value.toFixed(1) : value.toFixed(0));

export class Panel {
  constructor() {
    this.shown = [];
    this.bytes = [];
    setInterval(() => this.tick(), 500);
  }

  connection(state) {
    const words = { connecting: "connecting…", open: "connected", lost: "connection lost, trying again" };
    $("connection").dataset.state = state;
    $("connection").textContent = words[state];
    // Until there is a connection again, also while trying.
    if (state !== "connecting") $("lost").hidden = state === "open";
  }

  received(byteCount) { this.bytes.push([performance.now(), byteCount]); }
  picture() { this.shown.push(performance.now()); }

  tick() {
    const since = performance.now() - 2000;
    this.shown = this.shown.filter((time) => time > since);
    this.bytes = this.bytes.filter(([time]) => time > since);
    $("shown-fps").textContent = `${(this.shown.length / 2).toFixed(1)} fps`;
    const bits = this.bytes.reduce((sum, [, count]) => sum + 8 * count, 0) / 2;
    $("rate").textContent = `${(bits / 1e6).toFixed(2)} Mbit/s`;
  }

  stats(stats) {
    $("made-fps").textContent = `${stats.fps.toFixed(1)} fps`;
    $("viewers").textContent = stats.clients;
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
    $("drops").textContent = drops.length ? `dropped because slow: ${drops.map(([who, count]) => `${who} ${count}`).join(", ")}` : "";
    $("plan").textContent = `plan: ${Object.entries(stats.plan ?? {}).map(([key, value]) => `${key} ${value}`).join(", ")}`;
    $("learning").hidden = !(stats.scene?.learning ?? false);
    $("picture").dataset.settled = stats.scene?.settled ?? false;
    this.warnings(stats.warnings ?? []);
  }

  warnings(lines) {
    $("warnings").replaceChildren(...lines.map((line) => {
      const item = document.createElement("li");
      item.textContent = line;
      return item;
    }));
  }
}
