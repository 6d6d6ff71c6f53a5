// SPDX-License-Identifier: BSD-3-Clause
// Shapes that show a state without its colour.

const line = (d, width = 2.4) =>
    ({d, fill: 'none', stroke: 'currentColor', 'stroke-width': width, 'stroke-linejoin': 'round'});
const solid = (d) => ({d, fill: 'currentColor'});
const ring = 'M12 2a10 10 0 1 0 0 20a10 10 0 1 0 0-20z';
const shapes = {
  safe: [line(ring), line('M7 12.500l3.400 3.400L17 9', 2.8)],
  moving: [solid('M5 3l16 9-16 9z')],
  held: [solid('M5 3h5v18H5zM14 3h5v18h-5z')],
  attention: [line('M12 2.500L22.500 21h-21z'), line('M12 9v6M12 16.600v2.200', 2.6)],
  stop: [line('M8 1.500h8l6.500 6.500v8L16 22.500H8L1.500 16V8z'), line('M8 8l8 8M16 8l-8 8', 2.8)],
  unknown: [
    {...line(ring, 2.2), 'stroke-dasharray': '4 3.400'},
    line('M9 9.500a3 3 0 1 1 4.300 2.700c-.9.500-1.300 1-1.300 2.200M12 16.400v2.200', 2.2)
  ],
  passed: [line('M3.500 12.500l6 6L20.500 6', 3.4)],
  failed: [line('M5 5l14 14M19 5L5 19', 3.4)],
  running: [solid('M6 3l15 9-15 9z')],
  pending: [line('M12 7a5 5 0 1 0 0 10a5 5 0 1 0 0-10z', 2)],
  skipped: [line('M4 5l7 7-7 7M13 5l7 7-7 7', 2.6)],
  aborted: [solid('M4 4h16v16H4z')],
  timeout: [line(ring, 2.2), line('M12 6v6l4 3', 2.4)],
  inconclusive: [line('M4 9c4-4 12 4 16 0M4 16c4-4 12 4 16 0', 2.8)],
};
// Other words that look like one of these.
const alias = {
  error: 'stop',
  fatal: 'stop',
  fault: 'stop',
  lost: 'stop',
  fail: 'failed',
  pass: 'passed',
  ok: 'safe',
  ready: 'safe',
  degraded: 'attention',
  warning: 'attention',
  ambiguous: 'attention',
  acquiring: 'running',
  idle: 'pending',
  none: 'pending',
  starting: 'timeout',
  stopped: 'aborted',
  notice: 'moving',
  info: 'pending',
  prompting: 'attention',
  closed_loop: 'moving',
  holding: 'held',
  not_ready: 'timeout',
  tracking: 'safe',
  offline: 'unknown',
  scanning: 'running',
  estop: 'stop',
  preparing: 'timeout',
  teardown: 'skipped',
  closed: 'safe',
  open: 'stop',
};

/// Path data of a sign, for the favicon too.
export const pathsOf = (name) => shapes[name] || shapes[alias[name]] || shapes.unknown;

/// A new SVG element that shows the sign.
export function sign(name) {
  const space = 'http://www.w3.org/2000/svg';
  const svg = document.createElementNS(space, 'svg');
  svg.setAttribute('viewBox', '0 0 24 24');
  svg.setAttribute('class', 'sign');
  svg.setAttribute('aria-hidden', 'true');
  for (const attributes of pathsOf(name)) {
    const path = document.createElementNS(space, 'path');
    for (const [key, value] of Object.entries(attributes)) path.setAttribute(key, value);
    svg.append(path);
  }
  return svg;
}

/// Puts the sign into an element that holds one, when it is another than before.
export function setSign(element, name) {
  if (element.dataset.sign === name && element.firstChild) return;
  element.dataset.sign = name;
  element.replaceChildren(sign(name));
}
