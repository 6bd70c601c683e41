// Guides the person who holds the board: pictures with detected corners, regions that lack corners, and the result.

const EVERY_MS = 400;
const $ = (id) => document.getElementById(id);
const SVG = "http://www.w3.org/2000/svg";

function advice(camera) {
  if (camera.corners_now === 0) return "The board is not seen: hold it closer, still, and out of the glare.";
  if (camera.missing) return `Hold the board still in the ${camera.missing} of the picture, at a slant.`;
  if (camera.views < camera.views_wanted) return "Turn and tilt the board, and hold it still each time.";
  return "This camera has seen enough.";
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
  figure.querySelector(".views").textContent =
    `${camera.views} views, ${camera.views_wanted} needed; corners in ${Math.round(100 * camera.reached)} % of the ` +
    (camera.rings ? "field" : "picture");
  figure.querySelector(".advice").textContent = looking ? advice(camera) : "";
}

/** The file that the calibration was written to. */
function lastLine(report) { return report.trim().split("\n").at(-1); }

async function tick() {
  try {
    const state = await (await fetch("calibrate.json")).json();
    const words = { looking: "looking for the board", calculating: "calculating…", done: "done", refused: "refused" };
    $("doing").textContent = words[state.doing];
    $("doing").dataset.doing = state.doing;
    state.cameras.forEach((camera) => show(camera, state.doing === "looking"));
    $("finish").hidden = state.doing !== "looking";
    $("finish").disabled = !state.can_finish;
    $("both").hidden = state.doing !== "looking" || state.cameras.length < 2;
    $("result").hidden = !state.report && !state.refusal;
    $("verdict").textContent = state.doing === "done" ? lastLine(state.report) : "";
    $("refusal").textContent = state.refusal;
    $("report").textContent = state.report;
  } catch {
    $("doing").textContent = "the program has ended";
  }
}
$("finish").onclick = () => {
  $("finish").disabled = true; // until the service reports the result
  fetch("finish", { method: "POST" }).catch(() => {});
};
tick();
setInterval(tick, EVERY_MS);
