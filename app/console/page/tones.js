// SPDX-License-Identifier: BSD-3-Clause
// Which tone (theme.css) a word of state has.

const tones = {
  good: ['safe', 'ok', 'passed', 'pass', 'ready', 'tracking', 'closed', 'true'],
  busy: [
    'moving', 'running', 'scanning', 'acquiring', 'preparing', 'starting', 'closed_loop',
    'teardown', 'notice'
  ],
  wait: ['held', 'holding', 'prompting'],
  look: ['attention', 'degraded', 'ambiguous', 'inconclusive', 'warning', 'timeout', 'not_ready'],
  bad: [
    'stop', 'fault', 'failed', 'fail', 'error', 'fatal', 'lost', 'estop', 'offline', 'open',
    'false', 'aborted'
  ],
};
const toneByWord = Object.fromEntries(
    Object.entries(tones).flatMap(([tone, words]) => words.map((word) => [word, tone])));

export const toneOf = (word) => toneByWord[word] || 'none';
