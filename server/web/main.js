// The page: draws frames from the websocket on the canvas; statistics and controls.
import { Connection } from "./connection.js";
import { Controls } from "./controls.js";
import { Decoder, h264Possible } from "./decoder.js";
import { isKiosk, Kiosk } from "./kiosk.js";
import { Maps } from "./maps.js";
import { error, warnings } from "./messages.js";
import { Panel } from "./panel.js";
import { KIND, parseMessage } from "./protocol.js";
import { PlaybackBar } from "./playback.js";
import { RecordButton } from "./record.js";
import { SaveButton } from "./save.js";
import { text } from "./text.js";
import { Upload } from "./upload.js";

const canvas = document.getElementById("picture");
const context = canvas.getContext("2d");
const panel = new Panel();
const controls = new Controls((message) => connection.send(message));
const playbackBar = new PlaybackBar((message) => connection.send(message));
const recordButton = new RecordButton((message) => connection.send(message));
const saveButton = new SaveButton((message) => connection.send(message));
const upload = new Upload(() => controls.current?.name);
const kiosk = isKiosk ? new Kiosk() : null;
if (!isKiosk) new Maps();
let h264Works = h264Possible();
let program = null; // the version that this page belongs to

const decoder = new Decoder({
  onPicture(source, message) {
    if (canvas.width !== message.width || canvas.height !== message.height) {
      canvas.width = message.width;
      canvas.height = message.height;
    }
    context.drawImage(source, 0, 0, message.width, message.height);
    canvas.dataset.sequence = message.sequence;
    canvas.dataset.grafted = !message.passedThrough;
    canvas.dataset.pictures = Number(canvas.dataset.pictures ?? 0) + 1;
    canvas.dataset.codec = message.kind === KIND.jpeg ? "jpeg" : "h264";
    const instead = window.isSecureContext ? "JPEG" : text("stream.https");
    document.getElementById("codec-used").textContent = message.kind === KIND.jpeg ? instead : "H.264";
    panel.picture();
    kiosk?.picture();
    connection.send({ type: "ack", sequence: message.sequence });
  },
  onNeedKey: () => connection.send({ type: "key" }),
  onH264Failed() {
    h264Works = false;
    want();
  },
});

function want() {
  const choice = document.getElementById("codec").value;
  const codec = choice === "auto" ? (h264Works ? "h264" : "jpeg") : choice;
  decoder.reset();
  connection.send({ type: "want", codec, size: document.getElementById("size").value });
}
document.getElementById("codec").onchange = want;
document.getElementById("size").onchange = want;
if (!h264Works) document.querySelector('#codec option[value="h264"]').disabled = true;

const connection = new Connection(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/ws`, {
  onState(state) {
    panel.connection(state);
    if (state === "open") want();
  },
  onText(message) {
    if (message.type === "hello") {
      if (program && program !== message.program) location.reload(); // the service was updated, and so is its page
      program = message.program;
      document.getElementById("session").textContent = message.session;
      playbackBar.permitted = message.permissions?.includes("control") ?? true;
      recordButton.permitted = message.permissions?.includes("record") ?? true;
      upload.permitted = message.permissions?.includes("admin") ?? false;
      saveButton.permitted = message.permissions?.includes("admin") ?? false;
      controls.hello(message);
    } else if (message.type === "state") {
      controls.state(message.objects);
    } else if (message.type === "stats") {
      panel.stats(message);
      warnings(message.warnings ?? []);
      playbackBar.stats(message.playback ?? null);
      recordButton.stats(message.recording ?? null);
      controls.pose(message.T_tag_camera ?? null);
    } else if (message.type === "saved") {
      saveButton.saved(message.error);
    } else if (message.type === "error") {
      // What visitors see most often: their tap met no level surface.
      error(message.error.startsWith("on_pixel:") ? text("object.no-surface") : message.error);
    }
  },
  onBinary(buffer) {
    const message = parseMessage(buffer);
    if (!message) return;
    panel.received(buffer.byteLength);
    decoder.take(message);
  },
});
