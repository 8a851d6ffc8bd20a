// Made by scripts/tables from the descriptions of results in grapnel/: change those.

export type FieldNote = readonly [key: string, unit: string, text: string];

// what a sweep is, and how its points ended.
export interface SweepReport {
  /** the format of this file */
  schema: StudyTableFormat;
  /** of Grapnel */
  version: string;
  /** what it is */
  study: StudySettings;
  /** all of them [1] */
  points: number;
  /** points that came to their end [1] */
  ok: number;
  /** points in which something went wrong [1] */
  failed: number;
  /** points for which no configuration was found [1] */
  unreachable: number;
  /** in the order of the file */
  axes: StudyAxis[];
  /** of the table */
  columns: Column[];
  /** the study file */
  text: string;
}
export const kSweepReport: FieldNote[] = [
  ["schema","","the format of this file"],
  ["version","","of Grapnel"],
  ["study","","what it is"],
  ["points","1","all of them"],
  ["ok","1","points that came to their end"],
  ["failed","1","points in which something went wrong"],
  ["unreachable","1","points for which no configuration was found"],
  ["axes","","in the order of the file"],
  ["columns","","of the table"],
  ["text","","the study file"],
];

export type StudyTableFormat = "grapnel-study-table/1";

// what the study is.
export interface StudySettings {
  /** of the study */
  name: string;
  /** the study file's name, without folders */
  file: string;
  /** of its bytes, followed by that of the scenarios that were checked beforehand */
  sha256: string;
  /** as in the file */
  simulate: StudyMode;
}
export const kStudySettings: FieldNote[] = [
  ["name","","of the study"],
  ["file","","the study file's name, without folders"],
  ["sha256","","of its bytes, followed by that of the scenarios that were checked beforehand"],
  ["simulate","","as in the file"],
];

export type StudyMode = "impact" | "run";

// what a study varies.
export interface StudyAxis {
  /** path, quantity, or what the study calls it */
  name: string;
  /** of its numbers; empty: unknown, or no numbers */
  unit: string;
  /** what it changes */
  description: string;
  /** or labels [as stated] */
  values: (number | string)[];
}
export const kStudyAxis: FieldNote[] = [
  ["name","","path, quantity, or what the study calls it"],
  ["unit","","of its numbers; empty: unknown, or no numbers"],
  ["description","","what it changes"],
  ["values","as stated","or labels"],
];

// a number that is kept of every case.
export interface Column {
  /** groups by `/` */
  name: string;
  /** `1` for counts, ratios and yes (1) or no (0) */
  unit: string;
  /** what it is */
  description: string;
}
export const kColumn: FieldNote[] = [
  ["name","","groups by `/`"],
  ["unit","","`1` for counts, ratios and yes (1) or no (0)"],
  ["description","","what it is"],
];
