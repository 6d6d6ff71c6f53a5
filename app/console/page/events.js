// SPDX-License-Identifier: BSD-3-Clause
// Events, newest on top, filtered by severity and text.
import {$, keepList, make, setText} from './dom.js';
import {clock} from './format.js';
import {sign} from './signs.js';
import {toneOf} from './tones.js';
import {severityOf} from './words.js';

const words = ['info', 'notice', 'warning', 'error', 'fatal'];
const shownAtMost = 200;

function create(event) {
  const severity = words[severityOf(event)];
  const row = make('li', {
    'data-severity': severity,
    'data-code': event.code,
    'data-tone': toneOf(severity),
    title: `${severity}: ${event.code}`
  });
  const mark = sign(severity);
  mark.classList.add('tone');
  row.append(
      mark, make('span', {class: 'time number'}, clock(event.utime)),
      make(
          'span', {class: 'text'}, make('span', {class: 'node-name'}, `${event.node} `),
          event.text || event.code));
  return row;
}

export function startEvents(board) {
  const list = $('events');
  const keys = new WeakMap();  // the board hands out the same objects again
  let next = 0;
  const keyOf = (event) => keys.get(event) ?? (keys.set(event, ++next), next);
  const draw = () => {
    const least = Number($('events-severity').value);
    const text = $('events-text').value.toLowerCase();
    const all = board.list('events');
    const shown = [];
    for (let i = all.length - 1; i >= 0 && shown.length < shownAtMost; --i) {
      const event = all[i];
      if (severityOf(event) < least) continue;
      if (text && !`${event.node} ${event.code} ${event.text}`.toLowerCase().includes(text))
        continue;
      shown.push(event);
    }
    // Who has scrolled down reads: do not push the text away.
    const below = list.scrollTop > 4 ? list.scrollHeight - list.scrollTop : 0;
    keepList(list, shown, keyOf, create, () => {});
    if (below) list.scrollTop = list.scrollHeight - below;
    const grave = all.filter((event) => severityOf(event) >= 2).length;
    setText(
        $('events-count'),
        grave ? `${grave} warnings or worse` :
            all.length ? `${all.length}` :
                         'none');
  };
  board.view(['events'], draw);
  $('events-severity').addEventListener('change', draw);
  $('events-text').addEventListener('input', draw);
}
