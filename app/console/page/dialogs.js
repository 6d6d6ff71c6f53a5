// SPDX-License-Identifier: BSD-3-Clause
// Dialogs. None is modal: HOLD stays in reach whatever is open.
import {$, setText} from './dom.js';

let before = null;  // what had the focus

export function openDialog(dialog, focus) {
  for (const other of document.querySelectorAll('dialog[open]')) closeDialog(other);
  before = document.activeElement;
  dialog.show();
  (focus || dialog.querySelector('input, select, button')).focus();
}

export function closeDialog(dialog) {
  if (!dialog.open) return;
  dialog.close();
  if (before && before.isConnected) before.focus();
}

for (const dialog of document.querySelectorAll('dialog')) {
  for (const button of dialog.querySelectorAll('.cancel'))
    button.addEventListener('click', () => closeDialog(dialog));
  dialog.addEventListener('keydown', (event) => {
    if (event.key !== 'Escape') return;
    event.stopPropagation();
    closeDialog(dialog);
  });
}

/// A promise of the reason, or of null when it was called off.
export function askReason(title, label, standard = '') {
  const dialog = $('reason-dialog');
  setText($('reason-title'), title);
  setText($('reason-label'), label);
  $('reason-text').value = standard;
  return new Promise((resolve) => {
    let reason = null;
    const form = dialog.querySelector('form');
    form.onsubmit = (event) => {
      event.preventDefault();
      reason = $('reason-text').value.trim();
      if (!reason) return;
      closeDialog(dialog);
    };
    dialog.onclose = () => resolve(reason);
    openDialog(dialog, standard ? $('reason-send') : $('reason-text'));
  });
}

/// A promise of true when the operator confirms within `seconds`.
export function askConfirm(title, text, yes, seconds = 10) {
  const dialog = $('confirm-dialog');
  setText($('confirm-title'), title);
  setText($('confirm-text'), text);
  setText($('confirm-yes'), yes);
  return new Promise((resolve) => {
    let sure = false;
    const end = performance.now() + 1000 * seconds;
    const left = $('confirm-left');
    left.max = seconds;
    const timer = setInterval(() => {
      left.value = (end - performance.now()) / 1000;
      if (performance.now() > end) closeDialog(dialog);
    }, 100);
    $('confirm-yes').onclick = () => {
      sure = true;
      closeDialog(dialog);
    };
    $('confirm-no').onclick = () => closeDialog(dialog);
    dialog.onclose = () => {
      clearInterval(timer);
      resolve(sure);
    };
    openDialog(dialog, $('confirm-no'));
  });
}
