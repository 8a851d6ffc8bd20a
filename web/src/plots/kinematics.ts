// Motion of points and attitudes from series.
import type { Quat, Vec3 } from "../data";

export function cross(a: ArrayLike<number>, b: ArrayLike<number>): Vec3 {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

// A body's vector in W; the quaternion turns the body's axes into W's.
export function rotate(q: Quat, v: Vec3): Vec3 {
  const [w, x, y, z] = q;
  const t = cross([x, y, z], v).map((c) => 2 * c) as Vec3;
  const u = cross([x, y, z], t);
  return [v[0] + w * t[0] + u[0], v[1] + w * t[1] + u[1], v[2] + w * t[2] + u[2]];
}

// v + omega x R p: velocity of a point that is fixed at `point` in a body's frame.
export function pointVelocity(velocity: Vec3, angularVelocity: Vec3, attitude: Quat, point: Vec3): Vec3 {
  const arm = cross(angularVelocity, rotate(attitude, point));
  return [velocity[0] + arm[0], velocity[1] + arm[1], velocity[2] + arm[2]];
}

// The same for every sample; arrays hold samples x 3 (attitude: x 4).
export function pointVelocities(
  velocity: ArrayLike<number>,
  angularVelocity: ArrayLike<number>,
  attitude: ArrayLike<number>,
  point: Vec3,
): Float64Array {
  const samples = Math.floor(velocity.length / 3);
  const result = new Float64Array(samples * 3);
  for (let i = 0; i < samples; ++i) {
    const q: Quat = [attitude[4 * i], attitude[4 * i + 1], attitude[4 * i + 2], attitude[4 * i + 3]];
    result.set(pointVelocity(triple(velocity, i), triple(angularVelocity, i), q, point), 3 * i);
  }
  return result;
}

// Angle of the rotation between two attitudes, 0 to pi [rad]. By the vector part of the relative quaternion: accurate
// for small angles, unlike the arc cosine of its scalar part.
export function turnBetween(a: ArrayLike<number>, b: ArrayLike<number>): number {
  const scalar = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
  const [u, v] = [[a[1], a[2], a[3]], [b[1], b[2], b[3]]];
  const w = cross(u, v);
  const vector = [0, 1, 2].map((k) => a[0] * v[k] - b[0] * u[k] - w[k]);
  return 2 * Math.atan2(Math.hypot(...vector), Math.abs(scalar));
}

// Rotation vectors of attitudes [rad], samples x 3. Of equivalent vectors, whose angles differ by full turns, the one
// closest to the previous sample is used, so that continued rotation causes no jumps.
export function rotationVectors(attitude: ArrayLike<number>): Float64Array {
  const samples = Math.floor(attitude.length / 4);
  const result = new Float64Array(samples * 3);
  let before: Vec3 = [0, 0, 0];
  for (let i = 0; i < samples; ++i) {
    const q: Quat = [attitude[4 * i], attitude[4 * i + 1], attitude[4 * i + 2], attitude[4 * i + 3]];
    before = rotationVector(q, before);
    result.set(before, 3 * i);
  }
  return result;
}

function rotationVector(q: Quat, near: Vec3): Vec3 {
  const sine = Math.hypot(q[1], q[2], q[3]);
  const angle = 2 * Math.atan2(sine, q[0]);
  // At zero rotation the axis is undefined: the previous axis is used for full turns.
  const size = Math.hypot(...near);
  const axis: Vec3 =
    sine > 1e-12
      ? [q[1] / sine, q[2] / sine, q[3] / sine]
      : size > 0
        ? [near[0] / size, near[1] / size, near[2] / size]
        : [0, 0, 1];
  const along = axis[0] * near[0] + axis[1] * near[1] + axis[2] * near[2];
  const full = angle + 2 * Math.PI * Math.round((along - angle) / (2 * Math.PI));
  return [axis[0] * full, axis[1] * full, axis[2] * full];
}

// Lengths of vectors, samples x width.
export function magnitudes(vectors: ArrayLike<number>, width: number): Float64Array {
  const samples = Math.floor(vectors.length / width);
  const result = new Float64Array(samples);
  for (let i = 0; i < samples; ++i) {
    let sum = 0;
    for (let c = 0; c < width; ++c) sum += vectors[i * width + c] ** 2;
    result[i] = Math.sqrt(sum);
  }
  return result;
}

export function triple(values: ArrayLike<number>, sample: number): Vec3 {
  return [values[3 * sample], values[3 * sample + 1], values[3 * sample + 2]];
}
