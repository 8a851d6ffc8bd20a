// Progress of an optimization's search from its evaluations. No DOM.
import type { OptimizationData } from "../data";
import type { StudyTable } from "./field";

export type Outcome = "acceptable" | "beyond" | "none"; // none: failed or unreachable

export interface Search {
  maximize: boolean;
  outcome: Outcome[]; // per evaluation
  objective: Float64Array;
  bestSoFar: Float64Array; // of the acceptable ones up to here; NaN: none yet
  best: number | null; // evaluation
}

export function searchOf(table: StudyTable, comparison: OptimizationData["comparison"]): Search {
  const objective = table.find("objective")?.values ?? new Float64Array(table.size).fill(NaN);
  const acceptable = table.find("acceptable")?.values;
  const maximize = String(comparison?.objective?.name ?? "").startsWith("maximize");
  const outcome = table.status.map((status, k): Outcome => {
    if (status !== "ok" || !Number.isFinite(objective[k])) return "none";
    return acceptable && acceptable[k] !== 1 ? "beyond" : "acceptable";
  });
  const bestSoFar = new Float64Array(table.size).fill(NaN);
  let best = NaN;
  for (let k = 0; k < table.size; ++k) {
    const better = maximize ? objective[k] > best : objective[k] < best;
    if (outcome[k] === "acceptable" && (Number.isNaN(best) || better)) best = objective[k];
    bestSoFar[k] = best;
  }
  const at = comparison?.best;
  return { maximize, outcome, objective, bestSoFar, best: typeof at === "number" && Number.isInteger(at) && at >= 0 && at < table.size ? at : null };
}

export const kOutcomeColors: Record<Outcome, string> = { acceptable: "#0072b2", beyond: "#d55e00", none: "#d55e00" };
