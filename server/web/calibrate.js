// Guides the person who holds the board: pictures with detected corners, regions that lack corners, and the result.
import { say } from "./messages.js";
import { number, text } from "./text.js";

const EVERY_MS = 400;
const $ = (id) => document.getElementById(id);
const SVG = "http://www.w3.org/2000/svg";

/** The service's names of a picture's sides. */
const SIDES = {
  "right": text("calibrate.side.right"), "lower right": text("calibrate.side.lower-right"), "bottom": text("calibrate.side.bottom"),
  "lower left": text("calibrate.side.lower-left"), "left": text("calibrate.side.left"), "upper left": text("calibrate.side.upper-left"),
  "top": text("calibrate.side.top"), "upper right": text("calibrate.side.upper-right"),
};

function advice(camera) {
  if (camera.corners_now === 0) return text("calibrate.advice.unseen");
  if (camera.missing) return text("calibrate.advice.corners", { where: SIDES[camera.missing] ?? camera.missing });
  if (camera.views < camera.views_wanted) return text("calibrate.advice.tilt");
  return text("calibrate.advice.enough");
}

/** Draws a pinhole's cells as a grid, a fish-eye's as rings around the axis and sectors, clockwise from the right. */
function cellPath(camera, column, row) {
  if (!camera.rings) {
    const [w, h] = [80 / camera.columns, 60 / camera.rows];
    return `M${10 + column * w} ${20 + row * h}h${w}v${h}h${-w}z`;
  }
  const point = (ring, sector) => {
    const [r, a] = [(46 * ring) / camera.rows, (2 * Math.PI * sector) / camera.columns];
    return `${(50 + r * Math.cos(a)).toFixed(2)} ${(50 + r * Math.sin(a)).toFixed(2)}`;
  };
  return `M${point(row, column)}L${point(row + 1, column)}L${point(row + 1, column + 1)}L${point(row, column + 1)}z`;
}

function map(camera) {
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", "0 0 100 100");
  camera.corners.forEach((count, i) => {
    if (!camera.wanted[i]) return;
    const cell = document.createElementNS(SVG, "path");
    cell.setAttribute("d", cellPath(camera, i % camera.columns, Math.floor(i / camera.columns)));
    cell.setAttribute("class", count > 0 ? "seen" : "unseen");
    svg.append(cell);
  });
  return svg;
}

function element(tag, className, text = "") {
  const e = document.createElement(tag);
  e.className = className;
  e.textContent = text;
  return e;
}

function show(camera, looking) {
  let figure = $(camera.picture);
  if (!figure) {
    figure = element("section", "camera");
    figure.id = camera.picture;
    figure.append(element("h2", "", camera.name), element("img", "shown"), element("div", "map"), element("p", "views"), element("p", "advice"));
    $("cameras").append(figure);
  }
  if (looking || !figure.querySelector(".shown").src) figure.querySelector(".shown").src = `${camera.picture}?${Date.now()}`;
  figure.querySelector(".map").replaceChildren(map(camera));
  const seen = { views: number(camera.views), wanted: number(camera.views_wanted), percent: number(100 * camera.reached) };
  figure.querySelector(".views").textContent =
    camera.rings ? text("calibrate.views.fisheye", seen) : text("calibrate.views.picture", seen);
  figure.querySelector(".advice").textContent = looking ? advice(camera) : "";
}

/** The file that the calibration was written to. */
function lastLine(report) { return report.trim().split("\n").at(-1); }

async function tick() {
  try {
    const state = await (await fetch("calibrate.json")).json();
    const words = { looking: text("calibrate.looking"), calculating: text("calibrate.calculating"), done: text("calibrate.done"),
                    refused: text("calibrate.refused") };
    say($("doing"), words[state.doing]);
    $("doing").dataset.doing = state.doing;
    state.cameras.forEach((camera) => show(camera, state.doing === "looking"));
    $("finish").hidden = state.doing !== "looking";
    $("finish").disabled = !state.can_finish;
    $("both").hidden = state.doing !== "looking" || state.cameras.length < 2;
    $("result").hidden = !state.report && !state.refusal;
    $("verdict").textContent = state.doing === "done" ? lastLine(state.report) : "";
    say($("refusal"), state.refusal);
    $("report").textContent = state.report;
  } catch {
    say($("doing"), text("calibrate.ended"));
  }
}
$("finish").onclick = () => {
  $("finish").disabled = true; // until the service reports the result
  fetch("finish", { method: "POST" }).catch(() => {});
};
tick();
setInterval(tick, EVERY_MS);
