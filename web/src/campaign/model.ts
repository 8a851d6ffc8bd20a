// A campaign's statistics as its page needs them, from campaign.json (docs/formats/campaign.md). Whatever is missing
// there is null or empty here. No DOM.

export interface Proportion {
  successes: number;
  trials: number;
  estimate: number; // NaN without trials
  lower: number;
  upper: number;
}

export interface CriterionResult extends Proportion {
  name: string;
  text: string; // the expression
  onlyThis: number; // cases that fail this one alone; NaN: not known
  notChecked: number; // cases in which a number that it reads does not exist
  reads: string[]; // columns and inputs
}

// Where a criterion compares a column with a number.
export interface Limit {
  column: string;
  value: number;
  atMost: boolean; // else at least
  criterion: string; // its name
}

export interface Quantile {
  probability: number;
  value: number;
  lower: number; // of its interval; NaN: not known
  upper: number;
}

export interface Counts {
  begin: number;
  end: number; // bins of equal width between
  counts: number[];
  successes: number[] | null; // of them
  below: number; // numbers outside
  above: number;
}

// Success among cases whose input lies between two values.
export interface Group extends Proportion {
  from: number;
  to: number;
}

// One column or input over all rows.
export interface Described {
  name: string;
  unit: string;
  description: string;
  role: "input" | "column";
  count: number; // rows with a number
  missing: number;
  mean: number;
  deviation: number;
  least: number;
  largest: number;
  quantiles: Quantile[]; // by probability
  histogram: Counts | null;
  successBy: Group[]; // of inputs
}

export interface Influence {
  input: string;
  firstOrder: number; // NaN: not known
  error: number;
  rank: number;
}

export interface Sensitivity {
  output: string; // "success", a criterion or a column
  of: string; // "success", "criterion", "column"
  count: number; // cases it was computed from
  influences: Influence[]; // per input
  groups: Influence[]; // per group of inputs and design axis; none: not known
  unexplained: number; // share of the variance that goes with no group alone; NaN: not known
}

// Inputs that belong together; a design axis has none.
export interface InputGroup {
  name: string;
  design: boolean;
  inputs: string[];
}

// How often a grasp missed, and by which tolerance.
export interface GraspCount {
  endEffector: string;
  captured: number;
  missed: number;
  tolerances: { name: string; exceeded: number; limiting: number }[];
}

export interface WorstCase {
  index: number; // k
  value: number;
  success: boolean | null;
  inputs: number[]; // in their order
  command: string;
}

export interface WorstList {
  by: string;
  unit: string;
  direction: string; // "largest", "least"
  magnitude: boolean; // by the magnitude
  cases: WorstCase[];
}

export interface Failure {
  status: string;
  reason: string;
  count: number;
  examples: { index: number; reason: string; command: string }[];
}

export interface MapAxis {
  name: string;
  unit: string;
  description: string;
  values: number[];
  labels: string[] | null; // values count from 0 into them
}

export interface MapPoint extends Proportion {
  at: number[]; // per axis: which value
  deciding: string; // the criterion that most cases fail; "": none fails, or not known
  unmet: { criterion: string; count: number }[];
}

export interface SuccessMap {
  axes: MapAxis[];
  points: MapPoint[];
}

export interface CampaignModel {
  name: string;
  description: string;
  confidence: number;
  total: number; // cases that were asked for
  rows: number; // cases that there are
  counts: { status: string; count: number }[];
  success: Proportion;
  completed: Proportion; // status ok
  criteria: CriterionResult[];
  limits: Limit[];
  inputs: Described[];
  columns: Described[];
  sensitivities: Sensitivity[];
  worst: WorstList[];
  failures: Failure[]; // why cases are no success
  failuresAreAll: boolean; // else only those of cases without a result
  grasps: GraspCount[];
  groups: InputGroup[];
  assumed: number; // successes without an evaluated envelope
  warnings: string[];
  saved: Set<number>; // cases whose complete results lie in series/
  failuresLeftOut: number; // cases with other reasons
  measuresLeftOut: number; // of sensitivities
  successMap: SuccessMap | null;
  settings: [string, string][];
  text: string; // the campaign's file
  sampling: string;
}

// All columns and inputs.
export function describedOf(model: CampaignModel): Described[] {
  return [...model.columns, ...model.inputs];
}

export function kindOf(described: Described): string {
  return `${described.role}:${described.name}`;
}
