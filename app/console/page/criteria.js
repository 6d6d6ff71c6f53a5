// SPDX-License-Identifier: BSD-3-Clause
// Criteria and watched limits: value against what is allowed, with its uncertainty and margin.
import {$, keepList, make, setData, setText} from './dom.js';
import {fixed, known, significant, withUnit} from './format.js';
import {setSign} from './signs.js';
import {toneOf} from './tones.js';
import {spaced, word} from './words.js';

/// The range of the measurement that the bar shows, and the allowed part of it.
function scaleOf({lower_limit: lower, upper_limit: upper, value}) {
  const hasLower = known(lower), hasUpper = known(upper);
  if (!hasLower && !hasUpper) return null;
  let from, to;
  if (hasLower && hasUpper) {
    const room = 0.35 * (upper - lower) || 1;
    [from, to] = [lower - room, upper + room];
  } else if (hasUpper) {
    [from, to] = upper > 0 ? [0, 1.4 * upper] : [2 * upper - 1, 1];
  } else {
    [from, to] = lower > 0 ? [0, 1.6 * lower] : [lower - 1, -lower + 1];
  }
  if (known(value)) {
    const room = 0.05 * (to - from);
    if (value > to) to = value + room;
    if (value < from) from = value - room;
  }
  return {from, to, lower: hasLower ? lower : from, upper: hasUpper ? upper : to};
}

export function marginOf({lower_limit: lower, upper_limit: upper, value}) {
  if (!known(value)) return NaN;
  return Math.min(known(lower) ? value - lower : Infinity, known(upper) ? upper - value : Infinity);
}

function limitText({lower_limit: lower, upper_limit: upper, unit}) {
  if (known(lower) && known(upper))
    return `${significant(lower)} \u2026 ${withUnit(significant(upper), unit)}`;
  if (known(upper)) return `\u2264 ${withUnit(significant(upper), unit)}`;
  return known(lower) ? `\u2265 ${withUnit(significant(lower), unit)}` : 'no limit';
}

function create() {
  const bar = make(
      'div', {class: 'bar', 'aria-hidden': 'true'},
      ...['allowed', 'reached', 'whisker', 'mark'].map((name) => make('i', {class: name})));
  return make(
      'div', {class: 'criterion'}, make('span', {class: 'sign'}), make('span', {class: 'name'}),
      make('span', {class: 'value number'}),
      make(
          'span', {class: 'against number'}, bar, make('span', {class: 'limit'}),
          make('span', {class: 'margin'})),
      make('span', {class: 'reason'}));
}

function place(part, scale, from, to) {
  const share = (value) =>
      100 * Math.min(1, Math.max(0, (value - scale.from) / (scale.to - scale.from)));
  part.style.left = `${share(from)}%`;
  part.style.width = `${Math.max(0, share(to) - share(from))}%`;
}

function update(row, criterion) {
  const result = word('criterion', criterion.result);
  const [mark, name, value, against, reason] = row.children;
  const [bar, limit, marginPlace] = against.children;
  setData(row, 'name', criterion.name);
  setData(row, 'result', result);
  setData(row, 'tone', toneOf(result));
  setSign(mark, result);
  mark.classList.add('tone');
  setText(name, criterion.name);
  row.title = `${criterion.name}: ${spaced(criterion.measurement)}${
      criterion.phase ?
          `, phase ${criterion.phase}` :
          ''}, ${criterion.samples || 0} samples${criterion.reason ? `: ${criterion.reason}` : ''}`;
  setText(value, withUnit(significant(criterion.value), criterion.unit));
  const margin = marginOf(criterion);
  setText(limit, limitText(criterion));
  setText(
      marginPlace, Number.isFinite(margin) ? `${margin > 0 ? '+' : ''}${significant(margin)}` : '');
  setText(reason, result === 'failed' || result === 'inconclusive' ? criterion.reason || '' : '');
  reason.hidden = !reason.textContent;
  const scale = scaleOf(criterion);
  bar.hidden = !scale;
  if (!scale) return;
  const [allowed, reached, whisker, here] = bar.children;
  place(allowed, scale, scale.lower, scale.upper);
  const has = known(criterion.value);
  for (const part of [reached, whisker, here]) part.hidden = !has;
  if (!has) return;
  place(reached, scale, Math.min(scale.from, criterion.value), criterion.value);
  const spread = criterion.uncertainty || 0;
  place(whisker, scale, criterion.value - 2 * spread, criterion.value + 2 * spread);
  here.style.left = `${100 * (criterion.value - scale.from) / (scale.to - scale.from)}%`;
}

export function startCriteria(board) {
  const keyOf = (criterion, index) => `${index} ${criterion.name}`;
  board.view(['procedure'], () => {
    const {criteria = [], limits = []} = board.get('procedure') || {};
    $('criteria-panel').hidden = !board.get('procedure');
    $('criteria-none').hidden = criteria.length > 0;
    $('limits-panel').hidden = !limits.length;
    keepList($('criteria'), criteria, keyOf, create, update);
    keepList($('limits'), limits, keyOf, create, update);
    const count = (result) =>
        criteria.filter((criterion) => word('criterion', criterion.result) === result).length;
    const failed = count('failed'), open = count('inconclusive');
    setText(
        $('criteria-count'),
        !criteria.length ?
            '' :
            `${fixed(count('passed'), 0)} of ${criteria.length} passed${
                failed ? `, ${failed} failed` : ''}${open ? `, ${open} inconclusive` : ''}`);
  });
}
