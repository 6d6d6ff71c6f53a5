// SPDX-License-Identifier: BSD-3-Clause
// The LIDAR's field of view, scan windows and returns, in the sensor frame; and the replica's
// estimated position with its uncertainty.
import * as THREE from './lib/three/build/three.module.js';

/// Azimuth to the right (+x), elevation up (-y), along the boresight +z.
const direction = (azimuth, elevation) => new THREE.Vector3(
    Math.sin(azimuth) * Math.cos(elevation), -Math.sin(elevation),
    Math.cos(azimuth) * Math.cos(elevation));

/// The rim of a window at a distance, as pairs of points for line segments.
function rim(
    {azimuth_rad: azimuth, elevation_rad: elevation, width_rad: width, height_rad: height},
    distance) {
  const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]];
  const points = [];
  for (let side = 0; side < 4; ++side) {
    for (let i = 0; i < 6; ++i) {
      for (const share of [i / 6, (i + 1) / 6]) {
        const across = corners[side][0] + share * (corners[side + 1][0] - corners[side][0]);
        const up = corners[side][1] + share * (corners[side + 1][1] - corners[side][1]);
        points.push(direction(azimuth + across * width / 2, elevation + up * height / 2)
                        .multiplyScalar(distance));
      }
    }
  }
  return points;
}

const lines = (opacity) => {
  const object = new THREE.LineSegments(
      new THREE.BufferGeometry(), new THREE.LineBasicMaterial({transparent: true, opacity}));
  object.frustumCulled = false;
  return object;
};

class Returns {
  constructor(opacity) {
    this.object = new THREE.Points(
        new THREE.BufferGeometry(),
        new THREE.PointsMaterial(
            {size: 2.5, sizeAttenuation: false, transparent: opacity < 1, opacity}));
    this.object.frustumCulled = false;
    this.object.visible = false;
    this.capacity = 0;
  }

  /// Millimetres in the sensor frame, [x, y, z, ...].
  show(returns) {
    const count = Math.floor(returns.length / 3);
    this.object.visible = count > 0;
    if (!count) return;
    if (3 * count > this.capacity) {
      this.capacity = Math.max(3000, 3 * count, 2 * this.capacity);
      this.object.geometry.dispose();
      this.object.geometry = new THREE.BufferGeometry();
      const positions = new THREE.BufferAttribute(new Float32Array(this.capacity), 3);
      this.object.geometry.setAttribute('position', positions.setUsage(THREE.DynamicDrawUsage));
    }
    const attribute = this.object.geometry.attributes.position;
    for (let i = 0; i < 3 * count; ++i) attribute.array[i] = returns[i] / 1000;
    attribute.needsUpdate = true;
    this.object.geometry.setDrawRange(0, count);
  }

  /// Exchanges what both show, and is the older one from now on.
  take(other) {
    [this.object.geometry, other.object.geometry] = [other.object.geometry, this.object.geometry];
    [this.capacity, other.capacity] = [other.capacity, this.capacity];
    this.object.visible = other.object.visible;
    other.object.visible = false;
  }
}

export class SensorView {
  constructor(frame) {
    this.view = lines(0.6);
    this.windows = lines(1);
    // Returns of the scan that runs, and, fainter, of the one before.
    this.points = new Returns(1);
    this.before = new Returns(0.4);
    this.scan = undefined;
    this.ellipsoid = new THREE.Mesh(
        new THREE.SphereBufferGeometry(1, 24, 16),
        new THREE.MeshPhongMaterial(
            {transparent: true, opacity: 0.5, depthWrite: false, depthTest: false}));
    this.ellipsoid.visible = false;
    this.ellipsoid.renderOrder =
        2;  // it stands in the middle of the replica, and is to be seen all the same
    this.magnified = 1;
    frame.add(this.view, this.windows, this.points.object, this.before.object, this.ellipsoid);
  }

  paint(colour) {
    this.view.material.color.set(colour('--green'));
    this.windows.material.color.set(colour('--yellow'));
    for (const points of [this.points, this.before])
      points.object.material.color.set(colour('--returns'));
    this.ellipsoid.material.color.set(colour('--second'));
  }

  showView(lidar, distance) {
    const [width, height] = lidar.field_of_view_rad || [];
    this.view.visible = Boolean(width);
    if (!width) return;
    const whole = {azimuth_rad: 0, elevation_rad: 0, width_rad: width, height_rad: height};
    const far = Math.min(lidar.range_max_m || Infinity, 1.2 * distance);
    const near = Math.min(lidar.range_min_m || 0, 0.9 * far);
    const points = [...rim(whole, far)];
    if (near > 0) points.push(...rim(whole, near));
    for (const [across, up] of [[-1, -1], [1, -1], [1, 1], [-1, 1]]) {
      const ray = direction(across * width / 2, up * height / 2);
      points.push(new THREE.Vector3(), ray.clone().multiplyScalar(far));
    }
    this.view.geometry.setFromPoints(points);
  }

  showWindows(windows, distance) {
    this.windows.geometry.dispose();
    this.windows.geometry = new THREE.BufferGeometry().setFromPoints(
        windows.flatMap((window) => rim(window, distance)));
    this.windows.visible = windows.length > 0;
  }

  showReturns(returns, scan) {
    if (scan !== this.scan) {
      this.scan = scan;
      this.before.take(this.points);
    }
    this.points.show(returns);
  }

  /// Three sigma of the position, magnified where it would be too small to be seen: by 1, 2, 5, 10
  /// ...
  showUncertainty(estimate, distance) {
    const ellipsoid = estimate && estimate.ellipsoid;
    const radii =
        ellipsoid ? ellipsoid.radii_m : estimate && estimate.sigma && estimate.sigma.slice(0, 3);
    this.ellipsoid.visible = Boolean(radii && estimate.pose && radii.every(Number.isFinite));
    if (!this.ellipsoid.visible) return;
    const factor = 0.045 * distance / (3 * Math.max(...radii, 1e-9));
    const decade = 10 ** Math.floor(Math.log10(Math.max(factor, 1)));
    this.magnified = factor <= 1 ? 1 :
                                   decade *
            (factor / decade >= 5     ? 5 :
                 factor / decade >= 2 ? 2 :
                                        1);
    this.ellipsoid.position.set(...estimate.pose.slice(0, 3));
    const q = (ellipsoid && ellipsoid.q) || [1, 0, 0, 0];
    this.ellipsoid.quaternion.set(q[1], q[2], q[3], q[0]);
    this.ellipsoid.scale.set(...radii.map((radius) => 3 * this.magnified * Math.max(radius, 1e-6)));
  }
}
