// SPDX-License-Identifier: BSD-3-Clause
// The time bar of a replay: marks of steps and events, play, step, rate, seek, loop.
import {send} from './commands.js';
import {$, make, setData, setText} from './dom.js';
import {duration} from './format.js';
import {indexAt, timeInRun} from './samples.js';
import {toneOf} from './tones.js';
import {severityOf, word} from './words.js';

const rates = [0.1, 0.25, 0.5, 1, 2, 5, 10, 20, 50];

/// 1:04.2: tenths matter when one steps.
function position(seconds) {
  const minutes = Math.floor(seconds / 60);
  return `${minutes}:${(seconds - 60 * minutes).toFixed(1).padStart(4, '0')}`;
}

export class ReplayBar {
  constructor(board, connection) {
    Object.assign(this, {board, connection});
    for (const rate of rates)
      $('replay-rate').append(make('option', {value: rate}, `\u00d7${rate}`));
    $('replay-play').addEventListener('click', () => this.toggle());
    $('replay-forward').addEventListener('click', () => this.forward());
    $('replay-back').addEventListener('click', () => this.back());
    $('replay-loop').addEventListener('click', () => this.toggleLoop());
    $('replay-rate').addEventListener('change', () => this.request('rate', {
      factor: Number($('replay-rate').value)
    }));
    const slider = $('replay-slider');
    slider.addEventListener('input', () => this.drag(Number(slider.value)));
    slider.addEventListener('change', () => {
      this.dragging = false;
      this.seek(Number(slider.value));
    });
    $('replay-track').addEventListener('pointermove', (event) => this.hint(event));
    $('replay-track').addEventListener('pointerleave', () => {
      $('replay-hint').style.display = 'none';
    });
    board.view(['replay', 'hello'], () => this.draw());
    board.view(['run', 'replay', 'hello'], () => this.drawMarks());
  }

  get state() {
    return this.board.get('replay') ||
        {position_s: 0, length_s: 0, rate: 1, paused: true, loop: false};
  }
  get length() {
    return this.state.length_s || (this.board.get('run') || {}).length_s || 1;
  }

  async request(name, parameters = {}) {
    const answer = await this.connection.command(name, parameters);
    if (!answer.accepted) send(this.connection, name, parameters);
  }

  seek(seconds) {
    this.request('seek', {position_s: Math.min(this.length, Math.max(0, seconds))});
  }
  toggle() {
    this.request(this.state.paused ? 'play' : 'pause');
  }
  toggleLoop() {
    this.request('loop', {on: !this.state.loop});
  }
  forward() {
    this.request('step', {channel: 'POSE_ESTIMATE'});
  }
  skip(seconds) {
    this.seek(this.state.position_s + seconds);
  }

  /// To the estimate before the one that is shown.
  back() {
    const samples = this.board.list('samples');
    const now = timeInRun(this.board);
    const before = samples[indexAt(samples, now) - 1];
    this.skip(before ? before.time_s - now : -1);
  }

  faster(by) {
    const nearest = rates.reduce(
        (best, rate, index) =>
            (Math.abs(rate - this.state.rate) < Math.abs(rates[best] - this.state.rate) ? index :
                                                                                          best),
        0);
    this.request('rate', {factor: rates[Math.min(rates.length - 1, Math.max(0, nearest + by))]});
  }

  /// The position dragged to is shown at once, and requested at most ten times a second.
  drag(seconds) {
    this.dragging = true;
    setText($('replay-time'), `${position(seconds)} / ${position(this.length)}`);
    if (performance.now() - (this.draggedAt || 0) < 100) return;
    this.draggedAt = performance.now();
    this.connection.command('seek', {position_s: seconds});
  }

  draw() {
    const replay = this.state;
    const slider = $('replay-slider');
    setData($('replay-bar'), 'paused', replay.paused);
    setText($('replay-play'), replay.paused ? '\u25b6' : '\u275a\u275a');
    $('replay-play').setAttribute('aria-label', replay.paused ? 'Play' : 'Pause');
    $('replay-loop').setAttribute('aria-pressed', Boolean(replay.loop));
    if (document.activeElement !== $('replay-rate'))
      $('replay-rate').value = rates.includes(replay.rate) ? replay.rate : 1;
    if (this.dragging) return;
    slider.max = this.length;
    slider.value = replay.position_s;
    slider.setAttribute('aria-valuetext', duration(replay.position_s));
    setText($('replay-time'), `${position(replay.position_s)} / ${position(this.length)}`);
  }

  drawMarks() {
    const marks = (this.board.get('run') || {}).marks || [];
    const key = JSON.stringify([marks, this.length]);
    if (key === this.marksKey) return;
    this.marksKey = key;
    this.marks = marks;
    const place = (mark) => `${100 * mark.time_s / this.length}%`;
    $('replay-marks')
        .replaceChildren(
            ...marks.filter((mark) => mark.kind === 'step' || severityOf(mark) >= 1).map((mark) => {
              const isStep = mark.kind === 'step';
              const tone = isStep ?
                  toneOf(word('step', mark.state ?? 0)) :
                  toneOf(['info', 'notice', 'warning', 'error', 'fatal'][severityOf(mark)]);
              const element = make(
                  'i', {class: mark.kind, 'data-tone': tone, title: mark.text},
                  isStep ? mark.text : '');
              element.style.left = place(mark);
              if (isStep)
                element.style.width =
                    `${100 * ((mark.end_s || this.length) - mark.time_s) / this.length}%`;
              return element;
            }));
  }

  /// What is at the pointer: the time, the step, an event near.
  hint(event) {
    const box = $('replay-marks').getBoundingClientRect();
    const share = Math.min(1, Math.max(0, (event.clientX - box.left) / box.width));
    const seconds = share * this.length;
    const near = 4 * this.length / box.width;
    const found = (this.marks || [])
                      .filter(
                          (mark) =>
                              (mark.kind === 'step' ?
                                   mark.time_s <= seconds && seconds < (mark.end_s || this.length) :
                                   Math.abs(mark.time_s - seconds) < near));
    setText(
        $('replay-hint'),
        [position(seconds), ...found.slice(0, 3).map((mark) => mark.text)].join('  '));
    Object.assign($('replay-hint').style, {display: 'block', left: `${8 + share * box.width}px`});
  }
}
