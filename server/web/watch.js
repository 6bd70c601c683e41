// Plays the stream that the service publishes to a media server, which serves it by WebRTC (WHEP, the WebRTC-HTTP egress
// protocol): many can watch, and none can change anything.
//
// A connection on which no picture came for 10 s is made again, after 1 s, doubling each time, at most 16 s.
import { text } from "./text.js";

const FIRST_WAIT_MS = 1000;
const LONGEST_WAIT_MS = 16000;
const SILENCE_MS = 10000;
const LOOK_MS = 500;
const GATHERING_MS = 2000;

const video = document.getElementById("picture");
const connection = document.getElementById("connection");
const lost = document.getElementById("lost");

function show(state, words, why = "") {
  connection.dataset.state = state;
  connection.textContent = words;
  lost.textContent = why;
  lost.hidden = !why;
}

const sleep = (ms) => new Promise((done) => setTimeout(done, ms));

/** Candidates of this machine are part of the offer; those that take longer are left out. */
async function gathered(peer) {
  const end = performance.now() + GATHERING_MS;
  while (peer.iceGatheringState !== "complete" && performance.now() < end) await sleep(20);
}

/** Returns where the media server ends this session on request, if it says so and lets this page read it. */
async function negotiate(peer, whep) {
  peer.addTransceiver("video", { direction: "recvonly" });
  peer.ontrack = ({ track }) => { video.srcObject = new MediaStream([track]); };
  await peer.setLocalDescription(await peer.createOffer());
  await gathered(peer);
  let reply;
  try {
    reply = await fetch(whep, { method: "POST", headers: { "Content-Type": "application/sdp" }, body: peer.localDescription.sdp,
                                signal: AbortSignal.timeout(SILENCE_MS) });
  } catch {
    throw new Error(text("watch.silent", { origin: new URL(whep).origin }));
  }
  if (reply.status === 404) throw new Error(text("watch.unpublished"));
  if (!reply.ok) throw new Error(text("watch.status", { status: reply.status }));
  await peer.setRemoteDescription({ type: "answer", sdp: await reply.text() });
  const session = reply.headers.get("Location");
  return session && new URL(session, reply.url).href;
}

/** Returns when pictures have ceased, with what is wrong. */
async function play(peer, onPicture) {
  let count = 0, cameAt = performance.now();
  for (;;) {
    const now = video.getVideoPlaybackQuality().totalVideoFrames;
    if (now !== count) {
      count = now;
      cameAt = performance.now();
      onPicture();
    }
    if (peer.connectionState === "failed" || peer.connectionState === "closed") return text("watch.lost");
    if (performance.now() - cameAt > SILENCE_MS) return text("watch.no-pictures");
    await sleep(LOOK_MS);
  }
}

async function watch(whep) {
  for (let waitMs = FIRST_WAIT_MS; ; waitMs = Math.min(2 * waitMs, LONGEST_WAIT_MS)) {
    const peer = new RTCPeerConnection();
    let session = null, why;
    const leave = () => { if (session) fetch(session, { method: "DELETE", keepalive: true }).catch(() => {}); };
    addEventListener("pagehide", leave);
    try {
      session = await negotiate(peer, whep);
      why = await play(peer, () => {
        waitMs = FIRST_WAIT_MS;
        show("open", text("watch.live"));
      });
    } catch (error) {
      why = error.message;
    }
    removeEventListener("pagehide", leave);
    leave();
    peer.close();
    show("lost", text("watch.reconnecting"), why);
    await sleep(waitMs);
  }
}

async function start() {
  let whep;
  try {
    ({ whep } = await (await fetch("watch.json", { cache: "no-store" })).json());
  } catch {
    show("lost", text("watch.not-connected"), text("watch.no-service"));
    return;
  }
  if (whep) watch(whep);
  else show("lost", text("watch.not-connected"), text("watch.unset"));
}

start();
