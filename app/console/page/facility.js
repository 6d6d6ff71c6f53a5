// SPDX-License-Identifier: BSD-3-Clause
// The cell's own things: E-stop chain, fence, lamps, arms, LIDAR, testbed.
import {$, make, setData, setText} from './dom.js';
import {dash, fixed, known, milliseconds, percent} from './format.js';
import {setSign} from './signs.js';
import {toneOf} from './tones.js';
import {spaced, word} from './words.js';

const rows = [
  ['estop', 'E-stop chain'], ['fence', 'Fence'], ['enabled', 'Motion'], ['lamps', 'Lamps'],
  ['replica', 'Replica arm'], ['sensor', 'Sensor arm'], ['lidar', 'LIDAR'],
  ['estimator', 'Estimator'], ['testbed', 'Testbed']
];

function armText(arm) {
  const parts = [spaced(word('arm', arm.state))];
  if (known(arm.tcp_speed_m_s)) parts.push(`${fixed(1000 * arm.tcp_speed_m_s, 0)}\u00a0mm/s`);
  if (known(arm.speed_override) && arm.speed_override < 1) parts.push(percent(arm.speed_override));
  if (known(arm.cycle_s)) parts.push(`cycle ${milliseconds(arm.cycle_s)}`);
  if (arm.reason) parts.push(arm.reason);
  return parts.join(', ');
}

export function startFacility(board) {
  const places = {};
  for (const [name, title] of rows) {
    const text = make('span', {class: 'number'}, dash);
    const value =
        make('dd', {class: 'signed', 'data-part': name}, make('span', {class: 'sign'}), text);
    places[name] = {value, text};
    $('facility').append(make('dt', {}, title), value);
  }
  const put = (name, state, text) => {
    const {value, text: place} = places[name];
    setData(value, 'state', state);
    setData(value, 'tone', toneOf(state));
    setSign(value.firstChild, state);
    setText(place, text);
    value.title = text;
  };
  const forget = (...names) => {
    for (const name of names) put(name, 'none', dash);
  };

  board.view(['facility'], () => {
    const facility = board.get('facility');
    if (!facility) return forget('estop', 'fence', 'enabled', 'lamps');
    if (facility.valid === false) {
      for (const name of ['estop', 'fence', 'enabled', 'lamps'])
        put(name, 'unknown', facility.reason || 'the PLC does not answer');
      return;
    }
    put('estop', facility.estop_chain_closed ? 'closed' : 'open',
        facility.estop_chain_closed ? 'closed: none is pressed' :
                                      'OPEN: an emergency stop is pressed');
    put('fence', facility.fence_closed ? 'closed' : 'open',
        facility.fence_closed ? 'closed' : 'OPEN');
    put('enabled', facility.motion_enabled ? 'ok' : 'attention',
        facility.motion_enabled ? 'enabled by the PLC' : 'not enabled by the PLC');
    const degrees = (angle) => fixed(angle * 180 / Math.PI, 0);
    put('lamps', facility.sun_lamp > 0 || facility.albedo_lamp > 0 ? 'moving' : 'pending',
        `sun ${percent(facility.sun_lamp)} from ${degrees(facility.sun_azimuth_rad)}\u00b0/${
            degrees(facility.sun_elevation_rad)}\u00b0, albedo ${percent(facility.albedo_lamp)}`);
  });
  board.view(['arms'], () => {
    const arms = board.get('arms') || {};
    for (const name of ['replica', 'sensor']) {
      if (arms[name])
        put(name, armState(arms[name]), armText(arms[name]));
      else
        forget(name);
    }
  });
  const armState = (arm) =>
      (arm.valid === false ? 'unknown' :
                             {idle: 'ready'}[word('arm', arm.state)] || word('arm', arm.state));
  board.view(['lidar'], () => {
    const lidar = board.get('lidar');
    if (!lidar) return forget('lidar');
    const state = word('lidar', lidar.state);
    const scanning =
        state === 'scanning' ? `, scan ${lidar.scan_id} at ${percent(lidar.progress)}` : '';
    put('lidar', state === 'idle' ? 'ready' : state,
        `${state}${scanning}${lidar.model ? `, ${lidar.model}` : ''}${
            lidar.reason ? `, ${lidar.reason}` : ''}`);
  });
  board.view(['estimator'], () => {
    const estimator = board.get('estimator');
    if (!estimator) return forget('estimator');
    const mode = word('estimator', estimator.mode);
    put('estimator', mode === 'tracking' ? 'ok' : mode,
        `${mode}${estimator.target ? ` ${estimator.target}` : ''}${
            estimator.reason ? `, ${estimator.reason}` : ''}`);
  });
  board.view(['testbed'], () => {
    const testbed = board.get('testbed');
    if (!testbed) return forget('testbed');
    const state = word('testbed', testbed.state);
    const left = known(testbed.remaining_s) && testbed.remaining_s > 0 ?
        `, ${percent(testbed.progress)}, ${fixed(testbed.remaining_s, 0)}\u00a0s left` :
        '';
    const slow = known(testbed.speed_override) && testbed.speed_override < 1 ?
        `, at ${percent(testbed.speed_override)}` :
        '';
    put('testbed', state === 'idle' ? 'ready' : state,
        `${spaced(state)}${left}${slow}${testbed.reason ? `, ${testbed.reason}` : ''}, lease ${
            testbed.lease_holder || 'free'}`);
  });
}
