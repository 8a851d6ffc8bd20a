// Contour lines of a quantity on a grid: marching squares, with straight lines within cells. Supports non-uniform
// grids; a cell with an unknown corner has no line. No DOM.

export type Segment = [number, number, number, number]; // x1, y1, x2, y2

// `values[j][i]` at x[i], y[j].
export function contourSegments(x: number[], y: number[], values: number[][], level: number): Segment[] {
  const segments: Segment[] = [];
  for (let j = 0; j + 1 < y.length; ++j) {
    for (let i = 0; i + 1 < x.length; ++i) {
      const corners = [values[j][i], values[j][i + 1], values[j + 1][i + 1], values[j + 1][i]];
      if (corners.every(Number.isFinite)) segments.push(...cellSegments([x[i], x[i + 1]], [y[j], y[j + 1]], corners, level));
    }
  }
  return segments;
}

// Corners counter-clockwise from the minimum of x and y. If two lines cross a cell, the mean value determines their
// connection.
function cellSegments(x: [number, number], y: [number, number], v: number[], level: number): Segment[] {
  const places: [number, number][] = [[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]];
  const above = v.map((value) => value >= level);
  const crossings: [number, number][] = [];
  const edges: number[] = [];
  for (let e = 0; e < 4; ++e) {
    const f = (e + 1) % 4;
    if (above[e] === above[f]) continue;
    // Interpolates from the lower to the upper corner in both cells that share the edge, so that their lines end at
    // identical points.
    const [a, b] = e < 2 ? [e, f] : [f, e];
    const part = (level - v[a]) / (v[b] - v[a]);
    crossings.push([places[a][0] + part * (places[b][0] - places[a][0]), places[a][1] + part * (places[b][1] - places[a][1])]);
    edges.push(e);
  }
  const join = (a: number, b: number): Segment => [...crossings[a], ...crossings[b]];
  if (crossings.length === 2) return [join(0, 1)];
  if (crossings.length < 4) return [];
  const middle = (v[0] + v[1] + v[2] + v[3]) / 4 >= level;
  // Lines separate the corners that differ from the mean.
  return above[0] === middle ? [join(0, 1), join(2, 3)] : [join(3, 0), join(1, 2)];
}

// Joins segments end to end.
export function joined(segments: Segment[]): [number, number][][] {
  const key = (x: number, y: number): string => `${x},${y}`;
  const ends = new Map<string, number[]>();
  segments.forEach((s, k) => {
    for (const name of [key(s[0], s[1]), key(s[2], s[3])]) ends.set(name, [...(ends.get(name) ?? []), k]);
  });
  const used = new Set<number>();
  const follow = (line: [number, number][]): void => {
    for (;;) {
      const [x, y] = line[line.length - 1];
      const next = ends.get(key(x, y))?.find((k) => !used.has(k));
      if (next === undefined) return;
      used.add(next);
      const s = segments[next];
      line.push(s[0] === x && s[1] === y ? [s[2], s[3]] : [s[0], s[1]]);
    }
  };
  const lines: [number, number][][] = [];
  segments.forEach((s, k) => {
    if (used.has(k)) return;
    used.add(k);
    const line: [number, number][] = [[s[0], s[1]], [s[2], s[3]]];
    follow(line);
    line.reverse();
    follow(line);
    lines.push(line);
  });
  return lines;
}
