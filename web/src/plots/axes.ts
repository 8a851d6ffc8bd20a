// Ranges and ticks of axes, for both screen and files. A logarithmic axis has log10 of its values.
import { number } from "../format";

export interface Range {
  min: number;
  max: number;
}

// Steps of 1, 2 or 5 times a power of ten, about `count` of them.
export function ticks(range: Range, count: number): number[] {
  const span = range.max - range.min;
  if (!(span > 0) || !Number.isFinite(span)) return [range.min];
  const step = niceStep(span / Math.max(1, count));
  const result: number[] = [];
  for (let k = Math.ceil(range.min / step - 1e-9); k * step <= range.max + 1e-9 * span; ++k) result.push(k * step + 0);
  return result;
}

function niceStep(rough: number): number {
  const power = 10 ** Math.floor(Math.log10(rough));
  const part = rough / power;
  return power * (part <= 1 ? 1 : part <= 2 ? 2 : part <= 5 ? 5 : 10);
}

// Whole decades, or every second, third, ... decade.
export function decadeTicks(range: Range, count: number): number[] {
  const step = Math.max(1, Math.ceil((range.max - range.min) / Math.max(1, count)));
  const result: number[] = [];
  for (let k = Math.ceil(range.min); k <= range.max; ++k) if (k % step === 0) result.push(k);
  return result;
}

// With as many decimals as the step between ticks requires.
export function tickTexts(values: number[]): string[] {
  if (values.length === 0) return [];
  const step = values.length > 1 ? values[1] - values[0] : Math.abs(values[0]) || 1;
  const largest = Math.max(...values.map(Math.abs));
  if (largest >= 1e5 || (largest > 0 && largest < 1e-3)) {
    const exponent = Math.floor(Math.log10(largest) + 1e-9);
    const digits = Math.max(0, exponent - Math.floor(Math.log10(step) + 1e-9));
    return values.map((v) =>
      v === 0 ? "0" : `${(v / 10 ** exponent).toFixed(digits)}e${exponent}`.replace(/-/g, "−"),
    );
  }
  const decimals = Math.min(12, Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
  return values.map((v) =>
    v
      .toFixed(decimals)
      .replace(/^-(?=0(\.0+)?$)/, "")
      .replace("-", "−"),
  );
}

const kSuperscripts = "⁰¹²³⁴⁵⁶⁷⁸⁹";
export function decadeText(exponent: number): string {
  const sign = exponent < 0 ? "⁻" : "";
  return `10${sign}${String(Math.abs(exponent)).replace(/\d/g, (d) => kSuperscripts[Number(d)])}`;
}

// Margin above and below. Values that are constant to within rounding error are not magnified to fill the plot.
export function padded(low: number, high: number): Range {
  if (!(high >= low)) return { min: -1, max: 1 };
  const size = Math.max(Math.abs(low), Math.abs(high));
  const least = Math.max(1e-6 * size, 1e-12);
  if (high - low < least) {
    const half = size < 1e-12 ? 1 : Math.max(0.5 * least, 0.05 * size);
    return { min: (low + high) / 2 - half, max: (low + high) / 2 + half };
  }
  const room = 0.06 * (high - low);
  return { min: low - room, max: high + room };
}

// The range of the data with the limits close to it. Distant limits would flatten the lines; they are named at the edge
// instead.
export function withLimits(low: number, high: number, limits: readonly number[]): { low: number; high: number } {
  if (!(high >= low)) return limits.length > 0 ? { low: Math.min(...limits), high: Math.max(...limits) } : { low, high };
  const room = 1.5 * Math.max(high - low, 0.25 * Math.max(Math.abs(low), Math.abs(high)));
  const near = limits.filter((limit) => limit >= low - room && limit <= high + room);
  return { low: Math.min(low, ...near), high: Math.max(high, ...near) };
}

interface NamedLimit {
  label: string;
  value: number;
}

// A limit on an axis; on a logarithmic one its log10.
export function limitAt(value: number, log: boolean): number {
  return log ? Math.log10(value) : value;
}

// Limits beyond the axis, for the strip above a plot: "↑ limit 418.9, off scale". The two signs of a limit are one entry.
export function offScale(limits: readonly NamedLimit[], range: Range, log = false): string[] {
  const [below, above] = [(v: number) => !(limitAt(v, log) >= range.min), (v: number) => limitAt(v, log) > range.max];
  const beyond = limits.filter(({ value }) => below(value) || above(value));
  const opposite = (one: NamedLimit) => one.value !== 0 && beyond.some((other) => other.label === one.label && other.value === -one.value);
  return beyond
    .filter((one) => one.value >= 0 || !opposite(one))
    .map((one) => {
      const [mark, sign] = opposite(one) ? ["↕", "±"] : [above(one.value) ? "↑" : "↓", ""];
      return `${mark} ${one.label} ${sign}${number(one.value)}, off scale`;
    });
}

// Minimum and maximum of the values within a time window; null: none.
export function extent(time: ArrayLike<number>, values: ArrayLike<number>, window: Range): Range | null {
  let min = Infinity;
  let max = -Infinity;
  for (let i = 0; i < values.length; ++i) {
    // A sample just outside contributes the value at which the line enters or leaves the window.
    const near =
      (time[i] >= window.min || (i + 1 < time.length && time[i + 1] > window.min)) &&
      (time[i] <= window.max || (i > 0 && time[i - 1] < window.max));
    if (!near || !Number.isFinite(values[i])) continue;
    const v = clippedAtEdges(time, values, i, window);
    if (v < min) min = v;
    if (v > max) max = v;
  }
  return min <= max ? { min, max } : null;
}

function clippedAtEdges(time: ArrayLike<number>, values: ArrayLike<number>, i: number, window: Range): number {
  const edge = time[i] < window.min ? window.min : time[i] > window.max ? window.max : NaN;
  if (Number.isNaN(edge)) return values[i];
  const other = time[i] < window.min ? i + 1 : i - 1;
  const step = time[other] - time[i];
  if (step === 0 || !Number.isFinite(values[other])) return values[i];
  return values[i] + ((edge - time[i]) / step) * (values[other] - values[i]);
}

// log10, with zeros and values below the floor at the bottom of the axis.
export function logValues(values: Float64Array, floor: number): Float64Array {
  return values.map((v) => (Number.isNaN(v) ? NaN : Math.log10(Math.max(v, floor))));
}

// The decade below the smallest positive value, but not below rounding errors of numbers near 1 (10^-18), unless all
// values are smaller. `lowest`: the lowest decade.
export function logFloor(lines: Float64Array[], lowest = 0): number {
  let least = Infinity;
  let most = 0;
  for (const line of lines) {
    for (const v of line) {
      if (v > 0 && v < least) least = v;
      if (v > most) most = v;
    }
  }
  if (most === 0) return 1e-18;
  const decade = Math.log10(least);
  const bottom = Math.floor(decade) - (decade % 1 === 0 ? 1 : 0);
  return 10 ** Math.max(bottom, Math.min(-18, Math.floor(Math.log10(most)) - 3), lowest > 0 ? Math.log10(lowest) : -Infinity);
}
