// SPDX-License-Identifier: BSD-3-Clause
// Every channel's rate, bandwidth and gaps, in a list that can be unfolded.
import {$, keepList, make, setData, setText} from './dom.js';
import {bytesPerSecond, fixed} from './format.js';

export function startChannels(board) {
  const body = make('tbody');
  const head = make(
      'tr', {},
      ...['channel', 'Hz', 'data', 'gaps'].map((title) => make('th', {scope: 'col'}, title)));
  $('channels').append(make('thead', {}, head), body);
  const draw = () => {
    if (!$('channels-panel').open) return;
    keepList(
        body, board.list('channels'), (channel) => channel.channel,
        (channel) => make('tr', {title: channel.type}, ...[0, 1, 2, 3].map(() => make('td'))),
        (row, channel) => {
          const bad = channel.gaps + channel.undecodable;
          const texts = [
            channel.channel, fixed(channel.rate_hz, 1), bytesPerSecond(channel.bytes_per_s),
            String(bad)
          ];
          texts.forEach((text, index) => setText(row.children[index], text));
          setData(row.lastChild, 'bad', bad > 0);
        });
  };
  board.view(['channels'], draw);
  $('channels-panel').addEventListener('toggle', draw);
}
