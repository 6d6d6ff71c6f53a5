// SPDX-License-Identifier: BSD-3-Clause
// Rows for dygraphs from samples: null means "not of this series", NaN breaks a line.

const nothing = null;

/// Two lists of [time, ...] rows as one, by time; each keeps its own columns.
function merge(first, second, columnsFirst, columnsSecond) {
  if (!second.length) return first.map((row) => [...row, ...Array(columnsSecond).fill(nothing)]);
  const rows = [];
  let i = 0, k = 0;
  while (i < first.length || k < second.length) {
    const ofFirst = k >= second.length || (i < first.length && first[i][0] <= second[k][0]);
    rows.push(
        ofFirst ? [...first[i++], ...Array(columnsSecond).fill(nothing)] :
                  [second[k][0], ...Array(columnsFirst).fill(nothing), ...second[k++].slice(1)]);
  }
  return rows;
}

/// Whether an angle of these samples lies about +-180 degrees: it is then shown from 0 to 360.
export const turnsOver = (samples, index) =>
    samples.some((sample) => sample.estimate?.[index] > 120) &&
    samples.some((sample) => sample.estimate?.[index] < -120);
export const shown = (value, turned) => (turned && value < 0 ? value + 360 : number(value));

const number = (value) => (typeof value === 'number' && Number.isFinite(value) ? value : NaN);

/// [time, truth, estimate, second estimate] of one of x y z w p r; the line breaks where an angle
/// turns over.
export function poseRows(samples, samples2, index) {
  const turned = index > 2 && turnsOver(samples, index);
  const column = (list, pick) => {
    const rows = [];
    let last = null;
    for (const sample of list) {
      const row = [sample.time_s, ...pick(sample)];
      if (index > 2 && last && row.some((value, i) => i > 0 && Math.abs(value - last[i]) > 180)) {
        rows.push([(row[0] + last[0]) / 2, ...row.slice(1).map(() => NaN)]);
      }
      rows.push(row);
      last = row;
    }
    return rows;
  };
  const first = column(
      samples,
      (sample) => [shown(sample.truth?.[index], turned), shown(sample.estimate?.[index], turned)]);
  const second = column(samples2, (sample) => [shown(sample.estimate?.[index], turned)]);
  return merge(first, second, 2, 1);
}

const bar = (low, middle, high) => [number(low), number(middle), number(high)];

/// [time, band, error, second error] as dygraphs' custom bars, `signed` about zero or from zero up.
export function errorRows(samples, samples2, errorOf, sigmaOf, signed) {
  const first = samples.map((sample) => {
    const error = errorOf(sample), sigma = sigmaOf(sample);
    return [
      sample.time_s, signed ? bar(-sigma, 0, sigma) : bar(0, 0, sigma), bar(error, error, error)
    ];
  });
  const second = samples2.map(
      (sample) => [sample.time_s, bar(errorOf(sample), errorOf(sample), errorOf(sample))]);
  return merge(first, second, 2, 1);
}

/// [low, high] that holds nearly all of `values`, and at least `least` wide: one wild value does
/// not hide the rest.
export function rangeOf(values, least, fromZero = false) {
  const sorted = values.filter(Number.isFinite).sort((a, b) => a - b);
  if (!sorted.length) return [fromZero ? 0 : -least / 2, fromZero ? least : least / 2];
  const at = (share) => sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))];
  let low = fromZero ? 0 : at(0.01), high = at(0.985);
  const middle = (low + high) / 2;
  if (high - low < least)
    [low, high] = fromZero ? [0, least] : [middle - least / 2, middle + least / 2];
  const room = 0.08 * (high - low);
  return [fromZero ? 0 : low - room, high + room];
}
