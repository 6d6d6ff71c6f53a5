// SPDX-License-Identifier: BSD-3-Clause
// The enumerations of the message types as words, in their order in the .lcm files.

const tables = {
  procedure: ['preparing', 'running', 'held', 'prompting', 'teardown', 'finished'],
  outcome: ['pass', 'fail', 'error', 'aborted', 'inconclusive', 'timeout'],
  step: ['pending', 'running', 'passed', 'failed', 'error', 'timeout', 'aborted', 'skipped'],
  criterion: ['pending', 'passed', 'failed', 'inconclusive'],
  testbed: ['not_ready', 'idle', 'moving', 'closed_loop', 'holding', 'held', 'fault'],
  arm: ['offline', 'idle', 'running', 'held', 'fault', 'estop'],
  lidar: ['offline', 'idle', 'scanning', 'fault'],
  estimator: ['idle', 'acquiring', 'tracking', 'lost'],
  estimate: ['idle', 'acquiring', 'ok', 'ambiguous', 'lost'],
  range: ['long', 'medium', 'short'],
  node: ['starting', 'ready', 'running', 'degraded', 'fault', 'stopped'],
  severity: ['info', 'notice', 'warning', 'error', 'fatal'],
  host: ['cell', 'simulated-cell', 'twin'],
};

/// The word of an enumeration's value; a word stays what it is, in lower case.
export function word(table, value) {
  if (typeof value === 'string') return value.toLowerCase();
  return tables[table][value] || 'none';
}

export const spaced = (text) => String(text ?? '').replace(/[_-]/g, ' ');
export const severityOf = (event) =>
    (typeof event.severity === 'number' ?
         event.severity :
         Math.max(0, tables.severity.indexOf(word('severity', event.severity))));
