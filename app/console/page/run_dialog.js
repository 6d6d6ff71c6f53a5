// SPDX-License-Identifier: BSD-3-Clause
// Which procedure to run, with which parameters. (The seed is the cell's, from when it was brought
// up.)
import {closeDialog, openDialog} from './dialogs.js';
import {$, make, setText} from './dom.js';

function showProcedure(procedure) {
  setText($('run-description'), procedure.description || '');
  const parameters = procedure.parameters || [];
  const field = (parameter) => {
    const value =
        typeof parameter.value === 'string' ? parameter.value : JSON.stringify(parameter.value);
    const input =
        make('input', {name: parameter.name, value, autocomplete: 'off', spellcheck: 'false'});
    input.dataset.standard = value;
    const about = [parameter.unit, parameter.description].filter(Boolean).join(', ');
    return make(
        'label', {}, make('span', {}, about ? `${parameter.name} (${about})` : parameter.name),
        input);
  };
  $('run-parameters').replaceChildren(...(parameters.length ? parameters.map(field) : [
    make('p', {class: 'empty'}, 'none')
  ]));
}

/// Opens the dialog; calls `start({procedure, parameters})` with the parameters that differ from
/// the procedure's own.
export function openRun(board, start) {
  const dialog = $('run-dialog');
  const procedures = board.list('procedures');
  const select = $('run-procedure');
  const before = select.value;
  select.replaceChildren(...procedures.map(
      (procedure) => make(
          'option', {value: procedure.file},
          procedure.title && procedure.title !== procedure.file ?
              `${procedure.title} (${procedure.file})` :
              procedure.file)));
  if (procedures.some((procedure) => procedure.file === before)) select.value = before;
  const chosen = () => procedures.find((procedure) => procedure.file === select.value);
  select.onchange = () => showProcedure(chosen());
  showProcedure(chosen());
  dialog.querySelector('form').onsubmit = (event) => {
    event.preventDefault();
    const parameters = {};
    for (const input of $('run-parameters').querySelectorAll('input')) {
      if (input.value.trim() !== input.dataset.standard)
        parameters[input.name] = input.value.trim();
    }
    closeDialog(dialog);
    start({procedure: select.value, parameters});
  };
  openDialog(dialog, select);
}
