// SPDX-License-Identifier: BSD-3-Clause
// The words in the picture of the cell.
import {$, keepList, make, setText} from './dom.js';
import {metres, percent} from './format.js';

/// Which colour is what; only what is there.
export function drawLegend(board) {
  const frames = board.get('frames') || {};
  const bodies = (board.get('scene') || {}).bodies || [];
  const items = [
    ['replica (truth)', '#c9ae62', '', frames.replica],
    ['estimate', 'var(--first)', '', frames.ghost],
    ['estimate of the second run', 'var(--second)', '', frames.ghost2],
    ['hypotheses', 'var(--second)', '', board.get('estimate')?.hypotheses?.length],
    ['3\u03c3', 'var(--second)', 'ring', board.get('estimate')?.pose],
    ['returns', 'var(--returns)', 'dots', board.list('returns').length],
    ['scan windows', 'var(--yellow)', 'line', board.get('scan')?.windows?.length],
    ['field of view', 'var(--green)', 'line', frames.sensor],
    ['keep-out', 'var(--red)', '', bodies.some((body) => body.kind === 'keepout')],
  ].filter((item) => item[3]);
  keepList($('scene-legend'), items, (item) => item[0], ([text, colour, shape]) => {
    const swatch = make('i', {class: `swatch ${shape}`});
    swatch.style.color = colour;
    return make('li', {}, swatch, make('span', {}, text));
  }, () => {});
}

/// The scan, and how large the uncertainty is drawn.
export function drawNote(board, scene) {
  const parts = [];
  const scan = board.get('scan');
  if (scan && scan.scan_id !== undefined) {
    const count = Math.floor(board.list('returns').length / 3);
    parts.push(`scan ${scan.scan_id}${scan.progress < 1 ? `, ${percent(scan.progress)}` : ''}, ${
        count} returns`);
  }
  const testbed = board.get('testbed');
  if (testbed && testbed.clearance_m >= 0 && testbed.clearance_points)
    parts.push(`nearest ${metres(testbed.clearance_m, 2)}`);
  if (scene && scene.sensor.ellipsoid.visible && scene.sensor.magnified > 1)
    parts.push(`3\u03c3 drawn ${scene.sensor.magnified} times as large`);
  if (!board.get('frames')) parts.push('waiting for the arms');
  setText($('scene-note'), parts.join('\n'));
}
