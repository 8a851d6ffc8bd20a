// The distribution of an output along an input: quantiles of y among neighbours in x. No DOM.

export interface Band {
  x: number; // median of the neighbours' x
  low: number;
  middle: number;
  high: number;
  count: number;
}

const kMinNeighbours = 40; // minimum for a meaningful 5 % quantile

// Groups points by x into groups of equal size; quantiles 0.05, 0.5, 0.95 of each. Fewer than two groups: none.
export function quantileBands(x: ArrayLike<number>, y: ArrayLike<number>, points: number[], most = 24): Band[] {
  const order = points.filter((k) => Number.isFinite(x[k]) && Number.isFinite(y[k])).sort((a, b) => x[a] - x[b] || a - b);
  const groups = Math.min(most, Math.floor(order.length / kMinNeighbours));
  if (groups < 3) return [];
  const bands: Band[] = [];
  for (let g = 0; g < groups; ++g) {
    const part = order.slice(Math.floor((g * order.length) / groups), Math.floor(((g + 1) * order.length) / groups));
    const values = Float64Array.from(part, (k) => y[k]).sort();
    const places = Float64Array.from(part, (k) => x[k]);
    bands.push({ x: quantile(places, 0.5), low: quantile(values, 0.05), middle: quantile(values, 0.5), high: quantile(values, 0.95), count: part.length });
  }
  return bands;
}

// Quantile of sorted numbers, interpolated between order statistics (Hyndman and Fan's type 7).
export function quantile(sorted: ArrayLike<number>, p: number): number {
  if (sorted.length === 0) return NaN;
  const at = p * (sorted.length - 1);
  const below = Math.floor(at);
  const above = Math.min(below + 1, sorted.length - 1);
  return sorted[below] + (at - below) * (sorted[above] - sorted[below]);
}
