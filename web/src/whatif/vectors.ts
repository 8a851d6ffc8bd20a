// Vectors and rotations of the panel. No DOM.
import type { Vec3 } from "./settings";

export function length(v: readonly number[]): number {
  return Math.hypot(...v);
}
export function times(v: readonly number[], factor: number): Vec3 {
  return [factor * v[0], factor * v[1], factor * v[2]];
}
export function dot(a: readonly number[], b: readonly number[]): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
export function cross(a: readonly number[], b: readonly number[]): Vec3 {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

// Null: the zero vector.
export function unit(v: readonly number[]): Vec3 | null {
  const size = length(v);
  return size > 0 && Number.isFinite(size) ? [v[0] / size, v[1] / size, v[2] / size] : null;
}

// Rodrigues' formula; `axis` is a unit vector.
export function rotated(v: readonly number[], axis: readonly number[], angle: number): Vec3 {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  const [side, along] = [cross(axis, v), dot(axis, v) * (1 - c)];
  return [0, 1, 2].map((k) => v[k] * c + side[k] * s + axis[k] * along) as Vec3;
}

// By a quaternion w, x, y, z.
export function turned(v: readonly number[], q: readonly number[]): Vec3 {
  const [w, ...u] = q;
  const t = times(cross(u, v), 2);
  const more = cross(u, t);
  return [0, 1, 2].map((k) => v[k] + w * t[k] + more[k]) as Vec3;
}

// A unit vector with the digits of single precision removed, so that shown overrides are short.
export function shortUnit(v: readonly number[]): Vec3 | null {
  return unit(v.map((x) => Math.round(x * 1e6) / 1e6));
}
