// SPDX-License-Identifier: Apache-2.0
// Numbers of 16 bits as the page holds them (compositor/exports/web_pack.h says how they are packed).

function bytesOfBase64(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < bytes.length; ++i) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

async function inflated(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// What neighbors predicted, and the difference from it: one plane of whole numbers.
function restoredPlane(bytes, offset, predictor, width, height) {
  const plane = new Int16Array(width * height);
  const high = offset + plane.length;
  for (let y = 0, i = 0; y < height; ++y) {
    for (let x = 0; x < width; ++x, ++i) {
      let guess = 0;
      if (x === 0) {
        guess = y === 0 ? 0 : plane[i - width];
      } else if (y === 0 || predictor === 0) {
        guess = plane[i - 1];
      } else {
        const west = plane[i - 1], north = plane[i - width];
        if (predictor === 2) {
          guess = (west + north) >> 1;
        } else {
          const corner = plane[i - width - 1];
          const low = Math.min(west, north), most = Math.max(west, north);
          guess = corner >= most ? low : corner <= low ? most : west + north - corner;
        }
      }
      const code = bytes[offset + i] | bytes[high + i] << 8;
      plane[i] = guess + (code >> 1 ^ -(code & 1));
    }
  }
  return plane;
}

// [height][width][3]
async function unpackedPlanes(base64, width, height) {
  const bytes = await inflated(bytesOfBase64(base64));
  const pixels = width * height;
  const planes = [0, 1, 2].map(c => restoredPlane(bytes, 3 + 2 * c * pixels, bytes[c], width, height));
  const [green, red, blue] = planes;
  const rgb = new Uint16Array(3 * pixels);
  const bits = ordered => ordered < 0 ? 0x8000 | ~ordered & 0x7fff : ordered;
  for (let i = 0; i < pixels; ++i) {
    const g = green[i];
    rgb[3 * i] = bits((red[i] + g) << 16 >> 16);
    rgb[3 * i + 1] = bits(g);
    rgb[3 * i + 2] = bits((blue[i] + g) << 16 >> 16);
  }
  return rgb;
}

// The float of each half.
const floatOfHalf = (() => {
  const table = new Float32Array(65536);
  for (let bits = 0; bits < 65536; ++bits) {
    const exponent = bits >> 10 & 31, mantissa = bits & 1023;
    const size = exponent === 0 ? mantissa * 2 ** -24 : (1024 + mantissa) * 2 ** (exponent - 25);
    table[bits] = bits & 0x8000 ? -size : size;
  }
  return table;
})();
