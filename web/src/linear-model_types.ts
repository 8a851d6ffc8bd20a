// Made by scripts/tables from the descriptions of results in grapnel/; edit those.

export type FieldNote = readonly [key: string, unit: string, text: string];

// the linear model of a scenario at a time.
export interface LinearModel {
  /** format of this file */
  schema: LinearModelFormat;
  /** version of Grapnel */
  version: string;
  /** name of the scenario */
  scenario: string;
  /** SHA-256 of the scenario */
  sha256: string;
  /** time of the operating point [s] */
  time: number;
  /** phase of the motion that begins or continues there */
  phase: string;
  /** x: deviations of positions, then of rates */
  states: LinearVariable[];
  /** u: deviations of efforts, of the wrench on the base in its axes, of thrusts */
  inputs: LinearVariable[];
  /** y: deviations */
  outputs: LinearVariable[];
  /** x' by x; a list of rows [SI] */
  A: number[][];
  /** x' by u [SI] */
  B: number[][];
  /** y by x [SI] */
  C: number[][];
  /** y by u [SI] */
  D: number[][];
  /** estimated error of the differences, over the largest entry of A [1] */
  difference_error: number;
  /** with a sample time: the model from sample to sample */
  sampled?: SampledModel;
  /** eigenvalues of A */
  open_loop: LinearModes;
  /** the system with the scenario's own laws */
  closed_loop?: LinearClosedLoop;
  /** why there is none; empty: there is */
  closed_loop_absent: string;
  /** what the model does not contain, and how it takes nonlinear parts */
  notes: string[];
  /** doubts, and instability */
  warnings: string[];
}
export const kLinearModel: FieldNote[] = [
  ["schema","","format of this file"],
  ["version","","version of Grapnel"],
  ["scenario","","name of the scenario"],
  ["sha256","","SHA-256 of the scenario"],
  ["time","s","time of the operating point"],
  ["phase","","phase of the motion that begins or continues there"],
  ["states","","x: deviations of positions, then of rates"],
  ["inputs","","u: deviations of efforts, of the wrench on the base in its axes, of thrusts"],
  ["outputs","","y: deviations"],
  ["A","SI","x' by x; a list of rows"],
  ["B","SI","x' by u"],
  ["C","SI","y by x"],
  ["D","SI","y by u"],
  ["difference_error","1","estimated error of the differences, over the largest entry of A"],
  ["sampled","","with a sample time: the model from sample to sample"],
  ["open_loop","","eigenvalues of A"],
  ["closed_loop","","the system with the scenario's own laws"],
  ["closed_loop_absent","","why there is none; empty: there is"],
  ["notes","","what the model does not contain, and how it takes nonlinear parts"],
  ["warnings","","doubts, and instability"],
];

export type LinearModelFormat = "grapnel-linear-model/1";

// a state, an input or an output of a linear model.
export interface LinearVariable {
  /** its name, as of time series */
  name: string;
  /** its unit */
  unit: string;
  /** at the operating point; absent: the operating point is the origin [as `unit`] */
  value?: number;
}
export const kLinearVariable: FieldNote[] = [
  ["name","","its name, as of time series"],
  ["unit","","its unit"],
  ["value","as `unit`","at the operating point; absent: the operating point is the origin"],
];

// the model without laws, under inputs that are held from sample to sample.
export interface SampledModel {
  /** sample time [s] */
  period: number;
  /** from a sample to the time from which its input acts [s] */
  delay: number;
  /** n: whole periods in the delay [1] */
  whole_periods: number;
  /** transition of the states from sample to sample; a list of rows [SI] */
  Ad: number[][];
  /** by the input of n samples ago [SI] */
  Bd: number[][];
  /** by the input of n + 1 samples ago; zero if the delay is n periods [SI] */
  Bd_previous: number[][];
}
export const kSampledModel: FieldNote[] = [
  ["period","s","sample time"],
  ["delay","s","from a sample to the time from which its input acts"],
  ["whole_periods","1","n: whole periods in the delay"],
  ["Ad","SI","transition of the states from sample to sample; a list of rows"],
  ["Bd","SI","by the input of n samples ago"],
  ["Bd_previous","SI","by the input of n + 1 samples ago; zero if the delay is n periods"],
];

// eigenvalues and their verdict.
export interface LinearModes {
  /** unstable: an eigenvalue grows; marginal: none grows, one oscillates; stable: all decay; those of tumbling, drift and conserved momenta do not count */
  verdict: LinearStability;
  /** the eigenvalue behind the verdict */
  reason: string;
  /** the least stable first, then drift and conserved ones */
  eigenvalues: LinearEigenvalue[];
}
export const kLinearModes: FieldNote[] = [
  ["verdict","","unstable: an eigenvalue grows; marginal: none grows, one oscillates; stable: all decay; those of tumbling, drift and conserved momenta do not count"],
  ["reason","","the eigenvalue behind the verdict"],
  ["eigenvalues","","the least stable first, then drift and conserved ones"],
];

export type LinearStability = "stable" | "marginal" | "unstable" | "not decided";

// an eigenvalue.
export interface LinearEigenvalue {
  /** decays; grows; oscillates: neither; tumbles: grows or oscillates, but not faster than a base rotates whose rotation no law controls; drift: zero within the accuracy, or of positions without an effect; conserved: of a conserved momentum */
  kind: EigenvalueKind;
  /** real part; of a sampled loop of the equivalent ln(z)/period [1/s] */
  real: number | null;
  /** imaginary part [1/s] */
  imaginary: number;
  /** of a sampled loop: real part of z [1] */
  z_real?: number;
  /** imaginary part of z [1] */
  z_imaginary?: number;
  /** magnitude [rad/s] */
  frequency: number | null;
  /** minus real part over magnitude; absent: the eigenvalue is zero [1] */
  damping_ratio?: number;
  /** state that participates most in the mode: largest product of the components of left and right eigenvector */
  state: string;
}
export const kLinearEigenvalue: FieldNote[] = [
  ["kind","","decays; grows; oscillates: neither; tumbles: grows or oscillates, but not faster than a base rotates whose rotation no law controls; drift: zero within the accuracy, or of positions without an effect; conserved: of a conserved momentum"],
  ["real","1/s","real part; of a sampled loop of the equivalent ln(z)/period"],
  ["imaginary","1/s","imaginary part"],
  ["z_real","1","of a sampled loop: real part of z"],
  ["z_imaginary","1","imaginary part of z"],
  ["frequency","rad/s","magnitude"],
  ["damping_ratio","1","minus real part over magnitude; absent: the eigenvalue is zero"],
  ["state","","state that participates most in the mode: largest product of the components of left and right eigenvector"],
];

export type EigenvalueKind = "decays" | "grows" | "oscillates" | "tumbles" | "drift" | "conserved";

// the system with the scenario's own laws.
export interface LinearClosedLoop {
  /** the laws that act */
  laws: string[];
  /** eigenvalues of the controlled system */
  stability: LinearModes;
  /** whether the laws are sampled: then the eigenvalues are those from sample to sample */
  sampled: boolean;
  /** names of the states of `K`: without joints that move as prescribed */
  states: string[];
  /** inputs by the states, u = K x, without sampling; a list of rows [SI] */
  K: number[][];
  /** margins of each channel */
  margins: LoopMargin[];
  /** why there are none; empty: there are */
  margins_absent: string;
}
export const kLinearClosedLoop: FieldNote[] = [
  ["laws","","the laws that act"],
  ["stability","","eigenvalues of the controlled system"],
  ["sampled","","whether the laws are sampled: then the eigenvalues are those from sample to sample"],
  ["states","","names of the states of `K`: without joints that move as prescribed"],
  ["K","SI","inputs by the states, u = K x, without sampling; a list of rows"],
  ["margins","","margins of each channel"],
  ["margins_absent","","why there are none; empty: there are"],
];

// margins of a channel of the scenario's controllers.
export interface LoopMargin {
  /** the input whose loop is opened, while all others are closed */
  channel: string;
  /** unit of the input */
  unit: string;
  /** factor on the gains of the channel above which the loop is unstable; absent: no limit [1] */
  gain_maximum?: number;
  /** factor below which it is unstable; absent: no limit [1] */
  gain_minimum?: number;
  /** of the oscillation at the factor that is nearest to 1 [rad/s] */
  gain_frequency?: number;
  /** smallest phase margin, by magnitude; absent: the loop gain is nowhere 1 [rad] */
  phase?: number;
  /** its frequency [rad/s] */
  phase_frequency?: number;
  /** smallest added delay of the channel with which the loop is unstable [s] */
  delay?: number;
}
export const kLoopMargin: FieldNote[] = [
  ["channel","","the input whose loop is opened, while all others are closed"],
  ["unit","","unit of the input"],
  ["gain_maximum","1","factor on the gains of the channel above which the loop is unstable; absent: no limit"],
  ["gain_minimum","1","factor below which it is unstable; absent: no limit"],
  ["gain_frequency","rad/s","of the oscillation at the factor that is nearest to 1"],
  ["phase","rad","smallest phase margin, by magnitude; absent: the loop gain is nowhere 1"],
  ["phase_frequency","rad/s","its frequency"],
  ["delay","s","smallest added delay of the channel with which the loop is unstable"],
];
