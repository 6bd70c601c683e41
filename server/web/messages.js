// Lines below the picture: the service's warnings while they hold, and errors until somebody has read them.
import { text } from "./text.js";

const MOST_ERRORS = 5; // of which older ones go

const $ = (id) => document.getElementById(id);

/** Sets a text only where it changes: screen readers read a live region again whenever it is written to. */
export function say(element, words) {
  if (element.textContent !== words) element.textContent = words;
}

/** Tells people who use a screen reader. */
export function announce(words) { say($("announcement"), words); }

/** lines: all that hold now */
export function warnings(lines) {
  const shown = [...$("warnings").children].map((item) => item.textContent);
  if (shown.join("\n") === lines.join("\n")) return;
  $("warnings").replaceChildren(...lines.map((line) => {
    const item = document.createElement("li");
    item.textContent = line;
    return item;
  }));
}

export function error(words) {
  if ([...$("errors").children].some((item) => item.firstChild.textContent === words)) return;
  const item = document.createElement("li");
  const button = document.createElement("button");
  button.type = "button";
  button.textContent = text("message.dismiss");
  button.onclick = () => item.remove();
  item.append(Object.assign(document.createElement("span"), { textContent: words }), button);
  $("errors").append(item);
  while ($("errors").children.length > MOST_ERRORS) $("errors").firstChild.remove();
}
