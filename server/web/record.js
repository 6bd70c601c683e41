// The record button. Its state comes from the service, so that every viewer sees the same.

const $ = (id) => document.getElementById(id);

function time(seconds) {
  const total = Math.floor(seconds);
  return `${Math.floor(total / 60)}:${String(total % 60).padStart(2, "0")}`;
}

function words({ doing, seconds, folder, pictures, lost, error }) {
  if (doing === "starting") return "beginning";
  if (!folder) return "";
  const kept = `${pictures} pictures${lost ? `, ${lost} lost` : ""}`;
  if (doing === "recording") return `recording ${time(seconds)}, ${kept}, to ${folder}`;
  if (doing === "finishing") return `writing the rest, to ${folder}`;
  const then = doing === "compressing" ? "; its depth is being compressed" : "";
  if (error && pictures === 0) return `not recorded: ${error}`;
  return error ? `the recording ended: ${error}; ${kept}, in ${folder}${then}` : `recorded ${time(seconds)}, ${kept}, to ${folder}${then}`;
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
    $("record").textContent = on ? "Stop" : "Record";
    $("record").disabled = recording.doing === "finishing" || recording.doing === "starting";
    $("record-state").textContent = words(recording);
    $("record-state").dataset.doing = recording.doing;
    $("record-state").dataset.failed = Boolean(recording.error);
  }
}
