// An indexed PNG, north up, from the body of GET /vehicles/{id}/map.

import * as zlib from "node:zlib";

const TABLE = Uint32Array.from({ length: 256 }, (_, n) => {
  let c = n;
  for (let k = 0; k < 8; k += 1) c = c & 1 ? 0xedb88320 ^ (c >>> 1) : c >>> 1;
  return c;
});
const crc32 = zlib.crc32 ?? ((bytes) => ~bytes.reduce((c, b) => TABLE[(c ^ b) & 255] ^ (c >>> 8), ~0) >>> 0);

function chunk(kind, data) {
  const out = Buffer.alloc(12 + data.length);
  out.writeUInt32BE(data.length, 0);
  out.write(kind, 4, "latin1");
  data.copy(out, 8);
  out.writeUInt32BE(crc32(out.subarray(4, 8 + data.length)) >>> 0, 8 + data.length);
  return out;
}

export function encodePng(map, deflate) {
  const labels = Buffer.from(map.labels, "base64");
  const rows = Buffer.alloc((map.width + 1) * map.height);
  for (let y = 0; y < map.height; y += 1) {
    labels.copy(rows, (map.height - 1 - y) * (map.width + 1) + 1, y * map.width, (y + 1) * map.width);
  }
  const head = Buffer.alloc(13);
  head.writeUInt32BE(map.width, 0);
  head.writeUInt32BE(map.height, 4);
  head.set([8, 3, 0, 0, 0], 8);
  const colours = Buffer.from(Array.from({ length: 768 }, (_, i) => (Math.floor(i / 3) * (41 + 37 * (i % 3))) & 255));
  const signature = Buffer.from([137, 80, 78, 71, 13, 10, 26, 10]);
  return Buffer.concat([signature, chunk("IHDR", head), chunk("PLTE", colours), chunk("IDAT", deflate(rows)), chunk("IEND", Buffer.alloc(0))]);
}
