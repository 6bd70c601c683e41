// Operators add a model to the exhibit, a file that is chosen or dropped on the page, with progress; and remove one.
import { error } from "./messages.js";
import { number, text } from "./text.js";

const $ = (id) => document.getElementById(id);

export class Upload {
  /** chosen(): the name of the object that is chosen, undefined if none is */
  constructor(chosen) {
    this.request = null;
    $("remove").onclick = () => this.remove(chosen());
    $("upload").onclick = () => (this.request ? this.request.abort() : $("upload-file").click());
    $("upload-file").onchange = () => {
      const [file] = $("upload-file").files;
      $("upload-file").value = ""; // the same file may be chosen again
      if (file) this.send(file);
    };
    document.addEventListener("dragover", (event) => {
      if (this.permitted) event.preventDefault();
    });
    document.addEventListener("drop", (event) => {
      if (!this.permitted || this.request) return;
      event.preventDefault();
      const [file] = event.dataTransfer.files;
      if (file) this.send(file);
    });
  }

  get permitted() { return !$("upload").hidden; }
  set permitted(permitted) { $("upload").hidden = $("remove").hidden = !permitted; }

  /** What was uploaded is called as its file. */
  async remove(name) {
    if (name === undefined || !window.confirm(text("upload.remove.sure", { name }))) return;
    $("remove").disabled = true;
    $("upload-state").textContent = "";
    try {
      const reply = await fetch(`models/${encodeURIComponent(name)}.glb`, { method: "DELETE" });
      if (reply.ok) $("upload-state").textContent = text("upload.removed");
      else error(`${name}: ${(await reply.text()).trim()}`);
    } catch {
      error(`${name}: ${text("upload.lost")}`);
    }
    $("remove").disabled = false;
  }

  send(file) {
    const request = this.request = new XMLHttpRequest();
    $("upload").textContent = text("upload.cancel");
    $("upload-state").textContent = text("upload.sending", { percent: number(0) });
    request.upload.onprogress = ({ loaded, total }) => {
      const percent = Math.floor(100 * loaded / Math.max(1, total));
      $("upload-state").textContent = percent < 100 ? text("upload.sending", { percent: number(percent) }) : text("upload.loading");
    };
    request.onloadend = () => {
      this.request = null;
      $("upload").textContent = text("upload");
      $("upload-state").textContent = request.status === 201 ? text("upload.added") : "";
      if (request.status === 201 || request.readyState === XMLHttpRequest.UNSENT) return; // UNSENT: cancelled
      error(`${file.name}: ${request.responseText.trim() || text("upload.lost")}`);
    };
    request.open("PUT", `models/${encodeURIComponent(file.name)}`);
    request.send(file);
  }
}
