// SPDX-License-Identifier: BSD-3-Clause
// Finding and thinning in the list of samples, which is in the order of time.

/// The index of the newest sample that is not after the time; -1: none.
export function indexAt(samples, time) {
  let low = 0, high = samples.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (samples[middle].time_s <= time)
      low = middle + 1;
    else
      high = middle;
  }
  return low - 1;
}

/// The samples from one time to another, at most about `most` of them: of each bunch the one with
/// the largest error, so that no peak is lost.
export function thinned(samples, from, to, most) {
  const inside = samples.slice(indexAt(samples, from - 1e-9) + 1, indexAt(samples, to) + 1);
  const bunch = Math.ceil(inside.length / most);
  if (bunch <= 1) return inside;
  const kept = [];
  for (let i = 0; i < inside.length; i += bunch) {
    const of = inside.slice(i, i + bunch);
    kept.push(of.reduce(
        (worst, sample) => (sample.position_mm > (worst.position_mm ?? -1) ? sample : worst)));
  }
  return kept;
}

/// The time in the run now, s: samples count from its start. Infinite while that is not known.
export function timeInRun(board) {
  const start = (board.get('run') || {}).utime_start;
  return start ? (board.now() - start) / 1e6 : Infinity;
}
