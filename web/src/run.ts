// One decoded run: its series as typed arrays, found by path and sampled at any instant.
import type { PartlySummary, PackedSeries, RunData, Scene } from "./data";

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

const kRounding = 1e-6; // of single precision, relative to the largest

export class Run {
  readonly time: Float64Array; // [s], never decreasing; equal times at an impact
  readonly phase: Uint8Array;
  readonly phases: PhaseSpan[]; // in order of time; names may repeat
  private readonly byPath = new Map<string, Series>();
  private readonly largest: Record<string, number> = {}; // by path
  private ranked: Uint16Array | null = null;
  private stated: { time: number; back: number }[] | null = null;

  constructor(readonly data: RunData) {
    const packed = data.series;
    this.time = packed ? new Float64Array(bytesOf(packed.time).buffer) : new Float64Array();
    this.phase = packed ? bytesOf(packed.phase) : new Uint8Array();
    if (packed) this.decode(packed);
    this.phases = spans(this.time, this.phase, packed?.phases ?? []);
  }

  get summary(): PartlySummary {
    return this.data.summary ?? {};
  }
  // From here on bodies overlap, and the model is not valid [s]; null: valid to the end.
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

  // Per sample: the index of its state among the different states of equal time. At an impact: 0 just before, 1 just
  // after, although both adjacent phases have a sample of each.
  get ranks(): Uint16Array {
    return (this.ranked ??= stateRanks(this.time, (i, k) => this.alike(i, k)));
  }

  // Every different state in the order of time, as located by locate(): the steps of playback.
  get states(): { time: number; back: number }[] {
    return (this.stated ??= statesOf(this.time, this.ranks));
  }

  // Whether two samples show the same motion: velocities equal to within rounding error. Loads and references may
  // differ between phases.
  private alike(i: number, k: number): boolean {
    for (const { path, data, width } of this.byPath.values()) {
      if (!/(^|\/)(angular_)?velocity$/.test(path)) continue;
      const scale = (this.largest[path] ??= data.reduce((most, x) => (Math.abs(x) > most ? Math.abs(x) : most), 0));
      for (let c = 0; c < width; ++c) if (Math.abs(data[i * width + c] - data[k * width + c]) > kRounding * scale) return false;
    }
    return true;
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

  // Position of an instant: between sample `index` and the next, at `fraction`. Of several samples of that time it is
  // the last, or with `back` that many before it.
  locate(time: number, back = 0): Instant {
    const n = this.time.length;
    if (n === 0) return { index: 0, fraction: 0 };
    let low = 0;
    let high = n - 1; // last sample not after `time`
    while (low < high) {
      const mid = (low + high + 1) >> 1;
      if (this.time[mid] <= time) low = mid;
      else high = mid - 1;
    }
    if (back > 0 && this.time[low] === time) {
      let index = low;
      while (index > 0 && low - index < back && this.time[index - 1] === time) --index;
      return { index, fraction: 0 };
    }
    if (low === n - 1) return { index: low, fraction: 0 };
    const step = this.time[low + 1] - this.time[low];
    return { index: low, fraction: step > 0 ? Math.min(1, Math.max(0, (time - this.time[low]) / step)) : 0 };
  }

  // A series at an instant, linear between samples.
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

// Damaged series do not hide the other parts.
export function decodedRun(data: RunData): Run {
  const notes = Array.isArray(data.notes) ? data.notes : [];
  const whole = { ...data, notes, summary: data.summary ?? {} };
  try {
    return new Run(whole);
  } catch (error) {
    return new Run({
      ...whole,
      series: null,
      notes: [...notes, `The time series is damaged and not shown: ${(error as Error).message}`],
    });
  }
}

// Between sample `index` and the next.
export interface Instant {
  index: number;
  fraction: number;
}

export function stateRanks(time: ArrayLike<number>, alike: (i: number, k: number) => boolean): Uint16Array {
  const ranks = new Uint16Array(time.length);
  for (let i = 1; i < time.length; ++i)
    if (time[i] === time[i - 1]) ranks[i] = ranks[i - 1] + (alike(i, i - 1) ? 0 : 1);
  return ranks;
}

// Of equal samples of one time, the first, which belongs to the phase that ends there; except for the last state, which
// requires no `back`.
function statesOf(time: Float64Array, ranks: Uint16Array): { time: number; back: number }[] {
  const states: { time: number; back: number }[] = [];
  for (let first = 0; first < time.length; ) {
    let last = first;
    while (last + 1 < time.length && time[last + 1] === time[first]) ++last;
    for (let i = first; i <= last; ++i) {
      if (i > first && ranks[i] === ranks[i - 1]) continue;
      states.push({ time: time[first], back: ranks[i] === ranks[last] ? 0 : last - i });
    }
    first = last + 1;
  }
  return states;
}

// Decodes base64.
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
