// The plan of the joint motion and the search for it.
import { element } from "../dom";
import { number } from "../format";
import { kEstimateReport, kNavigationReport, kPlannedMiss, kPlannedPath, kPlanReport, kPlanTerm, kStraightInReport, kWheelShare, type PlanReport } from "../summary_types";
import { describedPairs, describedTable, without } from "./described";
import { list, num, text, type Partly, type PartlySummary } from "./read";
import { absent, fold, mark, table, type Cell, type Column } from "./table";
import { windowPart } from "./window";

const kElsewhere = ["joints", "final_position", "final_rates", "found"];

export function planSection(s: PartlySummary): HTMLElement[] {
  const plan = s.approach?.plan;
  if (!plan) return [absent("This run has no plan of an approach.")];
  const terms = list(plan.terms);
  return [
    ...found(s, plan),
    ...describedPairs(without(kPlanReport, ...kElsewhere), plan),
    ...(terms.length > 1 ? describedTable("Weighed objectives", kPlanTerm, terms) : []),
    ...pathPart(plan),
    ...windowPart(plan),
    ...finalValues(s, plan),
    ...describedTable("Miss when the plan is followed exactly", kPlannedMiss, list(plan.miss)),
    ...straightIn(plan),
    ...navigation(s),
  ];
}

export function isUnplanned(s: PartlySummary): boolean {
  return s.status === "failed" && text(s.failure, "").startsWith("planning");
}

// Result of the search for final values.
function found(s: PartlySummary, plan: Partly<PlanReport>): HTMLElement[] {
  // The planner may find final values although it finds no approach.
  if (isUnplanned(s)) return [element("p", {}, mark("bad", "no plan found: the run failed while it planned the approach"))];
  if (plan.found === undefined)
    return plan.window ? [] : [element("p", { class: "lead" }, "The scenario gives the final joint values; no search was necessary.")];
  const outcome = plan.found === true ? mark("good", "final joint values found") : mark("bad", "no solution found; the closest attempt is shown");
  return [element("p", {}, outcome)];
}

// Constraints along the trajectory and their margins.
function pathPart(plan: Partly<PlanReport>): HTMLElement[] {
  if (!plan.path) return [];
  return [
    element("h3", {}, "Planned trajectory, followed exactly"),
    ...describedPairs(kPlannedPath, plan.path),
    ...describedTable("Predicted loads of the reaction wheels", kWheelShare, list(plan.path.wheels)),
  ];
}

function straightIn({ straight_in: one }: Partly<PlanReport>): HTMLElement[] {
  if (!one) return [];
  return [element("h3", {}, "Straight in"), ...describedPairs(one.damped === false ? without(kStraightInReport, "damped_interval") : kStraightInReport, one)];
}

// Plans during the approach, and the errors of the estimates that they use.
function navigation(s: PartlySummary): HTMLElement[] {
  const plans = list(s.approach?.navigation);
  const rows = plans.flatMap((plan) => list(plan.estimates).map((one) => ({ planned_at: plan.time, ...one })));
  if (plans.length === 0) return [];
  return [
    element("h3", {}, "Plans on estimates"),
    ...describedTable("Plans", kNavigationReport, plans),
    ...describedTable("Errors of their estimates", [["planned_at", "s", "time of planning"], ...kEstimateReport], rows),
  ];
}

function finalValues(s: PartlySummary, plan: Partly<PlanReport>): HTMLElement[] {
  const columns: Column[] = [
    { head: "Joint" },
    { head: "Planned position", unit: "rad; m", numeric: true },
    { head: "reached", unit: "rad; m", numeric: true },
    { head: "Planned rate", unit: "rad/s; m/s", numeric: true },
    { head: "reached", unit: "rad/s; m/s", numeric: true },
  ];
  const reached = s.approach?.end?.joints ?? {};
  const at = (name: string, values: number[] | undefined) => num(list(values)[list(reached.names).indexOf(name)]);
  const rows = list(plan.joints).map((joint, i): Cell[] => [
    text(joint),
    number(num(list(plan.final_position)[i])),
    number(at(joint, reached.position)),
    number(num(list(plan.final_rates)[i])),
    number(at(joint, reached.velocity)),
  ]);
  return rows.length > 0
    ? [fold(`Final joint values (${rows.length})`, table("Final joint values", columns, rows))]
    : [];
}
