// SPDX-License-Identifier: BSD-3-Clause
// Light or dark: the system's choice, until one is made here.

const wish = matchMedia('(prefers-color-scheme: dark)');
const listeners = [];
const chosen = () => {
  try {
    return localStorage.getItem('berth-theme');
  } catch {
    return null;
  }
};

function apply() {
  document.documentElement.dataset.theme = chosen() || (wish.matches ? 'dark' : 'light');
  for (const listener of listeners) listener();
}

export const isDark = () => document.documentElement.dataset.theme === 'dark';
export const cssColour = (name) =>
    getComputedStyle(document.documentElement).getPropertyValue(name).trim();
export const onTheme = (listener) => listeners.push(listener);

export function switchTheme() {
  try {
    localStorage.setItem('berth-theme', isDark() ? 'light' : 'dark');
  } catch { /* private window: for now only */
  }
  apply();
}

wish.addEventListener('change', apply);
apply();
