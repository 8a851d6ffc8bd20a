// Numbers and points in words. No DOM.
import { label, number, withUnit } from "../format";
import type { Field, StudyTable } from "./field";

export function shown(field: Field, value: number): string {
  return field.labelOf(value) ?? number(value);
}

export function shownWithUnit(field: Field, value: number): string {
  return field.labelOf(value) ?? withUnit(value, field.unit);
}

export function fieldLabel(field: Field): string {
  return label(field.words, field.unit);
}

// "Point 12", "Case 40313".
export function rowName(table: StudyTable, row: number): string {
  const noun = table.noun;
  return `${noun[0].toUpperCase()}${noun.slice(1)} ${rowNumber(table, row)}`;
}

export function rowNumber(table: StudyTable, row: number): number {
  return table.numbers ? table.numbers[row] : row;
}

// Lines for a tooltip: the point, its axes, then the displayed columns.
export function describePoint(table: StudyTable, point: number, fields: Field[]): string[] {
  const lines = [`${rowName(table, point)}${table.status[point] === "ok" ? "" : ` · ${table.status[point]}`}`];
  for (const field of new Set([...table.axes.slice(0, 8), ...fields])) {
    lines.push(`${field.words}: ${shownWithUnit(field, field.values[point])}`);
  }
  if (table.reason[point]) lines.push(clipped(table.reason[point], 160));
  return lines;
}

export function clipped(text: string, most: number): string {
  return text.length <= most ? text : `${text.slice(0, most - 1)}…`;
}

// Beginning and end of a long name are the most informative parts.
export function shortened(name: string, most: number): string {
  if (name.length <= most) return name;
  const begin = Math.max(1, Math.floor((most - 1) * 0.4));
  return `${name.slice(0, begin)}…${name.slice(name.length - Math.max(1, most - 1 - begin))}`;
}

// Ticks of logarithmic axes: powers of ten only.
export function powerTick(value: number): string {
  const power = Math.log10(value);
  if (Math.abs(power - Math.round(power)) > 1e-9) return "";
  return Math.abs(power) <= 3 ? String(Number(value.toPrecision(1))) : number(value).replace(/^1·/, "");
}

// 100 000, with thin spaces that do not break.
export function counted(count: number): string {
  return String(count).replace(/\B(?=(\d{3})+$)/g, "\u202f");
}

export function plural(count: number, one: string, many = `${one}s`): string {
  return `${counted(count)} ${count === 1 ? one : many}`;
}

// Long names may break after their separators, but not within a unit at their end.
export function breakable(name: string): string {
  return name.replace(/[/_.](?=.)(?![^[]*\]$)/g, "$&\u200b");
}
