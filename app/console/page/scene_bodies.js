// SPDX-License-Identifier: BSD-3-Clause
// The bodies of the cell: each mesh once from the server, placed by the frame it belongs to.
import * as THREE from './lib/three/build/three.module.js';

const edgesUpTo = 12000;  // triangles: beyond it lines cost more than they show

function geometryOf(mesh) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.Float32BufferAttribute(mesh.positions, 3));
  if (mesh.indices) geometry.setIndex(mesh.indices);
  return geometry;
}

/// url: from the page's own place, "/mesh/0".
async function fetchMesh(url) {
  const answer = await fetch(url.replace(/^\//, ''));
  if (!answer.ok) throw new Error(`${url}: ${answer.status}`);
  return geometryOf(await answer.json());
}

/// A pose [x, y, z, qw, qx, qy, qz] onto an object.
export function place(object, pose) {
  object.position.set(pose[0], pose[1], pose[2]);
  object.quaternion.set(pose[4], pose[5], pose[6], pose[3]);
}

export class Bodies {
  /// `changed()` is called when something new is to be seen.
  constructor(root, changed) {
    this.root = root;
    this.changed = changed;
    this.frames = new Map();
    this.poses = {};  // the newest: a body may come after them
    this.materials = this.makeMaterials();
    this.loaded = '';
    this.replica = [];     // what it is made of, for its hypotheses
    this.hypotheses = [];  // groups in the sensor frame
  }

  makeMaterials() {
    const solid = (more = {}) => new THREE.MeshPhongMaterial({
      flatShading: true,
      shininess: 12,
      side: THREE.DoubleSide,
      polygonOffset: true,
      polygonOffsetFactor: 1,
      polygonOffsetUnits: 1,
      ...more
    });
    const glass = (opacity) => new THREE.MeshPhongMaterial(
        {flatShading: true, transparent: true, opacity, depthWrite: false, side: THREE.DoubleSide});
    const line = (opacity) => new THREE.LineBasicMaterial({transparent: true, opacity});
    return {
      arm: solid(),
      sensor: solid(),
      replica: solid(),
      cell: solid(),
      keepout: glass(0.16),
      ghost: glass(0.3),
      ghost2: glass(0.3),
      edges: line(0.35),
      keepoutEdges: line(0.9),
      ghostEdges: line(0.95),
      ghost2Edges: line(0.95),
      wallEdges: line(0.35),
    };
  }

  /// Colours as the theme has them.
  paint(colour, dark) {
    const set = (name, value) => this.materials[name].color.set(value);
    set('arm', dark ? '#8d9aa6' : '#aeb9c3');
    set('sensor', dark ? '#3f8f80' : '#4aa593');
    set('replica', dark ? '#d9c48a' : '#d8bd70');
    set('cell', dark ? '#2c363f' : '#c6d0d9');
    set('keepout', colour('--area-red'));
    set('keepoutEdges', colour('--red'));
    set('ghost', colour('--first'));
    set('ghostEdges', colour('--first'));
    set('ghost2', colour('--second'));
    set('ghost2Edges', colour('--second'));
    set('edges', dark ? '#000' : '#36424d');
    set('wallEdges', dark ? '#5c6a77' : '#8a97a3');
  }

  frame(name) {
    if (name === 'cell') return this.root;
    if (!this.frames.has(name)) {
      const group = new THREE.Group();
      this.put(group, this.poses[name]);
      this.frames.set(name, group);
      this.root.add(group);
    }
    return this.frames.get(name);
  }

  put(group, pose) {
    group.visible = Boolean(pose);
    if (pose) place(group, pose);
  }

  move(poses) {
    this.poses = poses;
    for (const [name, group] of this.frames) this.put(group, poses[name]);
  }

  /// Takes the scene; fetches its meshes when it is another than before.
  async show(scene) {
    const key = JSON.stringify(scene);
    if (key === this.loaded) return;
    const bodies = scene.bodies || [];
    this.loaded = key;
    for (const group of [this.root, ...this.frames.values()]) {
      for (const child of group.children.filter((child) => child.userData.body)) {
        group.remove(child);
        child.traverse((part) => part.geometry && part.geometry.dispose());
      }
    }
    this.replica = [];
    this.showHypotheses([]);
    const meshes = new Map();
    await Promise.all(bodies.map(async (body) => {
      try {
        if (!meshes.has(body.mesh)) meshes.set(body.mesh, fetchMesh(body.mesh));
        const geometry = await meshes.get(body.mesh);
        if (this.loaded === key) this.add(body, geometry);
      } catch (error) {
        console.warn(`body ${body.name}: ${error.message}`);
      }
    }));
    this.changed();
  }

  add(body, geometry) {
    const triangles =
        (geometry.index ? geometry.index.count : geometry.attributes.position.count) / 3;
    const edges = triangles <= edgesUpTo ? new THREE.EdgesGeometry(geometry, 25) : null;
    const put = (frame, material, edgeMaterial) => {
      const group = new THREE.Group();
      group.userData.body = body.name;
      if (material) group.add(new THREE.Mesh(geometry, material));
      if (edges && edgeMaterial) group.add(new THREE.LineSegments(edges, edgeMaterial));
      this.frame(frame).add(group);
    };
    const materials = this.materials;
    if (body.kind === 'replica') {
      this.replica.push({geometry, edges});
      put('replica', materials.replica, materials.edges);
      put('ghost', materials.ghost, materials.ghostEdges);
      put('ghost2', materials.ghost2, materials.ghost2Edges);
    } else if (body.kind === 'keepout') {
      put(body.frame, materials.keepout, materials.keepoutEdges);
    } else if (body.kind === 'cell' && /wall|ceiling|roof/i.test(body.name)) {
      put(body.frame, null, materials.wallEdges);  // walls would stand between the eye and the cell
    } else {
      put(body.frame, materials[body.kind] || materials.cell, materials.edges);
    }
  }

  /// The replica at each of these poses in the sensor frame, as glass.
  showHypotheses(poses) {
    const frame = this.frame('sensor');
    for (const group of this.hypotheses) frame.remove(group);
    this.hypotheses = poses.map((pose) => {
      const group = new THREE.Group();
      for (const {geometry, edges} of this.replica) {
        group.add(new THREE.Mesh(geometry, this.materials.ghost2));
        if (edges) group.add(new THREE.LineSegments(edges, this.materials.ghost2Edges));
      }
      place(group, pose);
      frame.add(group);
      return group;
    });
  }
}
