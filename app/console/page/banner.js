// SPDX-License-Identifier: BSD-3-Clause
// A connection that is lost or silent cannot be overlooked, nor can a picture be taken for a fresh
// one.
import {$, setData, setText} from './dom.js';
import {age} from './format.js';

export function startBanner(board, connection) {
  board.view(['connection', 'tick'], () => {
    const {state} = connection;
    setData(document.body, 'connection', state);
    const broken = state === 'lost' || state === 'stale';
    $('banner').hidden = !broken;
    setText(
        $('link-word'),
        {open: 'connected',
         lost: 'no connection',
         stale: 'silent',
         connecting: 'connecting'}[state]);
    if (!broken) return;
    setText($('banner-word'), state === 'lost' ? 'NO CONNECTION' : 'NOTHING IS RECEIVED');
    setText(
        $('banner-text'),
        `\u2013 what you see is ${
            age(connection.silentFor() / 1000)} old. HOLD does not work from here. ${
            state === 'lost' ? 'Connecting again by itself.' : 'The server is silent.'}`);
  });
}
