// Made by scripts/tables from the descriptions of results in grapnel/: change those.

export type FieldNote = readonly [key: string, unit: string, text: string];

// before, the scenario as it is, and after, the best that was found.
export interface OptimizationReport {
  /** the format of this file */
  schema: OptimizationResultFormat;
  /** of Grapnel */
  version: string;
  /** what it is */
  optimization: OptimizationSettings;
  /** points that were tried [1] */
  evaluations: number;
  /** points that came to their end [1] */
  ok: number;
  /** points in which something went wrong [1] */
  failed: number;
  /** points for which no configuration was found [1] */
  unreachable: number;
  /** points that are ok, and keep not all limits [1] */
  beyond_limits: number;
  /** the best point, as `point` in evaluations.csv; null: none keeps all limits [1] */
  best: number | null;
  /** why no point keeps all limits; absent with a best */
  why?: string;
  /** whether the scenario as it is keeps all limits */
  before_acceptable: boolean;
  /** why it came to no result; absent if it did */
  before_reason?: string;
  /** before and after */
  feasibility: FeasibilityChange;
  /** in the order of the file */
  variables: Variable[];
  /** what was minimized or maximized */
  objective: Change;
  /** in the order of the file */
  limits: Change[];
  /** everything that was kept */
  columns: Change[];
  /** the optimization file */
  text: string;
}
export const kOptimizationReport: FieldNote[] = [
  ["schema","","the format of this file"],
  ["version","","of Grapnel"],
  ["optimization","","what it is"],
  ["evaluations","1","points that were tried"],
  ["ok","1","points that came to their end"],
  ["failed","1","points in which something went wrong"],
  ["unreachable","1","points for which no configuration was found"],
  ["beyond_limits","1","points that are ok, and keep not all limits"],
  ["best","1","the best point, as `point` in evaluations.csv; null: none keeps all limits"],
  ["why","","why no point keeps all limits; absent with a best"],
  ["before_acceptable","","whether the scenario as it is keeps all limits"],
  ["before_reason","","why it came to no result; absent if it did"],
  ["feasibility","","before and after"],
  ["variables","","in the order of the file"],
  ["objective","","what was minimized or maximized"],
  ["limits","","in the order of the file"],
  ["columns","","everything that was kept"],
  ["text","","the optimization file"],
];

export type OptimizationResultFormat = "grapnel-optimization-result/1";

// what the optimization is.
export interface OptimizationSettings {
  /** of the optimization */
  name: string;
  /** of the file's bytes and of the scenario with what it includes */
  sha256: string;
  /** as in the file */
  simulate: StudyMode;
}
export const kOptimizationSettings: FieldNote[] = [
  ["name","","of the optimization"],
  ["sha256","","of the file's bytes and of the scenario with what it includes"],
  ["simulate","","as in the file"],
];

export type StudyMode = "impact" | "run";

// whether joints stay within their limits and bodies clear of each other.
export interface FeasibilityChange {
  /** of the scenario as it is */
  before: Verdict;
  /** of the best; absent without one */
  after?: Verdict;
}
export const kFeasibilityChange: FieldNote[] = [
  ["before","","of the scenario as it is"],
  ["after","","of the best; absent without one"],
];

export type Verdict = "yes" | "no" | "not checked";

// a number that was varied.
export interface Variable {
  /** of the variable */
  name: string;
  /** of its numbers; empty: unknown */
  unit: string;
  /** least value [as the variable] */
  from: number;
  /** largest value [as the variable] */
  to: number;
  /** of the best point; absent without one [as the variable] */
  best?: number;
}
export const kVariable: FieldNote[] = [
  ["name","","of the variable"],
  ["unit","","of its numbers; empty: unknown"],
  ["from","as the variable","least value"],
  ["to","as the variable","largest value"],
  ["best","as the variable","of the best point; absent without one"],
];

// a number before and after.
export interface Change {
  /** of the objective, the limit or the column */
  name: string;
  /** of its numbers; empty: they are added up from several */
  unit: string;
  /** of the scenario as it is; null: it has no such number [as `unit`] */
  before: number | null;
  /** of the best; null: it has no such number; absent without a best [as `unit`] */
  after?: number | null;
}
export const kChange: FieldNote[] = [
  ["name","","of the objective, the limit or the column"],
  ["unit","","of its numbers; empty: they are added up from several"],
  ["before","as `unit`","of the scenario as it is; null: it has no such number"],
  ["after","as `unit`","of the best; null: it has no such number; absent without a best"],
];
