// SPDX-License-Identifier: BSD-3-Clause
// Numbers for people: with units, of one width as they change.

export const dash = '\u2013';
const minus = (text) => text.replace('-', '\u2212');
export const known = (value) => typeof value === 'number' && Number.isFinite(value);

/// With so many decimals; a true minus sign; a dash where there is nothing.
export function fixed(value, decimals = 1) {
  if (!known(value)) return dash;
  const text = value.toFixed(decimals);
  return minus(Number(text) === 0 ? text.replace('-', '') : text);
}

/// With so many significant digits, never as 1e5.
export function significant(value, digits = 3) {
  if (!known(value)) return dash;
  if (value === 0) return '0';
  const decimals = Math.max(0, digits - 1 - Math.floor(Math.log10(Math.abs(value))));
  return fixed(value, Math.min(decimals, 6));
}

export const withUnit = (text, unit) => (text === dash || !unit ? text : `${text}\u00a0${unit}`);
export const metres = (value, decimals = 3) => withUnit(fixed(value, decimals), 'm');
export const percent = (fraction) =>
    withUnit(known(fraction) ? fixed(100 * fraction, 0) : dash, '%');
export const milliseconds = (seconds) =>
    withUnit(known(seconds) ? fixed(1000 * seconds, 0) : dash, 'ms');

/// 4.2 s, 1:04, 2:03:04.
export function duration(seconds) {
  if (!known(seconds)) return dash;
  if (seconds < 60) return withUnit(fixed(Math.max(0, seconds), 1), 's');
  const whole = Math.floor(seconds);
  const two = (value) => String(value).padStart(2, '0');
  const hours = Math.floor(whole / 3600);
  const minutes = Math.floor(whole / 60) % 60;
  return hours ? `${hours}:${two(minutes)}:${two(whole % 60)}` : `${minutes}:${two(whole % 60)}`;
}

/// 2.0 s, 3 min, 2 h: how old something is.
export function age(seconds) {
  if (!known(seconds)) return dash;
  if (seconds < 100) return withUnit(fixed(Math.max(0, seconds), 1), 's');
  return seconds < 6000 ? withUnit(fixed(seconds / 60, 0), 'min') :
                          withUnit(fixed(seconds / 3600, 0), 'h');
}

/// Time of day with tenths, from microseconds since the epoch.
export function clock(utime) {
  const date = new Date(utime / 1000);
  const two = (value) => String(value).padStart(2, '0');
  return `${two(date.getHours())}:${two(date.getMinutes())}:${two(date.getSeconds())}.${
      Math.floor(date.getMilliseconds() / 100)}`;
}

/// 1.2 kB/s.
export function bytesPerSecond(value) {
  if (!known(value)) return dash;
  if (value < 1e3) return withUnit(fixed(value, 0), 'B/s');
  return value < 1e6 ? withUnit(significant(value / 1e3), 'kB/s') :
                       withUnit(significant(value / 1e6), 'MB/s');
}
