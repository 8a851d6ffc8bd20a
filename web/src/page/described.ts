// Tables and lists of described structures: every field with a value is shown under its key, with its unit, and its
// text on hover. A new field of a description appears without a change here.
import { element } from "../dom";
import { number, unitText } from "../format";
import type { FieldNote } from "../summary_types";
import { num, size, text, vector, words } from "./read";
import { changeText, fold, pairs, sortableTable, table, vectorCell, type Cell, type Column } from "./table";

export interface Shown<T> {
  cells?: Record<string, (one: T) => Cell>; // of keys that are not shown by their value
  heads?: Record<string, string>; // of keys whose words are not the head
  few?: number; // rows above which the others are folded
  sizes?: boolean; // vectors by their magnitude
  sortBy?: string; // heads sort the rows, which are sorted by this key first
}

// All fields but some.
export function without(notes: readonly FieldNote[], ...keys: string[]): FieldNote[] {
  return notes.filter(([key]) => !keys.includes(key));
}
// Some fields in this order.
export function those(notes: readonly FieldNote[], ...keys: string[]): FieldNote[] {
  return keys.flatMap((key) => notes.filter(([one]) => one === key));
}

// One row per structure; nothing without structures.
export function describedTable<T extends object>(caption: string, notes: readonly FieldNote[], all: readonly T[], shown: Shown<T> = {}): HTMLElement[] {
  if (all.length === 0) return [];
  const { cells = {}, heads = {}, few = Infinity, sizes = false, sortBy } = shown;
  const kept = notes.filter(([key]) => key in cells || all.some((one) => isShown(value(one, key))));
  const columns = kept.map(([key, unit, about]): Column => {
    const numeric = all.some((one) => num(value(one, key)) !== null || (sizes && size(value(one, key)) !== null));
    return { head: heads[key] ?? heading(key), unit: unitOf(unit), title: about, numeric };
  });
  const rows = all.map((one) => kept.map(([key]) => (key in cells ? cells[key](one) : tableCell(key, value(one, key), sizes))));
  if (sortBy !== undefined) {
    const keys = all.map((one) => kept.map(([key]) => sortKey(value(one, key))));
    return [sortableTable(caption, columns, rows, keys, Math.max(0, kept.findIndex(([key]) => key === sortBy)))];
  }
  const rest = rows.slice(few);
  return [
    table(caption, columns, rows.slice(0, few)),
    ...(rest.length > 0 ? [fold(`${rest.length} more`, table(`${caption}, continued`, columns, rest))] : []),
  ];
}

// Name and value of every field of one structure.
export function describedPairs<T extends object>(notes: readonly FieldNote[], one: T, { cells = {} }: Shown<T> = {}): HTMLElement[] {
  const entries = notes
    .filter(([key]) => key in cells || isShown(value(one, key)))
    .map(([key, unit, about]): [string, Cell] => {
      const content = key in cells ? cells[key](one) : pairCell(value(one, key), unitOf(unit));
      return [heading(key).toLowerCase(), content && element("span", { title: about }, content)];
    });
  return entries.length > 0 ? [pairs(entries)] : [];
}

function value(one: object, key: string): unknown {
  return (one as Record<string, unknown>)[key];
}

// Numbers and vectors by size.
function sortKey(one: unknown): string | number {
  return typeof one === "string" ? one : Math.abs(num(one) ?? size(one) ?? -1);
}

// Structures in structures have their own tables.
function isShown(one: unknown): boolean {
  if (Array.isArray(one)) return one.length > 0 && one.every((item) => item === null || isShown(item));
  return one !== undefined && one !== null && one !== "" && typeof one !== "object";
}

// "miss_of_robot_com" -> "Miss of robot centre of mass"
function heading(key: string): string {
  const name = words(key).replace(/\bcom\b/, "centre of mass").replace("end effector", "end-effector").replace(/^rhs /, "");
  return name.charAt(0).toUpperCase() + name.slice(1);
}

// Units that depend on the row are in a column.
function unitOf(unit: string): string {
  return /^(1$|as |see )|[,`]/.test(unit) ? "" : unit;
}

function tableCell(key: string, one: unknown, sizes: boolean): Cell {
  if (key === "unit") return unitText(text(one));
  if (sizes && vector(one)) return element("span", { title: vector(one)!.join(", ") }, number(size(one)));
  return pairCell(one, "");
}

function pairCell(one: unknown, unit: string): Cell {
  if (typeof one === "boolean") return one ? "yes" : "no";
  if (typeof one === "string") return words(one);
  if (vector(one)?.length === 3 && unit) return changeText(one, unit);
  if (vector(one)) return vectorCell(one);
  if (Array.isArray(one)) return listCell(one);
  const shown = number(num(one));
  return unit && shown !== "–" ? `${shown}\u00a0${unitText(unit)}` : shown;
}

const kComponents = ["angular x", "angular y", "angular z", "x", "y", "z"];
function listCell(all: unknown[]): Cell {
  if (all.every((one) => typeof one === "boolean")) {
    const open = kComponents.filter((_, i) => all[i] === false);
    return open.length === 0 ? "all" : `open: ${open.join(", ")}`;
  }
  if (all.every((one) => vector(one))) return element("span", {}, ...all.flatMap((one, i) => [i > 0 ? ", " : "", vectorCell(one) as Node]));
  return all.map(String).join(", ");
}
