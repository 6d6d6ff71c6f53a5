// SPDX-License-Identifier: BSD-3-Clause
// The steps of the procedure, and what must be so before it starts or goes on.
import {$, keepList, make, scrollTo, setData, setText} from './dom.js';
import {dash, duration} from './format.js';
import {setSign} from './signs.js';
import {toneOf} from './tones.js';
import {word} from './words.js';

function createStep() {
  return make(
      'li', {}, make('span', {class: 'sign'}),
      make('span', {class: 'name'}, make('span'), make('span', {class: 'phase'})),
      make('span', {class: 'number time'}), make('span', {class: 'detail'}));
}

function updateStep(row, step, index, now) {
  const state = word('step', step.state);
  const [mark, name, time, detail] = row.children;
  setData(row, 'step', index);
  setData(row, 'state', state);
  setData(row, 'tone', toneOf(state));
  setSign(mark, state);
  mark.classList.add('tone');
  row.style.paddingLeft = `${4 + 14 * (step.depth || 0)}px`;
  setText(name.firstChild, step.name);
  setText(
      name.lastChild,
      (step.phase && step.phase !== step.name ? `  ${step.phase}` : '') +
          (step.attempts > 1 ? `  \u00d7${step.attempts}` : ''));
  const end = step.utime_end || (state === 'running' ? now : 0);
  setText(
      time,
      step.utime_start        ? duration((end - step.utime_start) / 1e6) :
          state === 'pending' ? '' :
                                dash);
  setText(detail, step.detail || '');
  detail.hidden = !step.detail;
  row.title = `${step.name}: ${state}${step.attempts > 1 ? `, attempt ${step.attempts}` : ''}${
      step.detail ? `, ${step.detail}` : ''}`;
  row.setAttribute('aria-current', state === 'running' ? 'step' : 'false');
}

export function startSteps(board) {
  const list = $('steps');
  let shown = '';
  const draw = () => {
    const procedure = board.get('procedure');
    const steps = procedure?.steps || [];
    const now = board.now();
    keepList(
        list, steps, (step, index) => index, createStep,
        (row, step, index) => updateStep(row, step, index, now));
    const done =
        steps.filter((step) => !['pending', 'running'].includes(word('step', step.state))).length;
    setText($('steps-count'), steps.length ? `${done} of ${steps.length}` : 'no procedure');
    const current = procedure ? procedure.current_step : -1;
    // Also when other panels have taken room; but not while somebody scrolls through the list.
    const place = `${current} ${list.clientHeight}`;
    if (place !== shown && list.children[current]) scrollTo(list, list.children[current]);
    shown = place;
  };
  board.view(['procedure', 'tick'], draw);

  board.view(['procedure'], () => {
    const procedure = board.get('procedure');
    const conditions = procedure?.preconditions || [];
    const unmet = conditions.some((condition) => !condition.met);
    // Green ones matter only while one waits for them.
    const waiting = procedure && ['preparing', 'held'].includes(word('procedure', procedure.state));
    $('preconditions-panel').hidden = !conditions.length || !(unmet || waiting);
    setData($('preconditions'), 'met', !unmet);
    keepList(
        $('preconditions'), conditions, (condition) => condition.name,
        () => make(
            'li', {}, make('span', {class: 'sign'}),
            make('span', {}, make('span'), make('span', {class: 'reason'}))),
        (row, condition) => {
          setData(row, 'met', condition.met);
          setData(row, 'tone', condition.met ? 'good' : 'bad');
          setSign(row.firstChild, condition.met ? 'passed' : 'failed');
          row.firstChild.classList.add('tone');
          setText(row.lastChild.firstChild, condition.name);
          setText(row.lastChild.lastChild, condition.reason ? `  ${condition.reason}` : '');
        });
  });
}
