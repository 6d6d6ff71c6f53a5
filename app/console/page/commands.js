// SPDX-License-Identifier: BSD-3-Clause
// Sending a command: a hazardous one is confirmed with the word from the server; answers are shown.
import {askConfirm} from './dialogs.js';
import {$, setData, setText} from './dom.js';

let timer = 0;

export function notice(text, accepted = true) {
  setText($('notice'), text);
  setData($('notice'), 'accepted', accepted);
  clearTimeout(timer);
  timer = setTimeout(() => setText($('notice'), ''), accepted ? 5000 : 15000);
}

/// Sends `name`; shows how it was answered. Resolves to whether it was accepted.
export async function send(connection, name, parameters = {}, title = name) {
  let answer = await connection.command(name, parameters);
  if (!answer.accepted && answer.confirm) {
    const sure = await askConfirm(`${title}: are you sure?`, answer.text, `Yes: ${title}`);
    if (!sure) {
      notice(`${title}: not sent`);
      return false;
    }
    answer = await connection.command(name, parameters, answer.confirm);
  }
  notice(
      `${title}: ${answer.accepted ? answer.text || 'accepted' : `refused: ${answer.text}`}`,
      answer.accepted);
  return answer.accepted;
}
