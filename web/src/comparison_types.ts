// Made by scripts/tables from the descriptions of results in grapnel/; edit those.

export type FieldNote = readonly [key: string, unit: string, text: string];

// residuals of a log against a run: measured minus simulated.
export interface LogComparison {
  /** format of this file */
  schema: ComparisonFormat;
  /** version of Grapnel */
  version: string;
  /** no: a quantity disagrees; yes: every quantity with an uncertainty agrees; not_checked: none has one */
  agrees: Verdict;
  /** number of quantities with a verdict [1] */
  checked: number;
  /** the run */
  run: ComparedRun;
  /** the log */
  log: ComparedLog;
  /** the clock of the log */
  clock: LogClock;
  /** in the order of the mapping */
  quantities: ComparedQuantity[];
  /** momentum and energy of the measured motion of the robot and of each target */
  momentum: MeasuredMomentum[];
  /** why `momentum` is empty; else empty */
  momentum_reason: string;
  /** doubts about the comparison */
  warnings: string[];
}
export const kLogComparison: FieldNote[] = [
  ["schema","","format of this file"],
  ["version","","version of Grapnel"],
  ["agrees","","no: a quantity disagrees; yes: every quantity with an uncertainty agrees; not_checked: none has one"],
  ["checked","1","number of quantities with a verdict"],
  ["run","","the run"],
  ["log","","the log"],
  ["clock","","the clock of the log"],
  ["quantities","","in the order of the mapping"],
  ["momentum","","momentum and energy of the measured motion of the robot and of each target"],
  ["momentum_reason","","why `momentum` is empty; else empty"],
  ["warnings","","doubts about the comparison"],
];

export type ComparisonFormat = "grapnel-log-comparison/1";

export type Verdict = "yes" | "no" | "not checked";

// the run.
export interface ComparedRun {
  /** name of the scenario */
  scenario: string;
  /** SHA-256 of the scenario, as in summary.json */
  sha256: string;
}
export const kComparedRun: FieldNote[] = [
  ["scenario","","name of the scenario"],
  ["sha256","","SHA-256 of the scenario, as in summary.json"],
];

// the log.
export interface ComparedLog {
  /** name of the log, without its folder */
  file: string;
  /** SHA-256 of the log */
  sha256: string;
  /** csv, hdf5, mat, mcap or rosbag */
  format: string;
}
export const kComparedLog: FieldNote[] = [
  ["file","","name of the log, without its folder"],
  ["sha256","","SHA-256 of the log"],
  ["format","","csv, hdf5, mat, mcap or rosbag"],
];

// the clock of the log.
export interface LogClock {
  /** time of the run minus time of the log; with a drift, at `reference` [s] */
  offset: number;
  /** whether the comparison determined it */
  found: boolean;
  /** its standard uncertainty, for uncorrelated noise; absent if it is stated [s] */
  uncertainty?: number;
  /** another offset that fits nearly as well; absent: none does [s] */
  other?: number;
  /** rate of the run's time per time of the log, minus 1 [1] */
  drift: number;
  /** time of the log from which the drift counts [s] */
  reference: number;
  /** whether the comparison determined the drift */
  drift_found: boolean;
  /** its standard uncertainty, for uncorrelated noise; absent if it is stated [1] */
  drift_uncertainty?: number;
}
export const kLogClock: FieldNote[] = [
  ["offset","s","time of the run minus time of the log; with a drift, at `reference`"],
  ["found","","whether the comparison determined it"],
  ["uncertainty","s","its standard uncertainty, for uncorrelated noise; absent if it is stated"],
  ["other","s","another offset that fits nearly as well; absent: none does"],
  ["drift","1","rate of the run's time per time of the log, minus 1"],
  ["reference","s","time of the log from which the drift counts"],
  ["drift_found","","whether the comparison determined the drift"],
  ["drift_uncertainty","1","its standard uncertainty, for uncorrelated noise; absent if it is stated"],
];

// a measured quantity against the run.
export interface ComparedQuantity {
  /** name of the quantity in the mapping */
  name: string;
  /** series of the run */
  run: string;
  /** columns of the log */
  columns: string[];
  /** unit of the residuals */
  unit: string;
  /** whether the residuals are consistent with the stated uncertainty; not_checked without one */
  agrees: Verdict;
  /** the values behind the verdict */
  reason: string;
  /** samples in the log [1] */
  samples: number;
  /** samples behind the statistics [1] */
  compared: number;
  /** samples without a number in the log [1] */
  missing: number;
  /** samples at times for which the run has no value, or outside `time.from` to `time.to` [1] */
  outside: number;
  /** isolated samples that the statistics leave out [1] */
  outliers: number;
  /** time of the first one, of the run; absent without outliers [s] */
  outlier_time?: number;
  /** intervals in the log that are more than three times as long as the median [1] */
  gaps: number;
  /** the longest of them; absent without gaps [s] */
  longest_gap?: number;
  /** its beginning, of the run; absent without gaps [s] */
  longest_gap_time?: number;
  /** root mean square residual of all components together; absent: no sample is compared [as `unit`] */
  rms?: number;
  /** residual of the largest magnitude, with its sign [as `unit`] */
  peak?: number;
  /** its time, of the run [s] */
  peak_time?: number;
  /** its component */
  peak_component: string;
  /** delay of this quantity in the log, with the common offset; positive: the log is late; absent: not determined [s] */
  lag?: number;
  /** its standard uncertainty [s] */
  lag_uncertainty?: number;
  /** stated standard uncertainty; absent: none is stated [as `unit`] */
  uncertainty?: number;
  /** stated standard uncertainty of the bias; absent: none is stated [as `unit`] */
  bias_uncertainty?: number;
  /** chi-square divided by the number of compared numbers; absent without an uncertainty [1] */
  chi_square?: number;
  /** largest value that agrees [1] */
  chi_square_bound?: number;
  /** estimated root mean square error of interpolation between samples of the run; absent with too few samples [as `unit`] */
  interpolation_error?: number;
  /** correlation of each residual with the next; near 0 for white noise [1] */
  autocorrelation: number;
  /** residuals by component */
  components: ComparedComponent[];
}
export const kComparedQuantity: FieldNote[] = [
  ["name","","name of the quantity in the mapping"],
  ["run","","series of the run"],
  ["columns","","columns of the log"],
  ["unit","","unit of the residuals"],
  ["agrees","","whether the residuals are consistent with the stated uncertainty; not_checked without one"],
  ["reason","","the values behind the verdict"],
  ["samples","1","samples in the log"],
  ["compared","1","samples behind the statistics"],
  ["missing","1","samples without a number in the log"],
  ["outside","1","samples at times for which the run has no value, or outside `time.from` to `time.to`"],
  ["outliers","1","isolated samples that the statistics leave out"],
  ["outlier_time","s","time of the first one, of the run; absent without outliers"],
  ["gaps","1","intervals in the log that are more than three times as long as the median"],
  ["longest_gap","s","the longest of them; absent without gaps"],
  ["longest_gap_time","s","its beginning, of the run; absent without gaps"],
  ["rms","as `unit`","root mean square residual of all components together; absent: no sample is compared"],
  ["peak","as `unit`","residual of the largest magnitude, with its sign"],
  ["peak_time","s","its time, of the run"],
  ["peak_component","","its component"],
  ["lag","s","delay of this quantity in the log, with the common offset; positive: the log is late; absent: not determined"],
  ["lag_uncertainty","s","its standard uncertainty"],
  ["uncertainty","as `unit`","stated standard uncertainty; absent: none is stated"],
  ["bias_uncertainty","as `unit`","stated standard uncertainty of the bias; absent: none is stated"],
  ["chi_square","1","chi-square divided by the number of compared numbers; absent without an uncertainty"],
  ["chi_square_bound","1","largest value that agrees"],
  ["interpolation_error","as `unit`","estimated root mean square error of interpolation between samples of the run; absent with too few samples"],
  ["autocorrelation","1","correlation of each residual with the next; near 0 for white noise"],
  ["components","","residuals by component"],
];

// residuals of one component.
export interface ComparedComponent {
  /** component of the series; of a vector x, y, z along the log's axes */
  name: string;
  /** root mean square residual [as the quantity] */
  rms: number;
  /** mean residual [as the quantity] */
  bias: number;
  /** residual of the largest magnitude, with its sign [as the quantity] */
  peak: number;
  /** its time, of the run [s] */
  peak_time: number;
  /** chi-square divided by the number of compared samples; absent without an uncertainty [1] */
  chi_square?: number;
}
export const kComparedComponent: FieldNote[] = [
  ["name","","component of the series; of a vector x, y, z along the log's axes"],
  ["rms","as the quantity","root mean square residual"],
  ["bias","as the quantity","mean residual"],
  ["peak","as the quantity","residual of the largest magnitude, with its sign"],
  ["peak_time","s","its time, of the run"],
  ["chi_square","1","chi-square divided by the number of compared samples; absent without an uncertainty"],
];

// momentum and kinetic energy of measured motion; momentum.csv has all times.
export interface MeasuredMomentum {
  /** robot, or the name of a target */
  body: string;
  /** series that the log does not measure completely; they would determine more */
  missing: string[];
  /** times in momentum.csv [1] */
  samples: number;
  /** at the first time; empty without samples */
  first: MeasuredComponent[];
  /** at the last time */
  last: MeasuredComponent[];
}
export const kMeasuredMomentum: FieldNote[] = [
  ["body","","robot, or the name of a target"],
  ["missing","","series that the log does not measure completely; they would determine more"],
  ["samples","1","times in momentum.csv"],
  ["first","","at the first time; empty without samples"],
  ["last","","at the last time"],
];

// a component of an impulse or momentum of measured motion.
export interface MeasuredComponent {
  /** component; of impulses along the axes of W, on the robot */
  name: string;
  /** its unit */
  unit: string;
  /** whether the measured quantities determine it */
  determined: boolean;
  /** estimate; absent: not determined [as `unit`] */
  value?: number;
  /** its standard uncertainty [as `unit`] */
  uncertainty?: number;
  /** value of the run; absent: the run has none [as `unit`] */
  simulated?: number;
}
export const kMeasuredComponent: FieldNote[] = [
  ["name","","component; of impulses along the axes of W, on the robot"],
  ["unit","","its unit"],
  ["determined","","whether the measured quantities determine it"],
  ["value","as `unit`","estimate; absent: not determined"],
  ["uncertainty","as `unit`","its standard uncertainty"],
  ["simulated","as `unit`","value of the run; absent: the run has none"],
];
