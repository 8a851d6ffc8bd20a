// What a row's badge says: that a case has numbers does not make it a good one.
import type { StudyTable } from "./field";

export interface Badge {
  text: string;
  kind: "ok" | "failed" | "unreachable" | "other";
}

const kVerdicts: [column: string, otherwise: string][] = [
  ["ledger/pass", "ledger fails"],
  ["captured", "not captured"],
  ["feasible", "not feasible"],
];

// Green only where nothing speaks against it: of a campaign's case its success, of a point its own verdicts.
export function badgeOf(table: StudyTable, row: number): Badge {
  const status = table.status[row] ?? "?";
  if (status !== "ok") return { text: status, kind: status === "failed" || status === "unreachable" ? status : "other" };
  const success = table.find("success")?.values[row];
  const against = kVerdicts.filter(([column]) => table.find(column)?.values[row] === 0).map(([, words]) => words);
  if (success === 0) return { text: against.length > 0 ? `no success: ${against.join(", ")}` : "no success", kind: "failed" };
  if (success === 1) return { text: "success", kind: "ok" };
  return against.length > 0 ? { text: against.join(", "), kind: against[0] === "ledger fails" ? "failed" : "unreachable" } : { text: status, kind: "ok" };
}
