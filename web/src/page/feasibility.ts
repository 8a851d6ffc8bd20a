// Feasibility: clearance between bodies, limits of joints; and loads on grasps after the impact, closed loops, cost.
import { element } from "../dom";
import { number } from "../format";
import type { Run } from "../run";
import { checkOf, limitUnit } from "./facts";
import { determined } from "./grasp_tables";
import { list, num, text, withUnit, words, type PartlySummary } from "./read";
import { absent, fold, mark, table, vectorCell, type Cell, type Column } from "./table";

const kFewEvents = 8;

export function feasibilitySection(run: Run): HTMLElement[] {
  const s = run.summary ?? {};
  return [element("h3", {}, "Clearance"), ...clearance(s), element("h3", {}, "Joint limits"), ...limits(run)];
}

function withoutClearance(s: PartlySummary): string {
  const reason = text(checkOf(s, "clearance_violation")?.not_checked, "");
  if (reason) return `Clearance was not checked: ${reason}.`;
  return "The summary has no clearance: nothing moves, fewer than two bodies have shapes, or the run ended early.";
}

function clearance(s: PartlySummary): HTMLElement[] {
  if (!s.clearance)
    return [absent(withoutClearance(s))];
  const phases = list(s.clearance.phases).map((one): Cell[] => [
    words(one.phase),
    number(num(one.distance)),
    list(one.bodies).join(" – "),
    number(num(one.time)),
    ...list(one.points).slice(0, 2).map(vectorCell),
  ]);
  const columns: Column[] = [
    { head: "Phase" },
    { head: "Minimum distance", unit: "m", numeric: true, title: "negative: a depth of overlap" },
    { head: "Bodies" },
    { head: "Time", unit: "s", numeric: true },
    { head: "Nearest points", unit: "m" },
    { head: "" },
  ];
  const result: HTMLElement[] = [];
  const reason = text(checkOf(s, "clearance_violation")?.not_checked, "");
  if (reason) result.push(element("p", {}, mark("warn", `Not checked: ${reason}.`)));
  if (phases.length > 0)
    result.push(table("Minimum clearance per phase (negative: depth of overlap)", columns, phases));
  const events = [...list(s.clearance.events)].sort(
    (a, b) => (num(a.minimum_distance) ?? 0) - (num(b.minimum_distance) ?? 0),
  );
  if (events.length === 0) result.push(element("p", {}, "All monitored bodies kept the required distance."));
  else {
    const heads: Column[] = [
      { head: "Bodies" },
      { head: "Phase" },
      { head: "From", unit: "s", numeric: true },
      { head: "to", unit: "s", numeric: true },
      { head: "Required", unit: "m", numeric: true },
      { head: "Least", unit: "m", numeric: true },
      { head: "at", unit: "s", numeric: true },
    ];
    const rows = events.map((one): Cell[] => [
      list(one.bodies).join(" – "),
      words(one.phase),
      number(num(one.begin)),
      number(num(one.end)),
      number(num(one.required)),
      number(num(one.minimum_distance)),
      number(num(one.minimum_time)),
    ]);
    result.push(table(`Too close: ${events.length} events, deepest first`, heads, rows.slice(0, kFewEvents)));
    if (rows.length > kFewEvents)
      result.push(fold(`${rows.length - kFewEvents} more events`, table("More events", heads, rows.slice(kFewEvents))));
  }
  const unwatched = list(s.clearance.unwatched).map((pair) => list(pair).join(" – "));
  if (unwatched.length > 0)
    result.push(
      fold(
        `${unwatched.length} pairs not monitored`,
        element("p", {}, `${unwatched.join("; ")}. Neighbouring links of an arm are not monitored either.`),
      ),
    );
  return result;
}

function limits(run: Run): HTMLElement[] {
  const s = run.summary ?? {};
  const events = list(s.limits?.events);
  if (!s.limits) return [absent("The summary has no joint limits.")];
  if (events.length === 0) return [element("p", {}, "No joint exceeded a limit of the robot file.")];
  const columns: Column[] = [
    { head: "Joint" },
    { head: "What" },
    { head: "Phase" },
    { head: "From", unit: "s", numeric: true },
    { head: "to", unit: "s", numeric: true },
    { head: "Limit", numeric: true },
    { head: "Worst", numeric: true },
    { head: "Unit" },
    { head: "at", unit: "s", numeric: true },
  ];
  const kinds: Record<string, string> = { effort_saturated: "motor at its limit (no violation)" };
  const rows = events.map((one): Cell[] => [
    text(one.joint),
    kinds[text(one.kind)] ?? words(one.kind),
    words(one.phase),
    number(num(one.begin)),
    number(num(one.end)),
    number(num(one.limit)),
    number(num(one.worst_value)),
    limitUnit(run, one),
    number(num(one.worst_time)),
  ]);
  return [
    table("Beyond limits", columns, rows.slice(0, 30)),
    ...(rows.length > 30 ? [fold(`${rows.length - 30} more`, table("More", columns, rows.slice(30)))] : []),
  ];
}

export function afterSection(s: PartlySummary): HTMLElement[] {
  const result = [...graspLoads(s), ...loops(s), ...endState(s)];
  return result.length > 0 ? result : [absent("The summary has no motion after the impact.")];
}

function graspLoads(s: PartlySummary): HTMLElement[] {
  const rows = list(s.post_impact?.grasp_loads).map((one): Cell[] => [
    text(one.end_effector),
    text(one.target),
    words(one.phase),
    number(num(one.largest_force)),
    number(num(one.force_time)),
    number(num(one.largest_moment)),
    number(num(one.moment_time)),
    determined(one.determined),
  ]);
  if (rows.length === 0) return [];
  const columns: Column[] = [
    { head: "End-effector" },
    { head: "Target" },
    { head: "Phase" },
    { head: "Largest force", unit: "N", numeric: true },
    { head: "at", unit: "s", numeric: true },
    { head: "Largest moment", unit: "N m", numeric: true },
    { head: "at", unit: "s", numeric: true },
    { head: "Determined" },
  ];
  return [table("Loads on grasps while they hold", columns, rows)];
}

function loops(s: PartlySummary): HTMLElement[] {
  const rows = list(s.post_impact?.loops).map((one): Cell[] => [
    words(one.phase),
    list(one.closures).join("; "),
    `${number(num(one.rank))} of ${number(num(one.rows))}`,
    number(num(one.unprojected_position), 3),
    number(num(one.unprojected_angle), 3),
    number(num(one.correction_total), 3),
    number(num(one.integration_error), 3),
  ]);
  if (rows.length === 0) return [];
  const columns: Column[] = [
    { head: "Phase" },
    { head: "Closures" },
    { head: "Rank of rows" },
    { head: "Defect before projection", unit: "m", numeric: true },
    { head: "Angle", unit: "rad", numeric: true },
    { head: "Sum of corrections", numeric: true },
    { head: "Integration error", numeric: true },
  ];
  return [table("Closed loops", columns, rows)];
}

function endState(s: PartlySummary): HTMLElement[] {
  const end = s.post_impact?.end ?? s.approach?.end;
  if (!end) return [];
  const bodies = [...(end.base ? [end.base] : []), ...list(end.targets)];
  const rows = bodies.map((body): Cell[] => [
    text(body.name),
    vectorCell(body.position),
    vectorCell(body.quaternion_wxyz),
    vectorCell(body.velocity),
    vectorCell(body.angular_velocity),
  ]);
  const columns: Column[] = [
    { head: "Body" },
    { head: "Position", unit: "m" },
    { head: "Quaternion w, x, y, z" },
    { head: "Velocity", unit: "m/s" },
    { head: "Angular velocity", unit: "rad/s" },
  ];
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
      table("Bodies at the end", columns, rows),
      joints.length > 0 ? table("Joints at the end", heads, joints) : null,
    ),
  ];
}

export function costSection(s: PartlySummary, samples: string): HTMLElement[] {
  const rows = list(s.cost).map((one): Cell[] => [
    words(one.phase),
    number(num(one.rhs_evaluations), 9),
    number(num(one.steps), 9),
    number(num(one.rejected), 9),
  ]);
  const columns: Column[] = [
    { head: "Phase" },
    { head: "Evaluations", numeric: true },
    { head: "Steps", numeric: true },
    { head: "Rejected", numeric: true },
  ];
  return [
    rows.length > 0 ? table("Cost of integration", columns, rows) : absent("The summary has no cost."),
    element("p", { class: "small" }, samples),
  ];
}
