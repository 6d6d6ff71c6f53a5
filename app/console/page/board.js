// SPDX-License-Identifier: BSD-3-Clause
// The board: the latest content from the server, section by section, and the views that draw it.

// Lists that grow are cut at their old end, so that a page left open for a week stays small.
const kept = {
  samples: 50000,
  samples2: 50000,
  events: 1000,
  events2: 1000,
  returns: 600000
};

export class Board {
  constructor() {
    this.sections = {};
    this.revision = 0;
    this.utime = 0;
    this.heardAt = 0;
    this.changed = new Set();
    this.views = [];
    this.drawing = false;
    this.paced = true;
  }

  get(name) {
    return this.sections[name];
  }
  list(name) {
    return this.sections[name] || [];
  }

  /// Time in the cell now, in microseconds; stands still in a paused replay and when nothing comes.
  now() {
    const since = this.paced ? Math.min(performance.now() - this.heardAt, 2000) : 0;
    return this.utime + 1000 * since;
  }

  clear() {
    for (const name of Object.keys(this.sections)) this.changed.add(name);
    this.sections = {};
    this.revision = 0;
    this.requestDraw();
  }

  /// Takes in one `board` message.
  take(message) {
    for (const name of message.reset || []) this.put(name, []);
    for (const [name, value] of Object.entries(message.set || {})) this.set(name, value);
    for (const [name, values] of Object.entries(message.add || {})) this.append(name, values);
    this.revision = message.revision ?? this.revision;
    if (message.utime) this.utime = message.utime;
    this.heardAt = performance.now();
    this.requestDraw();
  }

  put(name, value) {
    this.sections[name] = value;
    this.changed.add(name);
  }

  set(name, value) {
    // The returns of a scan come with it or after it; another scan begins anew.
    if (name === 'scan' && value) {
      if (value.returns)
        this.put('returns', value.returns);
      else if (!this.sections.scan || this.sections.scan.scan_id !== value.scan_id)
        this.put('returns', []);
    }
    this.put(name, value);
  }

  append(name, values) {
    const list = this.sections[name] || [];
    for (const value of values) list.push(value);
    const most = kept[name] || 1000;
    // A tenth at a time: cutting on every message would cost more than what it saves.
    if (list.length > most) list.splice(0, list.length - Math.floor(0.9 * most / 3) * 3);
    this.put(name, list);
  }

  /// `draw(board)` is called before the next picture whenever one of `names` has changed.
  view(names, draw) {
    this.views.push({names, draw});
  }

  touch(name) {
    this.changed.add(name);
    this.requestDraw();
  }

  requestDraw() {
    if (this.drawing) return;
    this.drawing = true;
    requestAnimationFrame(() => this.draw());
  }

  draw() {
    this.drawing = false;
    const changed = this.changed;
    this.changed = new Set();
    for (const {names, draw} of this.views) {
      if (!names.some((name) => changed.has(name))) continue;
      try {
        draw(this, changed);
      } catch (error) {
        console.error(error);  // one part that fails must not take the others with it
      }
    }
  }
}
