// The table of a study, campaign or optimization as columns of numbers. No DOM.
import type { OptimizationData, SweepData, TableColumn } from "../data";

// Folders of columns whose next parts are names of items: how many, and what stands before them.
const kItems = new Map<string, [number, string]>([
  ["grasps", [1, ""]],
  ["joints", [1, ""]],
  ["targets", [1, ""]],
  ["thrusters", [1, ""]],
  ["margins", [1, "margin of "]],
  ["loads", [1, "load of "]],
  ["contacts", [2, "contact "]],
]);

// The name of a column for people: "tip-1: impulse magnitude" for "grasps/tip-1/impulse_magnitude", "largest of
// grasps: mean force" for "largest of grasps/*/mean_force". Names of items are unchanged, and so are paths of a scenario
// such as "targets[0].mass".
export function plainName(name: string): string {
  const [, before = "", path] = /^((?:largest|least|norm) of )?(.*)$/s.exec(name)!;
  if (/[.[]/.test(path)) return name;
  const spaced = (text: string): string => text.replaceAll("_", " ");
  const parts = path.split("/").filter((part) => part !== "*");
  const [count, prefix] = kItems.get(parts[0]) ?? [0, ""];
  const first = count > 0 && parts.length > count + 1 ? count + 1 : 1;
  const owner = first > 1 ? prefix + parts.slice(1, first).join(" – ") : spaced(parts[0]);
  const rest = parts.slice(first);
  return before + (rest.length === 0 ? owner : `${owner}: ${spaced(rest.join(" "))}`);
}

export type Role = "axis" | "combined" | "column";

// One column. Its numbers are computed on first use: a study may have a hundred columns, of which few are displayed.
export class Field {
  words: string; // its name for people
  private made: Float64Array | null = null;
  private distinct: number[] | null = null;

  constructor(
    readonly key: string, // unique within the table
    readonly name: string,
    readonly unit: string,
    readonly description: string,
    readonly role: Role,
    private readonly make: () => Float64Array,
    readonly labels: string[] | null = null, // values count from 0 into them
    readonly colors: string[] | null = null, // of the labels, if they have a meaning
  ) {
    this.words = plainName(name);
  }

  // Per point; NaN without a value.
  get values(): Float64Array {
    return (this.made ??= this.make());
  }

  // Distinct numbers, ascending.
  get levels(): number[] {
    return (this.distinct ??= [...new Set(this.values)].filter(Number.isFinite).sort((a, b) => a - b));
  }

  // "case 1", or null for numbers.
  labelOf(value: number): string | null {
    return this.labels ? (this.labels[value] ?? "?") : null;
  }
}

export interface StudyTable {
  size: number; // points
  status: string[];
  reason: string[];
  fields: Field[]; // axes, then combined ones, then columns
  axes: Field[];
  noun: string; // name of a row: "point", "case"
  numbers: ArrayLike<number> | null; // the rows' own numbers; null: counted from 0
  first?: Field[]; // the most informative columns, such as those that criteria read
  find(name: string): Field | undefined;
}

export function sweepTable(data: SweepData): StudyTable {
  const size = data.status?.length ?? 0;
  const axes = (data.axes ?? []).map(
    (axis, k) =>
      new Field(`axis:${k}`, axis.name, axis.unit, axis.description, "axis", numbers(data.axis_values[k], size), axis.labels ?? null),
  );
  return tableOf(size, data.status ?? [], data.reason ?? [], axes, columnFields(data.columns ?? [], data.values ?? [], size));
}

// The variables of the search are its axes. `point` counts rows and is omitted.
export function optimizationTable(data: OptimizationData): StudyTable {
  const size = data.status?.length ?? 0;
  const variables: string[] = (data.comparison?.variables ?? []).map((v) => String(v?.name));
  const fields = columnFields(data.columns ?? [], data.values ?? [], size).filter((f) => f.name !== "point");
  const axes = variables
    .map((name) => fields.find((f) => f.name === name))
    .filter((f) => f !== undefined)
    .map((f) => new Field(f.key, f.name, f.unit, f.description, "axis", () => f.values));
  const rest = fields.filter((f) => !variables.includes(f.name));
  return tableOf(size, data.status ?? [], data.reason ?? [], axes, rest);
}

function columnFields(columns: TableColumn[], values: (number | null)[][], size: number): Field[] {
  return columns.map((c, k) => new Field(`column:${k}`, c.name, c.unit, c.description, "column", numbers(values[k], size)));
}

export function tableOf(size: number, status: string[], reason: string[], axes: Field[], columns: Field[]): StudyTable {
  const fields = [...axes, ...combinedFields(columns, size), ...columns];
  const count = new Map<string, number>();
  for (const { words } of fields) count.set(words, (count.get(words) ?? 0) + 1);
  for (const field of fields) if (count.get(field.words)! > 1) field.words = field.name; // grasps and joints of one name
  const byName = new Map<string, Field>();
  for (const field of fields) if (!byName.has(field.name)) byName.set(field.name, field);
  return { size, status, reason, fields, axes, noun: "point", numbers: null, find: (name) => byName.get(name) };
}

function numbers(values: (number | null)[] | undefined, size: number): () => Float64Array {
  return () => {
    const made = new Float64Array(size).fill(NaN);
    const count = Math.min(size, values?.length ?? 0);
    for (let k = 0; k < count; ++k) made[k] = values![k] ?? NaN;
    return made;
  };
}

// ---- Combined columns, named as in optimizations: largest of …, least of …, norm of … ----

const kLargest = /^(impulse_magnitude|angular_impulse_magnitude|mean_force|peak_force|impulse_tangential|relative_speed)$/;
const kMinimum = /^(speed_factor|largest_speed)$/;

function combinedFields(columns: Field[], size: number): Field[] {
  const made: Field[] = [];
  const add = (name: string, parts: Field[], description: string, combine: (values: number[]) => number): void => {
    if (parts.length < 2 || parts.some((p) => p.unit !== parts[0].unit)) return;
    const make = (): Float64Array => combined(parts, size, combine);
    made.push(new Field(`combined:${name}`, name, parts[0].unit, description, "combined", make));
  };
  for (const [rest, parts] of families(columns, /^grasps\/[^/]+\/([^/]+)$/)) {
    if (kLargest.test(rest)) add(`largest of grasps/*/${rest}`, parts, "the largest over the grasps", largest);
    if (kMinimum.test(rest)) add(`least of grasps/*/${rest}`, parts, "the least over the grasps", least);
  }
  const margins = columns.filter((c) => c.name.startsWith("margins/"));
  add("least of margins", margins, "the minimum margin of all ratings: 1 − load over rating", least);
  for (const [vector, parts] of families(columns, /^(.*)\/[xyz]$/)) {
    const hasMagnitude = columns.some((c) => c.name === `${vector}_magnitude`) || vector.endsWith("/relative_velocity");
    if (parts.length === 3 && !hasMagnitude) add(`norm of ${vector}`, parts, "magnitude of the vector", (v) => Math.hypot(...v));
  }
  return made;
}

function families(columns: Field[], pattern: RegExp): Map<string, Field[]> {
  const found = new Map<string, Field[]>();
  for (const column of columns) {
    const match = pattern.exec(column.name);
    if (!match) continue;
    const list = found.get(match[1]) ?? [];
    list.push(column);
    found.set(match[1], list);
  }
  return found;
}

// NaN if no part has a number.
function combined(parts: Field[], size: number, combine: (values: number[]) => number): Float64Array {
  const columns = parts.map((p) => p.values);
  const made = new Float64Array(size);
  for (let k = 0; k < size; ++k) {
    const values = columns.map((c) => c[k]).filter((v) => !Number.isNaN(v));
    made[k] = values.length > 0 ? combine(values) : NaN;
  }
  return made;
}

const largest = (values: number[]): number => Math.max(...values);
const least = (values: number[]): number => Math.min(...values);
