// SPDX-License-Identifier: Apache-2.0
// A look: what velatura-comp mix --preset takes, and the gains of planes that it means. The same
// numbers as those of compositor/mix/mix_plan.cpp: products of floats in the same order.

const fround = Math.fround;
const largestStops = 64;

// 1.50 as +1.50, for people and presets
function signed(stops, digits = 2) {
  return (stops < 0 ? '−' : '+') + Math.abs(stops).toFixed(digits);
}

// What a box of stops takes: 1.5, +1.5, 1.5 st are stops; 2x, x2, ×2 a multiplier. null: neither
function stopsOfText(text) {
  let t = text.trim().replace('−', '-').replace(',', '.');
  const isFactor = /^[x×]|[x×]$/i.test(t);
  t = t.replace(/^[x×]|[x×]$/gi, '').replace(/\s*st$/i, '').trim();
  if (!/^[+-]?(\d+\.?\d*|\.\d+)$/.test(t)) return null;
  const value = Number(t);
  if (!isFactor) return Math.max(-largestStops, Math.min(largestStops, value));
  return value > 0 ? Math.max(-largestStops, Math.min(largestStops, Math.log2(value))) : null;
}

// Of a black body against 6504 K, luminance 1 (compositor/look/controls.cpp)
function planckian(kelvin) {
  const t = 1000 / kelvin;
  const x = kelvin < 4000 ? ((-0.2661239 * t - 0.2343589) * t + 0.8776956) * t + 0.179910
                          : ((-3.0258469 * t + 2.1070379) * t + 0.2226347) * t + 0.240390;
  const y = kelvin < 2222 ? ((-1.1063814 * x - 1.34811020) * x + 2.18555832) * x - 0.20219683
          : kelvin < 4000 ? ((-0.9549476 * x - 1.37418593) * x + 2.09137015) * x - 0.16748867
                          : ((3.0817580 * x - 5.87338670) * x + 3.75112997) * x - 0.37001483;
  const X = x / y, Z = (1 - x - y) / y;
  return [3.2404542 * X - 1.5371385 - 0.4985314 * Z, -0.9692660 * X + 1.8760108 + 0.0415560 * Z,
          0.0556434 * X - 0.2040259 + 1.0572252 * Z];
}

function kelvinTint(kelvin, matrix) {
  const isRec709 = matrix.every((v, i) => v === (i % 4 === 0 ? 1 : 0));
  let rgb = planckian(kelvin);
  if (isRec709) rgb = rgb.map(v => Math.max(0, v));
  rgb = rgb.map((v, c) => v / planckian(6504)[c]);
  const luminance = 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
  rgb = rgb.map(v => v / luminance);
  if (isRec709) return rgb.map(fround);
  return [0, 3, 6].map(r => fround(Math.max(0, matrix[r] * rgb[0] + matrix[r + 1] * rgb[1] + matrix[r + 2] * rgb[2])));
}

class Look {
  constructor(data) {
    this.data = data;
    this.controls = data.look.controls.map(c => ({...c}));
    this.exposure = data.look.exposure;
  }

  // Controls of a row: the first of each kind that names it

  find(kind, name) {
    return this.controls.find(c => c.do === kind && c.name === name);
  }

  put(kind, name, value, factor, more = {}) {
    const control = {do: kind, name, ...(value === '' ? {} : {value}), factor, ...more};
    const at = this.controls.findIndex(c => c.do === kind && c.name === name);
    if (at < 0) this.controls.push(control);
    else this.controls[at] = control;
  }

  remove(kind, name) {
    const at = this.controls.findIndex(c => c.do === kind && c.name === name);
    if (at >= 0) this.controls.splice(at, 1);
  }

  stops(name) {
    const gain = this.find('gain', name);
    return gain ? Math.log2(gain.factor[0]) : 0;
  }

  setStops(name, stops) {
    const rounded = Math.round(stops * 100) / 100;
    if (rounded === 0) return this.remove('gain', name);
    const factor = fround(2 ** fround(rounded));
    this.put('gain', name, (rounded < 0 ? '' : '+') + rounded.toFixed(2) + 'st', [factor, factor, factor]);
  }

  tint(name) {
    const tint = this.find('tint', name);
    return tint ? tint.factor : [1, 1, 1];
  }

  setTint(name, rgb) {
    const texts = rgb.map(v => Math.max(0, v).toFixed(3));
    if (texts.every(t => t === '1.000')) return this.remove('tint', name);
    this.put('tint', name, texts.join(','), texts.map(t => fround(Number(t))));
  }

  kelvin(name) {
    const kelvin = this.find('kelvin', name);
    return kelvin ? kelvin.kelvin : null;
  }

  setKelvin(name, kelvin) {
    if (kelvin === null) return this.remove('kelvin', name);
    const rounded = Math.min(25000, Math.max(1667, Math.round(kelvin / 10) * 10));
    this.put('kelvin', name, String(rounded), kelvinTint(rounded, this.data.fileFromRec709), {kelvin: rounded});
  }

  isOn(kind, name) {
    return this.find(kind, name) !== undefined;
  }

  set(kind, name, isOn) {
    if (!isOn) this.remove(kind, name);
    else this.put(kind, name, '', [1, 1, 1]);
  }

  get isSoloing() {
    return this.controls.some(c => c.do === 'solo');
  }

  soloAlone(name) {
    const wasAlone = this.isOn('solo', name) && this.controls.filter(c => c.do === 'solo').length === 1;
    this.controls = this.controls.filter(c => c.do !== 'solo');
    if (!wasAlone) this.set('solo', name, true);
  }

  share(kind, name) {
    const control = this.find(kind, name);
    return control ? control.factor[0] : 0;
  }

  setShare(kind, name, share) {
    const rounded = Math.round(Math.min(1, Math.max(0, share)) * 100) / 100;
    if (rounded === 0) return this.remove(kind, name);
    const factor = fround(rounded);
    this.put(kind, name, rounded.toFixed(2), [factor, factor, factor]);
  }

  resetRow(name) {
    for (const kind of ['gain', 'tint', 'kelvin', 'mute', 'solo']) this.remove(kind, name);
  }

  isRowChanged(name) {
    return ['gain', 'tint', 'kelvin', 'mute', 'solo'].some(kind => this.isOn(kind, name));
  }

  reset() {
    this.controls = [];
    this.exposure = 0;
  }

  // Controls that no row shows: repeated ones, and names that the page has no row for.
  further(hasRow) {
    return this.controls.filter(c => !hasRow(c.do, c.name) || this.find(c.do, c.name) !== c);
  }

  snapshot() {
    return JSON.stringify([this.controls, this.exposure]);
  }

  restore(text) {
    [this.controls, this.exposure] = JSON.parse(text);
  }

  // Presets

  toJson() {
    const look = {schema: 'velatura.look/1'};
    if (Object.keys(this.data.look.rows || {}).length > 0) look.rows = this.data.look.rows;
    look.controls = this.controls.map(c => {
      const control = {do: c.do, name: c.name};
      if (c.value !== undefined) control.value = c.value;
      return control;
    });
    look.exposure = this.exposure;
    if (this.data.look.display) look.display = this.data.look.display;
    if (this.data.look.view) look.view = this.data.look.view;
    return JSON.stringify(look, null, 2) + '\n';
  }

  // Gains

  isShadowWord(c) {
    return c.name === 'shadow' && this.data.targets.cells.shadow === undefined;
  }

  // Of each cell, three factors.
  cellGains() {
    const {cells, targets} = this.data;
    const gains = new Float32Array(3 * cells).fill(1);
    const solos = new Set();
    for (const c of this.controls) {
      if (!['gain', 'tint', 'kelvin', 'mute', 'solo'].includes(c.do) || this.isShadowWord(c)) continue;
      for (const cell of targets.cells[c.name]) {
        if (c.do === 'solo') {
          solos.add(cell);
          continue;
        }
        for (let k = 0; k < 3; ++k) gains[3 * cell + k] *= c.do === 'mute' ? 0 : fround(c.factor[k]);
      }
    }
    if (this.isSoloing) {
      for (let cell = 0; cell < cells; ++cell) {
        if (!solos.has(cell)) gains.fill(0, 3 * cell, 3 * cell + 3);
      }
    }
    return gains;
  }

  // Shares of shadows that are given back: of rows `shadows` or `casters`.
  lifts(rows) {
    const lifts = new Float32Array(this.data[rows].length);
    for (const c of this.controls) {
      let lift = c.factor[0], numbers = [];
      if (rows === 'shadows' && (c.do === 'shadow' || this.isShadowWord(c))) {
        numbers = this.data.targets.shadows[c.name] || [];
        if (c.do === 'gain') lift = fround(1 - c.factor[0]);
        if (c.do === 'mute') lift = 1;
      } else if (rows === 'casters' && c.do === 'caster') {
        numbers = this.data.targets.casters[c.name] || [];
      }
      for (const n of numbers) lifts[n] += lift;
    }
    return lifts;
  }

  // The first family of the page that can express the gains; null: none.
  family(gains) {
    const same = (a, b) => [0, 1, 2].every(k => gains[3 * a + k] === gains[3 * b + k]);
    // All light of a layer has one gain
    const canExpress = family => family.terms.every(t => t.cells.every(cell => same(cell, t.cells[0])));
    return this.data.families.find(canExpress) || null;
  }

  // Of each plane, three factors; null where the page has no layers for it.
  planeGains(planeCount) {
    const cells = this.cellGains();
    const family = this.family(cells);
    if (!family) return null;
    // A lifted shadow needs one gain for all lobes of its light's direct light
    const same = (a, b) => [0, 1, 2].every(k => cells[3 * a + k] === cells[3 * b + k]);
    const isDivided = rows => this.lifts(rows).some((lift, i) => lift !== 0 &&
        !this.data[rows][i].cells.every(cell => same(cell, this.data[rows][i].cells[0])));
    if (isDivided('shadows') || isDivided('casters')) return null;
    const exposure = fround(2 ** this.exposure);
    const gains = new Float32Array(3 * planeCount);
    for (const {plane, cells: [cell]} of family.terms) {
      for (let k = 0; k < 3; ++k) {
        let gain = cells[3 * cell + k];
        // A row counts by how much it differs from the rest, which is the beauty's gain
        if (family.rest !== undefined && plane !== family.terms[0].plane) gain = fround(gain - cells[3 * family.rest + k]);
        gains[3 * plane + k] = fround(gain * exposure);
      }
    }
    for (const rows of ['shadows', 'casters']) {
      const lifts = this.lifts(rows);
      this.data[rows].forEach(({plane, cells: [cell]}, i) => {
        for (let k = 0; k < 3; ++k) {
          gains[3 * plane + k] = fround(fround(cells[3 * cell + k] * lifts[i]) * exposure);
        }
      });
    }
    return gains;
  }
}
