// Made by scripts/tables from the descriptions of results in grapnel/; edit those.

export type FieldNote = readonly [key: string, unit: string, text: string];

// derivatives of outcomes, and first-order uncertainty.
export interface SensitivityReport {
  /** format of this file */
  schema: SensitivityFormat;
  /** version of Grapnel */
  version: string;
  /** the captures */
  settings: SensitivitySettings;
  /** number of simulated captures [1] */
  runs: number;
  /** the numbers that were varied */
  values: SensitivityValue[];
  /** outcomes with their derivatives */
  outcomes: SensitivityOutcome[];
  /** names of the outcomes of the covariance */
  covariance_of: string[];
  /** of these outcomes to first order; a list of rows [SI] */
  covariance: number[][];
  /** limits of the campaign's criteria */
  limits: SensitivityLimit[];
  /** criteria without a first-order probability */
  unjudged: string[];
  /** about the method and outcomes */
  notes: string[];
}
export const kSensitivityReport: FieldNote[] = [
  ["schema","","format of this file"],
  ["version","","version of Grapnel"],
  ["settings","","the captures"],
  ["runs","1","number of simulated captures"],
  ["values","","the numbers that were varied"],
  ["outcomes","","outcomes with their derivatives"],
  ["covariance_of","","names of the outcomes of the covariance"],
  ["covariance","SI","of these outcomes to first order; a list of rows"],
  ["limits","","limits of the campaign's criteria"],
  ["unjudged","","criteria without a first-order probability"],
  ["notes","","about the method and outcomes"],
];

export type SensitivityFormat = "grapnel-sensitivities/1";

// the captures.
export interface SensitivitySettings {
  /** of the scenario or campaign */
  name: string;
  /** path as given */
  file: string;
  /** SHA-256 of the input */
  sha256: string;
  /** run: whole captures; impact: the impact only */
  simulate: StudyMode;
  /** per_case: every run plans its approach; nominal: all follow one plan */
  plan: CampaignPlan;
}
export const kSensitivitySettings: FieldNote[] = [
  ["name","","of the scenario or campaign"],
  ["file","","path as given"],
  ["sha256","","SHA-256 of the input"],
  ["simulate","","run: whole captures; impact: the impact only"],
  ["plan","","per_case: every run plans its approach; nominal: all follow one plan"],
];

export type StudyMode = "impact" | "run";

export type CampaignPlan = "nominal" | "per_case";

// a number that is varied.
export interface SensitivityValue {
  /** path in the scenario, with the component */
  name: string;
  /** its unit */
  unit: string;
  /** its meaning */
  description: string;
  /** at which outcomes are differentiated; of a campaign the mean [as `unit`] */
  value: number;
  /** standard deviation of the campaign; absent: not stated [as `unit`] */
  deviation?: number;
  /** magnitude, by which steps and effects are scaled; of a zero: see the page [as `unit`] */
  size: number;
}
export const kSensitivityValue: FieldNote[] = [
  ["name","","path in the scenario, with the component"],
  ["unit","","its unit"],
  ["description","","its meaning"],
  ["value","as `unit`","at which outcomes are differentiated; of a campaign the mean"],
  ["deviation","as `unit`","standard deviation of the campaign; absent: not stated"],
  ["size","as `unit`","magnitude, by which steps and effects are scaled; of a zero: see the page"],
];

// an outcome.
export interface SensitivityOutcome {
  /** column of studies and campaigns */
  name: string;
  /** its unit */
  unit: string;
  /** its meaning */
  description: string;
  /** at the values; null: it does not exist [as `unit`] */
  value: number | null;
  /** standard deviation to first order; absent: not stated [as `unit`] */
  deviation?: number;
  /** why there is none, for a campaign; empty: there is */
  deviation_absent: string;
  /** derivatives, in the order of the values */
  by: OutcomeDerivative[];
}
export const kSensitivityOutcome: FieldNote[] = [
  ["name","","column of studies and campaigns"],
  ["unit","","its unit"],
  ["description","","its meaning"],
  ["value","as `unit`","at the values; null: it does not exist"],
  ["deviation","as `unit`","standard deviation to first order; absent: not stated"],
  ["deviation_absent","","why there is none, for a campaign; empty: there is"],
  ["by","","derivatives, in the order of the values"],
];

// the derivative of an outcome by a value.
export interface OutcomeDerivative {
  /** name of the value */
  by: string;
  /** yes: differentiable, and the error is at most 1 % or negligible; NO: not differentiable here; not decided: the error is too large */
  verdict: Differentiable;
  /** outcome by value; absent: there is no estimate [SI] */
  derivative?: number;
  /** its estimated error [SI] */
  error?: number;
  /** value / outcome times the derivative; absent: the outcome is zero or negligible in its vector, or the verdict not yes [1] */
  elasticity?: number;
  /** of the outcome's variance; correlated values may have negative shares [1] */
  share?: number;
  /** derivative below the value, if it differs [SI] */
  left?: number;
  /** derivative above the value [SI] */
  right?: number;
  /** whether values beyond a bound are invalid, so that one side was used */
  one_sided: boolean;
  /** largest step of the differences [as the value] */
  step: number;
  /** of a verdict other than yes */
  reason: string;
}
export const kOutcomeDerivative: FieldNote[] = [
  ["by","","name of the value"],
  ["verdict","","yes: differentiable, and the error is at most 1 % or negligible; NO: not differentiable here; not decided: the error is too large"],
  ["derivative","SI","outcome by value; absent: there is no estimate"],
  ["error","SI","its estimated error"],
  ["elasticity","1","value / outcome times the derivative; absent: the outcome is zero or negligible in its vector, or the verdict not yes"],
  ["share","1","of the outcome's variance; correlated values may have negative shares"],
  ["left","SI","derivative below the value, if it differs"],
  ["right","SI","derivative above the value"],
  ["one_sided","","whether values beyond a bound are invalid, so that one side was used"],
  ["step","as the value","largest step of the differences"],
  ["reason","","of a verdict other than yes"],
];

export type Differentiable = "yes" | "NO" | "not decided";

// a limit of a criterion of success.
export interface SensitivityLimit {
  /** name of the criterion with this limit */
  criterion: string;
  /** the limited outcome */
  outcome: string;
  /** the limit [as the outcome] */
  bound: number;
  /** whether it is an upper limit */
  at_most: boolean;
  /** whether it limits the magnitude */
  magnitude: boolean;
  /** whether it holds at the values */
  holds: boolean;
  /** that it holds, to first order, if the outcome is normal; absent: no deviation [1] */
  probability?: number;
}
export const kSensitivityLimit: FieldNote[] = [
  ["criterion","","name of the criterion with this limit"],
  ["outcome","","the limited outcome"],
  ["bound","as the outcome","the limit"],
  ["at_most","","whether it is an upper limit"],
  ["magnitude","","whether it limits the magnitude"],
  ["holds","","whether it holds at the values"],
  ["probability","1","that it holds, to first order, if the outcome is normal; absent: no deviation"],
];
