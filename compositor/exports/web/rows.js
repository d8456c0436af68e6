// SPDX-License-Identifier: Apache-2.0
// Rows of faders. Each shows what the look says of a name, and edits it there.

const faderStops = 6;
const kelvinRange = [2000, 12000];

function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith('on')) made.addEventListener(name.slice(2), value);
    else if (value !== null && value !== false) made.setAttribute(name, value === true ? '' : value);
  }
  made.append(...children);
  return made;
}

// The track is filled from 0 to the value.
function fill(fader, zero = 0) {
  const share = v => (v - fader.min) / (fader.max - fader.min) * 100;
  // The thumb stays within the track
  const thumb = v => `calc(${v}% + ${(0.5 - v / 100) * 14}px)`;
  const value = share(Number(fader.value)), rest = share(zero);
  fader.style.setProperty('--from', thumb(Math.min(value, rest)));
  fader.style.setProperty('--to', thumb(Math.max(value, rest)));
}

class StopsRow {
  // edit(gesture, change) changes the look; seal() ends a gesture.
  constructor(app, row, {isPlain = false, read, write} = {}) {
    Object.assign(this, {app, row});
    const {name, title} = row;
    this.read = read || (() => app.look.stops(name));
    this.write = write || ((look, stops) => look.setStops(name, stops));
    this.fader = element('input', {
      type: 'range', class: 'fader', min: -faderStops, max: faderStops, step: 0.05,
      'aria-label': title + ', stops',
      oninput: () => this.move(Number(this.fader.value), 'fader'),
      onchange: () => app.seal(),
      ondblclick: () => this.move(0, ''),
      onkeydown: e => this.key(e),
    });
    this.value = element('input', {
      class: 'value', inputmode: 'decimal', autocomplete: 'off', spellcheck: 'false',
      'aria-label': title + ', stops, or 2x',
      onfocus: () => this.value.select(),
      onchange: () => this.typed(),
      onkeydown: e => this.valueKey(e),
    });
    this.box = element('div', {class: 'row', role: 'group', 'aria-label': title});
    const label = element('span', {class: 'name', title: row.note || null}, title);
    if (row.hint) label.append(element('small', {}, row.hint));
    if (isPlain) {
      this.box.classList.add('isPlain');
      this.resetButton = element('button', {
        class: 'switch', 'aria-label': 'Reset ' + title, title: 'Reset', onclick: () => this.move(0, ''),
      }, '↺');
      this.box.append(label, this.value, this.resetButton, this.fader);
      return;
    }
    if (row.isMaster) this.box.classList.add('isMaster');
    this.box.dataset.row = name;
    this.thumb = element('canvas', {class: 'thumb', width: 120, height: 76, 'aria-hidden': 'true'});
    const toggle = kind => element('button', {
      class: 'switch ' + kind, 'aria-pressed': 'false', 'aria-label': `${kind === 'mute' ? 'Mute' : 'Solo'} ${title}`,
      title: kind === 'mute' ? 'Mute (M)' : 'Solo (S); Alt-click: alone',
      onclick: e => this.toggle(kind, e.altKey || e.shiftKey),
    }, kind === 'mute' ? 'M' : 'S');
    this.mute = toggle('mute');
    this.solo = toggle('solo');
    this.swatch = element('i');
    this.color = element('button', {
      class: 'switch swatch', 'aria-expanded': 'false', 'aria-label': 'Color of ' + title,
      title: 'Tint and temperature',
      onclick: () => this.toggleDrawer(),
    }, this.swatch);
    this.box.append(this.thumb, label, this.value, this.mute, this.solo, this.color, this.fader);
    this.box.addEventListener('keydown', e => this.rowKey(e));
  }

  get name() { return this.row.name; }

  move(stops, gesture) {
    this.app.edit(gesture && `${gesture} ${this.name}`, look => this.write(look, stops));
  }

  typed() {
    const stops = stopsOfText(this.value.value);
    if (stops !== null) this.move(stops, '');
    this.show();
  }

  key(e) {
    const fine = {ArrowUp: 0.01, ArrowRight: 0.01, ArrowDown: -0.01, ArrowLeft: -0.01};
    const step = {PageUp: 1, PageDown: -1}[e.key] || (e.shiftKey && fine[e.key]);
    if (!step) return;
    e.preventDefault();
    this.move(this.read() + step, 'fader');
  }

  valueKey(e) {
    const step = {ArrowUp: 0.1, ArrowDown: -0.1}[e.key];
    if (e.key === 'Enter') this.typed();
    if (e.key === 'Escape') this.show();
    if (!step) return;
    e.preventDefault();
    this.move(this.read() + step, 'value');
    this.show(true);
  }

  rowKey(e) {
    if (e.ctrlKey || e.metaKey || e.altKey || e.target.classList.contains('value')) return;
    const key = e.key.toLowerCase();
    if (key === 'm') this.toggle('mute');
    else if (key === 's') this.toggle('solo', e.shiftKey);
    else if (key === '0') this.app.edit('', look => look.resetRow(this.name));
    else return;
    e.preventDefault();
    e.stopPropagation();
  }

  toggle(kind, isAlone = false) {
    this.app.edit('', look => {
      if (isAlone) look.soloAlone(this.name);
      else look.set(kind, this.name, !look.isOn(kind, this.name));
    });
  }

  toggleDrawer() {
    if (this.drawer) {
      this.drawer.remove();
      this.drawer = null;
    } else {
      this.makeDrawer();
      this.box.append(this.drawer);
      this.show();
    }
    this.color.setAttribute('aria-expanded', this.drawer !== null);
  }

  makeDrawer() {
    const {app, name} = this, title = this.row.title, id = 'drawer' + StopsRow.drawers++;
    const edit = (gesture, change) => app.edit(gesture && `${gesture} ${name}`, change);
    this.kelvin = element('input', {
      type: 'range', class: 'fader kelvin', id: id + 'k', min: kelvinRange[0], max: kelvinRange[1], step: 50,
      'aria-label': title + ', color temperature in kelvin',
      oninput: () => edit('kelvin', look => look.setKelvin(name, Number(this.kelvin.value))),
      onchange: () => app.seal(),
      ondblclick: () => edit('', look => look.setKelvin(name, null)),
    });
    this.kelvinValue = element('input', {
      class: 'value', inputmode: 'numeric', placeholder: '–', 'aria-label': title + ', kelvin',
      onfocus: () => this.kelvinValue.select(),
      onchange: () => {
        const kelvin = parseFloat(this.kelvinValue.value);
        edit('', look => look.setKelvin(name, Number.isFinite(kelvin) ? kelvin : null));
        this.show();
      },
    });
    this.tint = element('input', {
      type: 'color', id: id + 't', 'aria-label': title + ', tint',
      oninput: () => edit('tint', look => look.setTint(name, tintOfHex(this.tint.value))),
      onchange: () => app.seal(),
    });
    const none = element('button', {
      'aria-label': 'No color for ' + title,
      onclick: () => edit('', look => { look.setTint(name, [1, 1, 1]); look.setKelvin(name, null); }),
    }, 'None');
    this.drawer = element('div', {class: 'drawer'},
      element('label', {for: id + 'k'}, 'Warmth'), this.kelvin, this.kelvinValue,
      element('label', {for: id + 't'}, 'Tint'), this.tint, none);
  }

  show(isTyping = false) {
    const look = this.app.look, stops = this.read();
    this.fader.value = Math.max(-faderStops, Math.min(faderStops, stops));
    this.fader.setAttribute('aria-valuetext', Number.isFinite(stops) ? signed(stops) + ' stops' : 'no light');
    fill(this.fader);
    if (document.activeElement !== this.value || isTyping || !this.value.matches(':focus'))
      this.value.value = stops === 0 ? '0.00' : Number.isFinite(stops) ? signed(stops) : '0x';
    this.box.classList.toggle('isChanged', stops !== 0);
    if (this.resetButton) this.resetButton.disabled = stops === 0;
    if (!this.mute) return;
    const isMuted = look.isOn('mute', this.name), isSoloed = look.isOn('solo', this.name);
    this.mute.setAttribute('aria-pressed', isMuted);
    this.solo.setAttribute('aria-pressed', isSoloed);
    this.box.classList.toggle('isSilent', isMuted || look.isSoloing && !isSoloed);
    const kelvin = look.kelvin(this.name), tint = look.tint(this.name);
    const warmth = kelvin === null ? [1, 1, 1] : kelvinTint(kelvin, [1, 0, 0, 0, 1, 0, 0, 0, 1]);
    const both = tint.map((v, c) => v * warmth[c]);
    this.swatch.style.background = hexOfTint(both);
    if (!this.drawer) return;
    this.kelvin.value = kelvin === null ? 6500 : kelvin;
    if (document.activeElement !== this.kelvinValue) this.kelvinValue.value = kelvin === null ? '' : kelvin;
    this.tint.value = hexOfTint(tint);
  }
}
StopsRow.drawers = 0;

// A tint has no brightness of its own: its largest channel is 1.
function tintOfHex(hex) {
  const rgb = [1, 3, 5].map(i => Display.linear(parseInt(hex.slice(i, i + 2), 16) / 255));
  const largest = Math.max(...rgb);
  return largest > 0 ? rgb.map(v => v / largest) : [1, 1, 1];
}

function hexOfTint(rgb) {
  const largest = Math.max(...rgb, 1e-9);
  return '#' + rgb.map(v => Display.byte(Display.curve(v / largest)).toString(16).padStart(2, '0')).join('');
}

// What of a shadow is given back: 0 as rendered, 100 % none.
class ShareRow {
  constructor(app, kind, row) {
    Object.assign(this, {app, kind, row});
    const {name, title} = row;
    this.fader = element('input', {
      type: 'range', class: 'fader', min: 0, max: 100, step: 1, 'aria-label': `Lift the shadow of ${title}, percent`,
      oninput: () => this.move(Number(this.fader.value) / 100, 'share'),
      onchange: () => app.seal(),
      ondblclick: () => this.move(0, ''),
    });
    this.value = element('input', {
      class: 'value', inputmode: 'decimal', 'aria-label': `Lift the shadow of ${title}, percent`,
      onfocus: () => this.value.select(),
      onchange: () => {
        const percent = parseFloat(this.value.value);
        if (Number.isFinite(percent)) this.move(percent / 100, '');
        this.show();
      },
    });
    this.thumb = element('canvas', {class: 'thumb', width: 120, height: 76, 'aria-hidden': 'true'});
    this.box = element('div', {class: 'row isShare', role: 'group', 'aria-label': 'Shadow of ' + title},
      this.thumb, element('span', {class: 'name'}, title), this.value, this.fader);
  }

  move(share, gesture) {
    this.app.edit(gesture && `${this.kind} ${this.row.name}`, look => look.setShare(this.kind, this.row.name, share));
  }

  show() {
    const share = this.app.look.share(this.kind, this.row.name);
    this.fader.value = 100 * share;
    fill(this.fader);
    if (document.activeElement !== this.value) this.value.value = Math.round(100 * share) + ' %';
    this.box.classList.toggle('isChanged', share !== 0);
  }
}

// Stops of each bounce of each light.
class Grid {
  constructor(app, {groups, columns}) {
    this.app = app;
    this.cells = [];
    const cell = name => {
      const input = element('input', {
        inputmode: 'decimal', 'aria-label': name.replace(':', ', ') + ', stops', autocomplete: 'off',
        onfocus: () => input.select(),
        onchange: () => this.typed(input, name),
        onkeydown: e => this.key(e, input, name),
      });
      this.cells.push({input, name});
      return element('td', {}, input);
    };
    const heading = text => element('th', {scope: 'col'}, text);
    const head = element('tr', {}, element('td'), ...['all', ...columns].map(heading));
    const row = (title, names) => element('tr', {}, element('th', {scope: 'row', title}, title), ...names.map(cell));
    const body = element('tbody', {}, row('all light', ['all', ...columns]),
      ...groups.map(g => row(g, [g, ...columns.map(c => g + ':' + c)])));
    this.box = element('div', {class: 'gridwrap'}, element('table', {class: 'grid'}, element('thead', {}, head), body));
  }

  typed(input, name) {
    const stops = stopsOfText(input.value || '0');
    if (stops !== null) this.app.edit('', look => look.setStops(name, stops));
    this.show();
  }

  key(e, input, name) {
    const step = {ArrowUp: 0.25, ArrowDown: -0.25}[e.key];
    if (e.key === 'Enter') this.typed(input, name);
    if (!step) return;
    e.preventDefault();
    const stops = this.app.look.stops(name);
    this.app.edit('cell ' + name, look => look.setStops(name, (Number.isFinite(stops) ? stops : 0) + step));
  }

  show() {
    const {look} = this.app;
    for (const {input, name} of this.cells) {
      const stops = look.stops(name), isMuted = look.isOn('mute', name);
      input.value = isMuted ? 'mute' : stops === 0 ? '0' : Number.isFinite(stops) ? signed(stops) : '0x';
      input.style.setProperty('--tone', isMuted ? 'var(--mute)' : stops > 0 ? 'var(--accent)' : '#4f86c6');
      input.style.setProperty('--strength', (isMuted ? 60 : Math.min(70, Math.abs(stops) * 22)) + '%');
    }
  }
}
