// The record button. Its state comes from the service, so that every viewer sees the same.
import { announce } from "./messages.js";
import { text } from "./text.js";

const $ = (id) => document.getElementById(id);

function time(seconds) {
  const total = Math.floor(seconds);
  return `${Math.floor(total / 60)}:${String(total % 60).padStart(2, "0")}`;
}

function words({ doing, seconds, folder, pictures, lost, error }) {
  if (doing === "starting") return text("recording.beginning");
  if (!folder) return "";
  const kept = lost ? text("recording.kept.lost", { pictures, lost }) : text("recording.kept", { pictures });
  if (doing === "recording") return text("recording.recording", { time: time(seconds), kept, folder });
  if (doing === "finishing") return text("recording.finishing", { folder });
  const then = doing === "compressing" ? `; ${text("recording.compressing")}` : "";
  if (error && pictures === 0) return text("recording.none", { error });
  const end = error ? text("recording.ended", { error, kept, folder }) : text("recording.recorded", { time: time(seconds), kept, folder });
  return `${end}${then}`;
}

export class RecordButton {
  /** send(message) */
  constructor(send) {
    this.permitted = true;
    $("record").onclick = () => {
      $("record").disabled = true; // until the service reports the result
      send({ type: "record", on: $("record").getAttribute("aria-pressed") !== "true" });
    };
  }

  /** recording: from `stats`; null where recording is disabled */
  stats(recording) {
    $("recording").hidden = !recording || !this.permitted;
    if (!recording) return;
    const on = recording.doing === "recording";
    $("record").setAttribute("aria-pressed", on);
    $("record").textContent = on ? text("recording.stop") : text("recording.record");
    $("record").disabled = recording.doing === "finishing" || recording.doing === "starting";
    $("record-state").textContent = words(recording);
    if ($("record-state").dataset.doing !== recording.doing) this.announce(recording);
    $("record-state").dataset.doing = recording.doing;
    $("record-state").dataset.failed = Boolean(recording.error);
  }
  /** Once per step: the line itself counts seconds, and would be read again and again. */
  announce(recording) {
    announce(recording.doing === "recording" ? text("recording.running") : words(recording));
  }
}
