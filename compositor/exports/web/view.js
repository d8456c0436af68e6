// SPDX-License-Identifier: Apache-2.0
// The image on the screen: zoom, pan, the wipe against the render, and pixels under the pointer.

class View {
  constructor(data, mixer) {
    this.data = data;
    this.mixer = mixer;  // {planes, display, mixGains(), renderGains()}
    this.stage = document.getElementById('stage');
    this.sheet = document.getElementById('sheet');
    this.handle = document.getElementById('wipe');
    this.canvas = document.getElementById('image');
    this.width = data.width * data.pixelAspect;
    this.height = data.height;
    this.scale = 1;
    this.x = this.y = 0;
    this.isFitted = true;
    this.wipe = 0.5;
    this.isComparing = this.isShowingRender = false;
    this.pointers = new Map();
    document.documentElement.style.setProperty('--aspect', this.width / this.height);
    this.listen();
    new ResizeObserver(() => this.isFitted ? this.fit() : this.place()).observe(this.stage);
  }

  // Pixels left of it are of the render.
  get wipePixel() {
    if (this.isShowingRender) return this.data.width;
    return this.isComparing ? Math.round(this.wipe * this.data.width) : 0;
  }

  redraw(isMoving = false) {
    this.isMoving = isMoving;
    if (this.frame || !this.painter) return;
    this.frame = requestAnimationFrame(() => {
      this.frame = 0;
      this.painter.draw(this.mixer.mixGains(), this.mixer.renderGains(), this.wipePixel, this.isMoving);
      this.readOut();
    });
  }

  // Zoom and pan

  fit() {
    const {clientWidth, clientHeight} = this.stage;
    this.isFitted = true;
    this.scale = Math.min(clientWidth / this.width, clientHeight / this.height) || 1;
    this.x = (clientWidth - this.width * this.scale) / 2;
    this.y = (clientHeight - this.height * this.scale) / 2;
    this.place();
  }

  zoom(factor, x = this.stage.clientWidth / 2, y = this.stage.clientHeight / 2) {
    const before = this.scale;
    this.scale = Math.min(32, Math.max(0.05, this.scale * factor));
    this.x = x - (x - this.x) * this.scale / before;
    this.y = y - (y - this.y) * this.scale / before;
    this.isFitted = false;
    this.place();
  }

  place() {
    // Some of the image stays in sight
    const margin = 40;
    this.x = Math.min(this.stage.clientWidth - margin, Math.max(margin - this.width * this.scale, this.x));
    this.y = Math.min(this.stage.clientHeight - margin, Math.max(margin - this.height * this.scale, this.y));
    this.sheet.style.width = this.width + 'px';
    this.sheet.style.height = this.height + 'px';
    this.sheet.style.transform = `translate(${this.x}px, ${this.y}px) scale(${this.scale})`;
    this.sheet.classList.toggle('isPixelated', this.scale * devicePixelRatio >= 2);
    const at = this.x + this.wipe * this.width * this.scale;
    this.handle.style.left = Math.min(this.stage.clientWidth, Math.max(0, at)) + 'px';
    this.handle.setAttribute('aria-valuenow', Math.round(100 * this.wipe));
    const percent = Math.round(100 * this.wipe);
    this.handle.setAttribute('aria-valuetext', percent + ' percent of the image show the render');
  }

  setWipe(share) {
    this.wipe = Math.min(1, Math.max(0, share));
    this.place();
    this.redraw(true);
  }

  compare(isOn) {
    this.isComparing = isOn;
    this.handle.hidden = !isOn;
    document.getElementById('compare').setAttribute('aria-pressed', isOn);
    this.redraw();
  }

  showRender(isOn) {
    if (this.isShowingRender === isOn) return;
    this.isShowingRender = isOn;
    document.getElementById('badge').hidden = !isOn;
    this.redraw();
  }

  // Pixels

  pixelAt(event) {
    const box = this.stage.getBoundingClientRect();
    const x = Math.floor((event.clientX - box.left - this.x) / this.scale / this.data.pixelAspect);
    const y = Math.floor((event.clientY - box.top - this.y) / this.scale);
    return x >= 0 && y >= 0 && x < this.data.width && y < this.data.height ? {x, y} : null;
  }

  readOut() {
    if (!this.pixel) return;
    const {x, y} = this.pixel, pixel = y * this.data.width + x;
    const values = gains => {
      const sum = new Float32Array(3), bytes = new Uint8ClampedArray(4);
      if (gains) pixelSum(this.mixer.planes, gains, pixel, sum);
      this.mixer.display.bytes(sum, 0, bytes, 0);
      return {sum: [...sum], bytes: [...bytes].slice(0, 3)};
    };
    const number = v => {
      const size = Math.abs(v);
      return v === 0 ? '0' : size >= 100 ? v.toFixed(0) : size >= 0.001 ? v.toPrecision(3) : v.toExponential(1);
    };
    const text = (title, {sum, bytes}) =>
      `<span class="values"><b>${title}</b><i style="background:rgb(${bytes})"></i>` +
      `<span>${sum.map(number).join(' ')}</span><span class="soft">${bytes.join(' ')}</span></span>`;
    document.getElementById('readout').innerHTML = `<span class="pixel">x ${x}, y ${y}</span>` +
      text('Mix', values(this.mixer.mixGains())) + text('Render', values(this.mixer.renderGains()));
  }

  // Pointers: one pans, two pinch

  listen() {
    const {stage, handle} = this;
    stage.addEventListener('pointerdown', e => {
      if (e.target === handle || e.button > 1) return;
      stage.setPointerCapture(e.pointerId);
      this.pointers.set(e.pointerId, {x: e.clientX, y: e.clientY});
      this.pixel = this.pixelAt(e) || this.pixel;
      this.readOut();
    });
    stage.addEventListener('pointermove', e => {
      const before = this.pointers.get(e.pointerId);
      if (before) this.dragged(e, before);
      const pixel = this.pixelAt(e);
      if (pixel) this.pixel = pixel;
      this.readOut();
    });
    for (const end of ['pointerup', 'pointercancel']) {
      stage.addEventListener(end, e => {
        this.pointers.delete(e.pointerId);
        stage.classList.remove('isPanning');
      });
    }
    stage.addEventListener('wheel', e => {
      e.preventDefault();
      const box = stage.getBoundingClientRect();
      const factor = Math.exp(-e.deltaY * (e.deltaMode === 1 ? 0.05 : 0.0015));
      this.zoom(factor, e.clientX - box.left, e.clientY - box.top);
    }, {passive: false});
    stage.addEventListener('dblclick', e => {
      if (e.target === handle) return;
      const box = stage.getBoundingClientRect();
      const closer = Math.max(1 / devicePixelRatio, 2 * this.scale) / this.scale;
      if (this.isFitted) this.zoom(closer, e.clientX - box.left, e.clientY - box.top);
      else this.fit();
    });
    handle.addEventListener('pointerdown', e => {
      handle.setPointerCapture(e.pointerId);
      e.stopPropagation();
    });
    handle.addEventListener('pointermove', e => {
      if (!handle.hasPointerCapture(e.pointerId)) return;
      this.setWipe((e.clientX - stage.getBoundingClientRect().left - this.x) / (this.width * this.scale));
    });
    handle.addEventListener('pointerup', () => this.redraw());
    handle.addEventListener('keydown', e => {
      const steps = {ArrowLeft: -0.02, ArrowRight: 0.02, ArrowDown: -0.02, ArrowUp: 0.02, PageDown: -0.1, PageUp: 0.1};
      const step = {...steps, Home: -1, End: 1}[e.key];
      if (!step) return;
      e.preventDefault();
      this.setWipe(this.wipe + step);
    });
    stage.addEventListener('keydown', e => {
      const step = {ArrowLeft: [40, 0], ArrowRight: [-40, 0], ArrowUp: [0, 40], ArrowDown: [0, -40]}[e.key];
      if (!step || e.target !== stage) return;
      e.preventDefault();
      this.x += step[0];
      this.y += step[1];
      this.isFitted = false;
      this.place();
    });
  }

  dragged(e, before) {
    const other = [...this.pointers].find(([id]) => id !== e.pointerId);
    const box = this.stage.getBoundingClientRect();
    if (other) {
      const [, o] = other;
      const was = Math.hypot(before.x - o.x, before.y - o.y), is = Math.hypot(e.clientX - o.x, e.clientY - o.y);
      if (was > 0) this.zoom(is / was, (e.clientX + o.x) / 2 - box.left, (e.clientY + o.y) / 2 - box.top);
      this.x += (e.clientX - before.x) / 2;
      this.y += (e.clientY - before.y) / 2;
      this.place();
    } else if (!this.isFitted) {
      this.stage.classList.add('isPanning');
      this.x += e.clientX - before.x;
      this.y += e.clientY - before.y;
      this.place();
    }
    this.pointers.set(e.pointerId, {x: e.clientX, y: e.clientY});
  }
}
