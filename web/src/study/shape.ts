// Data of charts from a table: lines, cells, bins, extremes, neighbours. No DOM.
import type { Field, StudyTable } from "./field";

// ---- Lines: y against x, one per value of another axis ----

export interface Line {
  level: number; // of the axis `lines`; NaN: there is none
  points: number[]; // by x
}

export interface Panel {
  level: number; // of the axis `panels`; NaN: there is none
  lines: Line[];
}

export interface LineQuery {
  x: Field | null;
  lines: Field | null;
  panels: Field | null;
  held: Map<string, number>; // by axis key; an axis that is not held yields several lines of one colour
  most: number; // maximum number of lines per panel, evenly selected
}

export function linesOf(table: StudyTable, query: LineQuery): { panels: Panel[]; leftOut: number } {
  const { x, lines, panels } = query;
  const free = table.axes.filter((a) => a !== x && a !== lines && a !== panels && !query.held.has(a.key) && a.levels.length > 1);
  const held = table.axes.filter((a) => query.held.has(a.key) && a !== x && a !== lines && a !== panels);
  const grouped = new Map<number, Map<string, Line>>();
  for (let k = 0; k < table.size; ++k) {
    if (held.some((a) => a.values[k] !== query.held.get(a.key))) continue;
    const panel = panels ? panels.values[k] : NaN;
    const level = lines ? lines.values[k] : NaN;
    const key = free.length === 0 ? String(level) : [level, ...free.map((a) => a.values[k])].join();
    let inPanel = grouped.get(panel);
    if (!inPanel) grouped.set(panel, (inPanel = new Map()));
    let line = inPanel.get(key);
    if (!line) inPanel.set(key, (line = { level, points: [] }));
    line.points.push(k);
  }
  let leftOut = 0;
  const made = [...grouped].map(([level, found]) => {
    const all = [...found.values()].sort((a, b) => a.level - b.level);
    const few = all.length <= query.most ? all : all.filter((_, k) => spread(k, all.length, query.most));
    leftOut += all.length - few.length;
    for (const line of few) if (x) line.points.sort((a, b) => x.values[a] - x.values[b]);
    return { level, lines: few };
  });
  return { panels: made.sort((a, b) => a.level - b.level), leftOut };
}

// The selection includes first and last.
function spread(k: number, of: number, most: number): boolean {
  return k === of - 1 || Math.floor((k * (most - 1)) / (of - 1)) !== Math.floor(((k - 1) * (most - 1)) / (of - 1));
}

// ---- Cells of a map over two axes ----

export interface Cell {
  point: number;
  x1: number;
  x2: number;
  y1: number;
  y2: number;
  value: number; // NaN: no value
}

export function cellsOf(table: StudyTable, x: Field, y: Field, value: Field, held: Map<string, number>, log: [boolean, boolean]): Cell[] {
  const [edgesX, edgesY] = [edges(x, log[0]), edges(y, log[1])];
  const others = table.axes.filter((a) => a !== x && a !== y && held.has(a.key));
  const cells: Cell[] = [];
  for (let k = 0; k < table.size; ++k) {
    if (others.some((a) => a.values[k] !== held.get(a.key))) continue;
    const [ex, ey] = [edgesX.get(x.values[k]), edgesY.get(y.values[k])];
    if (!ex || !ey) continue;
    cells.push({ point: k, x1: ex[0], x2: ex[1], y1: ey[0], y2: ey[1], value: value.values[k] });
  }
  return cells;
}

// A cell extends half-way to its neighbours.
function edges(field: Field, log: boolean): Map<number, [number, number]> {
  const to = (v: number): number => (log ? Math.log(v) : v);
  const back = (v: number): number => (log ? Math.exp(v) : v);
  const levels = field.levels.map(to);
  const made = new Map<number, [number, number]>();
  levels.forEach((v, k) => {
    const before = k > 0 ? (v - levels[k - 1]) / 2 : levels.length > 1 ? (levels[1] - v) / 2 : 0.5;
    const after = k < levels.length - 1 ? (levels[k + 1] - v) / 2 : levels.length > 1 ? (v - levels[k - 1]) / 2 : 0.5;
    made.set(field.levels[k], [back(v - before), back(v + after)]);
  });
  return made;
}

// ---- Bins ----

export interface Bin {
  from: number;
  to: number;
  all: number;
  passing: number;
}

export function binsOf(field: Field, passing: Uint8Array, wanted = 30): { bins: Bin[]; missing: number } {
  const values = field.values;
  const { least, greatest, numbers } = span(values);
  const missing = values.length - numbers;
  if (numbers === 0) return { bins: [], missing };
  const levels = field.labels ? field.levels : null;
  const [from, step, n] = levels ? [-0.5, 1, field.labels!.length] : niceBins(least, greatest, wanted);
  const bins = Array.from({ length: n }, (_, k) => ({ from: from + k * step, to: from + (k + 1) * step, all: 0, passing: 0 }));
  for (let k = 0; k < values.length; ++k) {
    if (!Number.isFinite(values[k])) continue;
    const bin = bins[Math.min(n - 1, Math.max(0, Math.floor((values[k] - from) / step + 1e-9)))];
    ++bin.all;
    bin.passing += passing[k];
  }
  return { bins, missing };
}

function niceBins(least: number, greatest: number, wanted: number): [number, number, number] {
  if (!(greatest > least)) {
    const half = Math.abs(least) * 0.05 || 0.5;
    return [least - half, 2 * half, 1];
  }
  const raw = (greatest - least) / wanted;
  const ten = 10 ** Math.floor(Math.log10(raw));
  const step = ten * (raw / ten > 5 ? 10 : raw / ten > 2 ? 5 : raw / ten > 1 ? 2 : 1);
  const from = Math.floor(least / step + 1e-9) * step;
  return [from, step, Math.max(1, Math.floor((greatest - from) / step + 1e-9) + 1)];
}

// ---- Extremes ----

export interface Span {
  least: number;
  greatest: number;
  leastAt: number; // point; -1: none
  greatestAt: number;
  numbers: number; // number of points with a number
}

export function span(values: ArrayLike<number>): Span {
  const found = { least: Infinity, greatest: -Infinity, leastAt: -1, greatestAt: -1, numbers: 0 };
  for (let k = 0; k < values.length; ++k) {
    const value = values[k];
    if (!Number.isFinite(value)) continue;
    ++found.numbers;
    if (value < found.least) [found.least, found.leastAt] = [value, k];
    if (value > found.greatest) [found.greatest, found.greatestAt] = [value, k];
  }
  return found;
}

// ---- Neighbours on the grid ----

// The points that differ from a point by one step along one axis only.
export class Neighbours {
  private at: Map<number, number> | null = null;
  private strides: number[] = [];
  private ranks: Map<number, number>[] = [];

  constructor(private readonly table: StudyTable) {}

  step(point: number, axis: number, by: number): number | undefined {
    const at = this.build();
    const field = this.table.axes[axis];
    const rank = this.ranks[axis].get(field.values[point]);
    if (rank === undefined || rank + by < 0 || rank + by >= field.levels.length) return undefined;
    return at.get(this.key(point) + by * this.strides[axis]);
  }

  private build(): Map<number, number> {
    if (this.at) return this.at;
    let stride = 1;
    for (const axis of this.table.axes) {
      this.ranks.push(new Map(axis.levels.map((v, k) => [v, k])));
      this.strides.push(stride);
      stride *= Math.max(1, axis.levels.length);
    }
    this.at = new Map();
    for (let k = 0; k < this.table.size; ++k) this.at.set(this.key(k), k);
    return this.at;
  }

  private key(point: number): number {
    return this.table.axes.reduce((sum, a, k) => sum + (this.ranks[k].get(a.values[point]) ?? NaN) * this.strides[k], 0);
  }
}
