// SPDX-License-Identifier: BSD-3-Clause
// Estimate against truth, and errors with their three sigmas, over time.
import {$, keepList, make, setText} from './dom.js';
import {fixed} from './format.js';
import {axisErrorOf, poseOf, totals} from './plot_kinds.js';
import {indexAt, thinned, timeInRun} from './samples.js';
import {cssColour, onTheme} from './theme.js';

/* global Dygraph */
const spans = [[30, '30 s'], [120, '2 min'], [600, '10 min'], [0, 'all']];
const redrawEvery = 300;  // ms
const mostShown = 1500;   // samples of a run in a plot

// Its legend plug-in writes style attributes, which the page's security policy forbids; ours stands
// in the head.
Dygraph.PLUGINS = Dygraph.PLUGINS.filter((plugin) => plugin !== Dygraph.Plugins.Legend);

class Plots {
  constructor(board, seek) {
    this.board = board;
    this.seek = seek;
    this.span = 0;
    this.window = null;
    this.hovered = null;
    this.mode = 'pose';
    this.drawnAt = 0;
    this.cost = 0;  // ms
    this.timer = 0;
    this.graphs = [];
    for (const [seconds, title] of spans) {
      const button = make('button', {type: 'button', 'aria-pressed': seconds === this.span}, title);
      button.addEventListener('click', () => this.choose(seconds));
      button.dataset.span = seconds;
      $('plots-span').append(button);
    }
    const mode = make(
        'button', {
          type: 'button',
          id: 'plots-mode',
          title: 'Poses or errors of each axis (e)',
          'aria-pressed': 'false'
        },
        'errors x\u2026r');
    mode.addEventListener('click', () => this.switchMode());
    $('plots-span').prepend(mode);
    this.build();
    onTheme(() => this.build());
    new ResizeObserver(() => this.resize()).observe($('plots-grid'));
  }

  switchMode() {
    this.mode = this.mode === 'pose' ? 'error' : 'pose';
    $('plots-mode').setAttribute('aria-pressed', this.mode === 'error');
    this.build();
  }

  choose(seconds) {
    this.span = seconds;
    this.window = null;
    for (const button of $('plots-span').querySelectorAll('[data-span]'))
      button.setAttribute('aria-pressed', Number(button.dataset.span) === seconds);
    this.draw();
  }

  /// All graphs anew, in the order of the grid: x y z, position; w p r, attitude.
  build() {
    for (const {graph} of this.graphs) graph.destroy();
    const make6 = this.mode === 'pose' ? poseOf : axisErrorOf;
    const kinds =
        [make6(0), make6(1), make6(2), totals[0], make6(3), make6(4), make6(5), totals[1]];
    $('plots-grid').replaceChildren();
    this.graphs = kinds.map((kind, index) => this.add(kind, index));
    this.drawLegend();
    this.draw();
  }

  add(kind, index) {
    const value = make('span', {class: 'number'});
    const place = make('div', {class: 'graph'});
    $('plots-grid')
        .append(make(
            'div', {class: 'plot', 'data-plot': kind.title},
            make(
                'h3', {},
                make('span', {}, `${kind.title} `, make('span', {class: 'unit'}, kind.unit)),
                value),
            place));
    const [truth, first, second, band] =
        ['--truth', '--first', '--second', '--band'].map(cssColour);
    const series = kind.bars ?
        {
          [kind.labels[1]]:
              {color: band, strokeWidth: 0, drawPoints: false, highlightCircleSize: 0},
          error: {color: truth, strokeWidth: 1.4},
          second: {color: second, strokeWidth: 1.4}
        } :
        {
          truth: {color: truth, strokeWidth: 2, drawPoints: false},
          estimate: {color: first, strokeWidth: 1.6, drawPoints: true, pointSize: 1.3},
          second: {color: second, strokeWidth: 1.4}
        };
    const graph = new Dygraph(
        place, [[0, ...kind.labels.slice(1).map(() => (kind.bars ? [NaN, NaN, NaN] : NaN))]], {
          labels: kind.labels,
          series,
          customBars: kind.bars,
          fillAlpha: 0.22,
          connectSeparatedPoints: true,
          animatedZooms: false,
          axes: {
            x: {
              axisLabelFormatter: (seconds) =>
                  (seconds >= 600 ? `${fixed(seconds / 60, 0)} min` :
                                    `${fixed(seconds, seconds % 1 ? 1 : 0)} s`),
              pixelsPerLabel: 36,
              axisLabelWidth: 50,
              drawGrid: false,
              axisHeight: 14
            },
            y: {
              pixelsPerLabel: 20,
              axisLabelWidth: 42,
              axisLabelFormatter: (y) => String(Number(y.toPrecision(6))).replace('-', '\u2212')
            },
          },
          xAxisHeight: 15,
          gridLineColor: cssColour('--grid'),
          axisLineColor: cssColour('--edge'),
          highlightCircleSize: 3,
          rightGap: 4,
          underlayCallback: (canvas, area, of) => this.underlay(canvas, area, of),
          zoomCallback: (from, to) => this.zoomed(index, from, to),
          highlightCallback: (event, x) => this.hover(x),
          unhighlightCallback: () => this.hover(null),
          clickCallback: (event, x) => this.seek(x),
        });
    const now = make('i', {class: 'now'});
    now.hidden = true;
    place.append(now);
    return {kind, graph, value, now};
  }

  /// Where a replay stands: a line of its own, so that nothing else is drawn again.
  showNow() {
    const inReplay = Boolean(this.board.get('replay'));
    const time = timeInRun(this.board);
    for (const {graph, now} of this.graphs) {
      const x = graph.toDomXCoord(time);
      const area = graph.getArea();
      now.hidden = !inReplay || !(x >= area.x && x <= area.x + area.w);
      if (!now.hidden) now.style.transform = `translateX(${Math.round(x)}px)`;
    }
    if (inReplay && this.hovered === null) this.showAt(null);
  }

  /// Where steps begin.
  underlay(canvas, area, graph) {
    const run = this.board.get('run') || {};
    const line = (time, colour, width) => {
      const [x] = graph.toDomCoords(time, 0);
      if (!(x >= area.x && x <= area.x + area.w)) return;
      canvas.fillStyle = colour;
      canvas.fillRect(Math.round(x), area.y, width, area.h);
    };
    for (const step of (this.board.get('procedure') || {}).steps || []) {
      if (step.utime_start && run.utime_start)
        line((step.utime_start - run.utime_start) / 1e6, cssColour('--grid'), 1);
    }
  }

  zoomed(index, from, to) {
    const [low, high] = this.graphs[index].graph.xAxisExtremes();
    this.window = from <= low && to >= high ? null : [from, to];
    this.draw();
  }

  hover(time) {
    this.hovered = time;
    this.showAt(time);
  }

  /// The values of the newest sample at that time; null: now.
  showAt(time) {
    const samples = this.board.list('samples');
    const sample = samples[indexAt(samples, (time ?? timeInRun(this.board)) + 1e-6)];
    for (const {kind, value} of this.graphs)
      setText(value, sample ? fixed(kind.valueOf(sample), kind.decimals) : '');
  }

  requestDraw() {
    if (this.timer) return;
    const wait =
        Math.max(0, this.drawnAt + Math.max(redrawEvery, 5 * this.cost) - performance.now());
    this.timer = setTimeout(() => {
      this.timer = 0;
      this.draw();
    }, wait);
  }

  draw() {
    this.drawnAt = performance.now();
    const samples = this.board.list('samples'), samples2 = this.board.list('samples2');
    const ends = [...samples.slice(-1), ...samples2.slice(-1)].map((sample) => sample.time_s);
    const starts = [...samples.slice(0, 1), ...samples2.slice(0, 1)].map((sample) => sample.time_s);
    const end = Math.max(...ends, 1), start = Math.min(...starts, end - 1);
    // In a replay the samples are those of the whole run: then about where it stands.
    const last = this.board.get('replay') ?
        Math.min(end, Math.max(timeInRun(this.board) + this.span / 2, start + this.span)) :
        end;
    const window = this.window || (this.span ? [last - this.span, last] : [start, end]);
    const margin = 0.01 * (window[1] - window[0]);
    const inside = (list) => thinned(list, window[0] - margin, window[1] + margin, mostShown);
    const first = inside(samples), second = inside(samples2);
    for (const {kind, graph} of this.graphs) {
      const file = kind.rows(first, second);
      graph.updateOptions({
        file: file.length ?
            file :
            [[0, ...kind.labels.slice(1).map(() => (kind.bars ? [NaN, NaN, NaN] : NaN))]],
        dateWindow: [window[0] - margin, window[1] + margin],
        valueRange: kind.range(first, second),
        visibility: [true, true, samples2.length > 0],
      });
    }
    this.showAt(this.hovered);
    this.showNow();
    $('plots').dataset.samples = samples.length;
    this.cost = performance.now() - this.drawnAt;
  }

  drawLegend() {
    const two = this.board.list('samples2').length > 0;
    const items = [
      ['truth', '--truth', 'line'], ['estimate', '--first', 'line'], ['3\u03c3', '--band', 'band'],
      ['error', '--truth', 'line'], two && ['second run', '--second', 'line']
    ].filter(Boolean);
    keepList(
        $('plots-legend'),
        items.filter(([text]) => this.mode === 'pose' || !['truth', 'estimate'].includes(text)),
        (item) => item[0], ([text, colour, shape]) => {
          const swatch = make('i', {class: `swatch ${shape}`});
          swatch.style.color = `var(${colour})`;
          return make('li', {}, swatch, make('span', {}, text));
        }, () => {});
  }

  resize() {
    for (const {graph} of this.graphs) graph.resize();
  }
}

/// `seek(time_s)` is called when a plot is clicked. Returns {switchMode()}.
export function startPlots(board, seek) {
  const plots = new Plots(board, seek);
  board.view(['samples', 'samples2', 'run'], () => plots.requestDraw());
  board.view(['samples2'], () => plots.drawLegend());
  board.view(
      ['replay'], () => (plots.span && !plots.window ? plots.requestDraw() : plots.showNow()));
  return plots;
}
