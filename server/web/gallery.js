// The exhibit's objects to choose from: one radio button each, drawn as chips, that says which ones are hidden.
import { text } from "./text.js";

export class Gallery {
  /** box: the element that holds the buttons; onChoose() after a person chose another one */
  constructor(box, onChoose) {
    this.box = box;
    box.onchange = onChoose;
  }

  get buttons() { return [...this.box.querySelectorAll("input")]; }
  get index() { return this.buttons.findIndex((button) => button.checked); }
  set index(index) {
    if (this.buttons[index]) this.buttons[index].checked = true;
  }

  /** New objects; the same place in the list stays chosen. */
  fill(objects) {
    const chosen = Math.min(Math.max(0, this.index), objects.length - 1);
    this.box.replaceChildren(...objects.map((object) => {
      const label = document.createElement("label");
      const button = Object.assign(document.createElement("input"), { type: "radio", name: "object", value: object.index });
      const state = Object.assign(document.createElement("small"), { textContent: text("object.hidden") });
      label.append(button, object.name, state);
      return label;
    }));
    this.index = chosen;
    this.show(objects);
  }

  /** Which objects are hidden. */
  show(objects) {
    this.box.querySelectorAll("small").forEach((state, i) => { state.hidden = objects[i]?.visible ?? true; });
  }
}
