// Samples of equal time. At an impact a run has several samples at one instant; a line is to go up or down vertically
// there. Plots want times that grow, so equal ones are set apart by far less than a pixel of any zoom allowed.

export const kNudge = 1e-9; // of the whole duration

// The smallest part of the duration that may fill a plot: a nudge then stays below 1/1000 of its width.
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
export function valueAt(time: ArrayLike<number>, values: ArrayLike<number>, instant: number, before = false): number {
  const n = time.length;
  if (n === 0 || instant < time[0] || instant > time[n - 1]) return NaN;
  let low = 0;
  let high = n - 1; // ends at the last sample that is not after the instant (with `before`: first that is not before it)
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

// B minus A at the samples of A. At a jump of A the sample before it is compared with B before it.
export function difference(
  timeA: ArrayLike<number>,
  valuesA: ArrayLike<number>,
  timeB: ArrayLike<number>,
  valuesB: ArrayLike<number>,
): Float64Array {
  const result = new Float64Array(timeA.length);
  for (let i = 0; i < timeA.length; ++i) {
    const before = i + 1 < timeA.length && timeA[i + 1] === timeA[i];
    result[i] = valueAt(timeB, valuesB, timeA[i], before) - valuesA[i];
  }
  return result;
}

// Lines of several time bases on a common one, for uPlot: where a line has no sample `undefined` lets it pass straight
// through; NaN becomes null, a gap.
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
