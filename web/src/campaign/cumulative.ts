// The distribution function of a column over all rows, from bin counts and quantiles. No DOM.
import type { Described } from "./model";

export interface CumulativePoint {
  value: number;
  share: number; // of numbers up to `value`
}

// Exact at the bins' edges, at the quantiles and at both ends; linear in between.
export function cumulative(of: Described): CumulativePoint[] {
  const points: CumulativePoint[] = [];
  const add = (value: number, share: number): void => {
    if (Number.isFinite(value) && share >= 0 && share <= 1) points.push({ value, share });
  };
  const { histogram } = of;
  if (histogram) {
    const total = histogram.counts.reduce((sum, c) => sum + c, 0) + histogram.below + histogram.above;
    const step = (histogram.end - histogram.begin) / histogram.counts.length;
    let before = histogram.below;
    add(of.least, 0);
    if (total > 0) add(histogram.begin, before / total);
    histogram.counts.forEach((count, k) => {
      before += count;
      if (total > 0) add(histogram.begin + (k + 1) * step, before / total);
    });
  }
  if (of.count > 0) add(of.largest, 1);
  for (const q of of.quantiles) add(q.value, q.probability);
  points.sort((a, b) => a.value - b.value || a.share - b.share);
  // The sources agree to within one case; the result must be nondecreasing.
  let most = 0;
  for (const p of points) p.share = most = Math.max(most, p.share);
  return points;
}

// Half-width of the confidence band of the whole distribution function at level `confidence`, for independent draws:
// Dvoretzky, Kiefer and Wolfowitz with Massart's constant (1990).
export function bandWidth(count: number, confidence: number): number {
  return count > 0 ? Math.min(1, Math.sqrt(Math.log(2 / (1 - confidence)) / (2 * count))) : 1;
}

// Share of numbers up to a value.
export function shareAt(points: CumulativePoint[], value: number): number {
  if (points.length === 0 || value < points[0].value) return 0;
  for (let k = 1; k < points.length; ++k) {
    if (value >= points[k].value) continue;
    const [a, b] = [points[k - 1], points[k]];
    return a.share + ((value - a.value) / (b.value - a.value)) * (b.share - a.share);
  }
  return points[points.length - 1].share;
}
