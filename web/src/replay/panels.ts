// Thin rectangular plates (solar panels, radiators), drawn dark with cells, which makes slow rotation visible.
import { BufferAttribute, BufferGeometry, Vector3 } from "three";

const kThin = 0.08; // maximum ratio of thickness to the shorter edge
const kFilled = 0.85; // minimum share of the rectangle that the plate's faces fill

export interface Plate {
  centre: Vector3;
  u: Vector3; // unit, along the longer edge
  v: Vector3;
  size: [number, number, number]; // along u, v and across
}

// The plate of a box, by its edges; undefined: the box is not thin.
export function plateOfBox(size: readonly number[]): Plate | undefined {
  const order = [0, 1, 2].sort((a, b) => size[b] - size[a]);
  const [long, short, thin] = order.map((k) => size[k]);
  if (!(thin > 0) || thin > kThin * short) return undefined;
  const axis = (k: number) => new Vector3(Number(k === 0), Number(k === 1), Number(k === 2));
  return { centre: new Vector3(), u: axis(order[0]), v: axis(order[1]), size: [long, short, thin] };
}

// Connected triangles, by coincident vertices: lists of triangle indices.
export function connectedParts(vertices: ArrayLike<number>, triangles: ArrayLike<number>): number[][] {
  const byPlace = new Map<string, number>();
  const place = Array.from({ length: vertices.length / 3 }, (_, i) => {
    const key = `${vertices[3 * i]} ${vertices[3 * i + 1]} ${vertices[3 * i + 2]}`;
    if (!byPlace.has(key)) byPlace.set(key, byPlace.size);
    return byPlace.get(key)!;
  });
  const parent = Array.from({ length: byPlace.size }, (_, i) => i);
  const root = (i: number): number => {
    while (parent[i] !== i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (let t = 0; t + 2 < triangles.length; t += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => root(place[triangles[t + k]]));
    parent[b] = a;
    parent[root(c)] = a;
  }
  const parts = new Map<number, number[]>();
  for (let t = 0; t + 2 < triangles.length; t += 3) {
    const own = root(place[triangles[t]]);
    if (!parts.has(own)) parts.set(own, []);
    parts.get(own)!.push(t / 3);
  }
  return [...parts.values()];
}

// The plate of some triangles of a mesh; undefined: they are not a thin rectangle.
export function plateOf(vertices: ArrayLike<number>, triangles: ArrayLike<number>, part: number[]): Plate | undefined {
  const corner = (t: number, k: number) => new Vector3().fromArray(vertices as number[], 3 * triangles[3 * t + k]);
  const faces = part.map((t) => {
    const [a, b, c] = [0, 1, 2].map((k) => corner(t, k));
    const cross = b.clone().sub(a).cross(c.clone().sub(a));
    return { corners: [a, b, c], area: cross.length() / 2, normal: cross.normalize() };
  });
  const largest = faces.reduce((best, one) => (one.area > best.area ? one : best), faces[0]);
  if (!largest || !(largest.area > 0)) return undefined;
  const n = largest.normal;
  const edges = largest.corners.map((c, k) => largest.corners[(k + 1) % 3].clone().sub(c)).sort((a, b) => a.length() - b.length());
  const u = edges[1].clone().normalize(); // the longest edge of half a rectangle is its diagonal
  const v = n.clone().cross(u);
  const range = (axis: Vector3): [number, number] => {
    const values = faces.flatMap((face) => face.corners.map((c) => c.dot(axis)));
    return [Math.min(...values), Math.max(...values)];
  };
  const [ru, rv, rn] = [range(u), range(v), range(n)];
  const [lu, lv, thin] = [ru[1] - ru[0], rv[1] - rv[0], rn[1] - rn[0]];
  const flat = faces.filter((face) => Math.abs(face.normal.dot(n)) > 0.999).reduce((sum, face) => sum + face.area, 0);
  const sides = thin > 1e-9 * lu ? 2 : 1;
  if (thin > kThin * Math.min(lu, lv) || flat < kFilled * sides * lu * lv) return undefined;
  const middle = ([a, b]: [number, number]) => (a + b) / 2;
  const centre = u.clone().multiplyScalar(middle(ru)).addScaledVector(v, middle(rv)).addScaledVector(n, middle(rn));
  return lu >= lv ? { centre, u, v, size: [lu, lv, thin] } : { centre, u: v, v: u, size: [lv, lu, thin] };
}

// The edges of the plate's cells, on both sides.
export function cellLines(plate: Plate): BufferGeometry {
  const [long, short, thin] = plate.size;
  const across = Math.min(6, Math.max(2, Math.round((4 * short) / Math.max(short, long / 6))));
  const along = Math.min(40, Math.max(2, Math.round((long * across) / short)));
  const n = plate.u.clone().cross(plate.v);
  const points: number[] = [];
  const add = (a: number, b: number, side: number): void => {
    const at = plate.centre.clone().addScaledVector(plate.u, a).addScaledVector(plate.v, b).addScaledVector(n, side);
    points.push(at.x, at.y, at.z);
  };
  for (const side of [-1, 1].map((sign) => sign * (0.5 * thin + 0.002 * short))) {
    for (let i = 1; i < along; ++i) for (const end of [-0.5, 0.5]) add((i / along - 0.5) * long, end * short, side);
    for (let k = 1; k < across; ++k) for (const end of [-0.5, 0.5]) add(end * long, (k / across - 0.5) * short, side);
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(points), 3));
  return geometry;
}

