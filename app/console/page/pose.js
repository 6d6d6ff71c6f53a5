// SPDX-License-Identifier: BSD-3-Clause
// The newest pose in numbers: estimate, truth, error and three sigmas, x y z w p r.
import {$, make, setData, setText} from './dom.js';
import {age, dash, fixed, known, milliseconds, withUnit} from './format.js';
import {indexAt, timeInRun} from './samples.js';

const quantities = ['x', 'y', 'z', 'w', 'p', 'r'];
const freshFor = 10;  // s
const series = ['estimate', 'truth', 'error', 'sigma3'];

function build(table) {
  const head = make(
      'tr', {}, make('th', {}, ''),
      ...['estimate', 'truth', 'error', '3\u03c3'].map(
          (title) => make('th', {scope: 'col'}, title)),
      make('th', {}, ''));
  table.append(make('thead', {}, head));
  const body = make('tbody');
  for (const [index, quantity] of quantities.entries()) {
    body.append(make(
        'tr', {}, make('td', {}, quantity),
        ...series.map(
            (name) => make(
                'td', {
                  'data-quantity': quantity,
                  'data-series': name,
                  title: index > 2 && name !== 'estimate' && name !== 'truth' ?
                      `rotation vector about ${quantities[index - 3]} of the sensor` :
                      null
                },
                dash)),
        make('td', {class: 'also'}, index < 3 ? 'mm' : '\u00b0')));
  }
  for (const [name, unit] of [['position', 'mm'], ['attitude', '\u00b0']]) {
    body.append(make(
        'tr', {class: name === 'position' ? 'total' : ''}, make('td', {}, name), make('td', {}, ''),
        make('td', {}, ''),
        ...['error', 'sigma3'].map(
            (of) => make('td', {'data-quantity': name, 'data-series': of}, dash)),
        make('td', {class: 'also'}, unit)));
  }
  table.append(body);
}

export function startPose(board) {
  const table = $('pose-table');
  build(table);
  const cell = (quantity, of) =>
      table.querySelector(`td[data-quantity="${quantity}"][data-series="${of}"]`);
  const cells = Object.fromEntries([...quantities, 'position', 'attitude'].map(
      (quantity) => [quantity, Object.fromEntries(series.map((of) => [of, cell(quantity, of)]))]));
  const put = (quantity, of, value, decimals) =>
      cells[quantity][of] && setText(cells[quantity][of], fixed(value, decimals));

  board.view(['truth', 'samples', 'run', 'replay'], () => {
    // Of one time, so that a row adds up; without a fresh sample there is still the truth of now.
    const samples = board.list('samples');
    const newest = samples[indexAt(samples, timeInRun(board))];
    const last =
        newest && !(timeInRun(board) > newest.time_s + freshFor && board.get('run')) ? newest : {};
    for (const [index, quantity] of quantities.entries()) {
      const decimals = index < 3 ? 1 : 2;
      put(quantity, 'estimate', last.estimate?.[index], decimals);
      put(quantity, 'truth', (last.truth || board.get('truth')?.xyzwpr)?.[index], decimals);
      put(quantity, 'error', last.error?.[index], decimals);
      put(quantity, 'sigma3', last.sigma3?.[index], decimals);
      setData(cells[quantity].error, 'over', Math.abs(last.error?.[index]) > last.sigma3?.[index]);
    }
    put('position', 'error', last.position_mm, 1);
    put('position', 'sigma3', last.position_sigma3_mm, 1);
    put('attitude', 'error', last.attitude_deg, 2);
    put('attitude', 'sigma3', last.attitude_sigma3_deg, 2);
  });

  board.view(['estimate', 'tick'], () => {
    const estimate = board.get('estimate');
    const old = estimate ? (board.now() - estimate.utime) / 1e6 : NaN;
    const latency =
        estimate && known(estimate.latency_s) ? `latency ${milliseconds(estimate.latency_s)}` : '';
    const residual = estimate && known(estimate.residual_rms_m) && estimate.residual_rms_m > 0 ?
        `residual ${withUnit(fixed(1000 * estimate.residual_rms_m, 1), 'mm')}` :
        '';
    setText(
        $('estimate-age'),
        known(old) ? [latency, `${age(old)} old`].filter(Boolean).join('  \u00b7  ') : 'none');
    $('estimate-age').title = residual;
  });
}
