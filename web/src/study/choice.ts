// Default selection of the most informative columns. No DOM.
import type { Field, StudyTable } from "./field";

const kTelling = [
  /^objective$/,
  /^largest of grasps\/\*\/impulse_magnitude$/,
  /^grasps\/[^/]+\/impulse_magnitude$/,
  /^least of margins$/,
  /^norm of base\/angular_velocity_change$/,
  /^grasps\/[^/]+\/mean_force$/,
  /^clearance\/minimum$/,
  /^norm of end\/base\/angular_velocity$/,
  /^kinetic_energy_after$/,
  /^norm of base\/velocity_change$/,
  /^(violation|acceptable)$/,
  /^success$/,
  /^ledger\/pass$/,
];

// In order of information; constant and empty columns are omitted.
export function tellingColumns(table: StudyTable, most: number): Field[] {
  const found: Field[] = (table.first ?? []).filter(varies).slice(0, most);
  for (const pattern of kTelling) {
    for (const field of table.fields) {
      if (found.length >= most) return found;
      if (field.role !== "axis" && !found.includes(field) && pattern.test(field.name) && varies(field)) found.push(field);
    }
  }
  for (const field of table.fields) {
    if (found.length >= Math.min(most, 4)) break;
    if (field.role !== "axis" && !found.includes(field) && varies(field)) found.push(field);
  }
  return found;
}

// The column shown first. Undefined: the table has none.
export function mainColumn(table: StudyTable): Field | undefined {
  const columns = table.fields.filter((f) => f.role !== "axis");
  return tellingColumns(table, 1)[0] ?? columns.find(hasNumbers) ?? columns[0];
}

export function varies(field: Field): boolean {
  let first = NaN;
  for (const value of field.values) {
    if (!Number.isFinite(value)) continue;
    if (Number.isNaN(first)) first = value;
    else if (value !== first) return true;
  }
  return false;
}

export function hasNumbers(field: Field): boolean {
  return field.values.some(Number.isFinite);
}

export interface LinePlan {
  x: Field | null; // null: the number of the point
  lines: Field | null;
  panels: Field | null;
  held: Map<string, number>; // axis key: value at which it is held
}

const kMostLines = 12;
const kMostPanels = 6;

// x: the numeric axis with most values (relative speed before others); lines: the next; panels: one more that is short.
export function linePlan(table: StudyTable): LinePlan {
  const open = table.axes.filter((a) => a.levels.length > 1);
  const numeric = open.filter((a) => !a.labels);
  const longest = (axes: Field[]): Field | undefined =>
    axes.reduce<Field | undefined>((best, a) => (best && best.levels.length >= a.levels.length ? best : a), undefined);
  const speed = numeric.find((a) => /relative_speed$/.test(a.name) && a.levels.length >= 5);
  const x = speed ?? longest(numeric) ?? open[0] ?? table.axes[0] ?? null;
  const others = open.filter((a) => a !== x);
  const lines = longest(others.filter((a) => !a.labels && a.levels.length <= kMostLines)) ?? longest(others) ?? null;
  const left = others.filter((a) => a !== lines);
  const panels = left.find((a) => a.levels.length <= kMostPanels) ?? null;
  return { x, lines, panels, held: heldValues(left.filter((a) => a !== panels)) };
}

// Axes that no chart shows are held: labels at their first value, numbers at the middle one.
export function heldValues(axes: Field[]): Map<string, number> {
  return new Map(axes.map((a) => [a.key, a.levels[a.labels ? 0 : (a.levels.length - 1) >> 1] ?? 0]));
}

// Two axes for a map, the longest first; null: fewer than two have several values.
export function mapPlan(table: StudyTable): { x: Field; y: Field } | null {
  const open = table.axes.filter((a) => a.levels.length > 1);
  const order = [...open].sort((a, b) => Number(!!a.labels) - Number(!!b.labels) || b.levels.length - a.levels.length);
  return order.length < 2 ? null : { x: order[0], y: order[1] };
}

// Positive values over several powers of ten use a logarithmic axis if their argument does.
export function isWide(field: Field): boolean {
  let [least, greatest] = [Infinity, 0];
  for (const value of field.values) {
    if (!Number.isFinite(value)) continue;
    if (value <= 0) return false;
    least = Math.min(least, value);
    greatest = Math.max(greatest, value);
  }
  return greatest / least > 1e3;
}

// Values that grow by a factor are read on a logarithmic axis.
export function isGeometric(field: Field): boolean {
  const v = field.levels;
  if (field.labels || v.length < 3 || v[0] <= 0 || v[v.length - 1] / v[0] < 20) return false;
  const ratio = Math.log(v[v.length - 1] / v[0]) / (v.length - 1);
  return v.every((value, k) => Math.abs(Math.log(value / v[0]) - k * ratio) < 0.05 * ratio);
}
