// Made by scripts/tables from the descriptions of results in grapnel/; edit those.

export type FieldNote = readonly [key: string, unit: string, text: string];

// results of the cases of a campaign.
export interface CampaignReport {
  /** format of this file */
  schema: CampaignReportFormat;
  /** version of Grapnel */
  version: string;
  /** settings of the campaign */
  campaign: CampaignSettings;
  /** cases on disk; all following results refer to them [1] */
  rows: number;
  /** how the cases ended */
  counts: CaseCounts;
  /** success over all rows */
  success: SuccessRate;
  /** limits of the rates: criteria that never fail, never hold or were not checked, and assumed successes. The terminal prints them too */
  warnings: string[];
  /** criteria in the order of the file */
  criteria: CriterionResult[];
  /** drawn inputs */
  inputs: Distribution[];
  /** stored columns */
  columns: Distribution[];
  /** sensitivity of results to inputs */
  sensitivity: SensitivityOfAll;
  /** the first list is by `keep.series.worst.by`, if given; then by the numbers that criteria limit */
  worst: WorstCases[];
  /** reasons for which cases are not a success, the most frequent first, every case counted once; at most 50 */
  failures: Reason[];
  /** cases with other reasons [1] */
  failures_left_out: number;
  /** results per grasp, if the columns `grasps/*\/captured` are stored */
  grasps: GraspCount[];
  /** entries of `failures` whose cases are not ok; at most 50 */
  reasons: Reason[];
  /** cases with other reasons [1] */
  reasons_left_out: number;
  /** absent without a design */
  success_map?: SuccessMap;
  /** text of the campaign file */
  text: string;
}
export const kCampaignReport: FieldNote[] = [
  ["schema","","format of this file"],
  ["version","","version of Grapnel"],
  ["campaign","","settings of the campaign"],
  ["rows","1","cases on disk; all following results refer to them"],
  ["counts","","how the cases ended"],
  ["success","","success over all rows"],
  ["warnings","","limits of the rates: criteria that never fail, never hold or were not checked, and assumed successes. The terminal prints them too"],
  ["criteria","","criteria in the order of the file"],
  ["inputs","","drawn inputs"],
  ["columns","","stored columns"],
  ["sensitivity","","sensitivity of results to inputs"],
  ["worst","","the first list is by `keep.series.worst.by`, if given; then by the numbers that criteria limit"],
  ["failures","","reasons for which cases are not a success, the most frequent first, every case counted once; at most 50"],
  ["failures_left_out","1","cases with other reasons"],
  ["grasps","","results per grasp, if the columns `grasps/*/captured` are stored"],
  ["reasons","","entries of `failures` whose cases are not ok; at most 50"],
  ["reasons_left_out","1","cases with other reasons"],
  ["success_map","","absent without a design"],
  ["text","","text of the campaign file"],
];

export type CampaignReportFormat = "grapnel-campaign-report/1";

// settings of the campaign.
export interface CampaignSettings {
  /** name of the campaign */
  name: string;
  /** description of the campaign */
  description: string;
  /** name of the campaign file, without folders */
  file: string;
  /** SHA-256 of its bytes and of the files that it names */
  sha256: string;
  /** seed as text: up to 64 bits */
  seed: string;
  /** as in the file */
  sampling: Sampling;
  /** as in the file */
  simulate: StudyMode;
  /** as in the file */
  plan: CampaignPlan;
  /** number of cases, including extensions; with a design per point of it [1] */
  cases: number;
  /** number of cases at all points of a design [1] */
  total: number;
}
export const kCampaignSettings: FieldNote[] = [
  ["name","","name of the campaign"],
  ["description","","description of the campaign"],
  ["file","","name of the campaign file, without folders"],
  ["sha256","","SHA-256 of its bytes and of the files that it names"],
  ["seed","","seed as text: up to 64 bits"],
  ["sampling","","as in the file"],
  ["simulate","","as in the file"],
  ["plan","","as in the file"],
  ["cases","1","number of cases, including extensions; with a design per point of it"],
  ["total","1","number of cases at all points of a design"],
];

export type Sampling = "random" | "latin_hypercube" | "sobol";

export type StudyMode = "impact" | "run";

export type CampaignPlan = "nominal" | "per_case";

// how the cases ended.
export interface CaseCounts {
  /** cases that completed [1] */
  ok: number;
  /** cases that failed [1] */
  failed: number;
  /** cases for which no configuration was found [1] */
  unreachable: number;
  /** cases that are ok and meet all criteria [1] */
  success: number;
}
export const kCaseCounts: FieldNote[] = [
  ["ok","1","cases that completed"],
  ["failed","1","cases that failed"],
  ["unreachable","1","cases for which no configuration was found"],
  ["success","1","cases that are ok and meet all criteria"],
];

// the probability of success, with Wilson's score interval (1927).
export interface SuccessRate {
  /** successes over all rows; null: no rows [1] */
  estimate: number | null;
  /** lower end of its interval [1] */
  lower: number;
  /** likewise [1] */
  upper: number;
  /** confidence of this interval and of all other intervals here [1] */
  confidence: number;
  /** successes with a grasp that is assumed to hold because its end-effector has no envelope [1] */
  assumed: number;
}
export const kSuccessRate: FieldNote[] = [
  ["estimate","1","successes over all rows; null: no rows"],
  ["lower","1","lower end of its interval"],
  ["upper","1","likewise"],
  ["confidence","1","confidence of this interval and of all other intervals here"],
  ["assumed","1","successes with a grasp that is assumed to hold because its end-effector has no envelope"],
];

// results per criterion, in the order of the file.
export interface CriterionResult {
  /** name in the file, else its text */
  name: string;
  /** text of the expression */
  text: string;
  /** rows that are ok and meet the criterion [1] */
  met: number;
  /** these over all rows; null: no rows [1] */
  estimate: number | null;
  /** lower end of its interval [1] */
  lower: number;
  /** likewise [1] */
  upper: number;
  /** rows that are ok and in which no other criterion fails; other criteria may not have been checked, such as an impulse without a capture [1] */
  only_this: number;
  /** rows that are ok in which a decisive number does not exist [1] */
  not_checked: number;
  /** names of columns and inputs */
  reads: string[];
  /** limits on single numbers, if the criterion can be expressed by them */
  limits: CriterionLimit[];
}
export const kCriterionResult: FieldNote[] = [
  ["name","","name in the file, else its text"],
  ["text","","text of the expression"],
  ["met","1","rows that are ok and meet the criterion"],
  ["estimate","1","these over all rows; null: no rows"],
  ["lower","1","lower end of its interval"],
  ["upper","1","likewise"],
  ["only_this","1","rows that are ok and in which no other criterion fails; other criteria may not have been checked, such as an impulse without a capture"],
  ["not_checked","1","rows that are ok in which a decisive number does not exist"],
  ["reads","","names of columns and inputs"],
  ["limits","","limits on single numbers, if the criterion can be expressed by them"],
];

// limit of a criterion on a single number.
export interface CriterionLimit {
  /** name of a column or an input */
  name: string;
  /** upper limit [as the number] */
  at_most?: number | null;
  /** lower limit; a limit has one of the two [as the number] */
  at_least?: number | null;
  /** true: the limit applies to the magnitude */
  magnitude: boolean;
}
export const kCriterionLimit: FieldNote[] = [
  ["name","","name of a column or an input"],
  ["at_most","as the number","upper limit"],
  ["at_least","as the number","lower limit; a limit has one of the two"],
  ["magnitude","","true: the limit applies to the magnitude"],
];

// distribution of an input or a column.
export interface Distribution {
  /** name of the column or the input */
  name: string;
  /** unit of its numbers */
  unit: string;
  /** description of the column or the input */
  description: string;
  /** number of finite values [1] */
  count: number;
  /** others [1] */
  missing: number;
  /** mean; null: no numbers [as the number] */
  mean: number | null;
  /** standard error of the mean [as the number] */
  mean_error: number | null;
  /** standard deviation with n − 1; null: too few numbers [as the number] */
  standard_deviation: number | null;
  /** minimum [as the number] */
  least: number | null;
  /** maximum [as the number] */
  largest: number | null;
  /** quantiles at the probabilities of the file */
  quantiles: Quantile[];
  /** histogram of the finite numbers */
  histogram: Histogram;
  /** for inputs only: success by the input's value */
  success_by?: SuccessBy;
}
export const kDistribution: FieldNote[] = [
  ["name","","name of the column or the input"],
  ["unit","","unit of its numbers"],
  ["description","","description of the column or the input"],
  ["count","1","number of finite values"],
  ["missing","1","others"],
  ["mean","as the number","mean; null: no numbers"],
  ["mean_error","as the number","standard error of the mean"],
  ["standard_deviation","as the number","standard deviation with n − 1; null: too few numbers"],
  ["least","as the number","minimum"],
  ["largest","as the number","maximum"],
  ["quantiles","","quantiles at the probabilities of the file"],
  ["histogram","","histogram of the finite numbers"],
  ["success_by","","for inputs only: success by the input's value"],
];

// value that is not exceeded with a given probability.
export interface Quantile {
  /** requested probability [1] */
  probability: number;
  /** interpolated between order statistics: Hyndman and Fan 1996, type 7; null: no numbers [as the number] */
  value: number | null;
  /** order statistic; the quantile is between `lower` and `upper` with at least the confidence, for any distribution; null: the sample is too small [as the number] */
  lower: number | null;
  /** order statistic, likewise [as the number] */
  upper: number | null;
}
export const kQuantile: FieldNote[] = [
  ["probability","1","requested probability"],
  ["value","as the number","interpolated between order statistics: Hyndman and Fan 1996, type 7; null: no numbers"],
  ["lower","as the number","order statistic; the quantile is between `lower` and `upper` with at least the confidence, for any distribution; null: the sample is too small"],
  ["upper","as the number","order statistic, likewise"],
];

// distribution of numbers.
export interface Histogram {
  /** start of the first bin [as the number] */
  begin: number;
  /** end of the last bin, which includes it [as the number] */
  end: number;
  /** counts of bins of equal width. Whole numbers in a small range have one bin each, centred on them; equal numbers have one bin of width 0 [1] */
  counts: number[];
  /** number of successes in each bin [1] */
  successes: number[];
  /** numbers below the first bin, if a few outliers would leave all other numbers in one bin [1] */
  below: number;
  /** numbers beyond the last bin [1] */
  above: number;
}
export const kHistogram: FieldNote[] = [
  ["begin","as the number","start of the first bin"],
  ["end","as the number","end of the last bin, which includes it"],
  ["counts","1","counts of bins of equal width. Whole numbers in a small range have one bin each, centred on them; equal numbers have one bin of width 0"],
  ["successes","1","number of successes in each bin"],
  ["below","1","numbers below the first bin, if a few outliers would leave all other numbers in one bin"],
  ["above","1","numbers beyond the last bin"],
];

// up to 20 groups of rows, of as equal a size as possible, by the value of an input.
export interface SuccessBy {
  /** smallest value of each group [as the number] */
  from: number[];
  /** largest value of each group [as the number] */
  to: number[];
  /** rows of each group [1] */
  trials: number[];
  /** successes of each group [1] */
  successes: number[];
}
export const kSuccessBy: FieldNote[] = [
  ["from","as the number","smallest value of each group"],
  ["to","as the number","largest value of each group"],
  ["trials","1","rows of each group"],
  ["successes","1","successes of each group"],
];

// sensitivity of results to inputs, computed from the rows.
export interface SensitivityOfAll {
  /** names of the inputs */
  inputs: string[];
  /** groups of inputs, and the axes of a design */
  groups: InputGroup[];
  /** first `success`; then each criterion, if there are several; then the numbers that criteria read, the used share of each tolerance, and the other columns in their order, at most 64 besides criteria. Constant columns are not included */
  measures: Measure[];
  /** further columns without an entry [1] */
  left_out: number;
  /** columns whose numbers differ only by rounding error, which are not included either: by less than 1e-9 of the largest among them and the other components of their vector, or all below 1e-9 of the largest number of their unit */
  rounding: string[];
}
export const kSensitivityOfAll: FieldNote[] = [
  ["inputs","","names of the inputs"],
  ["groups","","groups of inputs, and the axes of a design"],
  ["measures","","first `success`; then each criterion, if there are several; then the numbers that criteria read, the used share of each tolerance, and the other columns in their order, at most 64 besides criteria. Constant columns are not included"],
  ["left_out","1","further columns without an entry"],
  ["rounding","","columns whose numbers differ only by rounding error, which are not included either: by less than 1e-9 of the largest among them and the other components of their vector, or all below 1e-9 of the largest number of their unit"],
];

// related inputs: the components of a vector, position and orientation of a pose, all drawn values of a grasp point.
export interface InputGroup {
  /** name of the group */
  name: string;
  /** true: an axis of the design, without inputs */
  design: boolean;
  /** names of the inputs in the group */
  inputs: string[];
}
export const kInputGroup: FieldNote[] = [
  ["name","","name of the group"],
  ["design","","true: an axis of the design, without inputs"],
  ["inputs","","names of the inputs in the group"],
];

// a quantity that is compared with every input.
export interface Measure {
  /** name of the quantity */
  name: string;
  /** unit of the quantity */
  unit: string;
  /** kind of the quantity. */
  of: MeasureOf;
  /** rows in which it exists [1] */
  count: number;
  /** per input: Sobol's index Var(E[y|x]) / Var(y), the part of the variance that would vanish if the input were known; by chance it may be slightly negative [1] */
  first_order: (number | null)[];
  /** its standard error [1] */
  error: (number | null)[];
  /** Spearman's rank correlation, per input [1] */
  rank_correlation: (number | null)[];
  /** the same for groups of inputs */
  groups: GroupIndices;
  /** 1 minus the sum of the groups: the share of the variance that no group alone explains, but interactions of groups, influences that are not drawn, or the error of the fit [1] */
  unexplained: number | null;
}
export const kMeasure: FieldNote[] = [
  ["name","","name of the quantity"],
  ["unit","","unit of the quantity"],
  ["of","","kind of the quantity."],
  ["count","1","rows in which it exists"],
  ["first_order","1","per input: Sobol's index Var(E[y|x]) / Var(y), the part of the variance that would vanish if the input were known; by chance it may be slightly negative"],
  ["error","1","its standard error"],
  ["rank_correlation","1","Spearman's rank correlation, per input"],
  ["groups","","the same for groups of inputs"],
  ["unexplained","1","1 minus the sum of the groups: the share of the variance that no group alone explains, but interactions of groups, influences that are not drawn, or the error of the fit"],
];

export type MeasureOf = "success" | "criterion" | "column";

// variance explained by groups of inputs, in the order of `sensitivity.groups`.
export interface GroupIndices {
  /** per group; for several inputs the variance of a quadratic function of them, fitted by least squares to at most 20 000 rows, minus the expected contribution of chance (adjusted R²), or the largest index of one of them if that is larger: a lower bound, exact for quadratic functions; null if there are fewer than ten rows or fewer than twice the terms [1] */
  first_order: (number | null)[];
  /** its standard error [1] */
  error: (number | null)[];
  /** rank correlation; null for groups of several inputs [1] */
  rank_correlation: (number | null)[];
}
export const kGroupIndices: FieldNote[] = [
  ["first_order","1","per group; for several inputs the variance of a quadratic function of them, fitted by least squares to at most 20 000 rows, minus the expected contribution of chance (adjusted R²), or the largest index of one of them if that is larger: a lower bound, exact for quadratic functions; null if there are fewer than ten rows or fewer than twice the terms"],
  ["error","1","its standard error"],
  ["rank_correlation","1","rank correlation; null for groups of several inputs"],
];

// up to 10 cases, or `keep.series.worst.count`, with the worst values of a column.
export interface WorstCases {
  /** name of the column */
  by: string;
  /** unit of its numbers */
  unit: string;
  /** `largest`, `least` */
  direction: string;
  /** true: sorted by magnitude */
  magnitude: boolean;
  /** the worst first; of equal values the first case */
  cases: WorstCase[];
}
export const kWorstCases: FieldNote[] = [
  ["by","","name of the column"],
  ["unit","","unit of its numbers"],
  ["direction","","`largest`, `least`"],
  ["magnitude","","true: sorted by magnitude"],
  ["cases","","the worst first; of equal values the first case"],
];

// one of the worst cases.
export interface WorstCase {
  /** k [1] */
  index: number;
  /** value of this case [as the number] */
  value: number;
  /** whether the case is a success */
  success: boolean;
  /** drawn values in the order of `inputs` [as drawn] */
  inputs: (number | null)[];
  /** command that runs this case with its full report, in the folder of the campaign file */
  replay: string;
}
export const kWorstCase: FieldNote[] = [
  ["index","1","k"],
  ["value","as the number","value of this case"],
  ["success","","whether the case is a success"],
  ["inputs","as drawn","drawn values in the order of `inputs`"],
  ["replay","","command that runs this case with its full report, in the folder of the campaign file"],
];

// reason for which cases are not a success.
export interface Reason {
  /** status of these cases */
  status: CaseStatus;
  /** for cases that are not ok their reason, with numbers replaced by `…` so that similar cases are counted together; failed conservation checks are one kind. For cases that are ok the criteria that they do not meet and, if a criterion requires closed grasps, the grasps that miss and the exceeded tolerance: `not met: captured (tip-1 misses by position); not checked: soft` */
  reason: string;
  /** cases [1] */
  count: number;
  /** the first three cases */
  examples: ReasonExample[];
}
export const kReason: FieldNote[] = [
  ["status","","status of these cases"],
  ["reason","","for cases that are not ok their reason, with numbers replaced by `…` so that similar cases are counted together; failed conservation checks are one kind. For cases that are ok the criteria that they do not meet and, if a criterion requires closed grasps, the grasps that miss and the exceeded tolerance: `not met: captured (tip-1 misses by position); not checked: soft`"],
  ["count","1","cases"],
  ["examples","","the first three cases"],
];

export type CaseStatus = "ok" | "failed" | "unreachable";

// a case with the reason.
export interface ReasonExample {
  /** k [1] */
  index: number;
  /** reason of this case */
  reason: string;
  /** command as for the worst cases */
  replay: string;
}
export const kReasonExample: FieldNote[] = [
  ["index","1","k"],
  ["reason","","reason of this case"],
  ["replay","","command as for the worst cases"],
];

// results of one grasp.
export interface GraspCount {
  /** end-effector of the grasp */
  end_effector: string;
  /** rows that are ok in which it closed and was not lost [1] */
  captured: number;
  /** rows that are ok in which it did not close, or was lost [1] */
  missed: number;
  /** tolerances of its envelope; empty: no envelope */
  tolerances: ToleranceCount[];
}
export const kGraspCount: FieldNote[] = [
  ["end_effector","","end-effector of the grasp"],
  ["captured","1","rows that are ok in which it closed and was not lost"],
  ["missed","1","rows that are ok in which it did not close, or was lost"],
  ["tolerances","","tolerances of its envelope; empty: no envelope"],
];

// how often a grasp's tolerance was exceeded.
export interface ToleranceCount {
  /** `position`, `angle`, `velocity`, `angular_velocity` */
  name: string;
  /** number of rows in which it was exceeded [1] */
  exceeded: number;
  /** number of rows in which the grasp missed and this tolerance was exceeded by the largest factor [1] */
  limiting: number;
}
export const kToleranceCount: FieldNote[] = [
  ["name","","`position`, `angle`, `velocity`, `angular_velocity`"],
  ["exceeded","1","number of rows in which it was exceeded"],
  ["limiting","1","number of rows in which the grasp missed and this tolerance was exceeded by the largest factor"],
];

// success at the points of the design: lists, the first axis varying slowest. The same uncertain numbers are drawn at every point, so that points differ only by the design.
export interface SuccessMap {
  /** axes of the design */
  axes: SuccessMapAxis[];
  /** confidence of the intervals [1] */
  confidence: number;
  /** rows [1] */
  trials: number[];
  /** rows that are ok [1] */
  ok: number[];
  /** rows that are a success [1] */
  successes: number[];
  /** successes over rows; null: no rows [1] */
  estimate: (number | null)[];
  /** lower end of its interval [1] */
  lower: number[];
  /** likewise [1] */
  upper: number[];
  /** failures per criterion */
  unmet: UnmetCriterion[];
  /** the criterion that most of the point's cases fail, `not ok` if more cases have no result, null if all are a success */
  deciding: (string | null)[];
  /** at three levels; the number in the report's headline */
  above: PointsAbove[];
}
export const kSuccessMap: FieldNote[] = [
  ["axes","","axes of the design"],
  ["confidence","1","confidence of the intervals"],
  ["trials","1","rows"],
  ["ok","1","rows that are ok"],
  ["successes","1","rows that are a success"],
  ["estimate","1","successes over rows; null: no rows"],
  ["lower","1","lower end of its interval"],
  ["upper","1","likewise"],
  ["unmet","","failures per criterion"],
  ["deciding","","the criterion that most of the point's cases fail, `not ok` if more cases have no result, null if all are a success"],
  ["above","","at three levels; the number in the report's headline"],
];

// an axis of the design.
export interface SuccessMapAxis {
  /** name of the axis */
  name: string;
  /** unit of its numbers */
  unit: string;
  /** what the axis changes */
  description: string;
  /** whether its values are numbers */
  is_numeric: boolean;
  /** values as in the file, or labels [as stated] */
  values: (number | string)[];
}
export const kSuccessMapAxis: FieldNote[] = [
  ["name","","name of the axis"],
  ["unit","","unit of its numbers"],
  ["description","","what the axis changes"],
  ["is_numeric","","whether its values are numbers"],
  ["values","as stated","values as in the file, or labels"],
];

// failures of one criterion.
export interface UnmetCriterion {
  /** name of the criterion */
  criterion: string;
  /** per point, cases that fail it; if a criterion fails, criteria that could not be checked do not count [1] */
  counts: number[];
}
export const kUnmetCriterion: FieldNote[] = [
  ["criterion","","name of the criterion"],
  ["counts","1","per point, cases that fail it; if a criterion fails, criteria that could not be checked do not count"],
];

// number of points of the design above a probability of success.
export interface PointsAbove {
  /** level of the probability [1] */
  level: number;
  /** points at or above it, by the lower end of the interval [1] */
  points: number;
}
export const kPointsAbove: FieldNote[] = [
  ["level","1","level of the probability"],
  ["points","1","points at or above it, by the lower end of the interval"],
];
