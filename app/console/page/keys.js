// SPDX-License-Identifier: BSD-3-Clause
// The keys, and the page that explains them. The procedure's are those of the terminal.
import {closeDialog, openDialog} from './dialogs.js';
import {$, make} from './dom.js';
import {switchTheme} from './theme.js';

export function startKeys(parts) {
  const {drive, replay, scene, plots, me} = parts;
  const live = [
    ['h', 'hold', () => drive.use('hold')],
    ['r', 'resume', () => drive.use('resume')],
    ['n', 'step: go on, and hold when this step is done', () => drive.use('step')],
    ['s', 'skip this step, with a reason', () => drive.use('skip')],
    ['t', 'retry: begin this step anew', () => drive.use('retry')],
    ['x', "reset the controllers' alarms", () => drive.use('reset')],
    ['a', 'abort', () => drive.use('abort')],
    ['u', 'run a procedure', () => drive.use('run')],
    ['c', 'take or release control', () => drive.toggleControl()],
    [
      'p', 'to the prompt',
      () => ($('prompt').querySelector('[data-choice]') || $('prompt-text')).focus()
    ],
  ];
  const recorded = [
    [' ', 'play or pause', () => replay.toggle()],
    [',', 'one estimate back', () => replay.back()],
    ['.', 'one estimate on', () => replay.forward()],
    ['ArrowLeft', '5 s back; with shift 30 s', (event) => replay.skip(event.shiftKey ? -30 : -5)],
    ['ArrowRight', '5 s on; with shift 30 s', (event) => replay.skip(event.shiftKey ? 30 : 5)],
    ['Home', 'to the start', () => replay.seek(0)],
    ['End', 'to the end', () => replay.seek(replay.length)],
    ['-', 'slower', () => replay.faster(-1)],
    ['+', 'faster', () => replay.faster(1)],
    ['l', 'loop', () => replay.toggleLoop()],
  ];
  const always = [
    ...['whole cell', "the sensor's eye", 'from above', 'from the side'].map(
        (text, index) => [String(index + 1), `view: ${text}`, () => scene.choose(index)]),
    ['i', "the sensor's eye in a corner", () => scene.toggleInset()],
    ['e', 'plots: poses or errors of each axis', () => plots.switchMode()],
    ['f', 'find in the events', () => $('events-text').focus()],
    ['d', 'dark or light', switchTheme],
    ['?', 'these keys', () => toggleHelp()],
  ];
  const keysNow = () => [...(me.mode === 'replay' ? recorded : live), ...always];

  function toggleHelp() {
    const dialog = $('help-dialog');
    if (dialog.open) return closeDialog(dialog);
    const names = {' ': 'space', ArrowLeft: '\u2190', ArrowRight: '\u2192'};
    const extra = [['Esc', 'close a dialog, leave a field', null]];
    $('help-keys')
        .replaceChildren(...[...keysNow(), ...extra].map(
            ([key, text]) => make(
                'div', {}, make('dt', {}, make('kbd', {}, names[key] || key)),
                make('dd', {}, text))));
    return openDialog(dialog, dialog.querySelector('.cancel'));
  }

  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const {target} = event;
    const typing = target.matches('input:not([type="range"]), select, textarea');
    const dialog = document.querySelector('dialog[open]');
    if (event.key === 'Escape') return dialog ? closeDialog(dialog) : target.blur();
    if (typing) return undefined;
    // While a dialog is open only HOLD works, and the keys that close the help.
    if (dialog && event.key.toLowerCase() !== 'h' && event.key !== '?') return undefined;
    // Space and Enter work the button that has the focus; arrows the slider.
    if (event.key === ' ' && target.matches('button')) return undefined;
    if (event.key.startsWith('Arrow') && target.matches('input')) return undefined;
    // A key that is kept down sends one command, but may go on seeking.
    if (event.repeat && !event.key.startsWith('Arrow')) return undefined;
    const found = keysNow().find(
        ([key]) => key === event.key || (key.length === 1 && key === event.key.toLowerCase()));
    if (!found) return undefined;
    event.preventDefault();
    return found[2](event);
  });
  $('help').addEventListener('click', toggleHelp);
  $('theme').addEventListener('click', switchTheme);
}
