// The contents of a report: written by the C++ module `report` into <script id="grapnel-data" type="application/json">,
// and read only by this viewer. SI units and radians; vectors in the world frame W; quaternions w, x, y, z. The C++
// side is grapnel/report/report_data.hpp; change both together.

import type { CampaignReport } from "./campaign_types";
import type { LogComparison } from "./comparison_types";
import type { MeasuredImpulses } from "./impulses_types";
import type { OptimizationReport } from "./optimization_types";
import type { Scene, SceneBody, SceneObstacle, SceneShape } from "./scene_types";
import type { SweepReport } from "./study_types";
import type { Summary } from "./summary_types";

export type { Scene, SceneBody, SceneObstacle, SceneShape };

export type Vec3 = [number, number, number];
export type Quat = [number, number, number, number]; // w, x, y, z

export interface ReportData {
  schema: "grapnel-report/1";
  version: string; // of Grapnel
  kind: "run" | "comparison" | "sweep" | "optimization" | "campaign" | "log" | "impulses" | "watch" | "index";
  title: string; // scenario's or study's name
  runs: RunData[]; // run: 1, comparison: 2, else 0
  sweep?: SweepData;
  optimization?: OptimizationData;
  campaign?: CampaignData;
  log?: LogData;
  impulses?: ImpulsesData;
  watch?: WatchData;
  index?: Partly<IndexData>;
}

// ---- Work in progress ----

export interface WatchData {
  command: string; // "run", "campaign", ...
}

// ---- Index of a folder ----

export interface IndexData {
  results: IndexedResult[]; // the newest first
  limit: number; // largest number of them
}

export interface IndexedResult {
  kind?: string; // run, sweep, optimization, campaign
  path?: string; // of the folder, relative to the page's
  title?: string;
  time?: number; // of its last change, since 1970 in UTC [s]
  version?: string;
  report?: boolean; // whether it has report.html
  answers?: { question?: string; tone?: string; word?: string; sentence?: string }[];
  fault?: string; // error of a damaged result; "": none
}

// ---- Comparison with a log ----

export interface LogData {
  comparison: Partly<LogComparison>; // comparison.json, unchanged (docs/formats/comparison.md)
  curves: ComparedCurve[];
}

// One component; base64, float64 little endian. Orientations have residuals only.
export interface ComparedCurve {
  quantity: number; // index into the quantities
  component: string;
  samples: number; // in the page
  of: number;
  time: string; // of the run [s]
  measured: string;
  simulated: string;
  residual: string;
  outliers: number[]; // their times
  breaks: number[]; // indices of samples that follow a gap in the log
}

// ---- Impulses from a log ----

export interface ImpulsesData {
  report: Partly<MeasuredImpulses>; // impulses.json, unchanged (docs/formats/impulses.md)
  momentum: MomentumCurve[];
}

// The determined components of one body; base64, float64 little endian.
export interface MomentumCurve {
  body: string;
  time: string; // of the run [s]
  components: { name: string; unit: string; value: string; deviation: string }[];
}

// ---- One run ----

// A value that may be missing as a whole or in part.
export type Partly<T> = T extends readonly (infer Item)[]
  ? Partly<Item>[]
  : T extends object
    ? { [Key in keyof T]?: Partly<T[Key]> }
    : T;
export type PartlySummary = Partly<Summary>;

export interface RunData {
  label: string; // "A", "B" of a comparison; else ""
  folder?: string; // name of the result folder, in a comparison
  summary: PartlySummary | null; // summary.json, unchanged
  scene: Scene | null; // scene.json, unchanged; null: the folder has none
  series: PackedSeries | null; // timeseries.h5, decimated; null: the folder has none
  notes: string[]; // irregularities: files of different runs, a missing file
  source?: SourceTexts | null; // scenario.json: input of the simulation; results of earlier versions have none
}

export interface SourceTexts {
  description: string;
  settings: string[]; // "path=value" of every --set
  files: { part: string; bytes: number; text: string }[]; // "scenario", "robot", "target NAME", "trajectory"; text "": too large
}

// Samples at common times; values are interpolated linearly between samples. At impacts several samples have the same
// time.
export interface PackedSeries {
  samples: number; // retained
  of: number; // recorded
  bound: number; // largest deviation of omitted samples, relative to each series' range
  time: string; // base64, float64 little endian [s]
  phase: string; // base64, uint8: index into phases
  phases: string[]; // "approach", "contact", "post_impact", ...
  series: { path: string; unit: string; description: string; components: string[]; data: string }[];
  // data: base64, float32 little endian, samples x components. A scalar has one component, named "" or as the series.
}

// ---- Studies ----

export interface TableColumn {
  name: string;
  unit: string; // "1" or "": none
  description: string;
}

export interface SweepData {
  settings: Partly<SweepReport>; // study.json, unchanged (docs/formats/study.md)
  command: string; // "grapnel sweep ../STUDY.yaml --only {K} -o out/point-{K}", in the page's folder; "" if not known
  axes: (TableColumn & { labels?: string[] })[]; // with labels: values count from 0 into them
  axis_values: number[][]; // per axis, per point
  status: string[]; // per point: ok, failed, unreachable
  reason: string[];
  columns: TableColumn[];
  values: (number | null)[][]; // per column, per point
}

export interface OptimizationData {
  comparison: Partly<OptimizationReport>; // comparison.json, unchanged (docs/formats/optimization.md)
  command: string; // "grapnel run best.yaml", in the page's folder
  columns: TableColumn[]; // of evaluations.csv, without the texts `search`, `status`, `reason`
  values: (number | null)[][]; // per column, per evaluation
  search: string[]; // per evaluation: sample, local 1, ...
  status: string[];
  reason: string[];
}

// ---- Campaigns ----

export interface CampaignData {
  statistics: Partly<CampaignReport>; // campaign.json, unchanged (docs/formats/campaign.md)
  command: string; // "grapnel campaign ../STUDY.yaml --only {K}", in the page's folder; "" if not known
  rows: number; // of the table; 0 without one
  sample: PackedSample | null; // null: the folder has no sound table.h5
  notes: string[]; // irregularities: the table is missing, or damaged
  saved: number[]; // cases with separate reports, series/case-K/report.html
}

// Some rows of the table, in the order of their cases. Campaigns with few cases contain all rows.
export interface PackedSample {
  rows: number;
  case: string; // base64, float64 little endian: k of each row
  drawn: string; // base64, uint8: 1: row of the even sample, 0: added because it failed or is among the worst
  status: string; // base64, uint8: index into statuses
  statuses: string[]; // "ok", "failed", "unreachable"
  success: string; // base64, uint8
  reasons: [number, string][]; // row, text: rows with a reason
  design: (TableColumn & { labels?: string[]; data: string })[]; // of a success map; with labels: values count from 0 into them
  inputs: (TableColumn & { data: string })[]; // base64, float32 little endian, NaN where there is nothing
  columns: (TableColumn & { data: string })[];
}
