// A success map's points as a grid. No DOM.
import type { SuccessMap, MapPoint } from "./model";

// [j][i]: value j of the first axis, value i of the second, both upward.
export function gridOf(successMap: SuccessMap): (MapPoint | undefined)[][] {
  const [y, x] = successMap.axes;
  const grid: (MapPoint | undefined)[][] = y.values.map(() => new Array(x.values.length).fill(undefined));
  for (const p of successMap.points) if (grid[p.at[0]] && p.at[1] < x.values.length) grid[p.at[0]][p.at[1]] = p;
  return grid;
}

// Cell edges for increasing values: midpoints between neighbours.
export function cellEdges(values: number[]): number[] {
  const n = values.length;
  if (n === 1) {
    const half = Math.abs(values[0]) * 0.05 || 0.5;
    return [values[0] - half, values[0] + half];
  }
  const edges = [values[0] - (values[1] - values[0]) / 2];
  for (let k = 1; k < n; ++k) edges.push((values[k - 1] + values[k]) / 2);
  edges.push(values[n - 1] + (values[n - 1] - values[n - 2]) / 2);
  return edges;
}
