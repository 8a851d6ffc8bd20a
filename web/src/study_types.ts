// Made by scripts/tables from the descriptions of results in grapnel/; edit those.

export type FieldNote = readonly [key: string, unit: string, text: string];

// settings of a sweep, and how its points ended.
export interface SweepReport {
  /** format of this file */
  schema: StudyTableFormat;
  /** version of Grapnel */
  version: string;
  /** settings of the study */
  study: StudySettings;
  /** number of all points [1] */
  points: number;
  /** points that completed [1] */
  ok: number;
  /** points that failed [1] */
  failed: number;
  /** points for which no configuration was found [1] */
  unreachable: number;
  /** axes in the order of the file */
  axes: StudyAxis[];
  /** columns of the table */
  columns: Column[];
  /** text of the study file */
  text: string;
}
export const kSweepReport: FieldNote[] = [
  ["schema","","format of this file"],
  ["version","","version of Grapnel"],
  ["study","","settings of the study"],
  ["points","1","number of all points"],
  ["ok","1","points that completed"],
  ["failed","1","points that failed"],
  ["unreachable","1","points for which no configuration was found"],
  ["axes","","axes in the order of the file"],
  ["columns","","columns of the table"],
  ["text","","text of the study file"],
];

export type StudyTableFormat = "grapnel-study-table/1";

// settings of the study.
export interface StudySettings {
  /** name of the study */
  name: string;
  /** name of the study file, without folders */
  file: string;
  /** SHA-256 of its bytes, followed by that of the scenarios that were checked before the run */
  sha256: string;
  /** as in the file */
  simulate: StudyMode;
}
export const kStudySettings: FieldNote[] = [
  ["name","","name of the study"],
  ["file","","name of the study file, without folders"],
  ["sha256","","SHA-256 of its bytes, followed by that of the scenarios that were checked before the run"],
  ["simulate","","as in the file"],
];

export type StudyMode = "impact" | "run";

// an axis of a study.
export interface StudyAxis {
  /** path, quantity, or label of the study */
  name: string;
  /** unit of its numbers; empty: unknown, or no numbers */
  unit: string;
  /** what the axis changes */
  description: string;
  /** values as in the file, or labels [as stated] */
  values: (number | string)[];
}
export const kStudyAxis: FieldNote[] = [
  ["name","","path, quantity, or label of the study"],
  ["unit","","unit of its numbers; empty: unknown, or no numbers"],
  ["description","","what the axis changes"],
  ["values","as stated","values as in the file, or labels"],
];

// a stored number of every case.
export interface Column {
  /** name of the column, grouped by `/` */
  name: string;
  /** `1` for counts, ratios and yes (1) or no (0) */
  unit: string;
  /** meaning of the number */
  description: string;
}
export const kColumn: FieldNote[] = [
  ["name","","name of the column, grouped by `/`"],
  ["unit","","`1` for counts, ratios and yes (1) or no (0)"],
  ["description","","meaning of the number"],
];
