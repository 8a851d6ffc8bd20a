// What a report holds: written by the C++ module `report` into <script id="grapnel-data" type="application/json">, read
// here and nowhere else. SI units and radians; vectors in the world frame W; quaternions w, x, y, z. The C++ side is
// grapnel/report/report_data.hpp; both change together.

import type { Summary } from "./summary_types";

export type Vec3 = [number, number, number];
export type Quat = [number, number, number, number]; // w, x, y, z

export interface ReportData {
  schema: "grapnel-report/1";
  version: string; // of Grapnel
  kind: "run" | "comparison" | "sweep" | "optimization" | "campaign";
  title: string; // scenario's or study's name
  runs: RunData[]; // run: 1, comparison: 2, else 0
  sweep?: SweepData;
  optimization?: OptimizationData;
  campaign?: CampaignData;
}

// ---- One run ----

// What may be missing in whole or in part.
export type Partly<T> = T extends readonly (infer Item)[]
  ? Partly<Item>[]
  : T extends object
    ? { [Key in keyof T]?: Partly<T[Key]> }
    : T;
export type PartlySummary = Partly<Summary>;

export interface RunData {
  label: string; // "A", "B" of a comparison; else ""
  folder?: string; // name of the result folder, in a comparison
  summary: PartlySummary | null; // summary.json as it is
  scene: Scene | null; // scene.json as it is; null: the folder has none
  series: PackedSeries | null; // timeseries.h5, decimated; null: the folder has none
  notes: string[]; // what is odd: files of different runs, a file missing
  source?: SourceTexts | null; // scenario.json: what was simulated; results of earlier versions have none
}

export interface SourceTexts {
  description: string;
  settings: string[]; // "path=value" of every --set
  files: { part: string; bytes: number; text: string }[]; // "scenario", "robot", "trajectory"; text "": too large to be kept
}

export interface Scene {
  schema: "grapnel-scene/1";
  version: string;
  scenario: { name: string; sha256: string };
  planar: boolean; // everything moves along the plane z = 0
  bodies: SceneBody[]; // base first, then links (parents before children), then targets
  end_effectors: { name: string; body: string; position: Vec3; quaternion_wxyz: Quat }[]; // in the body's frame
  grasp_points: {
    target: string;
    name: string;
    position: Vec3; // in the target's frame
    approach_direction: Vec3 | null; // unit, in the target's frame
  }[];
  grasps: { end_effector: string; target: string; grasp_point: string; model: string }[];
  limits?: {
    grips: { end_effector: string; position: number | null; velocity: number | null }[]; // [m], [m/s]; null: any
    clearance: number | null; // required [m]; null: not watched
  };
  meshes: { name: string; vertices: number[]; triangles: number[] }[]; // x, y, z in turn, in the file's unit (a geometry's size makes it m); three indices in turn
}

export interface SceneBody {
  name: string;
  kind: "base" | "link" | "target";
  parent: string | null; // of links
  joint: {
    // of links
    name: string;
    type: "revolute" | "continuous" | "prismatic" | "fixed";
    axis: Vec3; // unit, in the joint's frame
    position: Vec3; // of the joint in the parent's frame
    quaternion_wxyz: Quat;
  } | null;
  series: string; // its motion: series `${series}/position` and `${series}/quaternion_wxyz`
  mass: number; // [kg]
  com: Vec3; // in the body's frame [m]
  inertia: [number, number, number, number, number, number]; // xx, yy, zz, xy, xz, yz about com, body axes [kg m^2]
  geometry: Geometry | null;
}

export interface Geometry {
  shape: "box" | "cylinder" | "capsule" | "sphere" | "mesh";
  // box: edge lengths; cylinder and capsule: radius, length along z (of a capsule without its caps), 0; sphere: radius, 0, 0;
  // mesh: scales.
  size: Vec3;
  position: Vec3; // of the shape's centre in the body's frame
  quaternion_wxyz: Quat;
  mesh?: number; // index into meshes
}

// Samples at common times; between samples values go linearly. At impacts several samples have the same time.
export interface PackedSeries {
  samples: number; // kept
  of: number; // recorded
  bound: number; // largest deviation of what was left out, relative to each series' range
  time: string; // base64, float64 little endian [s]
  phase: string; // base64, uint8: index into phases
  phases: string[]; // "approach", "contact", "post_impact", ...
  series: { path: string; unit: string; description: string; components: string[]; data: string }[];
  // data: base64, float32 little endian, samples x components. A scalar has one component, "" or its own name.
}

// ---- Studies ----

export interface TableColumn {
  name: string;
  unit: string; // "1" or "": none
  description: string;
}

export interface SweepData {
  settings: any; // study.json as it is (docs/formats/study.md)
  command: string; // "grapnel sweep STUDY.yaml --only {K} -o out/point-{K}": replays a point; "" if not known
  axes: (TableColumn & { labels?: string[] })[]; // with labels: values count from 0 into them
  axis_values: number[][]; // per axis, per point
  status: string[]; // per point: ok, failed, unreachable
  reason: string[];
  columns: TableColumn[];
  values: (number | null)[][]; // per column, per point
}

export interface OptimizationData {
  comparison: any; // comparison.json as it is (docs/formats/optimization.md)
  command: string; // "grapnel run out/x/best.yaml"
  columns: TableColumn[]; // of evaluations.csv, the texts `search`, `status`, `reason` left out
  values: (number | null)[][]; // per column, per evaluation
  search: string[]; // per evaluation: sample, local 1, ...
  status: string[];
  reason: string[];
}

// ---- Campaigns ----

export interface CampaignData {
  statistics: any; // campaign.json as it is (docs/formats/campaign.md)
  command: string; // "grapnel campaign STUDY.yaml --only {K} -o out/case-{K}": replays a case; "" if not known
  rows: number; // of the table; 0 without one
  sample: PackedSample | null; // null: the folder has no sound table.h5
  notes: string[]; // what is odd: the table is missing, or damaged
  saved: number[]; // cases with a report of their own, series/case-K/report.html
}

// Some rows of the table, in the order of their cases. Of few cases these are all.
export interface PackedSample {
  rows: number;
  case: string; // base64, float64 little endian: k of each row
  drawn: string; // base64, uint8: 1 if the row is of the even sample, 0 if it is here because it failed or is among the worst
  status: string; // base64, uint8: index into statuses
  statuses: string[]; // "ok", "failed", "unreachable"
  success: string; // base64, uint8
  reasons: [number, string][]; // row, text: rows that have one
  design: (TableColumn & { labels?: string[]; data: string })[]; // of an envelope; with labels: values count from 0 into them
  inputs: (TableColumn & { data: string })[]; // base64, float32 little endian, NaN where there is nothing
  columns: (TableColumn & { data: string })[];
}
