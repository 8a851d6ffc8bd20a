// Paths of points: the whole path faint, the part up to now strong.
import { BufferAttribute, BufferGeometry, Group, type InstancedInterleavedBuffer, type InterleavedBufferAttribute, Line, type Material } from "three";
import { Line2 } from "three/examples/jsm/lines/Line2.js";
import { LineGeometry } from "three/examples/jsm/lines/LineGeometry.js";
import type { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import type { Instant } from "../run";

export class Trail {
  readonly object = new Group();
  private readonly done: Line2;
  private readonly ends: InstancedInterleavedBuffer; // per segment: x, y, z of its start, then of its end
  private shortened = -1; // segment that ends at the current instant instead of its sample

  // `points`: x, y, z per sample.
  constructor(
    private readonly points: Float32Array,
    strong: LineMaterial,
    faint: Material,
  ) {
    const whole = new BufferGeometry();
    const geometry = new LineGeometry();
    geometry.setPositions(points);
    this.done = new Line2(geometry, strong);
    this.done.frustumCulled = false;
    this.ends = (geometry.getAttribute("instanceEnd") as InterleavedBufferAttribute).data as InstancedInterleavedBuffer;
    whole.setAttribute("position", new BufferAttribute(thinned(points), 3));
    const line = new Line(whole, faint);
    line.frustumCulled = false;
    this.object.add(line, this.done);
  }

  update(instant: Instant): void {
    const { index, fraction } = instant;
    const segments = this.points.length / 3 - 1;
    const buffer = this.ends.array as Float32Array;
    if (this.shortened >= 0) this.setEnd(buffer, this.shortened, 1);
    this.shortened = -1;
    let shown = Math.min(index, segments);
    if (fraction > 0 && index < segments) {
      this.setEnd(buffer, index, fraction);
      this.shortened = index;
      shown = index + 1;
    }
    this.ends.needsUpdate = true;
    this.done.geometry.instanceCount = shown;
    this.done.visible = shown > 0;
  }

  private setEnd(buffer: Float32Array, segment: number, fraction: number): void {
    for (let c = 0; c < 3; ++c) {
      const a = this.points[3 * segment + c];
      buffer[6 * segment + 3 + c] = a + fraction * (this.points[3 * segment + 3 + c] - a);
    }
  }
}

// Points with a minimum distance: some drivers draw hundreds of segments smaller than a pixel at wrong depths.
function thinned(points: Float32Array): Float32Array {
  const retained: number[] = [];
  let size = 0;
  for (let i = 3; i < points.length; i += 3) {
    size = Math.max(size, Math.hypot(points[i] - points[0], points[i + 1] - points[1], points[i + 2] - points[2]));
  }
  const least = 0.004 * size;
  for (let i = 0; i < points.length; i += 3) {
    const k = retained.length;
    const apart = k === 0 || Math.hypot(points[i] - retained[k - 3], points[i + 1] - retained[k - 2], points[i + 2] - retained[k - 1]) >= least;
    if (apart) retained.push(points[i], points[i + 1], points[i + 2]);
  }
  return new Float32Array(retained);
}
