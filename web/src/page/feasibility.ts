// Feasibility: clearance between bodies, limits of joints; and loads on grasps after the impact, closed loops, cost.
import { element } from "../dom";
import { number } from "../format";
import type { Run } from "../run";
import { kBodyMotion, kClearanceEvent, kGraspLoad, kLimitEvent, kLoopReport, kMinimumClearance, kPhaseCost } from "../summary_types";
import { describedTable } from "./described";
import { checkOf, limitUnit } from "./facts";
import { list, num, text, withUnit, words, type PartlySummary } from "./read";
import { absent, fold, mark, table, type Cell, type Column } from "./table";

export function feasibilitySection(run: Run): HTMLElement[] {
  const s = run.summary ?? {};
  return [element("h3", {}, "Clearance"), ...clearance(s), element("h3", {}, "Joint limits"), ...limits(run)];
}

function clearance(s: PartlySummary): HTMLElement[] {
  const reason = text(checkOf(s, "clearance_violation")?.not_checked, "");
  if (!s.clearance)
    return [absent(reason ? `Clearance was not checked: ${reason}.` : "The summary has no clearance: nothing moves, fewer than two bodies have shapes, or the run ended early.")];
  const cells = { bodies: (one: { bodies?: readonly string[] }) => list(one.bodies).join(" – ") };
  const events = [...list(s.clearance.events)].sort((a, b) => (num(a.minimum_distance) ?? 0) - (num(b.minimum_distance) ?? 0));
  const unwatched = list(s.clearance.unwatched).map((pair) => list(pair).join(" – "));
  return [
    ...(reason ? [element("p", {}, mark("warn", `Not checked: ${reason}.`))] : []),
    ...describedTable("Minimum clearance per phase (negative: depth of overlap)", kMinimumClearance, list(s.clearance.phases), { cells }),
    ...(events.length === 0
      ? [element("p", {}, "All monitored bodies kept the required distance.")]
      : describedTable(`Too close: ${events.length} events, deepest first`, kClearanceEvent, events, { cells, few: 8 })),
    ...(unwatched.length > 0
      ? [fold(`${unwatched.length} pairs not monitored`, element("p", {}, `${unwatched.join("; ")}. Neighbouring links of an arm are not monitored either.`))]
      : []),
  ];
}

function limits(run: Run): HTMLElement[] {
  const events = list(run.summary?.limits?.events);
  if (!run.summary?.limits) return [absent("The summary has no joint limits.")];
  if (events.length === 0) return [element("p", {}, "No joint exceeded a limit of the robot file.")];
  const rows = events.map((one) => ({ ...one, unit: limitUnit(run, one) }));
  const cells = { kind: (one: { kind?: string }) => (one.kind === "effort_saturated" ? "motor at its limit (no violation)" : words(one.kind)) };
  return describedTable("Beyond limits", [...kLimitEvent, ["unit", "", "of limit and worst value"]], rows, { cells, few: 30 });
}

export function afterSection(s: PartlySummary): HTMLElement[] {
  const result = [
    ...describedTable("Loads on grasps while they hold", kGraspLoad, list(s.post_impact?.grasp_loads)),
    ...describedTable("Closed loops", kLoopReport, list(s.post_impact?.loops)),
    ...endState(s),
  ];
  return result.length > 0 ? result : [absent("The summary has no motion after the impact.")];
}

function endState(s: PartlySummary): HTMLElement[] {
  const end = s.post_impact?.end ?? s.approach?.end;
  if (!end) return [];
  const bodies = [...(end.base ? [end.base] : []), ...list(end.targets)];
  const joints = list(end.joints?.names).map((name, i): Cell[] => [
    text(name),
    number(num(list(end.joints?.position)[i])),
    number(num(list(end.joints?.velocity)[i])),
  ]);
  const heads: Column[] = [
    { head: "Joint" },
    { head: "Position", unit: "rad; m", numeric: true },
    { head: "Rate", unit: "rad/s; m/s", numeric: true },
  ];
  return [
    fold(
      `State at the end, ${withUnit(num(end.time), "s")}`,
      ...describedTable("Bodies at the end", kBodyMotion, bodies),
      joints.length > 0 ? table("Joints at the end", heads, joints) : null,
    ),
  ];
}

export function costSection(s: PartlySummary, samples: string): HTMLElement[] {
  const costs = list(s.cost);
  return [
    ...(costs.length > 0 ? describedTable("Cost of integration", kPhaseCost, costs) : [absent("The summary has no cost.")]),
    element("p", { class: "small" }, samples),
  ];
}
