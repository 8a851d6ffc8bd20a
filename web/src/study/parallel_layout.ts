// Layout of the lines of parallel coordinates. No DOM.
import { isGeometric } from "./choice";
import type { Field } from "./field";
import { span } from "./shape";

export interface ParallelAxis {
  field: Field;
  x: number; // [px]
  least: number;
  greatest: number;
  log: boolean;
}

export const kTop = 70; // above the axes: their names
export const kBottom = 34; // below them: points without a value

export function parallelAxes(fields: Field[], width: number): ParallelAxis[] {
  const side = Math.min(64, width / 6);
  const step = fields.length > 1 ? (width - 2 * side) / (fields.length - 1) : 0;
  return fields.map((field, k) => {
    const { least, greatest } = span(field.values);
    const flat = !(greatest > least);
    const half = flat ? Math.abs(least) * 0.1 || 1 : 0;
    const ends = Number.isFinite(least) ? [least - half, greatest + half] : [0, 1];
    return { field, x: side + k * step, least: ends[0], greatest: ends[1], log: isGeometric(field) };
  });
}

export function heightOf(axis: ParallelAxis, value: number, height: number): number {
  if (!Number.isFinite(value)) return height - kBottom + 20;
  const at = axis.log ? Math.log(value / axis.least) / Math.log(axis.greatest / axis.least) : (value - axis.least) / (axis.greatest - axis.least);
  return height - kBottom - at * (height - kBottom - kTop);
}

export function valueAt(axis: ParallelAxis, y: number, height: number): number {
  const at = Math.min(1, Math.max(0, (height - kBottom - y) / (height - kBottom - kTop)));
  return axis.log ? axis.least * (axis.greatest / axis.least) ** at : axis.least + at * (axis.greatest - axis.least);
}

export function ticksOf(axis: ParallelAxis): number[] {
  if (axis.field.labels || axis.field.levels.length <= 8) return axis.field.levels;
  return Array.from({ length: 5 }, (_, k) => (axis.log ? axis.least * (axis.greatest / axis.least) ** (k / 4) : axis.least + (k / 4) * (axis.greatest - axis.least)));
}

// A name in at most `most` lines, broken at its separators, without breaks in its unit.
export function wrapped(name: string, width: number, most: number): string[] {
  const lines: string[] = [""];
  for (const chunk of name.split(/(?<=[\s/_.])(?![^[]*\]$)/)) {
    for (let rest = chunk; rest !== ""; ) {
      const room = width - lines[lines.length - 1].length;
      if (rest.length <= room || (rest.length > width && room === width)) {
        lines[lines.length - 1] += rest.slice(0, width);
        rest = rest.slice(width);
      } else lines.push("");
    }
  }
  if (lines.length <= most) return lines;
  return [...lines.slice(0, most - 1), `${lines[most - 1].slice(0, Math.max(1, width - 1))}…`];
}

// Index of the nearest drawn line to a position; -1: none within reach.
export function nearestLine(axes: ParallelAxis[], points: number[], x: number, y: number, height: number, reach = 12): number {
  const right = axes.findIndex((a) => a.x >= x);
  if (right < 0 || axes.length < 2) return -1;
  const [a, b] = right === 0 ? [axes[0], axes[1]] : [axes[right - 1], axes[right]];
  const part = b.x > a.x ? (x - a.x) / (b.x - a.x) : 0;
  let best = -1;
  let least = reach;
  for (const k of points) {
    const ya = heightOf(a, a.field.values[k], height);
    const at = ya + part * (heightOf(b, b.field.values[k], height) - ya);
    if (Math.abs(at - y) < least) [best, least] = [k, Math.abs(at - y)];
  }
  return best;
}
