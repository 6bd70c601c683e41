// Decodes stream messages to pictures. H.264 uses WebCodecs, which browsers offer only in a secure context (localhost
// or TLS); JPEG works everywhere.
import { KIND } from "./protocol.js";

export function h264Possible() {
  return window.isSecureContext && "VideoDecoder" in window;
}

export class Decoder {
  /** handlers: onPicture(source, message) with a drawable source that is closed afterwards, onNeedKey(), onH264Failed() */
  constructor(handlers) {
    this.handlers = handlers;
    this.codec = null;
    this.video = null;
    this.waitingForKey = true;
    this.failures = 0;
    this.messages = new Map(); // by timestamp: messages of frames in the decoder
    this.lastJpeg = -1;
  }

  reset() {
    if (this.video && this.video.state !== "closed") this.video.close();
    this.video = null;
    this.waitingForKey = true;
    this.messages.clear();
    this.lastJpeg = -1;
  }

  take(message) {
    if (message.kind === KIND.config) {
      this.codec = new TextDecoder().decode(message.payload);
      this.reset();
    } else if (message.kind === KIND.jpeg) {
      this.takeJpeg(message);
    } else if (message.kind === KIND.h264Key || message.kind === KIND.h264Delta) {
      this.takeH264(message);
    }
  }

  async takeJpeg(message) {
    try {
      const bitmap = await createImageBitmap(new Blob([message.payload], { type: "image/jpeg" }));
      if (message.sequence > this.lastJpeg) {
        this.lastJpeg = message.sequence; // decoding may finish out of order: keep the newest
        this.handlers.onPicture(bitmap, message);
      }
      bitmap.close();
    } catch (error) {
      console.warn("a JPEG picture could not be decoded", error);
    }
  }

  takeH264(message) {
    const key = message.kind === KIND.h264Key;
    if (this.codec === null || (this.waitingForKey && !key)) {
      this.handlers.onNeedKey();
      return;
    }
    try {
      if (!this.video) this.openVideo();
      this.waitingForKey = false;
      this.messages.set(message.sequence, message);
      this.video.decode(new EncodedVideoChunk({ type: key ? "key" : "delta", timestamp: message.sequence, data: message.payload }));
    } catch (error) {
      this.fail(error);
    }
  }

  openVideo() {
    this.video = new VideoDecoder({
      output: (frame) => {
        const message = this.messages.get(frame.timestamp);
        for (const sequence of this.messages.keys()) {
          if (sequence <= frame.timestamp) this.messages.delete(sequence);
        }
        if (message) {
          this.failures = 0;
          this.handlers.onPicture(frame, message);
        }
        frame.close();
      },
      error: (error) => this.fail(error),
    });
    this.video.configure({ codec: this.codec, optimizeForLatency: true });
  }

  fail(error) {
    console.warn("H.264 decoding failed", error);
    this.reset();
    this.failures += 1;
    if (this.failures >= 3) this.handlers.onH264Failed();
    else this.handlers.onNeedKey();
  }
}
