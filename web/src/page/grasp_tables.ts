// Grasps of an impact: impulses, gaps and relative motion, rebounds of contacts, force histories.
import { kContactRebound, kForceProfile, kGraspImpulse, kImpulseAtGrasp, type ImpactReport, type ImpulseSet } from "../summary_types";
import { describedTable, those, without } from "./described";
import { list, type Partly } from "./read";
import { absent, fold, vectorCell } from "./table";

const kImpulses = ["end_effector", "target", "grasp_point", "model", "impulse_magnitude", "impulse", "angular_impulse", "mean_force", "determined"];

export function graspTables(impact: Partly<ImpactReport>): HTMLElement[] {
  const grasps = list(impact.grasps);
  if (grasps.length === 0) return [absent("The summary lists no grasps.")];
  const who = those(kGraspImpulse, "end_effector");
  const rebounds = grasps.flatMap(({ end_effector, rebound }) => (rebound ? { end_effector, ...rebound } : []));
  const profiles = grasps.flatMap(({ end_effector, profile }) => (profile ? { end_effector, ...profile } : []));
  return [
    ...describedTable("Grasps: impulses on the robot", those(kGraspImpulse, ...kImpulses), grasps),
    ...describedTable("Grasps: gap, and end-effector relative to the target at the contact point", [...who, ...without(kGraspImpulse, ...kImpulses)], grasps, { sizes: true, cells: { contact_point: (one) => vectorCell(one.contact_point) } }),
    ...describedTable("Rebound", [...who, ...kContactRebound], rebounds),
    ...describedTable("In time", [...who, ...kForceProfile], profiles),
  ];
}

// Impulses of all grasps, in sets that are numbered.
export function impulseSets(caption: string, title: string, sets: Partly<ImpulseSet>[]): HTMLElement[] {
  const rows = sets.flatMap((one, i) => list(one.grasps).map((grasp) => ({ set: i + 1, ...grasp })));
  return rows.length > 0 ? [fold(title, ...describedTable(caption, [["set", "", "number of the set"], ...kImpulseAtGrasp], rows))] : [];
}
