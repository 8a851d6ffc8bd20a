// Made by scripts/tables from the descriptions of results in grapnel/; edit those.

export type FieldNote = readonly [key: string, unit: string, text: string];

// parameters of a scenario identified from logs.
export interface FittedLogsReport {
  /** format of this file */
  schema: IdentificationFormat;
  /** version of Grapnel */
  version: string;
  /** settings of the identification */
  identification: IdentificationSettings;
  /** whether the model with the best values is consistent with all logs */
  agrees: Verdict;
  /** the values behind the verdict */
  reason: string;
  /** whether the best search met its stop rule */
  converged: boolean;
  /** of all logs and priors */
  chi_square: FitChiSquare;
  /** in the order of the file */
  parameters: IdentifiedParameter[];
  /** parameters with an uncertainty, in the order of the matrices */
  covariance_parameters: string[];
  /** their covariance [units of the parameters] */
  covariance: number[][];
  /** their correlation [1] */
  correlation: number[][];
  /** combinations of the parameters that are not at a bound, the best determined first */
  combinations: Combination[];
  /** ends of the searches, the best first */
  minima: LocalMinimum[];
  /** searches whose start could not be simulated [1] */
  failed_starts: number;
  /** number of simulations [1] */
  runs: number;
  /** simulations that failed; their steps were rejected [1] */
  failed_runs: number;
  /** in the order of the file */
  logs: IdentifiedLog[];
  /** doubts about the result */
  warnings: string[];
  /** text of the identification file */
  text: string;
}
export const kFittedLogsReport: FieldNote[] = [
  ["schema","","format of this file"],
  ["version","","version of Grapnel"],
  ["identification","","settings of the identification"],
  ["agrees","","whether the model with the best values is consistent with all logs"],
  ["reason","","the values behind the verdict"],
  ["converged","","whether the best search met its stop rule"],
  ["chi_square","","of all logs and priors"],
  ["parameters","","in the order of the file"],
  ["covariance_parameters","","parameters with an uncertainty, in the order of the matrices"],
  ["covariance","units of the parameters","their covariance"],
  ["correlation","1","their correlation"],
  ["combinations","","combinations of the parameters that are not at a bound, the best determined first"],
  ["minima","","ends of the searches, the best first"],
  ["failed_starts","1","searches whose start could not be simulated"],
  ["runs","1","number of simulations"],
  ["failed_runs","1","simulations that failed; their steps were rejected"],
  ["logs","","in the order of the file"],
  ["warnings","","doubts about the result"],
  ["text","","text of the identification file"],
];

export type IdentificationFormat = "grapnel-identification-result/1";

// settings.
export interface IdentificationSettings {
  /** name of the identification */
  name: string;
  /** SHA-256 of the file, of the scenarios with included files, and of the logs */
  sha256: string;
  /** number of searches [1] */
  starts: number;
  /** seed of the starts [1] */
  seed: number;
  /** maximum number of iterations of a search [1] */
  iterations: number;
}
export const kIdentificationSettings: FieldNote[] = [
  ["name","","name of the identification"],
  ["sha256","","SHA-256 of the file, of the scenarios with included files, and of the logs"],
  ["starts","1","number of searches"],
  ["seed","1","seed of the starts"],
  ["iterations","1","maximum number of iterations of a search"],
];

export type Verdict = "yes" | "no" | "not checked";

// chi-square.
export interface FitChiSquare {
  /** sum of the squares of the weighted residuals [1] */
  value: number;
  /** number of independent residuals [1] */
  degrees_of_freedom: number;
  /** their ratio [1] */
  per_degree_of_freedom: number;
  /** largest ratio that agrees [1] */
  bound: number;
  /** whether the ratio is within the bound */
  agrees: boolean;
}
export const kFitChiSquare: FieldNote[] = [
  ["value","1","sum of the squares of the weighted residuals"],
  ["degrees_of_freedom","1","number of independent residuals"],
  ["per_degree_of_freedom","1","their ratio"],
  ["bound","1","largest ratio that agrees"],
  ["agrees","","whether the ratio is within the bound"],
];

// an identified parameter.
export interface IdentifiedParameter {
  /** name of the parameter */
  name: string;
  /** its places in the scenario */
  paths: string[];
  /** its unit; empty: it has several */
  unit: string;
  /** lower bound [as `unit`] */
  from: number;
  /** upper bound [as `unit`] */
  to: number;
  /** first estimate [as `unit`] */
  start: number;
  /** whether the search is in the logarithm */
  logarithmic: boolean;
  /** standard uncertainty of `start`; absent: no prior [as `unit`] */
  prior_uncertainty?: number;
  /** identified; at_lower_bound, at_upper_bound: the best value is a bound; from_prior: the logs do not improve the prior; not_identifiable: the logs do not determine it, or only in combination with others */
  status: ParameterStatus;
  /** best value; without meaning if not_identifiable [as `unit`] */
  value: number;
  /** standard uncertainty; absent unless identified or from_prior [as `unit`] */
  uncertainty?: number;
  /** 95 % interval; absent without an uncertainty, or if the model disagrees [as `unit`] */
  interval?: [number, number];
}
export const kIdentifiedParameter: FieldNote[] = [
  ["name","","name of the parameter"],
  ["paths","","its places in the scenario"],
  ["unit","","its unit; empty: it has several"],
  ["from","as `unit`","lower bound"],
  ["to","as `unit`","upper bound"],
  ["start","as `unit`","first estimate"],
  ["logarithmic","","whether the search is in the logarithm"],
  ["prior_uncertainty","as `unit`","standard uncertainty of `start`; absent: no prior"],
  ["status","","identified; at_lower_bound, at_upper_bound: the best value is a bound; from_prior: the logs do not improve the prior; not_identifiable: the logs do not determine it, or only in combination with others"],
  ["value","as `unit`","best value; without meaning if not_identifiable"],
  ["uncertainty","as `unit`","standard uncertainty; absent unless identified or from_prior"],
  ["interval","as `unit`","95 % interval; absent without an uncertainty, or if the model disagrees"],
];

export type ParameterStatus = "identified" | "at_lower_bound" | "at_upper_bound" | "from_prior" | "not_identifiable";

// a combination of parameters.
export interface Combination {
  /** of the derivatives by the parameters, scaled to their ranges; its inverse is the standard uncertainty of the combination [1] */
  singular_value: number;
  /** whether the logs determine the combination */
  identifiable: boolean;
  /** the combination */
  weights: CombinationWeight[];
}
export const kCombination: FieldNote[] = [
  ["singular_value","1","of the derivatives by the parameters, scaled to their ranges; its inverse is the standard uncertainty of the combination"],
  ["identifiable","","whether the logs determine the combination"],
  ["weights","","the combination"],
];

// a part of a combination.
export interface CombinationWeight {
  /** name of the parameter */
  parameter: string;
  /** component of a unit vector, in the range of the parameter [1] */
  weight: number;
}
export const kCombinationWeight: FieldNote[] = [
  ["parameter","","name of the parameter"],
  ["weight","1","component of a unit vector, in the range of the parameter"],
];

// the end of searches.
export interface LocalMinimum {
  /** sum of the squares of the weighted residuals [1] */
  chi_square: number;
  /** number of independent residuals and priors in it [1] */
  numbers: number;
  /** number of searches that ended there [1] */
  starts: number;
  /** whether the search met its stop rule */
  converged: boolean;
  /** values in the order of `parameters` [as `unit`] */
  values: number[];
}
export const kLocalMinimum: FieldNote[] = [
  ["chi_square","1","sum of the squares of the weighted residuals"],
  ["numbers","1","number of independent residuals and priors in it"],
  ["starts","1","number of searches that ended there"],
  ["converged","","whether the search met its stop rule"],
  ["values","as `unit`","values in the order of `parameters`"],
];

// a log.
export interface IdentifiedLog {
  /** name of the log */
  name: string;
  /** its file, without its folder */
  file: string;
  /** SHA-256 of the file */
  sha256: string;
  /** name of the scenario */
  scenario: string;
  /** its SHA-256 with the starts of the parameters */
  scenario_sha256: string;
  /** folder of its comparison with the fitted run */
  folder: string;
  /** verdict of that comparison */
  agrees: Verdict;
  /** of the samples in the fit */
  chi_square: FitChiSquare;
  /** its clock */
  clock: FittedClock;
  /** estimated biases, of quantities with one */
  biases: FittedBias[];
  /** cross-validation; absent with a single log */
  left_out?: LeftOut;
}
export const kIdentifiedLog: FieldNote[] = [
  ["name","","name of the log"],
  ["file","","its file, without its folder"],
  ["sha256","","SHA-256 of the file"],
  ["scenario","","name of the scenario"],
  ["scenario_sha256","","its SHA-256 with the starts of the parameters"],
  ["folder","","folder of its comparison with the fitted run"],
  ["agrees","","verdict of that comparison"],
  ["chi_square","","of the samples in the fit"],
  ["clock","","its clock"],
  ["biases","","estimated biases, of quantities with one"],
  ["left_out","","cross-validation; absent with a single log"],
];

// the clock of a log.
export interface FittedClock {
  /** time of the run minus time of the log, at `reference` [s] */
  offset: number;
  /** its standard uncertainty; absent: it is stated [s] */
  offset_uncertainty?: number;
  /** rate of the difference; absent: it is not fitted [1] */
  drift?: number;
  /** its standard uncertainty [1] */
  drift_uncertainty?: number;
  /** time of the log from which the drift counts [s] */
  reference: number;
}
export const kFittedClock: FieldNote[] = [
  ["offset","s","time of the run minus time of the log, at `reference`"],
  ["offset_uncertainty","s","its standard uncertainty; absent: it is stated"],
  ["drift","1","rate of the difference; absent: it is not fitted"],
  ["drift_uncertainty","1","its standard uncertainty"],
  ["reference","s","time of the log from which the drift counts"],
];

// an estimated bias.
export interface FittedBias {
  /** name in the mapping */
  quantity: string;
  /** component of the quantity */
  component: string;
  /** its unit */
  unit: string;
  /** estimated bias of the measurements [as `unit`] */
  value: number;
  /** its standard uncertainty [as `unit`] */
  uncertainty: number;
}
export const kFittedBias: FieldNote[] = [
  ["quantity","","name in the mapping"],
  ["component","","component of the quantity"],
  ["unit","","its unit"],
  ["value","as `unit`","estimated bias of the measurements"],
  ["uncertainty","as `unit`","its standard uncertainty"],
];

// cross-validation of a log.
export interface LeftOut {
  /** of the log under the fit to the others, with the uncertainty of that fit; absent: not computed */
  chi_square?: FitChiSquare;
  /** values of that fit, in the order of `parameters` [as `unit`] */
  values: number[];
  /** reason without a value; else empty */
  reason: string;
}
export const kLeftOut: FieldNote[] = [
  ["chi_square","","of the log under the fit to the others, with the uncertainty of that fit; absent: not computed"],
  ["values","as `unit`","values of that fit, in the order of `parameters`"],
  ["reason","","reason without a value; else empty"],
];
