// A websocket that reconnects: after 0.5 s, doubling each time, at most 8 s.

const FIRST_WAIT_MS = 500;
const LONGEST_WAIT_MS = 8000;

export class Connection {
  /** handlers: onState("connecting" | "open" | "lost"), onText(object), onBinary(ArrayBuffer) */
  constructor(url, handlers) {
    this.url = url;
    this.handlers = handlers;
    this.waitMs = FIRST_WAIT_MS;
    this.open();
  }

  open() {
    this.handlers.onState("connecting");
    const socket = new WebSocket(this.url);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.waitMs = FIRST_WAIT_MS;
      this.handlers.onState("open");
    };
    socket.onmessage = ({ data }) => {
      if (typeof data === "string") this.handlers.onText(JSON.parse(data));
      else this.handlers.onBinary(data);
    };
    socket.onclose = () => {
      this.handlers.onState("lost");
      setTimeout(() => this.open(), this.waitMs);
      this.waitMs = Math.min(2 * this.waitMs, LONGEST_WAIT_MS);
    };
    this.socket = socket;
  }

  send(message) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }
}
