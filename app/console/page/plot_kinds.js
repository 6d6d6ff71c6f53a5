// SPDX-License-Identifier: BSD-3-Clause
// What each plot shows: its series, unit and range.
import {errorRows, poseRows, rangeOf, shown, turnsOver} from './plot_rows.js';

const axes = ['x', 'y', 'z', 'w', 'p', 'r'];

/// One of x y z w p r, estimate against truth.
export const poseOf = (index) => ({
  title: axes[index],
  unit: index < 3 ? 'mm' : '\u00b0',
  decimals: index < 3 ? 1 : 2,
  labels: ['s', 'truth', 'estimate', 'second'],
  bars: false,
  valueOf: (sample) => sample.estimate?.[index],
  rows: (first, second) => poseRows(first, second, index),
  range: (first, second) => {
    const turned = index > 2 && turnsOver(first, index);
    return rangeOf(
        [...first, ...second].flatMap(
            (sample) =>
                [shown(sample.estimate?.[index], turned), shown(sample.truth?.[index], turned)]),
        index < 3 ? 4 : 0.5);
  },
});

/// The error in or about one axis, within its three sigmas.
export const axisErrorOf = (index) => ({
  // Of the attitude the rotation vector: differences of w p r would mean nothing.
  title: index < 3 ? `error ${axes[index]}` : `error about ${axes[index - 3]}`,
  unit: index < 3 ? 'mm' : '\u00b0',
  decimals: index < 3 ? 1 : 2,
  labels: ['s', '3\u03c3', 'error', 'second'],
  bars: true,
  valueOf: (sample) => sample.error?.[index],
  rows: (first, second) => errorRows(
      first, second, (sample) => sample.error?.[index], (sample) => sample.sigma3?.[index], true),
  range: (first, second) => {
    const [, high] = rangeOf(
        [...first, ...second].flatMap(
            (sample) => [Math.abs(sample.error?.[index]), sample.sigma3?.[index]]),
        index < 3 ? 2 : 0.2, true);
    return [-high, high];
  },
});

/// The length of an error, below three sigmas.
const totalOf = (title, unit, decimals, least, errorOf, sigmaOf) => ({
  title,
  unit,
  decimals,
  labels: ['s', '3\u03c3', 'error', 'second'],
  bars: true,
  valueOf: errorOf,
  rows: (first, second) => errorRows(first, second, errorOf, sigmaOf, false),
  range: (first, second) => rangeOf(
      [...first, ...second].flatMap((sample) => [errorOf(sample), sigmaOf(sample)]), least, true),
});
export const totals = [
  totalOf(
      'position error', 'mm', 1, 3, (sample) => sample.position_mm,
      (sample) => sample.position_sigma3_mm),
  totalOf(
      'attitude error', '\u00b0', 2, 0.2, (sample) => sample.attitude_deg,
      (sample) => sample.attitude_sigma3_deg)
];
