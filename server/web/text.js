// The page's texts in the reader's language. English stands in the HTML itself, and in texts.js what scripts show.
import { TEXTS } from "./texts.js";

const KEPT = "lumigraft-language"; // in the browser's storage: what was chosen on a page

function kept() {
  try {
    return localStorage.getItem(KEPT);
  } catch {
    return null; // storage is switched off
  }
}

const asked = new URLSearchParams(location.search).get("lang");
const wanted = [asked, kept(), ...navigator.languages].filter(Boolean).map((tag) => tag.split("-")[0].toLowerCase());
export const language = wanted.find((tag) => tag in TEXTS) ?? "en";
const locale = navigator.languages.find((tag) => tag.split("-")[0].toLowerCase() === language) ?? language;

/** The text of a key with {name} replaced by values.name. */
export function text(key, values = {}) {
  return TEXTS[language][key].replace(/\{(\w+)\}/g, (_, name) => values[name]);
}

/** A number with this many digits after its point. */
export function number(value, digits = 0) {
  return new Intl.NumberFormat(locale, { minimumFractionDigits: digits, maximumFractionDigits: digits }).format(value);
}

/** Translates what stands in the document: data-text, data-text-title and data-text-label (aria-label). */
function translate() {
  document.documentElement.lang = language;
  const own = (key, english) => TEXTS[language][key] ?? english;
  for (const e of document.querySelectorAll("[data-text]")) e.textContent = own(e.dataset.text, e.textContent);
  for (const e of document.querySelectorAll("[data-text-title]")) e.title = own(e.dataset.textTitle, e.title);
  for (const e of document.querySelectorAll("[data-text-label]")) e.ariaLabel = own(e.dataset.textLabel, e.ariaLabel);
}

function choose(another) {
  try {
    localStorage.setItem(KEPT, another);
  } catch {
    // the address alone says it then
  }
  const address = new URL(location.href);
  address.searchParams.set("lang", another);
  location.replace(address);
}

translate();
for (const button of document.querySelectorAll("[data-language]")) {
  button.setAttribute("aria-pressed", button.dataset.language === language);
  button.onclick = () => choose(button.dataset.language);
}
