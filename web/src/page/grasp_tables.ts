// Grasps of an impact: impulses, gaps and relative motion, rebounds of contacts, force histories.
import { element } from "../dom";
import { number } from "../format";
import type { GraspImpulse, ImpactReport } from "../summary_types";
import { list, num, size, text, type Partly } from "./read";
import { absent, table, vectorCell, type Cell, type Column } from "./table";

export function graspTables(impact: Partly<ImpactReport>): HTMLElement[] {
  const grasps = list(impact.grasps);
  if (grasps.length === 0) return [absent("The summary lists no grasps.")];
  return [impulseTable(grasps), motionTable(grasps)];
}

function impulseTable(grasps: Partly<GraspImpulse>[]): HTMLElement {
  const columns: Column[] = [
    { head: "End-effector" },
    { head: "Target: grasp point" },
    { head: "Model" },
    { head: "Impulse", unit: "N s", numeric: true },
    { head: "Vector, on the robot", unit: "N s" },
    { head: "Angular impulse", unit: "N m s", numeric: true },
    { head: "Vector, about the contact point", unit: "N m s" },
    { head: "Mean force", unit: "N", numeric: true },
    { head: "Determined", title: "components that are unique; others are open to a self-stress of closed loops" },
  ];
  const rows = grasps.map((grasp): Cell[] => [
    text(grasp.end_effector),
    `${text(grasp.target)}: ${text(grasp.grasp_point)}`,
    text(grasp.model),
    number(num(grasp.impulse_magnitude) ?? size(grasp.impulse)),
    vectorCell(grasp.impulse),
    number(size(grasp.angular_impulse)),
    vectorCell(grasp.angular_impulse),
    number(num(grasp.mean_force)),
    determined(grasp.determined),
  ]);
  return table("Grasps: impulses on the robot", columns, rows);
}

function motionTable(grasps: Partly<GraspImpulse>[]): HTMLElement {
  const moved = grasps.some((grasp) => (size(grasp.target_displacement) ?? 0) > 0);
  const columns: Column[] = [
    { head: "End-effector" },
    { head: "Gap", unit: "m", numeric: true },
    {
      head: "Angle of frames",
      unit: "rad",
      numeric: true,
      title: "between the frames of end-effector and grasp point, independently of the required grasp orientation",
    },
    ...(moved ? [{ head: "Target moved by", unit: "m", numeric: true, title: "contact.gap: translate_target" }] : []),
    { head: "Relative velocity before", unit: "m/s", numeric: true },
    { head: "after", unit: "m/s", numeric: true },
    { head: "Relative rate before", unit: "rad/s", numeric: true },
    { head: "after", unit: "rad/s", numeric: true },
    { head: "Contact point", unit: "m" },
  ];
  const rows = grasps.map((grasp): Cell[] => [
    text(grasp.end_effector),
    number(num(grasp.gap)),
    number(num(grasp.gap_angle)),
    ...(moved ? [number(size(grasp.target_displacement))] : []),
    sized(grasp.relative_velocity_before),
    sized(grasp.relative_velocity_after),
    sized(grasp.relative_angular_velocity_before),
    sized(grasp.relative_angular_velocity_after),
    vectorCell(grasp.contact_point),
  ]);
  return table("Grasps: gap, and end-effector relative to the target at the contact point", columns, rows);
}

// The magnitude; components on hover.
function sized(value: number[] | undefined): Cell {
  return element("span", { title: list(value).map(String).join(", ") }, number(size(value)));
}

const kComponents = ["angular x", "angular y", "angular z", "x", "y", "z"];
export function determined(flags: boolean[] | undefined): Cell {
  const all = list(flags);
  if (all.length === 0) return null;
  const open = kComponents.filter((_, i) => all[i] === false);
  return open.length === 0 ? "all" : `open: ${open.join(", ")}`;
}

export function rebounds(impact: Partly<ImpactReport>): HTMLElement[] {
  const rows = list(impact.grasps)
    .flatMap(({ end_effector, rebound }) => (rebound ? { end_effector, rebound } : []))
    .map(({ end_effector, rebound }): Cell[] => [
      text(end_effector),
      vectorCell(rebound.normal),
      number(num(rebound.normal_impulse)),
      number(size(rebound.tangential_impulse)),
      number(num(rebound.compression)),
      number(num(rebound.normal_work)),
      number(num(rebound.friction_work)),
      list(rebound.modes).join(", "),
      number(num(rebound.spread)),
    ]);
  if (rows.length === 0) return [];
  const columns: Column[] = [
    { head: "End-effector" },
    { head: "Normal, to the robot" },
    { head: "Normal impulse", unit: "N s", numeric: true },
    { head: "Tangential", unit: "N s", numeric: true },
    { head: "In compression", unit: "N s", numeric: true },
    { head: "Normal work", unit: "J", numeric: true },
    { head: "Friction work", unit: "J", numeric: true },
    { head: "Modes" },
    {
      head: "Spread",
      numeric: true,
      title: "of the normal impulse over other orders of simultaneous contacts, relative",
    },
  ];
  return [table("Rebound", columns, rows)];
}

export function profiles(impact: Partly<ImpactReport>): HTMLElement[] {
  const rows = list(impact.grasps)
    .flatMap(({ end_effector, profile }) => (profile ? { end_effector, profile } : []))
    .map(({ end_effector, profile }): Cell[] => [
      text(end_effector),
      number(num(profile.peak_force)),
      number(num(profile.peak_force_time)),
      number(num(profile.peak_moment)),
      number(num(profile.peak_moment_time)),
      number(num(profile.largest_deformation)),
      number(num(profile.duration)),
      number(num(profile.energy_lost)),
      number(num(profile.touches)),
    ]);
  if (rows.length === 0) return [];
  const columns: Column[] = [
    { head: "End-effector" },
    { head: "Peak force", unit: "N", numeric: true },
    { head: "after", unit: "s", numeric: true },
    { head: "Peak moment", unit: "N m", numeric: true },
    { head: "after", unit: "s", numeric: true },
    { head: "Largest deformation", unit: "m", numeric: true },
    { head: "Duration", unit: "s", numeric: true },
    { head: "Energy lost", unit: "J", numeric: true },
    { head: "Touches", numeric: true },
  ];
  return [table("In time", columns, rows)];
}
