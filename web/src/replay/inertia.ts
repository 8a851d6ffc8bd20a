// The solid box that has a body's mass and inertia: what is drawn of bodies without geometry.
import { Matrix4, Quaternion, Vector3 } from "three";

export interface InertiaBox {
  size: Vector3;
  quaternion: Quaternion; // from the box's axes to the body's
}

// Undefined: mass or inertia are none of a solid.
export function inertiaBox(mass: number, inertia: readonly number[]): InertiaBox | undefined {
  const [xx, yy, zz, xy, xz, yz] = inertia;
  if (!(mass > 0) || !inertia.every(Number.isFinite) || xx + yy + zz <= 0) return undefined;
  const { values, vectors } = principal([
    [xx, xy, xz],
    [xy, yy, yz],
    [xz, yz, zz],
  ]);
  const sum = values[0] + values[1] + values[2];
  // I1 = m (b^2 + c^2) / 12, ..., so a^2 = 6 (I2 + I3 - I1) / m; a rod keeps a little thickness.
  const longest = Math.sqrt((6 * sum) / mass);
  const edge = (moment: number) => Math.max(Math.sqrt(Math.max(0, (6 * (sum - 2 * moment)) / mass)), 0.02 * longest);
  const [x, y, z] = vectors.map((v) => new Vector3(...v));
  if (new Vector3().crossVectors(x, y).dot(z) < 0) z.negate();
  return {
    size: new Vector3(edge(values[0]), edge(values[1]), edge(values[2])),
    quaternion: new Quaternion().setFromRotationMatrix(new Matrix4().makeBasis(x, y, z)),
  };
}

type Row = [number, number, number];

// Eigenvalues and unit eigenvectors of a symmetric matrix, by Jacobi's rotations.
function principal(a: Row[]): { values: Row; vectors: Row[] } {
  const v: Row[] = [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
  ]; // rows become the eigenvectors
  for (let sweep = 0; sweep < 30; ++sweep) {
    for (const [p, q] of [
      [0, 1],
      [0, 2],
      [1, 2],
    ]) {
      if (Math.abs(a[p][q]) < 1e-300) continue;
      const angle = 0.5 * Math.atan2(2 * a[p][q], a[q][q] - a[p][p]);
      rotate(a, v, p, q, Math.cos(angle), Math.sin(angle));
    }
  }
  return { values: [a[0][0], a[1][1], a[2][2]], vectors: v };
}

function rotate(a: Row[], v: Row[], p: number, q: number, c: number, s: number): void {
  for (let k = 0; k < 3; ++k) {
    const [x, y] = [a[k][p], a[k][q]];
    a[k][p] = c * x - s * y;
    a[k][q] = s * x + c * y;
  }
  for (let k = 0; k < 3; ++k) {
    const [x, y] = [a[p][k], a[q][k]];
    a[p][k] = c * x - s * y;
    a[q][k] = s * x + c * y;
    const [e, f] = [v[p][k], v[q][k]];
    v[p][k] = c * e - s * f;
    v[q][k] = s * e + c * f;
  }
}
