// The binary messages of docs/protocol.md: a 32-byte little-endian header, then a payload.

export const KIND = { config: 1, h264Key: 2, h264Delta: 3, jpeg: 4 };
const HEADER_BYTES = 32;
const MAGIC = 0x494d554c; // "LUMI"
const VERSION = 1;

/** Parses a message into { kind, passedThrough, sequence, width, height, payload }; null where it is malformed. */
export function parseMessage(buffer) {
  if (buffer.byteLength < HEADER_BYTES) return null;
  const view = new DataView(buffer);
  if (view.getUint32(0, true) !== MAGIC || view.getUint8(4) !== VERSION) return null;
  return {
    kind: view.getUint8(5),
    passedThrough: (view.getUint16(6, true) & 1) !== 0,
    sequence: view.getUint32(8, true),
    width: view.getUint16(12, true),
    height: view.getUint16(14, true),
    payload: new Uint8Array(buffer, HEADER_BYTES),
  };
}
