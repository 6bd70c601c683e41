// The seek bar of a recording. Its state comes from the service, so that every viewer sees the same.
import { number, text } from "./text.js";

const MESSAGES_A_SECOND = 10;

const $ = (id) => document.getElementById(id);

function time(seconds) {
  const tenths = Math.floor(10 * seconds);
  return `${Math.floor(tenths / 600)}:${number((tenths % 600) / 10, 1).padStart(4, "0")}`;
}

export class PlaybackBar {
  /** send(message) */
  constructor(send) {
    this.send = send;
    this.permitted = true;
    this.dragged = false;
    this.waiting = null;
    $("pause").onclick = () => this.command({ paused: $("pause").getAttribute("aria-pressed") !== "true" });
    $("step").onclick = () => this.command({ paused: true, step: true });
    $("seek").oninput = () => {
      this.dragged = true;
      this.show();
      this.waiting ??= setTimeout(() => this.go(), 1000 / MESSAGES_A_SECOND);
    };
    $("seek").onchange = () => {
      this.go();
      this.dragged = false;
    };
  }

  command(values) { this.send({ type: "playback", ...values }); }

  go() {
    clearTimeout(this.waiting);
    this.waiting = null;
    this.command({ at_s: Number($("seek").value) });
  }

  show() { $("moment").textContent = text("playback.moment.of", { at: time(Number($("seek").value)), length: time(Number($("seek").max)) }); }

  /** playback: from `stats`; null for live cameras */
  stats(playback) {
    $("playback").hidden = !playback || !this.permitted;
    if (!playback) return;
    $("pause").setAttribute("aria-pressed", playback.paused);
    $("pause").textContent = playback.paused ? text("playback.play") : text("playback.pause");
    $("seek").max = playback.length_s;
    if (!this.dragged) $("seek").value = playback.at_s;
    this.show();
  }
}
