// Tables as text. Numbers are written so that they read back to the same double. No DOM.
import type { Field, StudyTable } from "./field";
import { columnHead } from "../format";

function quoted(text: string, separator: string): string {
  const flat = separator === "\t" ? text.replace(/[\t\r\n]+/g, " ") : text;
  return /[",\r\n]/.test(flat) && separator === "," ? `"${flat.replace(/"/g, '""')}"` : flat;
}

export function rowsToText(rows: (string | number)[][], separator = ","): string {
  return rows.map((row) => row.map((v) => (typeof v === "number" ? String(v) : quoted(v, separator))).join(separator)).join("\n") + "\n";
}

// Selected points with selected columns, in the format of table.csv.
export function pointsToText(table: StudyTable, points: Iterable<number>, fields: Field[], separator = ","): string {
  const columns = fields.filter((f) => f.role !== "axis");
  const axes = fields.filter((f) => f.role === "axis");
  const head = [table.noun, ...axes.map((a) => columnHead(a.name, a.unit)), "status", "reason", ...columns.map((c) => columnHead(c.name, c.unit))];
  const rows: (string | number)[][] = [head];
  for (const k of points) {
    const axisCells = axes.map((a) => a.labelOf(a.values[k]) ?? a.values[k]);
    rows.push([table.numbers ? table.numbers[k] : k, ...axisCells, table.status[k], table.reason[k] ?? "", ...columns.map((c) => c.values[k])]);
  }
  return rowsToText(rows, separator);
}
