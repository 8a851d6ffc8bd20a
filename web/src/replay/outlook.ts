// A view direction that separates arms and targets and does not hide the grasps behind bodies.
import { Mesh, MeshStandardMaterial, type Object3D, Raycaster, Vector3 } from "three";

export interface Sight {
  apart: Vector3[]; // points to separate: centres of bodies, end-effectors
  seen: Vector3[]; // points to keep visible: grasps
  bodies: Object3D[]; // bodies that may hide them
  span: number; // size of the scene [m]
}

const kPlanar = new Vector3(-0.25, -0.75, 0.85).normalize();

// Unit vector from the scene to the camera. Requires up-to-date world matrices of the bodies.
export function goodDirection(sight: Sight, planar: boolean): Vector3 {
  if (planar) return kPlanar.clone();
  const meshes: Mesh[] = [];
  for (const body of sight.bodies)
    body.traverse((o) => {
      if (o instanceof Mesh && o.material instanceof MeshStandardMaterial) meshes.push(o);
    });
  let best = kPlanar.clone();
  let most = -Infinity;
  for (const height of [0.14, 0.27, 0.4]) {
    for (let k = 0; k < 24; ++k) {
      const azimuth = ((k + 0.5) * Math.PI) / 12;
      const direction = new Vector3(Math.cos(azimuth) * Math.cos(height), Math.sin(azimuth) * Math.cos(height), Math.sin(height));
      const front = 0.06 * -direction.y; // prefers the front of equal directions
      const score = spread(sight.apart, direction) + 0.8 * visible(sight, direction, meshes) - 1.5 * (height - 0.27) ** 2 + front;
      if (score > most) {
        most = score;
        best = direction;
      }
    }
  }
  return best;
}

// Width of the points seen along a direction, relative to the maximum.
function spread(points: Vector3[], direction: Vector3): number {
  const right = new Vector3(-direction.y, direction.x, 0).normalize();
  const up = new Vector3().crossVectors(direction, right);
  let [seen, whole] = [0, 0];
  for (let i = 1; i < points.length; ++i) {
    for (let k = 0; k < i; ++k) {
      const d = points[i].clone().sub(points[k]);
      seen += Math.hypot(d.dot(right), 0.8 * d.dot(up));
      whole += d.length();
    }
  }
  return whole > 0 ? seen / whole : 0;
}

function visible(sight: Sight, direction: Vector3, meshes: Mesh[]): number {
  if (sight.seen.length === 0) return 0;
  let count = 0;
  const ray = new Raycaster();
  for (const point of sight.seen) {
    ray.set(point.clone().addScaledVector(direction, 0.03 * sight.span), direction);
    if (ray.intersectObjects(meshes, false).length === 0) ++count;
  }
  return count / sight.seen.length;
}
