// Made by scripts/tables from the descriptions of results in grapnel/: change those.

export type FieldNote = readonly [key: string, unit: string, text: string];

// what the cases of a campaign say.
export interface CampaignReport {
  /** the format of this file */
  schema: CampaignReportFormat;
  /** of Grapnel */
  version: string;
  /** what it is */
  campaign: CampaignSettings;
  /** cases on disk; all that follows is about them [1] */
  rows: number;
  /** how they ended */
  counts: CaseCounts;
  /** of all rows */
  success: SuccessRate;
  /** what the rates do not say: criteria that never fail, never hold or were not checked, successes that are assumed. The terminal has them too */
  warnings: string[];
  /** in the order of the file */
  criteria: CriterionResult[];
  /** what was drawn */
  inputs: Distribution[];
  /** what was kept */
  columns: Distribution[];
  /** what matters for what */
  sensitivity: SensitivityOfAll;
  /** the first list is by `keep.series.worst.by`, if given; then by the numbers that criteria limit */
  worst: WorstCases[];
  /** why cases are no success, the most frequent reason first, every case counted once; at most 50 */
  failures: Reason[];
  /** cases with other reasons [1] */
  failures_left_out: number;
  /** where the columns `grasps/*\/captured` are kept */
  grasps: GraspCount[];
  /** the part of `failures` that are not ok; at most 50 */
  reasons: Reason[];
  /** cases with other reasons [1] */
  reasons_left_out: number;
  /** absent without a design */
  success_map?: SuccessMap;
  /** the campaign file */
  text: string;
}
export const kCampaignReport: FieldNote[] = [
  ["schema","","the format of this file"],
  ["version","","of Grapnel"],
  ["campaign","","what it is"],
  ["rows","1","cases on disk; all that follows is about them"],
  ["counts","","how they ended"],
  ["success","","of all rows"],
  ["warnings","","what the rates do not say: criteria that never fail, never hold or were not checked, successes that are assumed. The terminal has them too"],
  ["criteria","","in the order of the file"],
  ["inputs","","what was drawn"],
  ["columns","","what was kept"],
  ["sensitivity","","what matters for what"],
  ["worst","","the first list is by `keep.series.worst.by`, if given; then by the numbers that criteria limit"],
  ["failures","","why cases are no success, the most frequent reason first, every case counted once; at most 50"],
  ["failures_left_out","1","cases with other reasons"],
  ["grasps","","where the columns `grasps/*/captured` are kept"],
  ["reasons","","the part of `failures` that are not ok; at most 50"],
  ["reasons_left_out","1","cases with other reasons"],
  ["success_map","","absent without a design"],
  ["text","","the campaign file"],
];

export type CampaignReportFormat = "grapnel-campaign-report/1";

// what the campaign is.
export interface CampaignSettings {
  /** of the campaign */
  name: string;
  /** of it, for the reader */
  description: string;
  /** the campaign file's name, without folders */
  file: string;
  /** of its bytes and of what it names */
  sha256: string;
  /** as text: up to 64 bits */
  seed: string;
  /** as in the file */
  sampling: Sampling;
  /** as in the file */
  simulate: StudyMode;
  /** as in the file */
  plan: CampaignPlan;
  /** those of extensions included; with a design per point of it [1] */
  cases: number;
  /** cases of all points of a design [1] */
  total: number;
}
export const kCampaignSettings: FieldNote[] = [
  ["name","","of the campaign"],
  ["description","","of it, for the reader"],
  ["file","","the campaign file's name, without folders"],
  ["sha256","","of its bytes and of what it names"],
  ["seed","","as text: up to 64 bits"],
  ["sampling","","as in the file"],
  ["simulate","","as in the file"],
  ["plan","","as in the file"],
  ["cases","1","those of extensions included; with a design per point of it"],
  ["total","1","cases of all points of a design"],
];

export type Sampling = "random" | "latin_hypercube" | "sobol";

export type StudyMode = "impact" | "run";

export type CampaignPlan = "nominal" | "per_case";

// how the cases ended.
export interface CaseCounts {
  /** cases that came to their end [1] */
  ok: number;
  /** cases in which something went wrong [1] */
  failed: number;
  /** cases for which no configuration was found [1] */
  unreachable: number;
  /** cases that are ok and meet all criteria [1] */
  success: number;
}
export const kCaseCounts: FieldNote[] = [
  ["ok","1","cases that came to their end"],
  ["failed","1","cases in which something went wrong"],
  ["unreachable","1","cases for which no configuration was found"],
  ["success","1","cases that are ok and meet all criteria"],
];

// the probability of success, with Wilson's score interval (1927).
export interface SuccessRate {
  /** successes over all rows; null: no rows [1] */
  estimate: number | null;
  /** end of its interval [1] */
  lower: number;
  /** likewise [1] */
  upper: number;
  /** of this interval and of every other one here [1] */
  confidence: number;
  /** successes in which a grasp was taken to hold because its end-effector has no envelope: nobody judged it [1] */
  assumed: number;
}
export const kSuccessRate: FieldNote[] = [
  ["estimate","1","successes over all rows; null: no rows"],
  ["lower","1","end of its interval"],
  ["upper","1","likewise"],
  ["confidence","1","of this interval and of every other one here"],
  ["assumed","1","successes in which a grasp was taken to hold because its end-effector has no envelope: nobody judged it"],
];

// how often a criterion was met, in the order of the file.
export interface CriterionResult {
  /** as in the file, else its text */
  name: string;
  /** the expression */
  text: string;
  /** rows that are ok and meet it [1] */
  met: number;
  /** these over all rows; null: no rows [1] */
  estimate: number | null;
  /** end of its interval [1] */
  lower: number;
  /** likewise [1] */
  upper: number;
  /** rows that are ok and in which no other criterion fails; others may not have been checked, such as an impulse where nothing was caught [1] */
  only_this: number;
  /** rows that are ok in which a number that decides does not exist [1] */
  not_checked: number;
  /** names of columns and inputs */
  reads: string[];
  /** what it asks of single numbers, where it can be said so */
  limits: CriterionLimit[];
}
export const kCriterionResult: FieldNote[] = [
  ["name","","as in the file, else its text"],
  ["text","","the expression"],
  ["met","1","rows that are ok and meet it"],
  ["estimate","1","these over all rows; null: no rows"],
  ["lower","1","end of its interval"],
  ["upper","1","likewise"],
  ["only_this","1","rows that are ok and in which no other criterion fails; others may not have been checked, such as an impulse where nothing was caught"],
  ["not_checked","1","rows that are ok in which a number that decides does not exist"],
  ["reads","","names of columns and inputs"],
  ["limits","","what it asks of single numbers, where it can be said so"],
];

// what a criterion asks of a single number.
export interface CriterionLimit {
  /** of a column or an input */
  name: string;
  /** what it must not exceed [as the number] */
  at_most?: number | null;
  /** what it must reach; a limit has one of the two [as the number] */
  at_least?: number | null;
  /** true: of the number's magnitude */
  magnitude: boolean;
}
export const kCriterionLimit: FieldNote[] = [
  ["name","","of a column or an input"],
  ["at_most","as the number","what it must not exceed"],
  ["at_least","as the number","what it must reach; a limit has one of the two"],
  ["magnitude","","true: of the number's magnitude"],
];

// the numbers of an input or a column.
export interface Distribution {
  /** of the column or the input */
  name: string;
  /** of its numbers */
  unit: string;
  /** what it is */
  description: string;
  /** finite numbers [1] */
  count: number;
  /** others [1] */
  missing: number;
  /** null: no numbers [as the number] */
  mean: number | null;
  /** standard error of the mean [as the number] */
  mean_error: number | null;
  /** with n − 1; null: too few [as the number] */
  standard_deviation: number | null;
  /** of all [as the number] */
  least: number | null;
  /** of all [as the number] */
  largest: number | null;
  /** at the probabilities of the file */
  quantiles: Quantile[];
  /** of the finite numbers */
  histogram: Histogram;
  /** of inputs only: success by the input's value */
  success_by?: SuccessBy;
}
export const kDistribution: FieldNote[] = [
  ["name","","of the column or the input"],
  ["unit","","of its numbers"],
  ["description","","what it is"],
  ["count","1","finite numbers"],
  ["missing","1","others"],
  ["mean","as the number","null: no numbers"],
  ["mean_error","as the number","standard error of the mean"],
  ["standard_deviation","as the number","with n − 1; null: too few"],
  ["least","as the number","of all"],
  ["largest","as the number","of all"],
  ["quantiles","","at the probabilities of the file"],
  ["histogram","","of the finite numbers"],
  ["success_by","","of inputs only: success by the input's value"],
];

// a number that is not exceeded with a probability.
export interface Quantile {
  /** as asked for [1] */
  probability: number;
  /** interpolated between order statistics: Hyndman and Fan 1996, type 7; null: no numbers [as the number] */
  value: number | null;
  /** order statistic; between the two is the quantile, with the confidence at least, whatever the distribution; null: the sample is too small [as the number] */
  lower: number | null;
  /** likewise [as the number] */
  upper: number | null;
}
export const kQuantile: FieldNote[] = [
  ["probability","1","as asked for"],
  ["value","as the number","interpolated between order statistics: Hyndman and Fan 1996, type 7; null: no numbers"],
  ["lower","as the number","order statistic; between the two is the quantile, with the confidence at least, whatever the distribution; null: the sample is too small"],
  ["upper","as the number","likewise"],
];

// how numbers are distributed.
export interface Histogram {
  /** of the first bin [as the number] */
  begin: number;
  /** of the last bin, which includes it [as the number] */
  end: number;
  /** of bins of equal width. Whole numbers in a small range have a bin each, around them; numbers that are all the same one bin of width 0 [1] */
  counts: number[];
  /** how many of each bin's cases are a success [1] */
  successes: number[];
  /** numbers before the first bin, where a few far from all others would leave the rest in one [1] */
  below: number;
  /** numbers beyond the last bin [1] */
  above: number;
}
export const kHistogram: FieldNote[] = [
  ["begin","as the number","of the first bin"],
  ["end","as the number","of the last bin, which includes it"],
  ["counts","1","of bins of equal width. Whole numbers in a small range have a bin each, around them; numbers that are all the same one bin of width 0"],
  ["successes","1","how many of each bin's cases are a success"],
  ["below","1","numbers before the first bin, where a few far from all others would leave the rest in one"],
  ["above","1","numbers beyond the last bin"],
];

// up to 20 groups of rows, of as equal a size as possible, by the value of an input.
export interface SuccessBy {
  /** least value of each group [as the number] */
  from: number[];
  /** largest value of each [as the number] */
  to: number[];
  /** rows of each [1] */
  trials: number[];
  /** those that are a success [1] */
  successes: number[];
}
export const kSuccessBy: FieldNote[] = [
  ["from","as the number","least value of each group"],
  ["to","as the number","largest value of each"],
  ["trials","1","rows of each"],
  ["successes","1","those that are a success"],
];

// what matters for what, from the rows themselves.
export interface SensitivityOfAll {
  /** their names */
  inputs: string[];
  /** of inputs, and the axes of a design */
  groups: InputGroup[];
  /** first `success`; then each criterion, where there are several; then the numbers that criteria read, what is used of each tolerance, and the other columns in their order, at most 64 besides criteria. What is the same in all rows is no measure */
  measures: Measure[];
  /** columns beyond these [1] */
  left_out: number;
  /** columns whose numbers differ by rounding alone, no measures either: by less than 1e-9 of the largest among them and the other components of their vector, or all below 1e-9 of the largest number of their unit */
  rounding: string[];
}
export const kSensitivityOfAll: FieldNote[] = [
  ["inputs","","their names"],
  ["groups","","of inputs, and the axes of a design"],
  ["measures","","first `success`; then each criterion, where there are several; then the numbers that criteria read, what is used of each tolerance, and the other columns in their order, at most 64 besides criteria. What is the same in all rows is no measure"],
  ["left_out","1","columns beyond these"],
  ["rounding","","columns whose numbers differ by rounding alone, no measures either: by less than 1e-9 of the largest among them and the other components of their vector, or all below 1e-9 of the largest number of their unit"],
];

// inputs that belong together: the components of a vector, position and orientation of a pose, all that is drawn of a grasp point.
export interface InputGroup {
  /** of the group */
  name: string;
  /** true: an axis of the design, without inputs */
  design: boolean;
  /** names of those that are in it */
  inputs: string[];
}
export const kInputGroup: FieldNote[] = [
  ["name","","of the group"],
  ["design","","true: an axis of the design, without inputs"],
  ["inputs","","names of those that are in it"],
];

// a number that is compared with every input.
export interface Measure {
  /** of the number */
  name: string;
  /** of it */
  unit: string;
  /** what it is. */
  of: MeasureOf;
  /** rows where it exists [1] */
  count: number;
  /** per input: Sobol's index Var(E[y|x]) / Var(y), the part of the variance that would go away if the input were known; by chance it may be slightly negative [1] */
  first_order: (number | null)[];
  /** its standard error [1] */
  error: (number | null)[];
  /** Spearman's, per input [1] */
  rank_correlation: (number | null)[];
  /** the same of groups of inputs */
  groups: GroupIndices;
  /** 1 less the groups' sum: the share of the variance that goes with no group alone, but with several acting together, with what is not drawn, or with what the fit misses [1] */
  unexplained: number | null;
}
export const kMeasure: FieldNote[] = [
  ["name","","of the number"],
  ["unit","","of it"],
  ["of","","what it is."],
  ["count","1","rows where it exists"],
  ["first_order","1","per input: Sobol's index Var(E[y|x]) / Var(y), the part of the variance that would go away if the input were known; by chance it may be slightly negative"],
  ["error","1","its standard error"],
  ["rank_correlation","1","Spearman's, per input"],
  ["groups","","the same of groups of inputs"],
  ["unexplained","1","1 less the groups' sum: the share of the variance that goes with no group alone, but with several acting together, with what is not drawn, or with what the fit misses"],
];

export type MeasureOf = "success" | "criterion" | "column";

// what inputs explain together, in the order of `sensitivity.groups`.
export interface GroupIndices {
  /** per group; of several inputs the variance of a quadratic function of them, fitted by least squares to 20 000 rows at most, less what chance adds to it (adjusted R²), or the largest index of one of them if that is more: a lower bound, exact for what is quadratic; null where rows are fewer than ten and twice the terms [1] */
  first_order: (number | null)[];
  /** its standard error [1] */
  error: (number | null)[];
  /** null of groups of several inputs [1] */
  rank_correlation: (number | null)[];
}
export const kGroupIndices: FieldNote[] = [
  ["first_order","1","per group; of several inputs the variance of a quadratic function of them, fitted by least squares to 20 000 rows at most, less what chance adds to it (adjusted R²), or the largest index of one of them if that is more: a lower bound, exact for what is quadratic; null where rows are fewer than ten and twice the terms"],
  ["error","1","its standard error"],
  ["rank_correlation","1","null of groups of several inputs"],
];

// up to 10 cases, or `keep.series.worst.count`, with the worst numbers of a column.
export interface WorstCases {
  /** name of a column */
  by: string;
  /** of its numbers */
  unit: string;
  /** `largest`, `least` */
  direction: string;
  /** true: by the number's magnitude */
  magnitude: boolean;
  /** the worst first, of equal ones the first case */
  cases: WorstCase[];
}
export const kWorstCases: FieldNote[] = [
  ["by","","name of a column"],
  ["unit","","of its numbers"],
  ["direction","","`largest`, `least`"],
  ["magnitude","","true: by the number's magnitude"],
  ["cases","","the worst first, of equal ones the first case"],
];

// one of the worst.
export interface WorstCase {
  /** k [1] */
  index: number;
  /** of this case [as the number] */
  value: number;
  /** of this case */
  success: boolean;
  /** in the order of `inputs` [as drawn] */
  inputs: (number | null)[];
  /** the command that runs this case with its full report, in the folder of the campaign file */
  replay: string;
}
export const kWorstCase: FieldNote[] = [
  ["index","1","k"],
  ["value","as the number","of this case"],
  ["success","","of this case"],
  ["inputs","as drawn","in the order of `inputs`"],
  ["replay","","the command that runs this case with its full report, in the folder of the campaign file"],
];

// why cases are no success.
export interface Reason {
  /** of these cases */
  status: CaseStatus;
  /** of cases that are not ok theirs, with numbers replaced by `…` so that cases of one kind come together; failed conservation checks are one kind. Of cases that are ok which criteria they do not meet, and where one asks whether grasps close, which grasps miss and by which tolerance: `not met: captured (tip-1 misses by position); not checked: soft` */
  reason: string;
  /** cases [1] */
  count: number;
  /** the first three */
  examples: ReasonExample[];
}
export const kReason: FieldNote[] = [
  ["status","","of these cases"],
  ["reason","","of cases that are not ok theirs, with numbers replaced by `…` so that cases of one kind come together; failed conservation checks are one kind. Of cases that are ok which criteria they do not meet, and where one asks whether grasps close, which grasps miss and by which tolerance: `not met: captured (tip-1 misses by position); not checked: soft`"],
  ["count","1","cases"],
  ["examples","","the first three"],
];

export type CaseStatus = "ok" | "failed" | "unreachable";

// a case with the reason.
export interface ReasonExample {
  /** k [1] */
  index: number;
  /** of this case */
  reason: string;
  /** as of the worst cases */
  replay: string;
}
export const kReasonExample: FieldNote[] = [
  ["index","1","k"],
  ["reason","","of this case"],
  ["replay","","as of the worst cases"],
];

// what became of one grasp.
export interface GraspCount {
  /** of the grasp */
  end_effector: string;
  /** rows that are ok in which it closed [1] */
  captured: number;
  /** rows that are ok in which it did not [1] */
  missed: number;
  /** of its envelope; none: nobody judged it */
  tolerances: ToleranceCount[];
}
export const kGraspCount: FieldNote[] = [
  ["end_effector","","of the grasp"],
  ["captured","1","rows that are ok in which it closed"],
  ["missed","1","rows that are ok in which it did not"],
  ["tolerances","","of its envelope; none: nobody judged it"],
];

// how often a grasp's tolerance was exceeded.
export interface ToleranceCount {
  /** `position`, `angle`, `velocity`, `angular_velocity` */
  name: string;
  /** in so many rows [1] */
  exceeded: number;
  /** in so many rows the grasp missed, and this tolerance by the largest factor [1] */
  limiting: number;
}
export const kToleranceCount: FieldNote[] = [
  ["name","","`position`, `angle`, `velocity`, `angular_velocity`"],
  ["exceeded","1","in so many rows"],
  ["limiting","1","in so many rows the grasp missed, and this tolerance by the largest factor"],
];

// success at the points of the design: lists, the first axis varying slowest. The same uncertain numbers are drawn at every point, so that points differ by the design alone.
export interface SuccessMap {
  /** of the design */
  axes: SuccessMapAxis[];
  /** of the intervals [1] */
  confidence: number;
  /** rows [1] */
  trials: number[];
  /** rows that are ok [1] */
  ok: number[];
  /** rows that are a success [1] */
  successes: number[];
  /** successes over rows; null: no rows [1] */
  estimate: (number | null)[];
  /** end of its interval [1] */
  lower: number[];
  /** likewise [1] */
  upper: number[];
  /** per criterion */
  unmet: UnmetCriterion[];
  /** the criterion that most of the point's cases fail, `not ok` if more have no result, null if all are a success */
  deciding: (string | null)[];
  /** at three levels; the number in the report's headline */
  above: PointsAbove[];
}
export const kSuccessMap: FieldNote[] = [
  ["axes","","of the design"],
  ["confidence","1","of the intervals"],
  ["trials","1","rows"],
  ["ok","1","rows that are ok"],
  ["successes","1","rows that are a success"],
  ["estimate","1","successes over rows; null: no rows"],
  ["lower","1","end of its interval"],
  ["upper","1","likewise"],
  ["unmet","","per criterion"],
  ["deciding","","the criterion that most of the point's cases fail, `not ok` if more have no result, null if all are a success"],
  ["above","","at three levels; the number in the report's headline"],
];

// an axis of the design.
export interface SuccessMapAxis {
  /** of the axis */
  name: string;
  /** of its numbers */
  unit: string;
  /** what it changes */
  description: string;
  /** whether its values are numbers */
  is_numeric: boolean;
  /** or labels [as stated] */
  values: (number | string)[];
}
export const kSuccessMapAxis: FieldNote[] = [
  ["name","","of the axis"],
  ["unit","","of its numbers"],
  ["description","","what it changes"],
  ["is_numeric","","whether its values are numbers"],
  ["values","as stated","or labels"],
];

// where a criterion fails.
export interface UnmetCriterion {
  /** its name */
  criterion: string;
  /** per point, cases that fail it; where one fails, those that could not be checked do not count [1] */
  counts: number[];
}
export const kUnmetCriterion: FieldNote[] = [
  ["criterion","","its name"],
  ["counts","1","per point, cases that fail it; where one fails, those that could not be checked do not count"],
];

// how many points of the design are good enough.
export interface PointsAbove {
  /** of probability [1] */
  level: number;
  /** that have it at least, by the lower end of the interval [1] */
  points: number;
}
export const kPointsAbove: FieldNote[] = [
  ["level","1","of probability"],
  ["points","1","that have it at least, by the lower end of the interval"],
];
