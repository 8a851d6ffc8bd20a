// Filtering and sorting of points. No DOM.
import type { Field, StudyTable } from "./field";

export interface Range {
  field: Field;
  from: number;
  to: number;
}

export interface Filter {
  ranges: Range[]; // all must hold; a point without a number fails
  status: string; // "": any
  text: string; // in number, status, reason or a label; "": any
}

export const kNoFilter: Filter = { ranges: [], status: "", text: "" };

export function isActive(filter: Filter): boolean {
  return filter.ranges.length > 0 || filter.status !== "" || filter.text.trim() !== "";
}

// Per point: 1 if it passes the filter.
export function passingPoints(table: StudyTable, filter: Filter): Uint8Array {
  const passing = new Uint8Array(table.size).fill(1);
  for (const { field, from, to } of filter.ranges) {
    const values = field.values;
    for (let k = 0; k < table.size; ++k) if (!(values[k] >= from && values[k] <= to)) passing[k] = 0;
  }
  if (filter.status !== "") for (let k = 0; k < table.size; ++k) if (table.status[k] !== filter.status) passing[k] = 0;
  const text = filter.text.trim().toLowerCase();
  if (text !== "") for (let k = 0; k < table.size; ++k) if (passing[k] && !mentions(table, k, text)) passing[k] = 0;
  return passing;
}

function mentions(table: StudyTable, point: number, text: string): boolean {
  if (String(table.numbers ? table.numbers[point] : point) === text || table.status[point].toLowerCase().includes(text)) return true;
  if (table.reason[point]?.toLowerCase().includes(text)) return true;
  return table.axes.some((a) => a.labelOf(a.values[point])?.toLowerCase().includes(text));
}

export interface Order {
  field: Field | "point" | "status";
  descending: boolean;
}

// Points that pass, sorted; those without a number are last in both directions.
export function orderedPoints(table: StudyTable, passing: Uint8Array, order: Order): Int32Array {
  const points: number[] = [];
  for (let k = 0; k < table.size; ++k) if (passing[k]) points.push(k);
  const sign = order.descending ? -1 : 1;
  const { field } = order;
  if (field === "status") points.sort((a, b) => sign * compareText(table.status[a], table.status[b]) || a - b);
  else if (field === "point") points.sort((a, b) => sign * (a - b));
  else {
    const values = field.values;
    points.sort((a, b) => {
      const [u, v] = [values[a], values[b]];
      if (Number.isNaN(u) || Number.isNaN(v)) return Number(Number.isNaN(u)) - Number(Number.isNaN(v)) || a - b;
      return sign * (u - v) || a - b;
    });
  }
  return Int32Array.from(points);
}

function compareText(a: string, b: string): number {
  return a < b ? -1 : a > b ? 1 : 0;
}

export function count(passing: Uint8Array): number {
  let sum = 0;
  for (const one of passing) sum += one;
  return sum;
}

// At most `most` points, evenly selected, always the same ones.
export function thinned(points: ArrayLike<number>, most: number): number[] {
  if (points.length <= most) return Array.from(points);
  return Array.from({ length: most }, (_, k) => points[Math.floor((k * points.length) / most)]);
}
