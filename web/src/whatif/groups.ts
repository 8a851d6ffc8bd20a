// Quantities of the panel in groups, each of which states the overrides that its changed quantities mean. No DOM.
import type { Override } from "./engine_interface";
import { isNumber, numbersIn, scaled, type Vec3 } from "./settings";

export type Value = number | string | Vec3;
export type Values = ReadonlyMap<string, Value>; // changed quantities, by key

export interface Quantity {
  key: string;
  name: string;
  unit: string;
  base: Value; // in the base case
  low: number; // of the slider
  high: number;
  log: boolean;
  choices?: string[];
  note?: string;
}

export interface Group {
  title: string; // groups of one title are shown together
  quantities: Quantity[];
  paths: string[]; // which it changes
  // Of the changed quantities; none: no override.
  overrides(values: Values): Override[];
  // The values that lead to this value at its only path; null: none do.
  read?(value: unknown): [string, Value][] | null;
}

// ---- Kinds of groups ----

export interface Range {
  low: number;
  high: number;
  log?: boolean;
}

// One value of the scenario.
export function direct(title: string, name: string, unitName: string, path: string, base: number, range: Range): Group {
  const quantity: Quantity = { key: path, name, unit: unitName, base, low: range.low, high: range.high, log: range.log ?? false };
  return {
    title,
    quantities: [quantity],
    paths: [path],
    overrides: (values) => [{ path, value: values.get(path) }],
    read: (value) => (isNumber(value) ? [[path, value]] : null),
  };
}

// Ten times less to ten times more.
export function decade(base: number): Range {
  return base > 0 ? { low: base / 10, high: base * 10, log: true } : { low: 0, high: 1 };
}

// All numbers of a value times a factor.
export function factor(title: string, name: string, path: string, base: unknown): Group {
  const key = `factor ${path}`;
  return {
    title,
    quantities: [{ key, name, unit: "1", base: 1, low: 0.2, high: 5, log: true }],
    paths: [path],
    overrides: (values) => [{ path, value: scaled(base, values.get(key) as number) }],
    read: (value) => {
      const [from, to] = [numbersIn(base), numbersIn(value)];
      const first = from.findIndex((x) => x !== 0);
      const ratio = first < 0 ? NaN : to[first] / from[first];
      return ratio > 0 && JSON.stringify(scaled(base, ratio)) === JSON.stringify(value) ? [[key, ratio]] : null;
    },
  };
}

export function choice(title: string, name: string, path: string, base: string, choices: string[]): Group {
  return {
    title,
    quantities: [{ key: path, name, unit: "", base, low: 0, high: 0, log: false, choices }],
    paths: [path],
    overrides: (values) => [{ path, value: values.get(path) }],
    read: (value) => (typeof value === "string" && choices.includes(value) ? [[path, value]] : null),
  };
}

export function overridesOf(groups: Group[], values: Values): Override[] {
  return groups.flatMap((group) => (group.quantities.some((one) => values.has(one.key)) ? group.overrides(values) : []));
}
