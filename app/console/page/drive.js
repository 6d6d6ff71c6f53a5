// SPDX-License-Identifier: BSD-3-Clause
// The drive bar: the holder of control, and the commands that the procedure accepts now.
import {notice, send} from './commands.js';
import {askReason} from './dialogs.js';
import {$, setData, setText} from './dom.js';
import {percent} from './format.js';
import {procedureWords} from './look.js';
import {openRun} from './run_dialog.js';

const active = ['preparing', 'running', 'held', 'prompting', 'teardown'];

/// States of the procedure in which a command makes sense, and the message in all others.
const when = {
  resume: [['held'], 'nothing is held'],
  step: [['held', 'running'], 'nothing is held'],
  skip: [['running', 'held', 'prompting'], 'no step runs'],
  retry: [['running', 'held', 'prompting'], 'no step runs'],
  reset: [['held'], 'nothing is held'],
  abort: [active, 'nothing runs'],
};

export class Drive {
  constructor(board, connection, me) {
    Object.assign(this, {board, connection, me});
    this.bind();
    board.view(['procedure', 'control', 'connection', 'procedures', 'hello'], () => this.draw());
    board.view(['testbed', 'facility'], () => this.drawSettings());
  }

  get holder() {
    return (this.board.get('control') || {}).holder || '';
  }
  get mine() {
    const {holder, viewer} = this.board.get('control') || {};
    return Boolean(this.me.viewer) && (viewer || holder) === this.me.viewer;
  }

  /// Why `id` cannot be used now; empty: it can.
  obstacle(id) {
    if (this.connection.state !== 'open') return 'no connection';
    if (!this.me.may_command) return 'this page may only look';
    const {state} = procedureWords(this.board.get('procedure'));
    if (when[id] && !when[id][0].includes(state)) return when[id][1];
    if (id === 'hold' && state === 'held') return 'it is held';
    if (id === 'run' && active.includes(state)) return 'a procedure runs';
    if (id === 'run' && !this.board.list('procedures').length)
      return 'the server offers no procedures';
    // A hold is requested at once, whichever viewer holds the control: the server decides.
    if (id === 'hold' || id === 'take-control') return '';
    return this.mine ? '' : this.holder ? `${this.holder} holds the control` : 'take control first';
  }

  draw() {
    for (const id
             of ['hold', 'resume', 'step', 'skip', 'retry', 'reset', 'abort', 'run', 'speed-set',
                 'lamps-set', 'take-control', 'release-control']) {
      const why = this.obstacle(id);
      const button = $(id);
      button.setAttribute('aria-disabled', why !== '');
      button.title = why ? `Not now: ${why}` : '';
    }
    const lost = this.wasMine && !this.mine && !this.released;
    if (lost)
      notice(
          `You no longer hold the control: ${
              this.holder ? `${this.holder} has taken it` : 'no sign of life of this page'}`,
          false);
    if (this.mine && !this.wasMine) this.released = false;
    this.wasMine = this.mine;
    setData(document.body, 'control', this.mine ? 'mine' : this.holder ? 'other' : 'nobody');
    setText(
        $('control-word'),
        this.mine       ? 'You hold the control' :
            this.holder ? `${this.holder} holds the control` :
                          'Nobody holds the control');
    $('take-control').hidden = this.mine;
    $('release-control').hidden = !this.mine;
    setText($('who'), this.me.viewer ? `you: ${this.me.viewer}` : '');
  }

  drawSettings() {
    const override = (this.board.get('testbed') || {}).speed_override;
    const free = (id) => document.activeElement !== $(id);
    if (override > 0 && free('speed') && !this.speedTouched)
      $('speed').value = Math.round(100 * override);
    setText($('speed-output'), percent($('speed').value / 100));
    const facility = this.board.get('facility');
    if (!facility || this.lampsTouched) return;
    if (free('sun')) $('sun').value = Math.round(100 * facility.sun_lamp);
    if (free('albedo')) $('albedo').value = Math.round(100 * facility.albedo_lamp);
  }

  bind() {
    const act = {
      hold: () => this.send('hold', {reason: 'requested at the console'}, 'Hold'),
      resume: () => this.send('resume', {}, 'Resume'),
      step: () => this.send('step', {}, 'Step'),
      retry: () => this.send('retry', {}, 'Retry'),
      reset: () => this.send('reset', {}, 'Reset'),
      skip: () => this.withReason('skip', 'Skip this step', ''),
      abort: () => this.withReason('abort', 'Abort the procedure', 'the operator aborts'),
      run: () => openRun(
          this.board, (parameters) => this.send('run', parameters, `Run ${parameters.procedure}`)),
      'take-control': () => this.send('take_control', {}, 'Take control'),
      'release-control': () => {
        this.released = true;
        return this.send('release_control', {}, 'Release control');
      },
    };
    for (const [id, action] of Object.entries(act))
      $(id).addEventListener('click', () => this.use(id, action));
    this.act = act;
    $('speed').addEventListener('input', () => {
      this.speedTouched = true;
      setText($('speed-output'), percent($('speed').value / 100));
    });
    for (const id of ['sun', 'albedo'])
      $(id).addEventListener('input', () => {
        this.lampsTouched = true;
      });
    $('speed-form').addEventListener('submit', (event) => {
      event.preventDefault();
      this.use('speed-set', () => this.send('speed', {override: $('speed').value / 100}, 'Speed'));
      this.speedTouched = false;
    });
    $('lamps-form').addEventListener('submit', (event) => {
      event.preventDefault();
      this.use(
          'lamps-set',
          () => this.send(
              'lamps', {sun: $('sun').value / 100, albedo: $('albedo').value / 100}, 'Lamps'));
      this.lampsTouched = false;
    });
  }

  /// A button or its key: a command that cannot be used shows the reason.
  use(id, action = this.act[id]) {
    const why = this.obstacle(id);
    if (!why) return action();
    notice(`${id.replace(/-/g, ' ')}: ${why}`, false);
    return undefined;
  }

  send(name, parameters, title) {
    return send(this.connection, name, parameters, title);
  }

  async withReason(name, title, standard) {
    const reason = await askReason(title, 'Reason, for the log', standard);
    if (reason) this.send(name, {reason}, title);
  }

  toggleControl() {
    this.use(this.mine ? 'release-control' : 'take-control');
  }
}
