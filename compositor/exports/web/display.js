// SPDX-License-Identifier: Apache-2.0
// The display transform (compositor/exports/web_display.h), for the CPU and as GLSL.

class Display {
  constructor(data) {
    this.kind = data.kind;
    this.matrix = data.matrix;
    this.size = data.size;
    this.scale = data.scale;
    this.max = data.max;
    this.packed = data.table;
    this.codes = data.codes;
  }

  async unpack() {
    if (this.kind !== 'lut') return;
    this.table = await unpackedPlanes(this.packed, this.size * this.size, this.size);
    this.packed = null;
  }

  // Scene-linear to 8 bits: reads in[3 i …], writes out[4 i …].
  bytes(input, i, output, o) {
    const r = input[i], g = input[i + 1], b = input[i + 2];
    if (this.kind === 'raw') {
      output[o] = Display.byte(r);
      output[o + 1] = Display.byte(g);
      output[o + 2] = Display.byte(b);
    } else if (this.kind === 'srgb') {
      const m = this.matrix;
      output[o] = Display.byte(Display.curve(m[0] * r + m[1] * g + m[2] * b));
      output[o + 1] = Display.byte(Display.curve(m[3] * r + m[4] * g + m[5] * b));
      output[o + 2] = Display.byte(Display.curve(m[6] * r + m[7] * g + m[8] * b));
    } else {
      this.lookUp(r, g, b, output, o);
    }
    output[o + 3] = 255;
  }

  static byte(v) {
    return v > 0 ? Math.min(255, Math.floor(v * 255 + 0.5)) : 0;
  }

  static curve(v) {
    return v <= 0.0031308 ? 12.92 * v : 1.055 * Math.pow(v, 1 / 2.4) - 0.055;
  }

  static linear(v) {
    return v <= 0.04045 ? v / 12.92 : Math.pow((v + 0.055) / 1.055, 2.4);
  }

  // The corners of the tetrahedron that the color is in.
  lookUp(r, g, b, output, o) {
    const n = this.size, last = n - 2, per = (n - 1) / Math.log2(1 + this.scale * this.max);
    const place = v => Math.log2(1 + this.scale * Math.min(Math.max(v, 0), this.max)) * per;
    const pr = place(r), pg = place(g), pb = place(b);
    const cr = Math.min(Math.floor(pr), last), cg = Math.min(Math.floor(pg), last),
          cb = Math.min(Math.floor(pb), last);
    const x = pr - cr, y = pg - cg, z = pb - cb;
    const dr = 3, dg = 3 * n, db = 3 * n * n;
    const at = cr * dr + cg * dg + cb * db, end = at + dr + dg + db;
    let first, second, largest, middle, smallest;
    if (x >= y) {
      if (y >= z) [first, second, largest, middle, smallest] = [dr, dr + dg, x, y, z];
      else if (x >= z) [first, second, largest, middle, smallest] = [dr, dr + db, x, z, y];
      else [first, second, largest, middle, smallest] = [db, db + dr, z, x, y];
    } else if (x >= z) {
      [first, second, largest, middle, smallest] = [dg, dg + dr, y, x, z];
    } else if (y >= z) {
      [first, second, largest, middle, smallest] = [dg, dg + db, y, z, x];
    } else {
      [first, second, largest, middle, smallest] = [db, db + dg, z, y, x];
    }
    const t = this.table, step = 2 / this.codes;
    for (let c = 0; c < 3; ++c) {
      const sum = (1 - largest) * t[at + c] + (largest - middle) * t[at + first + c] +
                  (middle - smallest) * t[at + second + c] + smallest * t[end + c];
      output[o + c] = Display.byte(sum * step - 0.5);
    }
  }

  // vec3 shown(vec3)
  glsl() {
    if (this.kind === 'raw') return 'vec3 shown(vec3 v) { return v; }';
    if (this.kind === 'srgb') {
      const m = this.matrix.map(v => v.toExponential(9));
      return `
        float curve(float v) {
          return v <= 0.0031308 ? 12.92 * v : 1.055 * pow(max(v, 0.0), 1.0 / 2.4) - 0.055;
        }
        vec3 shown(vec3 v) {
          vec3 l = vec3(${m[0]} * v.r + ${m[1]} * v.g + ${m[2]} * v.b,
                        ${m[3]} * v.r + ${m[4]} * v.g + ${m[5]} * v.b,
                        ${m[6]} * v.r + ${m[7]} * v.g + ${m[8]} * v.b);
          return vec3(curve(l.r), curve(l.g), curve(l.b));
        }`;
    }
    const n = this.size, per = (n - 1) / Math.log2(1 + this.scale * this.max);
    return `
      uniform highp usampler3D lut;
      vec3 entry(ivec3 p) { return vec3(texelFetch(lut, p, 0).rgb); }
      vec3 shown(vec3 v) {
        vec3 place = log2(1.0 + float(${this.scale}) * clamp(v, 0.0, float(${this.max}))) * ${per.toExponential(9)};
        vec3 cell = min(floor(place), float(${n - 2}));
        vec3 f = place - cell;
        ivec3 p = ivec3(cell), first, second;
        float largest = max(f.x, max(f.y, f.z)), smallest = min(f.x, min(f.y, f.z));
        float middle = f.x + f.y + f.z - largest - smallest;
        if (f.x >= f.y) {
          if (f.y >= f.z) { first = ivec3(1, 0, 0); second = ivec3(1, 1, 0); middle = f.y; }
          else if (f.x >= f.z) { first = ivec3(1, 0, 0); second = ivec3(1, 0, 1); middle = f.z; }
          else { first = ivec3(0, 0, 1); second = ivec3(1, 0, 1); middle = f.x; }
        } else if (f.x >= f.z) { first = ivec3(0, 1, 0); second = ivec3(1, 1, 0); middle = f.x; }
        else if (f.y >= f.z) { first = ivec3(0, 1, 0); second = ivec3(0, 1, 1); middle = f.z; }
        else { first = ivec3(0, 0, 1); second = ivec3(0, 1, 1); middle = f.y; }
        vec3 sum = (1.0 - largest) * entry(p) + (largest - middle) * entry(p + first) +
                   (middle - smallest) * entry(p + second) + smallest * entry(p + ivec3(1));
        return sum * ${(2 / this.codes).toExponential(9)} - 0.5;
      }`;
  }
}
