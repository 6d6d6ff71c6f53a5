// SPDX-License-Identifier: BSD-3-Clause
// Puts the parts of the page together.
import {startBanner} from './banner.js';
import {Board} from './board.js';
import {startChannels} from './channels.js';
import {Connection} from './connection.js';
import {startCriteria} from './criteria.js';
import {$} from './dom.js';
import {Drive} from './drive.js';
import {startEvents} from './events.js';
import {startFacility} from './facility.js';
import {startKeys} from './keys.js';
import {startLook} from './look.js';
import {startNodes} from './nodes.js';
import {startPlots} from './plots.js';
import {startPose} from './pose.js';
import {startPrompt} from './prompt.js';
import {ReplayBar} from './replay_bar.js';
import {timeInRun} from './samples.js';
import {startScene} from './scene.js';
import {setSign} from './signs.js';
import {startSteps} from './steps.js';

const board = new Board();
const me = {
  viewer: '',
  may_command: false,
  mode: 'live',
  version: ''
};

const connection = new Connection({
  hello: (message) => {
    // A server of another version has another page.
    if (me.version && message.version !== me.version) location.reload();
    board.paced = message.mode !== 'replay';  // a replay has a pace of its own
    board.clear();                            // sections that it does not send again are gone
    Object.assign(me, message);
    document.body.dataset.mode = me.mode;
    $('replay-bar').hidden = me.mode !== 'replay';
    board.touch('hello');
  },
  board: (message) => board.take(message),
  state: () => board.touch('connection'),
});

for (const element of document.querySelectorAll('[data-sign]'))
  setSign(element, element.dataset.sign);
startLook(board, connection);
startBanner(board, connection);
startSteps(board);
startCriteria(board);
startPose(board);
startFacility(board);
startNodes(board);
startChannels(board);
startEvents(board);
const drive = new Drive(board, connection, me);
startPrompt(board, connection, drive);
const replay = new ReplayBar(board, connection);
const scene = startScene(board);
const plots = startPlots(board, (time) => {
  const run = board.get('run') || {};
  if (me.mode === 'replay' && run.utime_start) replay.skip(time - timeInRun(board));
});
startKeys({drive, replay, scene, plots, me});

// Ages and countdowns go on when nothing else does.
setInterval(() => {
  if (!document.hidden) board.touch('tick');
}, 200);
// The holder of control sends a sign of life as long as this page works: the tick comes from a
// worker, the answer from here.
new Worker('heartbeat.js').onmessage = () => {
  if (drive.mine) connection.command('keep_control');
};
board.touch('hello');

window.berthConsole = Object.freeze({
  get board() {
    return board.sections;
  },
  get revision() {
    return board.revision;
  },
  get connection() {
    return connection.state;
  },
  get viewer() {
    return me.viewer;
  },
  get mode() {
    return me.mode;
  },
});
