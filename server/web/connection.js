// A websocket that reconnects: after 0.5 s, doubling each time, at most 4 s.
//
// The service sends something at least once a second. A connection on which nothing came for 2.5 s is dead, whatever the
// browser says of it: a cable that was pulled or a network that was left is noticed by TCP after minutes.

const FIRST_WAIT_MS = 500;
const LONGEST_WAIT_MS = 4000;
const SILENCE_MS = 2500;
const LOOK_MS = 250;
const OPENING_MS = 5000;

/** Whether the service sends who asks for the page to another one: a websocket that is refused does not tell why. */
async function mustLogIn() {
  try {
    const reply = await fetch(location.pathname, { method: "HEAD", redirect: "manual", cache: "no-store",
                                                   signal: AbortSignal.timeout(SILENCE_MS) });
    return reply.type === "opaqueredirect";
  } catch {
    return false; // not there, or the network is dead
  }
}

export class Connection {
  /** handlers: onState("connecting" | "open" | "lost"), onText(object), onBinary(ArrayBuffer) */
  constructor(url, handlers) {
    this.url = url;
    this.handlers = handlers;
    this.waitMs = FIRST_WAIT_MS;
    setInterval(() => this.look(), LOOK_MS);
    this.open();
  }

  open() {
    this.handlers.onState("connecting");
    const socket = new WebSocket(this.url);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.heard();
      this.handlers.onState("open");
    };
    socket.onmessage = ({ data }) => {
      this.heard();
      this.waitMs = FIRST_WAIT_MS; // not before: a service may accept and say nothing
      if (typeof data === "string") this.handlers.onText(JSON.parse(data));
      else this.handlers.onBinary(data);
    };
    socket.onclose = () => this.lost();
    this.socket = socket;
    this.heardAt = this.lookedAt = performance.now();
  }

  heard() { this.heardAt = performance.now(); }

  /** Whether the connection lives. */
  look() {
    const now = performance.now();
    // After a pause of the page itself, as of a laptop that slept, messages may be waiting.
    if (now - this.lookedAt > SILENCE_MS) this.heardAt = now;
    this.lookedAt = now;
    if (!this.socket) return;
    const patience = this.socket.readyState === WebSocket.CONNECTING ? OPENING_MS : SILENCE_MS;
    if (now - this.heardAt > patience) this.lost();
  }

  lost() {
    const socket = this.socket;
    this.socket = null;
    socket.onopen = socket.onmessage = socket.onclose = null; // closing a dead connection takes the browser minutes
    socket.close();
    this.handlers.onState("lost");
    setTimeout(() => this.reopen(), this.waitMs);
    this.waitMs = Math.min(2 * this.waitMs, LONGEST_WAIT_MS);
  }

  async reopen() {
    if (await mustLogIn()) location.reload();
    else this.open();
  }

  send(message) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }
}
