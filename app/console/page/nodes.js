// SPDX-License-Identifier: BSD-3-Clause
// Every node's health, rate, gaps and latency.
import {$, keepList, make, setData, setText} from './dom.js';
import {age, dash, fixed, known, milliseconds} from './format.js';
import {setSign} from './signs.js';
import {toneOf} from './tones.js';
import {word} from './words.js';

const silentAfter = 3;  // s: nodes speak once a second

/// A fault of a node beyond the state that it reports, for its second line.
function troubleOf(node, state) {
  const parts = [];
  if (node.age_s > silentAfter) parts.push(`silent for ${age(node.age_s)}`);
  if (node.reason && !['ready', 'running'].includes(state)) parts.push(node.reason);
  for (const name of ['undecodable', 'overflowed'])
    if (node[name] > 0) parts.push(`${node[name]} ${name}`);
  return parts.join(', ');
}

function create() {
  return make(
      'div', {class: 'node', role: 'row'}, make('span', {class: 'sign tone'}),
      ...[0, 1, 2, 3].map(() => make('span', {role: 'cell', class: 'number'})),
      make('span', {class: 'detail'}));
}

function update(row, node) {
  const state = word('node', node.state);
  const silent = node.age_s > silentAfter;
  const seen = silent && state !== 'stopped' ? 'lost' : state;
  const [mark, name, rate, gaps, latency, detail] = row.children;
  setData(row, 'node', node.node);
  setData(row, 'state', state);
  setData(row, 'tone', toneOf(seen));
  setSign(mark, seen === 'running' ? 'ready' : seen);
  setText(name, node.node);
  setText(
      rate,
      known(node.rate_hz) ? `${fixed(node.rate_hz, node.rate_hz < 10 ? 1 : 0)}\u00a0Hz` : dash);
  setText(gaps, known(node.gaps) ? String(node.gaps) : dash);
  setData(gaps, 'bad', node.gaps > 0);
  setText(latency, milliseconds(node.latency_s));
  setText(detail, troubleOf(node, state));
  detail.hidden = !detail.textContent;
  const counters = (node.counters || [])
                       .map((counter) => `${counter.name} ${Number(counter.value.toPrecision(6))}`)
                       .join('\n');
  row.title = `${node.node}: ${state}${node.reason ? `, ${node.reason}` : ''}\nheartbeat ${
      age(node.age_s)} ago, ${node.received ?? dash} received, ${
      node.published ?? dash} published\n${counters}`;
}

const isBad = (node) => (node.age_s > silentAfter && word('node', node.state) !== 'stopped') ||
    ['degraded', 'fault'].includes(word('node', node.state));

export function startNodes(board) {
  const list = make('div', {role: 'rowgroup'});
  $('nodes').append(
      make(
          'div', {class: 'node head', role: 'row'}, make('span'),
          ...['node', 'rate', 'gaps', 'latency'].map(
              (title) => make('span', {role: 'columnheader'}, title))),
      list);
  board.view(['nodes'], () => {
    const nodes = board.list('nodes');
    // Faulty nodes come first; the others keep their places.
    const ordered = [...nodes].sort((a, b) => isBad(b) - isBad(a));
    keepList(list, ordered, (node) => node.node, create, update);
    const bad = nodes.filter(isBad).length;
    const place = $('nodes-count');
    setText(
        place,
        !nodes.length ? 'no nodes' :
            bad       ? `${bad} of ${nodes.length} not well` :
                        `all ${nodes.length} well`);
    setData(place, 'tone', bad ? 'bad' : nodes.length ? 'good' : 'none');
    place.className = 'tone';
  });
}
