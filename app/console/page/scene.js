// SPDX-License-Identifier: BSD-3-Clause
// The live picture of the cell. Drawn when something has changed, at most once a frame of the
// screen.
import * as THREE from './lib/three/build/three.module.js';

import {$, setText} from './dom.js';
import {Bodies} from './scene_bodies.js';
import {Cameras} from './scene_camera.js';
import {SensorView} from './scene_sensor.js';
import {drawLegend, drawNote} from './scene_words.js';
import {cssColour, isDark, onTheme} from './theme.js';
import {word} from './words.js';

const views = ['cell', 'eye', 'top', 'side'];

class Scene {
  constructor(board, canvas) {
    this.board = board;
    this.canvas = canvas;
    this.renderer =
        new THREE.WebGLRenderer({canvas, antialias: true, powerPreference: 'low-power'});
    this.renderer.autoClear = false;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.world = new THREE.Scene();
    this.hemisphere = new THREE.HemisphereLight(0xffffff, 0x606870, 0.75);
    this.hemisphere.position.set(0, 0, 1);
    this.sun = new THREE.DirectionalLight(0xffffff, 0.55);
    this.sun.position.set(-3, -6, 8);
    this.world.add(this.hemisphere, this.sun);
    this.bodies = new Bodies(this.world, () => this.invalidate());
    this.cameras = new Cameras(canvas, () => this.invalidate());
    this.sensor = new SensorView(this.bodies.frame('sensor'));
    this.nearest = new THREE.Line(
        new THREE.BufferGeometry(), new THREE.LineDashedMaterial({dashSize: 0.06, gapSize: 0.04}));
    this.nearest.frustumCulled = false;
    this.nearest.visible = false;
    this.grid = null;
    this.world.add(this.nearest);
    this.withInset = true;
    this.requested = false;
    this.notBefore = 0;
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    onTheme(() => this.paint());
    this.paint();
    this.resize();
  }

  paint() {
    this.bodies.paint(cssColour, isDark());
    this.sensor.paint(cssColour);
    this.nearest.material.color.set(cssColour('--red'));
    this.renderer.setClearColor(cssColour('--picture'));
    this.drawGrid();
    this.invalidate();
  }

  drawGrid() {
    if (this.grid) this.world.remove(this.grid);
    const box = (this.board.get('scene') || {}).box;
    const size =
        box ? Math.ceil(Math.max(box.max[0] - box.min[0], box.max[1] - box.min[1]) / 2) * 2 : 12;
    if (size > 100) return;
    const colour = new THREE.Color(cssColour('--grid'));
    this.grid = new THREE.GridHelper(size, size, colour, colour);
    this.grid.rotation.x = Math.PI / 2;
    if (box)
      this.grid.position.set((box.min[0] + box.max[0]) / 2, (box.min[1] + box.max[1]) / 2, 0.002);
    this.world.add(this.grid);
  }

  resize() {
    const {clientWidth: width, clientHeight: height} = this.canvas.parentElement;
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.cameras.shape(this.cameras.free, width, height);
    const insetWidth = Math.round(Math.min(300, 0.3 * width, 0.55 * height));
    this.inset = {width: insetWidth, height: Math.round(0.8 * insetWidth)};
    Object.assign(
        $('inset-label').style, {width: `${this.inset.width}px`, height: `${this.inset.height}px`});
    this.makeRoom(width, height);
    this.cameras.fitted = 0;
    this.cameras.fit(this.subject());
    this.render();  // at once: a canvas of another size is empty
  }

  /// The inset covers the right end of the picture: the subject moves to the left by part of it.
  makeRoom(width, height) {
    const shift = this.withInset && width > 380 ? 0.4 * this.inset.width : 0;
    this.cameras.free.setViewOffset(width, height, shift, 0, width, height);
  }

  /// The subject of a picture of the whole: sensor and replica with their surroundings.
  subject() {
    const frames = this.board.get('frames') || {};
    const {sensor} = frames;
    const replica = frames.replica || frames.ghost;
    if (!sensor || !replica) return null;
    const from = new THREE.Vector3(...sensor), to = new THREE.Vector3(...replica);
    const centre = from.clone().add(to).multiplyScalar(0.5);
    centre.z -= 0.15 * Math.min(from.distanceTo(to), 3);
    return {centre, radius: 0.5 * from.distanceTo(to) + 1.7};
  }

  distance() {
    const estimate = this.board.get('estimate');
    const truth = this.board.get('truth');
    const pose = (truth && truth.pose) || (estimate && estimate.pose);
    return pose ? Math.max(0.5, Math.hypot(pose[0], pose[1], pose[2])) : 5;
  }

  takeFrames() {
    const frames = this.board.get('frames') || {};
    this.bodies.move(frames);
    this.cameras.placeEye(
        this.bodies.frame('sensor'), (this.board.get('scene')?.lidar || {}).field_of_view_rad);
    this.cameras.fit(this.subject());
    this.invalidate();
  }

  takeScan() {
    const scan = this.board.get('scan') || {};
    this.sensor.showWindows(scan.windows || [], this.distance());
    this.sensor.showReturns(this.board.list('returns'), scan.scan_id);
    this.invalidate();
  }

  takeEstimate() {
    const scene = this.board.get('scene') || {};
    this.sensor.showView(
        {
          ...scene.lidar,
          ...(this.board.get('lidar')?.field_of_view_rad?.[0] > 0 ? this.board.get('lidar') : {})
        },
        this.distance());
    const estimate = this.board.get('estimate');
    const isAmbiguous = estimate && word('estimate', estimate.status) === 'ambiguous';
    this.bodies.showHypotheses(
        isAmbiguous ? (estimate.hypotheses || []).slice(0, 4).map((hypothesis) => hypothesis.pose) :
                      []);
    this.sensor.showUncertainty(this.board.get('estimate'), this.distance());
    this.invalidate();
  }

  takeClearance() {
    const points = (this.board.get('testbed') || {}).clearance_points;
    this.nearest.visible = Boolean(points && points.length === 2);
    if (this.nearest.visible) {
      this.nearest.geometry.setFromPoints(points.map((point) => new THREE.Vector3(...point)));
      this.nearest.computeLineDistances();
    }
    this.invalidate();
  }

  choose(view) {
    this.cameras.choose(view, this.subject());
    for (const button of document.querySelectorAll('#scene-views [data-view]'))
      button.setAttribute('aria-pressed', button.dataset.view === view);
    this.invalidate();
  }

  toggleInset() {
    this.withInset = !this.withInset;
    $('inset').setAttribute('aria-pressed', this.withInset);
    this.resize();
  }

  /// Requests a picture. Where one takes long, or the screen falls behind, they are made less
  /// often: commands must get through.
  invalidate() {
    if (this.requested) return;
    this.requested = true;
    const draw = () => {
      const askedAt = performance.now();
      requestAnimationFrame(() => {
        this.requested = false;
        const begin = performance.now();
        this.render();
        const end = performance.now();
        const late = begin - askedAt;
        this.notBefore = end + 2 * (end - begin) + (late > 40 ? Math.min(500, late) : 0);
      });
    };
    const wait = this.notBefore - performance.now();
    if (wait > 10)
      setTimeout(draw, wait);
    else
      draw();
  }

  render() {
    const {clientWidth: width, clientHeight: height} = this.canvas.parentElement;
    const {renderer, cameras} = this;
    renderer.setViewport(0, 0, width, height);
    renderer.setScissorTest(false);
    renderer.clear();
    if (cameras.view === 'eye') cameras.shape(cameras.eye, width, height);
    renderer.render(this.world, cameras.current);
    const inset = this.withInset && cameras.view !== 'eye' && width > 380 &&
        this.bodies.frame('sensor').visible;
    $('inset-label').hidden = !inset;
    if (!inset) return;
    cameras.shape(cameras.eye, this.inset.width, this.inset.height);
    const left = width - this.inset.width - 8;
    renderer.setViewport(left, 8, this.inset.width, this.inset.height);
    renderer.setScissor(left, 8, this.inset.width, this.inset.height);
    renderer.setScissorTest(true);
    renderer.clear();
    this.sensor.view.visible = false;  // the rim of its own field of view is of no use here
    renderer.render(this.world, cameras.eye);
    this.sensor.view.visible = true;
  }
}

/// Returns {choose(view), toggleInset()}.
export function startScene(board) {
  let scene = null;
  try {
    scene = new Scene(board, $('scene-canvas'));
  } catch (error) {
    setText(
        $('scene-note'),
        'This browser has no WebGL: the cell is not drawn, the numbers are all there.');
    console.warn(error);
    return {choose() {}, toggleInset() {}};
  }
  board.view(['scene'], () => {
    scene.bodies.show(board.get('scene') || {});
    scene.drawGrid();
  });
  board.view(['scene', 'frames'], () => scene.takeFrames());
  board.view(['scan', 'returns'], () => scene.takeScan());
  board.view(['estimate', 'scene', 'lidar'], () => scene.takeEstimate());
  board.view(['testbed'], () => scene.takeClearance());
  board.view(['scene', 'frames', 'scan', 'returns', 'estimate', 'testbed'], () => {
    drawLegend(board);
    drawNote(board, scene);
  });
  for (const button of document.querySelectorAll('#scene-views [data-view]'))
    button.addEventListener('click', () => scene.choose(button.dataset.view));
  $('inset').addEventListener('click', () => scene.toggleInset());
  return {
    choose: (index) => scene.choose(views[index]),
    toggleInset: () => scene.toggleInset(),
    scene
  };
}
