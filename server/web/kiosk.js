// The exhibit's own screen, `/?kiosk`: the picture alone, and nothing that leads away from it.
import { keyOf } from "./picture.js";

const CURSOR_MS = 3000;
const PATIENCE_MS = 3000; // without pictures
const LOOK_MS = 250;
const KEYS = ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "q", "e", "n"]; // of the picture

const $ = (id) => document.getElementById(id);

export const isKiosk = new URLSearchParams(location.search).has("kiosk");

/** Keeps the screen on, as far as the browser permits; it forgets that whenever the page is hidden. */
async function stayAwake() {
  if (document.visibilityState !== "visible") return;
  try {
    await navigator.wakeLock?.request("screen"); // undefined where the page is not secure
  } catch (reason) {
    console.warn("the screen may turn off", reason);
  }
}

function stayHere() {
  const refuse = (event) => event.preventDefault();
  for (const type of ["contextmenu", "selectstart", "dragstart", "dragover", "drop", "auxclick", "gesturestart"]) {
    addEventListener(type, refuse);
  }
  addEventListener("wheel", (event) => { if (event.ctrlKey) event.preventDefault(); }, { passive: false }); // zoom
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || !KEYS.includes(keyOf(event))) event.preventDefault();
  }, { capture: true });
  history.pushState(null, "");
  addEventListener("popstate", () => history.pushState(null, ""));
  document.querySelector("meta[name=viewport]").content += ", maximum-scale=1, user-scalable=no";
}

/** Hides the cursor while nothing moves it. */
function hideCursor() {
  let timer = null;
  const rest = () => { document.documentElement.dataset.cursor = "hidden"; };
  const wake = () => {
    delete document.documentElement.dataset.cursor;
    clearTimeout(timer);
    timer = setTimeout(rest, CURSOR_MS);
  };
  addEventListener("pointermove", wake);
  wake();
}

export class Kiosk {
  constructor() {
    document.documentElement.dataset.kiosk = "";
    this.picture();
    setInterval(() => { $("waiting").hidden = performance.now() - this.pictureAt < PATIENCE_MS; }, LOOK_MS);
    stayHere();
    hideCursor();
    stayAwake();
    document.addEventListener("visibilitychange", stayAwake);
    $("picture").focus(); // its keys work at once
  }

  /** A picture was drawn. */
  picture() {
    this.pictureAt = performance.now();
    $("waiting").hidden = true;
  }
}
