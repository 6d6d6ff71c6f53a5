// SPDX-License-Identifier: BSD-3-Clause
// Where the cell is looked at from: whole cell, the sensor's eye, from above, from the side; and by
// hand.
import * as THREE from './lib/three/build/three.module.js';
import {OrbitControls} from './lib/three/examples/jsm/controls/OrbitControls.js';

const directions = {
  cell: [-0.28, -1, 0.42],
  top: [0, -0.0005, 1],
  side: [0, -1, 0.0]
};

export class Cameras {
  constructor(canvas, changed) {
    this.free = new THREE.PerspectiveCamera(34, 1, 0.05, 500);
    this.free.up.set(0, 0, 1);
    this.eye = new THREE.PerspectiveCamera(40, 1, 0.05, 1000);
    this.controls = new OrbitControls(this.free, canvas);
    this.controls.enableKeys = false;
    this.controls.screenSpacePanning = true;
    this.controls.maxPolarAngle = Math.PI * 0.98;
    this.controls.addEventListener('change', changed);
    this.controls.addEventListener('start', () => {
      this.byHand = true;
    });
    this.view = 'cell';
    this.byHand = false;
    this.fitted = 0;
  }

  get current() {
    return this.view === 'eye' ? this.eye : this.free;
  }

  choose(view, subject) {
    this.view = view;
    this.byHand = false;
    this.controls.enabled = view !== 'eye';
    this.fitted = 0;
    this.fit(subject);
  }

  /// Looks at `subject`: {centre, radius}; leaves alone what a hand has set, and small changes.
  fit(subject) {
    if (this.view === 'eye' || this.byHand || !subject) return;
    if (this.fitted && Math.abs(subject.radius / this.fitted - 1) < 0.25) return;
    this.fitted = subject.radius;
    const flat = this.view !== 'cell';
    this.free.fov = flat ? 8 : 34;  // from afar: nearly parallel rays
    const narrow = Math.min(1.8, Math.max(0.6, this.free.aspect));
    const distance = subject.radius * 1.2 / (Math.tan(this.free.fov * Math.PI / 360) * narrow);
    this.controls.target.copy(subject.centre);
    this.free.position.set(...directions[this.view])
        .normalize()
        .multiplyScalar(distance)
        .add(subject.centre);
    this.free.near = distance / 200;
    this.free.far = distance * 30;
    this.free.updateProjectionMatrix();
    this.controls.update();
  }

  /// The eye sits in the sensor frame: x right, y down, z along the boresight.
  placeEye(sensor, fieldOfView) {
    this.eye.fov = Math.min(75, 1.15 * Math.max(...(fieldOfView || [0.7])) * 180 / Math.PI);
    this.eye.position.copy(sensor.position);
    // A camera looks along its -z with y up: half a turn about x.
    this.eye.quaternion.copy(sensor.quaternion).multiply(new THREE.Quaternion(1, 0, 0, 0));
    this.eye.updateMatrixWorld();
  }

  shape(camera, width, height) {
    camera.aspect = width / Math.max(1, height);
    camera.updateProjectionMatrix();
  }
}
