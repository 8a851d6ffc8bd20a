// Verdicts on rows: a completed case is not necessarily a success.
import type { StudyTable } from "./field";

export interface Badge {
  text: string;
  kind: "ok" | "failed" | "unreachable" | "other";
}

// Columns with a verdict on a row, the text of a negative verdict, and its plural. A name that ends in "/" represents
// all columns below it, of which the minimum counts.
const kVerdicts: { columns: string[]; against: (value: number) => boolean; words: string; many: string }[] = [
  { columns: ["ledger/pass"], against: isZero, words: "ledger fails", many: "fail the conservation checks" },
  { columns: ["captured"], against: isZero, words: "not captured", many: "do not capture" },
  { columns: ["ledger/feasible", "feasible"], against: isZero, words: "not feasible", many: "are not feasible" },
  { columns: ["worst_margin", "margins/"], against: (margin) => margin < -1e-9, words: "rating exceeded", many: "exceed a rating" },
  { columns: ["stable"], against: isZero, words: "unstable", many: "have unstable control" },
  { columns: ["rest/at_rest"], against: isZero, words: "not at rest", many: "do not come to rest" },
];

function isZero(value: number): boolean {
  return value === 0;
}

function columnOf(table: StudyTable, names: string[]): Float64Array | undefined {
  for (const name of names) {
    const values = name.endsWith("/") ? leastBelow(table, name) : table.find(name)?.values;
    if (values !== undefined) return values;
  }
  return undefined;
}

const leasts = new WeakMap<StudyTable, Map<string, Float64Array | undefined>>();
function leastBelow(table: StudyTable, folder: string): Float64Array | undefined {
  const known = leasts.get(table) ?? new Map<string, Float64Array | undefined>();
  leasts.set(table, known);
  if (!known.has(folder)) {
    const below = table.fields.filter((field) => field.role === "column" && field.name.startsWith(folder));
    const least = (row: number): number => Math.min(...below.map((field) => field.values[row]).filter(Number.isFinite));
    known.set(folder, below.length === 0 ? undefined : Float64Array.from({ length: table.size }, (_, row) => (Number.isFinite(least(row)) ? least(row) : NaN)));
  }
  return known.get(folder);
}

function wordsAgainst(table: StudyTable, row: number): string[] {
  return kVerdicts.filter(({ columns, against }) => against(columnOf(table, columns)?.[row] ?? NaN)).map(({ words }) => words);
}

// Whether any column has a verdict on the row.
function isJudged(table: StudyTable, row: number): boolean {
  return kVerdicts.some(({ columns }) => Number.isFinite(columnOf(table, columns)?.[row] ?? NaN));
}

// "3 exceed a rating", over completed rows; and the number of completed rows without a negative verdict.
export function verdictsOf(table: StudyTable): { against: string[]; clean: number } {
  const completed = Array.from({ length: table.size }, (_, row) => row).filter((row) => table.status[row] === "ok");
  const against = kVerdicts.flatMap(({ columns, against, many }) => {
    const values = columnOf(table, columns);
    const count = values ? completed.filter((row) => against(values[row])).length : 0;
    return count > 0 ? [`${count} ${many}`] : [];
  });
  return { against, clean: completed.filter((row) => wordsAgainst(table, row).length === 0).length };
}

// Green only without a negative verdict: for a campaign's case its success, for a point its verdicts.
export function badgeOf(table: StudyTable, row: number): Badge {
  const status = table.status[row] ?? "?";
  if (status !== "ok") return { text: status, kind: status === "failed" || status === "unreachable" ? status : "other" };
  const success = table.find("success")?.values[row];
  const against = wordsAgainst(table, row);
  if (success === 0) return { text: against.length > 0 ? `no success: ${against.join(", ")}` : "no success", kind: "failed" };
  if (success === 1) return { text: against.length > 0 ? `success, but ${against.join(", ")}` : "success", kind: against.length > 0 ? "unreachable" : "ok" };
  if (against.length > 0) return { text: against.join(", "), kind: against[0] === "ledger fails" ? "failed" : "unreachable" };
  return isJudged(table, row) ? { text: status, kind: "ok" } : { text: "completed, not evaluated", kind: "other" };
}
