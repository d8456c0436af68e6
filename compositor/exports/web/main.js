// SPDX-License-Identifier: Apache-2.0
// The page: reads what it holds, makes rows and image, and keeps the look with its undo.

class App {
  constructor(data) {
    this.data = data;
    this.look = new Look(data);
    this.past = [];
    this.future = [];
    this.gesture = '';
    this.rows = [];
    this.start = this.look.snapshot();
  }

  // Reading

  async load() {
    const texts = [...document.querySelectorAll('script.plane')];
    const {width, height} = this.data;
    this.display = new Display(this.data.display);
    await this.display.unpack();
    this.planes = [];
    // Some at a time: browsers inflate in threads of their own
    for (let first = 0; first < texts.length; first += 4) {
      const some = texts.slice(first, first + 4);
      this.planes.push(...await Promise.all(some.map(text => unpackedPlanes(text.textContent, width, height))));
      some.forEach(text => text.remove());
      document.getElementById('progress').value = this.planes.length / texts.length;
      await new Promise(done => setTimeout(done));
    }
    const untouched = new Look({...this.data, look: {controls: [], exposure: 0}});
    this.render = untouched.planeGains(this.planes.length);
    this.mix = this.look.planeGains(this.planes.length);
  }

  mixGains() { return this.mix; }

  renderGains() { return this.render; }

  // The GPU where it can, unless the address ends in #cpu.
  painter() {
    const {width, height} = this.data;
    let canvas = document.getElementById('image');
    if (location.hash !== '#cpu') {
      try {
        return new Gpu(canvas, width, height, this.planes, this.display);
      } catch (error) {
        // A canvas that gave a context gives no other
        const other = canvas.cloneNode();
        canvas.replaceWith(other);
        canvas = other;
        this.whyNoGpu = error.message;
      }
    }
    return new Cpu(canvas, width, height, this.planes, this.display);
  }

  paint() {
    this.view.painter = this.painter();
    this.view.canvas = document.getElementById('image');
    this.view.canvas.addEventListener('webglcontextlost', e => {
      e.preventDefault();
      this.view.painter = null;
    });
    this.view.canvas.addEventListener('webglcontextrestored', () => {
      this.paint();
      this.view.redraw();
    });
  }

  // The look. Changes of one gesture are one step of undo; an empty name is a step of its own.

  edit(gesture, change) {
    const before = this.look.snapshot();
    change(this.look);
    const after = this.look.snapshot();
    if (after === before) return this.show();
    const gains = this.look.planeGains(this.planes.length);
    if (!gains) {
      this.look.restore(before);
      this.show();
      this.say('This file stores lights and bounces, not each bounce of each light: ' +
               'use faders of one page at a time.');
      return;
    }
    if (gesture === '' || gesture !== this.gesture) this.past.push(before);
    if (this.past.length > 500) this.past.shift();
    this.future = [];
    this.gesture = gesture;
    this.mix = gains;
    this.show();
    this.view.redraw(gesture !== '');
  }

  seal() {
    this.gesture = '';
    this.view.redraw();
  }

  step(from, to) {
    if (from.length === 0) return;
    to.push(this.look.snapshot());
    this.look.restore(from.pop());
    this.gesture = '';
    this.mix = this.look.planeGains(this.planes.length);
    this.show();
    this.view.redraw();
  }

  undo() { this.step(this.past, this.future); }

  redo() { this.step(this.future, this.past); }

  show() {
    for (const row of this.rows) row.show();
    document.getElementById('undo').disabled = this.past.length === 0;
    document.getElementById('redo').disabled = this.future.length === 0;
    document.getElementById('reset').disabled = this.look.controls.length === 0 && this.look.exposure === 0;
    this.showFurther();
  }

  // Rows

  makeRows() {
    const {data} = this;
    const exposure = new StopsRow(this, {name: 'exposure', title: 'Exposure', hint: 'of the whole image'}, {
      isPlain: true, read: () => this.look.exposure,
      write: (look, stops) => {
        look.exposure = Math.round(Math.max(-largestStops, Math.min(largestStops, stops)) * 100) / 100;
      },
    });
    this.rows.push(exposure);
    document.getElementById('exposure').append(exposure.box);
    const hints = {
      direct: 'one bounce', indirect: 'two bounces and more', b0: 'seen directly', tail: 'all further bounces',
    };
    const hint = name => hints[name] || (/^b\d+$/.test(name) ? `bounce ${name.slice(1)}` : '');
    const pages = [];
    const stopsPage = (title, rows) => {
      const made = rows.map(row => new StopsRow(this, row));
      if (made.length > 0) pages.push({title, made, boxes: made.map(m => m.box)});
    };
    // Faders of what the page has layers of; `all` works with any
    const has = names => data.families.some(f => names.includes(f.name));
    const cells = ['lobe-matrix', 'matrix'];
    const hasLights = has([...cells, 'groups', 'plain']), hasBounces = has([...cells, 'bounces']);
    stopsPage('Lights', data.lights.filter(row => hasLights || row.name === 'all'));
    stopsPage('Bounces', data.bounces.filter(() => hasBounces).map(row => ({...row, hint: hint(row.name)})));
    stopsPage('Lobes', data.lobes.filter(() => has(['lobe-matrix'])));
    if (data.grid.groups.length > 0 && data.grid.columns.length > 0) {
      const grid = new Grid(this, data.grid);
      const note = element('p', {class: 'note'}, 'Stops of each bounce of each light. Arrow keys: a quarter stop.');
      pages.push({title: 'Light × bounce', made: [grid], boxes: [note, grid.box]});
    }
    if (data.shadows.length > 0) {
      const made = [];
      for (const row of data.shadows) {
        made.push(new ShareRow(this, 'shadow', row));
        for (const caster of data.casters.filter(c => c.group === row.name))
          made.push(new ShareRow(this, 'caster', {...caster, title: '↳ ' + caster.name.slice(row.name.length + 1)}));
      }
      const note = element('p', {class: 'note'}, 'Lifts the shadows of a light: 0 % as rendered, 100 % none.');
      pages.push({title: 'Shadows', made, boxes: [note, ...made.map(m => m.box)]});
    }
    for (const {made} of pages) this.rows.push(...made);
    this.makeTabs(pages);
  }

  makeTabs(pages) {
    const tabs = document.getElementById('tabs'), panels = document.getElementById('pages');
    const choose = number => {
      [...tabs.children].forEach((tab, i) => {
        tab.setAttribute('aria-selected', i === number);
        tab.tabIndex = i === number ? 0 : -1;
        panels.children[i].hidden = i !== number;
      });
      panels.scrollTop = 0;
    };
    pages.forEach(({title, boxes}, i) => {
      tabs.append(element('button', {
        role: 'tab', id: 'tab' + i, 'aria-controls': 'page' + i, onclick: () => choose(i),
        onkeydown: e => {
          const to = {ArrowRight: i + 1, ArrowLeft: i - 1, Home: 0, End: pages.length - 1}[e.key];
          if (to === undefined) return;
          e.preventDefault();
          const next = (to + pages.length) % pages.length;
          choose(next);
          tabs.children[next].focus();
        },
      }, title));
      panels.append(element('div', {role: 'tabpanel', id: 'page' + i, 'aria-labelledby': 'tab' + i}, ...boxes));
    });
    choose(0);
  }

  hasRow(kind, name) {
    const {lights, bounces, lobes, grid, shadows, casters} = this.data;
    if (kind === 'shadow') return shadows.some(r => r.name === name);
    if (kind === 'caster') return casters.some(r => r.name === name);
    if ([...lights, ...bounces, ...lobes].some(r => r.name === name)) return true;
    const colon = name.lastIndexOf(':');
    return colon > 0 && (kind === 'gain' || kind === 'mute') && grid.groups.includes(name.slice(0, colon)) &&
           grid.columns.includes(name.slice(colon + 1));
  }

  showFurther() {
    const box = document.getElementById('further');
    const further = this.look.further((kind, name) => this.hasRow(kind, name));
    box.hidden = further.length === 0;
    if (box.hidden) return;
    const remove = c => element('button', {
      'aria-label': `Remove ${c.do} ${c.name}`,
      onclick: () => this.edit('', look => { look.controls = look.controls.filter(o => o !== c); }),
    }, 'Remove');
    const line = c => element('li', {}, element('span', {}, `${c.do} ${c.name} ${c.value || ''}`), remove(c));
    box.replaceChildren(element('span', {class: 'soft'}, 'Also in this look'), element('ul', {}, ...further.map(line)));
  }

  // Planes whose sum is what a row stands for.
  planesOf(cells) {
    const has = new Set(cells);
    for (const family of this.data.families) {
      // The beauty holds all rows of another renderer
      if (family.rest !== undefined && has.size === this.data.cells) return [family.terms[0].plane];
      // A family of lights has what stands for all bounces of a light, and the other way around
      const terms = family.terms.filter(
        (t, i) => t.cells.every(cell => has.has(cell)) && (family.rest === undefined || i > 0));
      if (terms.length > 0) return terms.map(t => t.plane);
    }
    return [];
  }

  isBlack(plane) {
    return this.planes[plane].every(bits => (bits & 0x7fff) === 0);
  }

  // What each row gives, small: the brightest pixels just below white.
  drawThumbs() {
    const {width, height, pixelAspect, targets} = this.data;
    for (const {thumb, row, kind, box} of this.rows) {
      if (!thumb) continue;
      const planes = kind ? [row.plane] : this.planesOf(targets.cells[row.name]);
      const w = thumb.width, h = thumb.height, scale = Math.max(w / width / pixelAspect, h / height);
      const within = (v, end) => Math.min(end - 1, Math.max(0, Math.floor(v)));
      const sums = new Float32Array(3 * w * h), levels = new Float32Array(w * h);
      for (let i = 0; i < w * h; ++i) {
        const x = within(width / 2 + (i % w + 0.5 - w / 2) / scale / pixelAspect, width);
        const y = within(height / 2 + (Math.floor(i / w) + 0.5 - h / 2) / scale, height);
        for (const p of planes) {
          for (let k = 0; k < 3; ++k) sums[3 * i + k] += floatOfHalf[this.planes[p][3 * (y * width + x) + k]];
        }
        levels[i] = Math.max(sums[3 * i], sums[3 * i + 1], sums[3 * i + 2]);
      }
      levels.sort();
      const bright = levels[Math.floor(0.97 * levels.length)] || levels[levels.length - 1];
      const gain = bright > 0 ? 0.9 / bright : 1;
      if (planes.every(p => this.isBlack(p))) {
        box.classList.add('isDark');
        box.querySelector('.name').append(element('small', {}, 'no light'));
      }
      const context = thumb.getContext('2d'), image = context.createImageData(w, h);
      for (let i = 0; i < w * h; ++i) {
        for (let k = 0; k < 3; ++k) image.data[4 * i + k] = Display.byte(Display.curve(sums[3 * i + k] * gain));
        image.data[4 * i + 3] = 255;
      }
      context.putImageData(image, 0, 0);
    }
  }

  // Out of the page

  say(text) {
    const toast = document.getElementById('toast');
    toast.textContent = text;
    toast.classList.add('isShown');
    clearTimeout(this.toastTimer);
    this.toastTimer = setTimeout(() => toast.classList.remove('isShown'), 4000);
  }

  async copyLook() {
    const text = this.look.toJson();
    try {
      await navigator.clipboard.writeText(text);
      this.say('Look copied: a preset for velatura-comp mix --preset');
    } catch (error) {
      document.getElementById('lookText').value = text;
      document.getElementById('lookDialog').showModal();
      document.getElementById('lookText').select();
    }
  }

  download(blob, name) {
    const link = element('a', {href: URL.createObjectURL(blob), download: name});
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }

  saveImage() {
    this.view.canvas.toBlob(blob => this.download(blob, this.data.title + '.png'), 'image/png');
  }

  // Buttons and keys

  listen() {
    const on = (id, event, action) => document.getElementById(id).addEventListener(event, action);
    const {view} = this;
    on('undo', 'click', () => this.undo());
    on('redo', 'click', () => this.redo());
    on('reset', 'click', () => this.edit('', look => look.reset()));
    on('copy', 'click', () => this.copyLook());
    on('compare', 'click', () => view.compare(!view.isComparing));
    on('fit', 'click', () => view.fit());
    on('full', 'click', () => view.zoom(1 / devicePixelRatio / view.scale));
    const before = document.getElementById('before');
    before.addEventListener('pointerdown', e => {
      before.setPointerCapture(e.pointerId);
      view.showRender(true);
    });
    for (const end of ['pointerup', 'pointercancel', 'blur'])
      before.addEventListener(end, () => view.showRender(false));
    for (const [event, isOn] of [['keydown', true], ['keyup', false]]) {
      before.addEventListener(event, e => {
        if (e.key === ' ' || e.key === 'Enter') view.showRender(isOn);
      });
    }
    this.listenToMenu(on);
    document.addEventListener('keydown', e => this.key(e));
    document.addEventListener('keyup', e => {
      if (e.key.toLowerCase() === 'b') view.showRender(false);
    });
  }

  listenToMenu(on) {
    const menu = document.getElementById('menu'), more = document.getElementById('more');
    const open = isOpen => {
      menu.hidden = !isOpen;
      more.setAttribute('aria-expanded', isOpen);
      if (isOpen) menu.children[0].focus();
    };
    on('more', 'click', () => open(menu.hidden));
    document.addEventListener('pointerdown', e => {
      if (!menu.hidden && !menu.contains(e.target) && !more.contains(e.target)) open(false);
    });
    menu.addEventListener('keydown', e => {
      const items = [...menu.children], at = items.indexOf(document.activeElement);
      if (e.key === 'ArrowDown') items[(at + 1) % items.length].focus();
      else if (e.key === 'ArrowUp') items[(at + items.length - 1) % items.length].focus();
      else if (e.key === 'Escape' || e.key === 'Tab') {
        open(false);
        more.focus();
      } else return;
      e.preventDefault();
    });
    on('saveLook', 'click', () => {
      open(false);
      const preset = new Blob([this.look.toJson()], {type: 'application/json'});
      this.download(preset, this.data.title + '.look.json');
    });
    on('saveImage', 'click', () => {
      open(false);
      this.saveImage();
    });
    on('help', 'click', () => {
      open(false);
      document.getElementById('helpDialog').showModal();
    });
    const themes = ['automatic', 'dark', 'light'];
    let theme = 0;
    on('theme', 'click', () => {
      theme = (theme + 1) % themes.length;
      document.getElementById('theme').textContent = 'Theme: ' + themes[theme];
      if (theme === 0) delete document.documentElement.dataset.theme;
      else document.documentElement.dataset.theme = themes[theme];
    });
  }

  key(e) {
    const isTyping = e.target.matches('input:not([type=range]), textarea'), key = e.key.toLowerCase();
    const {view} = this;
    if (document.querySelector('dialog[open]') || isTyping) return;
    if (e.ctrlKey || e.metaKey) {
      if (key === 'z') e.shiftKey ? this.redo() : this.undo();
      else if (key === 'y') this.redo();
      else return;
      e.preventDefault();
      return;
    }
    if (e.altKey) return;
    if (key === 'w') view.compare(!view.isComparing);
    else if (key === 'b') view.showRender(true);
    else if (key === 'c') this.copyLook();
    else if (key === 'f') view.fit();
    else if (key === '1') view.zoom(1 / devicePixelRatio / view.scale);
    else if (key === '+' || key === '=') view.zoom(1.25);
    else if (key === '-') view.zoom(0.8);
    else if (key === '?') document.getElementById('helpDialog').showModal();
    else return;
    e.preventDefault();
  }

  describe() {
    const {width, height, fullWidth, fullHeight, look} = this.data;
    const isWhole = width === fullWidth && height === fullHeight;
    const size = `${width} × ${height}` + (isWhole ? '' : ` of ${fullWidth} × ${fullHeight}`);
    const view = [look.display, look.view].filter(Boolean).join(' / ');
    document.getElementById('facts').textContent = `Light mixer · ${size}${view ? ' · ' + view : ''}`;
    const {equalShare, largestDifference} = this.data;
    const share = (100 - 100 * equalShare).toPrecision(2);
    const difference = largestDifference === 0 ? 'the render to the bit' : 'the render, but for ' +
      `${share} % of the values, which differ by up to ${largestDifference} of 255 steps`;
    document.getElementById('about').textContent = `${this.planes.length} layers, drawn by ${this.view.painter.name}` +
      `${this.whyNoGpu ? ` (${this.whyNoGpu})` : ''}. Untouched, the image is ${difference}. Made by Velatura.`;
  }
}

async function main() {
  const data = JSON.parse(document.getElementById('data').textContent);
  const app = new App(data);
  const fail = text => {
    document.getElementById('loading').replaceChildren(element('p', {class: 'fault', role: 'alert'}, text));
  };
  if (typeof DecompressionStream === 'undefined')
    return fail('This browser is too old for this page: use Chrome 80, Firefox 113, Safari 16.4 or newer.');
  try {
    await app.load();
  } catch (error) {
    return fail('This page is damaged: ' + error.message);
  }
  app.view = new View(data, app);
  app.paint();
  app.makeRows();
  app.listen();
  app.describe();
  app.show();
  document.getElementById('loading').remove();
  app.view.fit();
  app.view.redraw();
  app.drawThumbs();
  document.documentElement.dataset.ready = app.view.painter.name;
  // For scripts
  window.mixer = app;
}
main();
