// Made by scripts/tables from the descriptions of results in grapnel/; edit those.

export type FieldNote = readonly [key: string, unit: string, text: string];

// results of an optimization: before, the unchanged scenario, and after, the best point.
export interface OptimizationReport {
  /** format of this file */
  schema: OptimizationResultFormat;
  /** version of Grapnel */
  version: string;
  /** settings of the optimization */
  optimization: OptimizationSettings;
  /** number of evaluated points [1] */
  evaluations: number;
  /** points that completed [1] */
  ok: number;
  /** points that failed [1] */
  failed: number;
  /** points for which no configuration was found [1] */
  unreachable: number;
  /** points that are ok but violate limits [1] */
  beyond_limits: number;
  /** the best point, as `point` in evaluations.csv; null: no point meets all limits [1] */
  best: number | null;
  /** reason for which no point meets all limits; absent with a best point */
  why?: string;
  /** whether the unchanged scenario meets all limits */
  before_acceptable: boolean;
  /** reason for which the unchanged scenario has no result; absent if it has one */
  before_reason?: string;
  /** feasibility before and after */
  feasibility: FeasibilityChange;
  /** variables in the order of the file */
  variables: Variable[];
  /** minimized or maximized columns */
  objective: Change;
  /** limits in the order of the file */
  limits: Change[];
  /** all stored columns */
  columns: Change[];
  /** text of the optimization file */
  text: string;
}
export const kOptimizationReport: FieldNote[] = [
  ["schema","","format of this file"],
  ["version","","version of Grapnel"],
  ["optimization","","settings of the optimization"],
  ["evaluations","1","number of evaluated points"],
  ["ok","1","points that completed"],
  ["failed","1","points that failed"],
  ["unreachable","1","points for which no configuration was found"],
  ["beyond_limits","1","points that are ok but violate limits"],
  ["best","1","the best point, as `point` in evaluations.csv; null: no point meets all limits"],
  ["why","","reason for which no point meets all limits; absent with a best point"],
  ["before_acceptable","","whether the unchanged scenario meets all limits"],
  ["before_reason","","reason for which the unchanged scenario has no result; absent if it has one"],
  ["feasibility","","feasibility before and after"],
  ["variables","","variables in the order of the file"],
  ["objective","","minimized or maximized columns"],
  ["limits","","limits in the order of the file"],
  ["columns","","all stored columns"],
  ["text","","text of the optimization file"],
];

export type OptimizationResultFormat = "grapnel-optimization-result/1";

// settings of the optimization.
export interface OptimizationSettings {
  /** name of the optimization */
  name: string;
  /** SHA-256 of the file's bytes and of the scenario with its included files */
  sha256: string;
  /** as in the file */
  simulate: StudyMode;
}
export const kOptimizationSettings: FieldNote[] = [
  ["name","","name of the optimization"],
  ["sha256","","SHA-256 of the file's bytes and of the scenario with its included files"],
  ["simulate","","as in the file"],
];

export type StudyMode = "impact" | "run";

// whether joints stay within their limits and bodies keep their clearance.
export interface FeasibilityChange {
  /** verdict of the unchanged scenario */
  before: Verdict;
  /** verdict of the best point; absent without one */
  after?: Verdict;
}
export const kFeasibilityChange: FieldNote[] = [
  ["before","","verdict of the unchanged scenario"],
  ["after","","verdict of the best point; absent without one"],
];

export type Verdict = "yes" | "no" | "not checked";

// a number that was varied.
export interface Variable {
  /** name of the variable */
  name: string;
  /** unit of its numbers; empty: unknown */
  unit: string;
  /** lower bound [as the variable] */
  from: number;
  /** upper bound [as the variable] */
  to: number;
  /** value at the best point; absent without one [as the variable] */
  best?: number;
}
export const kVariable: FieldNote[] = [
  ["name","","name of the variable"],
  ["unit","","unit of its numbers; empty: unknown"],
  ["from","as the variable","lower bound"],
  ["to","as the variable","upper bound"],
  ["best","as the variable","value at the best point; absent without one"],
];

// a number before and after.
export interface Change {
  /** name of the objective, the limit or the column */
  name: string;
  /** unit of its numbers; empty: the sum of several units */
  unit: string;
  /** value of the unchanged scenario; null: it does not exist [as `unit`] */
  before: number | null;
  /** value at the best point; null: it does not exist; absent without a best point [as `unit`] */
  after?: number | null;
}
export const kChange: FieldNote[] = [
  ["name","","name of the objective, the limit or the column"],
  ["unit","","unit of its numbers; empty: the sum of several units"],
  ["before","as `unit`","value of the unchanged scenario; null: it does not exist"],
  ["after","as `unit`","value at the best point; null: it does not exist; absent without a best point"],
];
