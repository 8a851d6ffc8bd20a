// A direction to look from, chosen so that arms and targets lie apart and the grasps are not hidden behind bodies.
import { Mesh, MeshStandardMaterial, type Object3D, Raycaster, Vector3 } from "three";

export interface Sight {
  apart: Vector3[]; // what should lie apart: centres of bodies, end-effectors
  seen: Vector3[]; // what should be seen: grasps
  bodies: Object3D[]; // what may hide it
  span: number; // size of it all [m]
}

const kPlanar = new Vector3(-0.25, -0.75, 0.85).normalize();

// From the scene to the camera, unit. Bodies' world matrices are to be up to date.
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
      const front = 0.06 * -direction.y; // of equals the one from the front
      const score = spread(sight.apart, direction) + 0.8 * visible(sight, direction, meshes) - 1.5 * (height - 0.27) ** 2 + front;
      if (score > most) {
        most = score;
        best = direction;
      }
    }
  }
  return best;
}

// How wide points lie as seen along a direction, over how wide they can.
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
