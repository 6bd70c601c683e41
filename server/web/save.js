// The button with which an operator makes what is shown the exhibit's start.
import { text } from "./text.js";

const $ = (id) => document.getElementById(id);

export class SaveButton {
  /** send(message) */
  constructor(send) {
    $("save").onclick = () => {
      $("save").disabled = true; // until the service answers
      $("save-state").textContent = "";
      send({ type: "save" });
    };
  }

  set permitted(permitted) {
    $("save").hidden = !permitted;
    $("save").disabled = false; // an answer is lost with its connection
  }

  /** error: empty if it was saved */
  saved(error) {
    $("save").disabled = false;
    $("save-state").textContent = error || text("save.saved");
  }
}
