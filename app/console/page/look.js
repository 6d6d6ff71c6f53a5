// SPDX-License-Identifier: BSD-3-Clause
// The look: what is running, which step, is it safe, is the estimate good.
import {$, setData, setText} from './dom.js';
import {age, dash, duration, fixed, known, metres} from './format.js';
import {pathsOf, setSign} from './signs.js';
import {toneOf} from './tones.js';
import {spaced, word} from './words.js';

const currentFor = 3;  // s: an older estimate is not current
const outcomeWords = {
  pass: 'PASS',
  fail: 'FAIL',
  error: 'ERROR',
  aborted: 'ABORTED',
  inconclusive: 'INCONCLUSIVE',
  timeout: 'TIMEOUT'
};

function drawState(board, connection) {
  const safe = board.get('safe') || {};
  const live = connection.state === 'open';
  const state = live && safe.word ? safe.word : 'unknown';
  const titles = {lost: 'No link', stale: 'Stale', connecting: 'Connecting'};
  setData($('state'), 'state', state);
  setData(
      $('state'), 'tone',
      live                                  ? toneOf(state) :
          connection.state === 'connecting' ? 'none' :
                                              'bad');
  setSign($('state').querySelector('.sign'), state);
  setText(
      $('state-word'),
      live ? (safe.word ? spaced(safe.word) : 'No cell') : titles[connection.state]);
  setText(
      $('state-why'),
      live ? safe.why || (safe.word ? '' : 'no message on the bus') :
             'what is shown is old; the cell goes on without this page');
}

/// The procedure's state and outcome as words; in no run both are `none`.
export function procedureWords(procedure) {
  if (!procedure) return {state: 'none', outcome: 'none'};
  const state = word('procedure', procedure.state);
  const outcome = typeof procedure.outcome === 'number' && procedure.outcome < 0 ?
      'none' :
      word('outcome', procedure.outcome ?? 'none');
  return {state, outcome: outcome || 'none'};
}

function drawRunning(board) {
  const tile = $('running');
  const procedure = board.get('procedure');
  const run = board.get('run') || {};
  const {state, outcome} = procedureWords(procedure);
  setData(tile, 'procedureState', state);
  setData(tile, 'outcome', outcome);
  const finished = state === 'finished';
  setData(tile, 'tone', toneOf(finished ? outcome : state));
  const steps = procedure?.steps || [];
  const name = procedure?.procedure || run.procedure || 'nothing';
  setSign(tile.querySelector('.sign'), finished ? outcome : state);
  const inReplay = Boolean(board.get('replay'));
  const second = board.get('run2');
  const about =
      [run.host, run.target, run.layout, run.seed === undefined ? '' : `seed ${run.seed}`];
  const recorded =
      [run.directory || run.run, second && `compared with ${second.directory || second.run}`];
  setText($('run-about'), inReplay ? `Replay of ${recorded.filter(Boolean).join(' ')}` : [
    'Running', ...about
  ].filter(Boolean).join(' \u00b7 '));
  $('run-about').title = [run.run, ...about, run.version].filter(Boolean).join(', ');
  setText($('procedure-name'), finished ? `${outcomeWords[outcome] || outcome} ${name}` : name);
  const index = procedure ? procedure.current_step : -1;
  const current = steps[index];
  const done =
      steps.filter((step) => !['pending', 'running'].includes(word('step', step.state))).length;
  let where = procedure ? '' : 'no procedure runs';
  if (finished)
    where = procedure.reason || `${done} of ${steps.length} steps`;
  else if (current)
    where = `${state === 'running' ? '' : `${state}, `}step ${index + 1} of ${steps.length}: ${
        current.name}`;
  else if (procedure)
    where = procedure.reason || spaced(state);
  if (current && current.utime_start && !finished)
    where += `  ${duration((board.now() - current.utime_start) / 1e6)}`;
  setText($('current-step'), where);
  $('current-step').title = where;
  $('run-progress').value = steps.length ? done / steps.length : 0;
}

function drawClearance(board) {
  const testbed = board.get('testbed') || {};
  const estimate = board.get('estimate');
  const truth = board.get('truth');
  const clear = known(testbed.clearance_m) && testbed.clearance_m >= 0;
  setText($('clearance-value'), clear ? metres(testbed.clearance_m, 2) : dash);
  setData($('clearance'), 'metres', clear ? testbed.clearance_m : '');
  setData($('clearance'), 'tone', 'none');
  const pose = (estimate && estimate.pose) || (truth && truth.pose);
  const range = pose ? Math.hypot(pose[0], pose[1], pose[2]) : NaN;
  setText($('range-value'), known(range) ? `range ${metres(range, 3)}` : '');
  setText(
      $('clearance-between'),
      (testbed.clearance_between || []).join(' \u2013 ') ||
          (testbed.state === undefined ? '' : spaced(word('testbed', testbed.state))));
}

function drawEstimate(board) {
  const tile = $('estimate');
  const estimate = board.get('estimate');
  const status = estimate ? word('estimate', estimate.status) : 'none';
  const since = estimate ? (board.now() - estimate.utime) / 1e6 : 0;
  const isOld = since > currentFor;
  setData(tile, 'status', status);
  setData(tile, 'old', isOld);
  setData(tile, 'tone', isOld ? 'none' : toneOf(status));
  const error = estimate && estimate.error;
  const numbers = error && known(error.position_m) ?
      `error ${fixed(1000 * error.position_m, 1)}\u00a0mm  ${
          fixed(error.attitude_rad * 180 / Math.PI, 2)}\u00b0` :
      '';
  setSign(tile.querySelector('.sign'), isOld ? 'timeout' : status);
  setText($('estimate-word'), isOld ? 'old' : status);
  setText($('estimate-error'), numbers);
  let second = estimate ? estimate.reason : 'no estimate yet';
  if (!second && known(estimate.position_sigma_m)) {
    second = `3\u03c3  ${fixed(3000 * estimate.position_sigma_m, 1)}\u00a0mm  ${
        fixed(3 * estimate.attitude_sigma_rad * 180 / Math.PI, 2)}\u00b0`;
    if (error && known(error.position_m))
      second += error.position_m >
              3 * Math.hypot(estimate.position_sigma_m, error.position_sigma_m || 0) ?
          '  outside' :
          '  inside';
  }
  if (isOld) second = `the last one, ${status}, is ${age(since)} old`;
  setText($('estimate-second'), second || '');
}

/// The tab's title and sign, seen while another page is in front.
function drawTab(board) {
  const state = $('state').dataset.state;
  const title = `${$('state-word').textContent.toUpperCase()} \u2013 ${
      $('procedure-name').textContent} \u2013 Berth`;
  if (document.title !== title) document.title = title;
  const icon = $('favicon');
  if (icon.dataset.state === state) return;
  icon.dataset.state = state;
  const colours =
      {safe: '#00a878', moving: '#0072b2', held: '#e69f00', attention: '#d4c500', stop: '#d55e00'};
  const paths =
      pathsOf(state)
          .map(
              (path) => `<path ${
                  Object.entries(path).map(([key, value]) => `${key}="${value}"`).join(' ')}/>`)
          .join('');
  icon.href = `data:image/svg+xml,${
      encodeURIComponent(`<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 24 24" color="${
          colours[state] || '#777'}">${paths}</svg>`)}`;
}

export function startLook(board, connection) {
  const draw = () => {
    drawState(board, connection);
    drawRunning(board);
    drawTab(board);
  };
  board.view(['safe', 'connection', 'procedure', 'run', 'tick'], draw);
  board.view(['testbed', 'estimate', 'truth'], () => drawClearance(board));
  board.view(['estimate', 'tick'], () => drawEstimate(board));
}
