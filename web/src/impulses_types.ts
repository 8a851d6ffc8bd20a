// Made by scripts/tables from the descriptions of results in grapnel/; edit those.

export type FieldNote = readonly [key: string, unit: string, text: string];

// impulses and momentum of measured motion.
export interface MeasuredImpulses {
  /** format of this file */
  schema: ImpulsesFormat;
  /** version of Grapnel */
  version: string;
  /** no: the balance of a contact is violated; yes: those of all contacts with redundant measurements are satisfied; not_checked: there are none */
  consistent: Verdict;
  /** name of the run's scenario */
  scenario: string;
  /** SHA-256 of the scenario */
  sha256: string;
  /** name of the log, without its folder */
  log: string;
  /** SHA-256 of the log */
  log_sha256: string;
  /** time of the run minus time of the log [s] */
  offset: number;
  /** its standard uncertainty; absent if it is stated [s] */
  offset_uncertainty?: number;
  /** bound on the expected number of contacts that noise alone causes in this log [1] */
  false_alarms: number;
  /** window of the test for contacts, on either side; absent: the times are stated [s] */
  detection_window?: number;
  /** the contacts, in the order of time */
  contacts: MeasuredContact[];
  /** momentum and energy of the robot and of each target */
  momentum: MeasuredMomentum[];
  /** quantities of the mapping that say nothing about impulses, with the reason */
  unused: string[];
  /** doubts about the results */
  warnings: string[];
}
export const kMeasuredImpulses: FieldNote[] = [
  ["schema","","format of this file"],
  ["version","","version of Grapnel"],
  ["consistent","","no: the balance of a contact is violated; yes: those of all contacts with redundant measurements are satisfied; not_checked: there are none"],
  ["scenario","","name of the run's scenario"],
  ["sha256","","SHA-256 of the scenario"],
  ["log","","name of the log, without its folder"],
  ["log_sha256","","SHA-256 of the log"],
  ["offset","s","time of the run minus time of the log"],
  ["offset_uncertainty","s","its standard uncertainty; absent if it is stated"],
  ["false_alarms","1","bound on the expected number of contacts that noise alone causes in this log"],
  ["detection_window","s","window of the test for contacts, on either side; absent: the times are stated"],
  ["contacts","","the contacts, in the order of time"],
  ["momentum","","momentum and energy of the robot and of each target"],
  ["unused","","quantities of the mapping that say nothing about impulses, with the reason"],
  ["warnings","","doubts about the results"],
];

export type ImpulsesFormat = "grapnel-impulses/1";

export type Verdict = "yes" | "no" | "not checked";

// the impulses of one contact.
export interface MeasuredContact {
  /** time of the contact, of the run's clock; its beginning, if it has a duration [s] */
  time: number;
  /** its end; equal for an instant [s] */
  end: number;
  /** whether the log determined the time; else the user stated it */
  detected: boolean;
  /** standard uncertainty of a detected time [s] */
  time_uncertainty?: number;
  /** root of the chi-square of a detected step [1] */
  statistic?: number;
  /** the statistic from which on a step is detected [1] */
  threshold?: number;
  /** the contact of the run that it is related to [s] */
  simulated_time: number;
  /** whether the measured changes satisfy the momentum balance of the model; not_checked without redundant measurements */
  consistent: Verdict;
  /** the values behind the verdict */
  reason: string;
  /** of the residuals of the balance, per degree of freedom; absent without redundancy [1] */
  chi_square?: number;
  /** largest value that is consistent [1] */
  chi_square_bound?: number;
  /** number of unknown components of impulses [1] */
  unknowns: number;
  /** number of their combinations that the measurements determine [1] */
  rank: number;
  /** number of measured changes [1] */
  rows: number;
  /** rows minus rank: number of redundant measurements [1] */
  freedom: number;
  /** the impulses at grasps */
  grasps: MeasuredGrasp[];
  /** impulses of drives and brakes that kept a rate */
  drives: MeasuredComponent[];
  /** each a combination of impulses that changes no measurement: of the constrained components of the grasps in order, then of the drives; its largest entry is 1 [N s and N m s] */
  null_space: number[][];
  /** the measured changes of rates */
  rates: MeasuredRateChange[];
  /** places that are not measured and are therefore those of the run */
  assumed: string[];
  /** of a contact with a duration: joints and wheels whose effort is not measured and counts as exactly zero; it is not part of the uncertainty */
  zero_efforts: string[];
}
export const kMeasuredContact: FieldNote[] = [
  ["time","s","time of the contact, of the run's clock; its beginning, if it has a duration"],
  ["end","s","its end; equal for an instant"],
  ["detected","","whether the log determined the time; else the user stated it"],
  ["time_uncertainty","s","standard uncertainty of a detected time"],
  ["statistic","1","root of the chi-square of a detected step"],
  ["threshold","1","the statistic from which on a step is detected"],
  ["simulated_time","s","the contact of the run that it is related to"],
  ["consistent","","whether the measured changes satisfy the momentum balance of the model; not_checked without redundant measurements"],
  ["reason","","the values behind the verdict"],
  ["chi_square","1","of the residuals of the balance, per degree of freedom; absent without redundancy"],
  ["chi_square_bound","1","largest value that is consistent"],
  ["unknowns","1","number of unknown components of impulses"],
  ["rank","1","number of their combinations that the measurements determine"],
  ["rows","1","number of measured changes"],
  ["freedom","1","rows minus rank: number of redundant measurements"],
  ["grasps","","the impulses at grasps"],
  ["drives","","impulses of drives and brakes that kept a rate"],
  ["null_space","N s and N m s","each a combination of impulses that changes no measurement: of the constrained components of the grasps in order, then of the drives; its largest entry is 1"],
  ["rates","","the measured changes of rates"],
  ["assumed","","places that are not measured and are therefore those of the run"],
  ["zero_efforts","","of a contact with a duration: joints and wheels whose effort is not measured and counts as exactly zero; it is not part of the uncertainty"],
];

// the estimated impulse at a grasp.
export interface MeasuredGrasp {
  /** end-effector of the grasp */
  end_effector: string;
  /** its target */
  target: string;
  /** linear and angular impulse on the robot, at the end-effector's origin, in W */
  components: MeasuredComponent[];
  /** covariance of the determined components, in their order, row by row [squares of the units] */
  covariance: number[];
}
export const kMeasuredGrasp: FieldNote[] = [
  ["end_effector","","end-effector of the grasp"],
  ["target","","its target"],
  ["components","","linear and angular impulse on the robot, at the end-effector's origin, in W"],
  ["covariance","squares of the units","covariance of the determined components, in their order, row by row"],
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

// the change of a measured rate at a contact.
export interface MeasuredRateChange {
  /** name of the quantity in the mapping */
  quantity: string;
  /** its component */
  component: string;
  /** unit of the rate */
  unit: string;
  /** rate just before the contact, from the polynomial of the samples before [as `unit`] */
  before: number;
  /** rate just after it [as `unit`] */
  after: number;
  /** after minus before [as `unit`] */
  change: number;
  /** standard uncertainty of the change [as `unit`] */
  uncertainty: number;
  /** part of it: error of the polynomials, estimated by the same fit to the run [as `unit`] */
  curvature: number;
  /** length of the polynomials on either side [s] */
  window: number;
  /** samples in both windows [1] */
  samples: number;
  /** isolated samples that the fit leaves out [1] */
  outliers: number;
  /** of the samples about the polynomials, per degree of freedom, of all components together [1] */
  chi_square: number;
  /** residual of the momentum balance, in standard uncertainties [1] */
  residual: number;
}
export const kMeasuredRateChange: FieldNote[] = [
  ["quantity","","name of the quantity in the mapping"],
  ["component","","its component"],
  ["unit","","unit of the rate"],
  ["before","as `unit`","rate just before the contact, from the polynomial of the samples before"],
  ["after","as `unit`","rate just after it"],
  ["change","as `unit`","after minus before"],
  ["uncertainty","as `unit`","standard uncertainty of the change"],
  ["curvature","as `unit`","part of it: error of the polynomials, estimated by the same fit to the run"],
  ["window","s","length of the polynomials on either side"],
  ["samples","1","samples in both windows"],
  ["outliers","1","isolated samples that the fit leaves out"],
  ["chi_square","1","of the samples about the polynomials, per degree of freedom, of all components together"],
  ["residual","1","residual of the momentum balance, in standard uncertainties"],
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
