// The engine that simulates variants of a run in the page, as the panel uses it. web/src/engine has the engine itself.
import type { PartlySummary, ReportData, RunData } from "../data";

// A value in place of the scenario's, as `--set path=value`.
export interface Override {
  path: string;
  value: unknown;
}

export interface VariantRequest {
  overrides: Override[];
  plan: "again" | "keep"; // keep: the joints move as in the base case
}

export interface VariantResult {
  summary: PartlySummary;
  run: RunData;
}

// A value of the scenario that an override can replace.
export interface Settable {
  path: string;
  unit: string;
  text: string; // its meaning
  value: unknown; // in the base case; null or undefined: not given
}

export type Progress = (phase: string, fraction: number) => void;

export interface VariantEngine {
  // Rejects with the program's messages, one per line.
  run(request: VariantRequest, progress?: Progress): Promise<VariantResult>;
  cancel(): void; // the current run
  paths(): Promise<Settable[]>;
}

// Null: this page cannot compute variants.
export type EngineProvider = (data: ReportData) => VariantEngine | null;
