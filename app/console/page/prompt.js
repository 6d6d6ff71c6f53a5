// SPDX-License-Identifier: BSD-3-Clause
// The procedure's prompt to the operator, with its choices and the time that is left.
import {send} from './commands.js';
import {$, make, setData, setText} from './dom.js';
import {duration} from './format.js';
import {procedureWords} from './look.js';

export function startPrompt(board, connection, drive) {
  const answer = (text) => {
    const id = $('prompt').dataset.promptId;
    if (drive.mine)
      send(connection, 'answer', {prompt_id: id, text}, `Answer ${text}`);
    else
      drive.use('release-control');  // shows the holder of control
  };
  $('prompt-form').addEventListener('submit', (event) => {
    event.preventDefault();
    if ($('prompt-text').value.trim()) answer($('prompt-text').value.trim());
  });
  board.view(['procedure', 'tick', 'control'], () => {
    const procedure = board.get('procedure') || {};
    const prompting = procedureWords(procedure).state === 'prompting' && procedure.prompt_id;
    $('prompt').hidden = !prompting;
    if (!prompting) {
      setData($('prompt'), 'promptId', '');
      return;
    }
    if ($('prompt').dataset.promptId !== procedure.prompt_id) {
      setData($('prompt'), 'promptId', procedure.prompt_id);
      setText($('prompt-question'), procedure.prompt);
      $('prompt-text').value = '';
      const choices = procedure.choices || [];
      $('prompt-form').hidden = choices.length > 0;
      $('prompt-choices').replaceChildren(...choices.map((choice) => {
        const button = make('button', {type: 'button', 'data-choice': choice}, choice);
        button.addEventListener('click', () => answer(choice));
        return button;
      }));
    }
    const left =
        procedure.utime_prompt_expires ? (procedure.utime_prompt_expires - board.now()) / 1e6 : NaN;
    setText(
        $('prompt-countdown'),
        Number.isFinite(left) ? `${duration(Math.max(0, left))} left` : 'no time limit');
  });
}
