// One run, decoded: its series as typed arrays, looked up by path and sampled at any instant.
import type { PackedSeries, RunData, Scene } from "./data";

export interface Series {
  path: string; // "base/position"
  unit: string;
  description: string;
  components: string[];
  width: number;
  data: Float32Array; // samples x width
}

export interface PhaseSpan {
  name: string;
  begin: number; // [s]
  end: number;
  first: number; // samples
  last: number;
}

export class Run {
  readonly time: Float64Array; // [s], never decreasing; equal times at an impact
  readonly phase: Uint8Array;
  readonly phases: PhaseSpan[]; // in order of time; a name may come again
  private readonly byPath = new Map<string, Series>();

  constructor(readonly data: RunData) {
    const packed = data.series;
    this.time = packed ? new Float64Array(bytesOf(packed.time).buffer) : new Float64Array();
    this.phase = packed ? bytesOf(packed.phase) : new Uint8Array();
    if (packed) this.decode(packed);
    this.phases = spans(this.time, this.phase, packed?.phases ?? []);
  }

  get summary(): any {
    return this.data.summary;
  }
  // From here on bodies overlap: what follows is beyond what the model can say [s]; null: to the end.
  get validUntil(): number | null {
    const until = this.data.summary?.feasibility?.valid_until;
    return typeof until === "number" && Number.isFinite(until) ? until : null;
  }
  get scene(): Scene | null {
    return this.data.scene;
  }
  get samples(): number {
    return this.time.length;
  }
  get begin(): number {
    return this.time[0] ?? 0;
  }
  get end(): number {
    return this.time[this.time.length - 1] ?? 0;
  }

  series(path: string): Series | undefined {
    return this.byPath.get(path);
  }
  all(): Series[] {
    return [...this.byPath.values()];
  }

  private decode(packed: PackedSeries): void {
    for (const one of packed.series) {
      const width = one.components.length;
      const data = new Float32Array(bytesOf(one.data).buffer);
      if (data.length !== packed.samples * width) throw new Error(`${one.path}: damaged data`);
      this.byPath.set(one.path, { ...one, width, data });
    }
    if (this.time.length !== packed.samples) throw new Error("time: damaged data");
  }

  // Where an instant lies: between sample `index` and the next, `fraction` of the way.
  locate(time: number): Instant {
    const n = this.time.length;
    if (n === 0) return { index: 0, fraction: 0 };
    let low = 0;
    let high = n - 1; // last sample that is not after `time`
    while (low < high) {
      const mid = (low + high + 1) >> 1;
      if (this.time[mid] <= time) low = mid;
      else high = mid - 1;
    }
    if (low === n - 1) return { index: low, fraction: 0 };
    const step = this.time[low + 1] - this.time[low];
    return { index: low, fraction: step > 0 ? Math.min(1, Math.max(0, (time - this.time[low]) / step)) : 0 };
  }

  // A series at an instant, linearly between samples.
  at(series: Series, instant: Instant): number[] {
    const { index, fraction } = instant;
    const w = series.width;
    const next = Math.min(index + 1, this.time.length - 1);
    const values: number[] = [];
    for (let c = 0; c < w; ++c) {
      const a = series.data[index * w + c];
      values.push(fraction === 0 ? a : a + fraction * (series.data[next * w + c] - a));
    }
    return values;
  }
}

// Between sample `index` and the next.
export interface Instant {
  index: number;
  fraction: number;
}

// The bytes that base64 stands for.
export function bytesOf(base64: string): Uint8Array<ArrayBuffer> {
  const text = atob(base64);
  const result = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) result[i] = text.charCodeAt(i);
  return result;
}

function spans(time: Float64Array, phase: Uint8Array, names: string[]): PhaseSpan[] {
  const result: PhaseSpan[] = [];
  for (let i = 0; i < time.length; ++i) {
    if (i === 0 || phase[i] !== phase[i - 1])
      result.push({ name: names[phase[i]] ?? "?", begin: time[i], end: time[i], first: i, last: i });
    const span = result[result.length - 1];
    span.end = time[i];
    span.last = i;
  }
  return result;
}
