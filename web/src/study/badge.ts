// Verdicts on rows: that a case has numbers does not make it a good one.
import type { StudyTable } from "./field";

export interface Badge {
  text: string;
  kind: "ok" | "failed" | "unreachable" | "other";
}

// Columns that judge a row, what is said where they speak against it, and in the plural of rows.
const kVerdicts: { columns: string[]; against: (value: number) => boolean; words: string; many: string }[] = [
  { columns: ["ledger/pass"], against: isZero, words: "ledger fails", many: "fail the conservation checks" },
  { columns: ["captured"], against: isZero, words: "not captured", many: "do not capture" },
  { columns: ["ledger/feasible", "feasible"], against: isZero, words: "not feasible", many: "are not feasible" },
  { columns: ["worst_margin"], against: (margin) => margin < -1e-9, words: "rating exceeded", many: "exceed a rating" },
  { columns: ["stable"], against: isZero, words: "unstable", many: "have unstable control" },
  { columns: ["rest/at_rest"], against: isZero, words: "not at rest", many: "do not come to rest" },
];

function isZero(value: number): boolean {
  return value === 0;
}

function columnOf(table: StudyTable, names: string[]): Float64Array | undefined {
  return names.map((name) => table.find(name)?.values).find((values) => values !== undefined);
}

function wordsAgainst(table: StudyTable, row: number): string[] {
  return kVerdicts.filter(({ columns, against }) => against(columnOf(table, columns)?.[row] ?? NaN)).map(({ words }) => words);
}

// Whether any column judges the row.
function isJudged(table: StudyTable, row: number): boolean {
  return kVerdicts.some(({ columns }) => Number.isFinite(columnOf(table, columns)?.[row] ?? NaN));
}

// "3 exceed a rating", of the rows that came to their end; and in how many of these rows nothing speaks against them.
export function verdictsOf(table: StudyTable): { against: string[]; clean: number } {
  const completed = Array.from({ length: table.size }, (_, row) => row).filter((row) => table.status[row] === "ok");
  const against = kVerdicts.flatMap(({ columns, against, many }) => {
    const values = columnOf(table, columns);
    const count = values ? completed.filter((row) => against(values[row])).length : 0;
    return count > 0 ? [`${count} ${many}`] : [];
  });
  return { against, clean: completed.filter((row) => wordsAgainst(table, row).length === 0).length };
}

// Green only where nothing speaks against it: of a campaign's case its success, of a point its own verdicts.
export function badgeOf(table: StudyTable, row: number): Badge {
  const status = table.status[row] ?? "?";
  if (status !== "ok") return { text: status, kind: status === "failed" || status === "unreachable" ? status : "other" };
  const success = table.find("success")?.values[row];
  const against = wordsAgainst(table, row);
  if (success === 0) return { text: against.length > 0 ? `no success: ${against.join(", ")}` : "no success", kind: "failed" };
  if (success === 1) return { text: against.length > 0 ? `success, but ${against.join(", ")}` : "success", kind: against.length > 0 ? "unreachable" : "ok" };
  if (against.length > 0) return { text: against.join(", "), kind: against[0] === "ledger fails" ? "failed" : "unreachable" };
  return isJudged(table, row) ? { text: status, kind: "ok" } : { text: "completed, not judged", kind: "other" };
}
