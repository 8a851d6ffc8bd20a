// Rows of a campaign that the page holds, as the table that charts of studies draw: inputs are its axes. No DOM.
import type { CampaignData, PackedSample, TableColumn } from "../data";
import { bytesOf } from "../run";
import { Field, type StudyTable, tableOf } from "../study/field";
import { list } from "./read";

export interface Sample {
  table: StudyTable;
  cases: Float64Array; // k of each row
  success: Uint8Array;
  drawn: Uint8Array; // 1: of the even sample
  successField: Field;
  complete: boolean; // all rows of the campaign are here
}

export const kSuccessLabels = ["no success", "success"];
export const kSuccessColors = ["#d55e00", "#0072b2"];

export function sampleOf(data: CampaignData): Sample {
  const packed = data.sample;
  const rows = packed?.rows ?? 0;
  const cases = packed ? new Float64Array(bytesOf(packed.case).buffer).slice(0, rows) : new Float64Array();
  const success = flags(packed?.success, rows);
  const drawn = flags(packed?.drawn, rows);
  const inputs = fieldsOf([...(packed?.design ?? []), ...(packed?.inputs ?? [])], "axis", rows);
  const successField = new Field("success", "success", "", "whether the case is ok and meets all criteria", "column", () => Float64Array.from(success), kSuccessLabels, kSuccessColors);
  // Columns of criteria first, in their order.
  const read: string[] = list(data.statistics?.criteria).flatMap((one) => list(one?.reads));
  const place = (f: Field): number => (read.includes(f.name) ? read.indexOf(f.name) : read.length);
  const rest = fieldsOf(packed?.columns ?? [], "column", rows).sort((a, b) => place(a) - place(b));
  const columns = [successField, ...rest];
  const first = rest.filter((f) => read.includes(f.name));
  const table: StudyTable = { ...tableOf(rows, statuses(packed, rows), reasons(packed, rows), inputs, columns), noun: "case", numbers: cases, first };
  return { table, cases, success, drawn, successField, complete: data.rows === rows };
}

function flags(text: string | undefined, rows: number): Uint8Array {
  const made = new Uint8Array(rows);
  made.set((text ? bytesOf(text) : made).subarray(0, rows));
  return made;
}

function statuses(packed: PackedSample | null, rows: number): string[] {
  return Array.from(flags(packed?.status, rows), (s) => packed?.statuses[s] ?? "?");
}

function reasons(packed: PackedSample | null, rows: number): string[] {
  const made = new Array<string>(rows).fill("");
  for (const [row, text] of packed?.reasons ?? []) if (row >= 0 && row < rows) made[row] = text;
  return made;
}

function fieldsOf(columns: (TableColumn & { labels?: string[]; data: string })[], role: "axis" | "column", rows: number): Field[] {
  const make = (data: string): (() => Float64Array) => () => {
    const made = new Float64Array(rows).fill(NaN);
    made.set(new Float32Array(bytesOf(data).buffer).subarray(0, rows));
    return made;
  };
  return columns.map((c, k) => new Field(`${role}:${k}`, c.name, c.unit, c.description, role, make(c.data), c.labels ?? null));
}
