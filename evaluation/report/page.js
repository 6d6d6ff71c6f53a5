// SPDX-License-Identifier: BSD-3-Clause
'use strict';
// Reading by hover, zoom by dragging (double click: back), legends that switch curves off.
(() => {
  const canvas = 1000;
  const figures = [...document.querySelectorAll('figure.chart')].map((figure) => {
    const range = (name) => figure.dataset[name].split(' ').map(Number);
    const log = 'log' in figure.dataset;
    const chart = {
      figure, log, area: figure.querySelector('.area'), svg: figure.querySelector('svg'), x: range('xrange'), y: range('yrange'),
      group: figure.dataset.group, keys: [...figure.querySelectorAll('.key')], cross: document.createElement('i'),
    };
    chart.cross.className = 'cross';
    chart.cross.hidden = true;
    chart.area.append(chart.cross);
    chart.view = [...chart.x];
    figure.classList.add('live');
    return chart;
  });
  const mates = (chart) => (chart.group ? figures.filter((f) => f.group === chart.group) : [chart]);
  const number = (v) => (v === 0 ? '0' : Math.abs(v) >= 1e6 || Math.abs(v) < 1e-4 ? v.toExponential(3) : String(Number(v.toPrecision(5))));

  // The value at a height in the drawing, and back.
  const value = (chart, v) => {
    const [low, high] = chart.y;
    return chart.log ? low * (high / low) ** (1 - v / canvas) : low + (high - low) * (1 - v / canvas);
  };
  const height = (chart, y) => {
    const [low, high] = chart.y;
    return canvas * (1 - (chart.log ? Math.log(y / low) / Math.log(high / low) : (y - low) / (high - low)));
  };

  // Points of a curve as they were drawn, in the units of its axes.
  const points = (chart, path) => path.points ??= [...(path.getAttribute('d') ?? '').matchAll(/([MLHV])(-?[\d.]+)(?: (-?[\d.]+))?/g)].reduce((list, [, command, a, b]) => {
    const last = list[list.length - 1];
    const u = command === 'V' ? last.u : Number(a);
    const v = command === 'V' ? Number(a) : command === 'H' ? last.v : Number(b);
    list.push({ u, v, x: chart.x[0] + (chart.x[1] - chart.x[0]) * u / canvas, y: value(chart, v) });
    return list;
  }, []);

  const place = (element, from, to, view) => {
    const part = (v) => (v - view[0]) / (view[1] - view[0]);
    const a = Math.max(0, part(from));
    const b = Math.min(1, part(to));
    element.hidden = a > b;
    element.style.left = `${100 * a}%`;
    if (to !== from) {
      element.style.width = `${100 * Math.max(0, b - a)}%`;
      element.classList.toggle('small', b - a < 0.07);
    }
  };

  const tick = (chart, kind, side, part, label) => {
    const mark = document.createElement('i');
    mark.className = kind;
    mark.style[side] = `${100 * part}%`;
    mark.appendChild(document.createElement('b')).textContent = label;
    chart.area.insertBefore(mark, chart.svg);
  };

  // As ticks() of axis.cpp.
  const ticks = (chart, kind, side, [low, high], count) => {
    for (const old of chart.area.querySelectorAll(`.${kind}`)) old.remove();
    if (kind === 'yt' && chart.log) {
      for (let p = Math.ceil(Math.log10(low) - 1e-9); p <= Math.log10(high) + 1e-9; ++p) {
        tick(chart, kind, side, (p - Math.log10(low)) / Math.log10(high / low), number(10 ** p));
      }
      return;
    }
    const round = (least) => {
      const power = 10 ** Math.floor(Math.log10(least));
      return [1, 2, 5, 10].map((f) => f * power).find((s) => s >= least * (1 - 1e-9));
    };
    const marks = (step) => [Math.ceil(low / step - 1e-9), Math.floor(high / step + 1e-9)];
    let step = round((high - low) / count);
    let [first, last] = marks(step);
    if (last <= first) [first, last] = marks((step = round((high - low) / count / 2)));
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    for (let i = first; i <= last; ++i) {
      tick(chart, kind, side, (i * step - low) / (high - low), (i * step).toFixed(digits));
    }
  };

  // The visible points determine the scale; the whole is shown as it was drawn.
  const scale = (chart, view) => {
    if (view[0] === chart.x[0] && view[1] === chart.x[1]) return [0, canvas];
    let top = Infinity;
    let bottom = -Infinity;
    for (const path of chart.svg.querySelectorAll('path')) {
      if (path.style.display === 'none') continue;
      for (const p of points(chart, path)) {
        if (p.x < view[0] || p.x > view[1] || p.v < -canvas || p.v > 2 * canvas) continue;
        top = Math.min(top, p.v);
        bottom = Math.max(bottom, p.v);
      }
    }
    if (!(top <= bottom)) return [0, canvas];
    const air = Math.max(0.06 * (bottom - top), 1);
    return [top - air, bottom + air];
  };

  const show = (chart, view) => {
    chart.view = view;
    const [top, bottom] = scale(chart, view);
    const across = (x) => canvas * ((x - chart.x[0]) / (chart.x[1] - chart.x[0]));  // the whole: exactly the canvas
    const left = across(view[0]);
    chart.svg.setAttribute('viewBox', `${left} ${top} ${across(view[1]) - left} ${bottom - top}`);
    for (const element of chart.area.querySelectorAll('[data-x]')) {
      const [from, to] = element.dataset.x.split(' ').map(Number);
      place(element, from, to ?? from, view);
    }
    const y = [value(chart, bottom), value(chart, top)];
    for (const level of chart.area.querySelectorAll('.level')) {
      const at = (bottom - height(chart, Number(level.dataset.y))) / (bottom - top);
      level.hidden = at < 0 || at > 1;
      level.style.bottom = `${100 * at}%`;
    }
    if (!('fixedTicks' in chart.figure.dataset)) ticks(chart, 'xt', 'left', view, 8);
    ticks(chart, 'yt', 'bottom', y, Math.max(2, chart.area.clientHeight / 36));
  };

  const tip = document.body.appendChild(document.createElement('div'));
  tip.id = 'tip';
  tip.hidden = true;
  const hide = (chart) => {
    tip.hidden = true;
    for (const mate of mates(chart)) mate.cross.hidden = true;
  };
  const at = (chart, event) => {
    const box = chart.area.getBoundingClientRect();
    const part = Math.min(1, Math.max(0, (event.clientX - box.left) / box.width));
    return chart.view[0] + part * (chart.view[1] - chart.view[0]);
  };

  const hover = (chart, event) => {
    const x = at(chart, event);
    for (const mate of mates(chart)) {
      mate.cross.hidden = false;
      mate.cross.style.left = `${100 * (x - mate.view[0]) / (mate.view[1] - mate.view[0])}%`;
    }
    tip.replaceChildren();
    const line = (text) => tip.appendChild(document.createElement('div')).textContent = text;
    line(chart.figure.dataset.xunit ? `${number(x)} ${chart.figure.dataset.xunit}` : '');
    for (const span of chart.area.querySelectorAll('.span')) {
      const [from, to] = span.dataset.x.split(' ').map(Number);
      if (from <= x && x <= to) line(span.title);
    }
    const near = 0.02 * (chart.view[1] - chart.view[0]);
    for (const key of chart.keys) {
      const path = chart.svg.querySelector(`path[data-curve="${key.dataset.curve}"]`);
      if (key.classList.contains('off') || path.matches('.band, .range')) continue;
      const candidates = points(chart, path);
      const best = path.matches('.bars')
        ? candidates.filter((p) => p.x <= x && p.v < canvas).pop()
        : candidates.reduce((b, p) => (!b || Math.abs(p.x - x) < Math.abs(b.x - x) ? p : b), null);
      if (best && (path.matches('.bars') || Math.abs(best.x - x) < near)) line(`${key.textContent}: ${number(best.y)} ${chart.figure.dataset.unit ?? ''}`);
    }
    for (const mark of chart.area.querySelectorAll('.mark')) {
      if (Math.abs(Number(mark.dataset.x) - x) < near / 4) line(mark.title);
    }
    tip.hidden = false;
    tip.style.left = `${Math.max(4, Math.min(event.clientX + 14, innerWidth - tip.offsetWidth - 8))}px`;
    tip.style.top = `${Math.max(4, Math.min(event.clientY + 14, innerHeight - tip.offsetHeight - 8))}px`;
  };

  for (const chart of figures) {
    let start = null;
    const pick = document.createElement('i');
    pick.className = 'pick';
    chart.area.addEventListener('pointerdown', (event) => {
      if (event.pointerType === 'touch' || event.button !== 0) return;
      start = at(chart, event);
      chart.area.setPointerCapture(event.pointerId);
      event.preventDefault();
    });
    chart.area.addEventListener('pointermove', (event) => {
      hover(chart, event);
      if (start === null) return;
      if (!pick.isConnected) chart.area.append(pick);
      const now = at(chart, event);
      place(pick, Math.min(start, now), Math.max(start, now), chart.view);
    });
    chart.area.addEventListener('pointerup', (event) => {
      pick.remove();
      const from = start;
      start = null;
      if (from === null) return;
      const view = [from, at(chart, event)].sort((a, b) => a - b);
      if (view[1] - view[0] < 0.01 * (chart.view[1] - chart.view[0])) return;
      for (const mate of mates(chart)) show(mate, [...view]);
    });
    chart.area.addEventListener('pointerleave', () => hide(chart));
    chart.area.addEventListener('dblclick', () => { for (const mate of mates(chart)) show(mate, [...mate.x]); });
    for (const key of chart.keys) {
      key.tabIndex = 0;
      key.setAttribute('role', 'button');
      const toggle = () => {
        const off = key.classList.toggle('off');
        key.setAttribute('aria-pressed', String(!off));
        for (const path of chart.svg.querySelectorAll(`path[data-curve="${key.dataset.curve}"]`)) path.style.display = off ? 'none' : '';
      };
      key.addEventListener('click', toggle);
      key.addEventListener('keydown', (event) => { if (event.key === 'Enter' || event.key === ' ') { event.preventDefault(); toggle(); } });
    }
  }
  document.body.dataset.charts = String(figures.length);
})();
