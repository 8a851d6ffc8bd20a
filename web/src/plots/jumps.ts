// Samples of equal time. At an impact a run has several samples at one instant, where lines must be vertical. Plots
// require increasing times, so equal times are separated by much less than a pixel at any zoom.

import { stateRanks } from "../run";

export const kNudge = 1e-9; // of the whole duration

// The smallest part of the duration that may fill a plot: the separation then stays below 1/1000 of its width.
export const kSmallestWindow = 1e-5;

export function setApart(time: ArrayLike<number>, span: number): Float64Array {
  const step = Math.max(span, Number.MIN_VALUE) * kNudge;
  const result = new Float64Array(time.length);
  for (let i = 0; i < time.length; ++i) {
    result[i] = i > 0 && !(time[i] > result[i - 1]) ? result[i - 1] + step : time[i];
  }
  return result;
}

// Value of a line at an instant, linear between samples; at a jump the value after it, or with `before` that before it.
// If `before` is a number: that many samples of equal time before the last.
export function valueAt(time: ArrayLike<number>, values: ArrayLike<number>, instant: number, before: boolean | number = false): number {
  const n = time.length;
  if (typeof before === "number") {
    let last = valueIndex(time, instant);
    for (let k = 0; k < before && last > 0 && time[last - 1] === instant; ++k) --last;
    return last >= 0 && time[last] === instant ? values[last] : valueAt(time, values, instant);
  }
  if (n === 0 || instant < time[0] || instant > time[n - 1]) return NaN;
  let low = 0;
  let high = n - 1; // ends at the last sample not after the instant (with `before`: the first not before it)
  while (low < high) {
    const mid = before ? (low + high) >> 1 : (low + high + 1) >> 1;
    if (before) {
      if (time[mid] >= instant) high = mid;
      else low = mid + 1;
    } else if (time[mid] <= instant) low = mid;
    else high = mid - 1;
  }
  const next = before ? low - 1 : low + 1;
  if (time[low] === instant || next < 0 || next >= n) return values[low];
  const part = (instant - time[low]) / (time[next] - time[low]);
  return values[low] + part * (values[next] - values[low]);
}

// The last sample not after the instant; -1: none.
function valueIndex(time: ArrayLike<number>, instant: number): number {
  let [low, high] = [-1, time.length - 1];
  while (low < high) {
    const mid = (low + high + 1) >> 1;
    if (time[mid] <= instant) low = mid;
    else high = mid - 1;
  }
  return low;
}

// A line's samples with their times, and for each the index of its state among the states of equal time (Run.ranks);
// without it, equal values mean equal states.
export interface Sampled {
  time: ArrayLike<number>;
  values: ArrayLike<number>;
  ranks?: ArrayLike<number>;
}

// Tolerance for equal times of two runs, whose impact times have rounding errors: relative to the time.
const kSameInstant = 1e-9;

// B minus A at the samples of A. At an instant with several states, corresponding states are compared: those before a
// jump, and those after it.
export function difference(a: Sampled, b: Sampled): Float64Array {
  const [ranksA, ranksB] = [a, b].map(({ time, values, ranks }) => ranks ?? stateRanks(time, (i, k) => values[i] === values[k]));
  const result = new Float64Array(a.time.length);
  let k = 0;
  for (let first = 0; first < a.time.length; ) {
    const instant = a.time[first];
    let last = first;
    while (last + 1 < a.time.length && a.time[last + 1] === instant) ++last;
    const near = kSameInstant * Math.max(1, Math.abs(instant));
    while (k < b.time.length && b.time[k] < instant - near) ++k;
    let end = k;
    while (end < b.time.length && b.time[end] <= instant + near) ++end;
    const alike = end - k === last - first + 1; // one sample for each
    for (let i = first; i <= last; ++i) {
      const at = alike ? k + i - first : like(ranksA[i], ranksA[last], ranksB, k, end);
      const other = end > k ? b.values[at] : valueAt(b.time, b.values, instant);
      result[i] = other - a.values[i];
    }
    first = last + 1;
  }
  return result;
}

// The sample of B between `begin` and `end` with the state of that rank. If B has another number of states, the last
// corresponds to the last, and the others are counted from the first.
function like(rank: number, lastRank: number, ranks: ArrayLike<number>, begin: number, end: number): number {
  if (rank === lastRank) return end - 1;
  const most = ranks[end - 1] - (ranks[end - 1] > 0 ? 1 : 0);
  for (let i = begin; i < end; ++i) if (ranks[i] === Math.min(rank, most)) return i;
  return begin;
}

// Lines with several time bases on a common one, for uPlot: `undefined` where a line has no sample, which uPlot skips;
// NaN becomes null, a gap.
export function onCommonTime(
  times: Float64Array[],
  lines: { run: number; values: Float64Array }[],
): { time: Float64Array; values: (number | null | undefined)[][] } {
  const time = union(times);
  const at = times.map((one) => positions(time, one));
  const values = lines.map((line) => {
    const row: (number | null | undefined)[] = new Array(time.length).fill(undefined);
    const where = at[line.run];
    for (let i = 0; i < line.values.length && i < where.length; ++i) {
      row[where[i]] = Number.isFinite(line.values[i]) ? line.values[i] : null;
    }
    return row;
  });
  return { time, values };
}

function union(times: Float64Array[]): Float64Array {
  if (times.length === 1) return times[0];
  const all = new Float64Array(times.reduce((sum, one) => sum + one.length, 0));
  let end = 0;
  for (const one of times) {
    all.set(one, end);
    end += one.length;
  }
  all.sort();
  return all.filter((value, i) => i === 0 || value !== all[i - 1]);
}

function positions(all: Float64Array, some: Float64Array): Int32Array {
  const result = new Int32Array(some.length);
  let k = 0;
  for (let i = 0; i < some.length; ++i) {
    while (k < all.length && all[k] < some[i]) ++k;
    result[i] = k;
  }
  return result;
}
