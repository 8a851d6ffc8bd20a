// Impulses that the arms transmit in an impact: at joints, on the base, on every body; brakes.
import { element } from "../dom";
import { number } from "../format";
import type { ImpactReport } from "../summary_types";
import { list, num, size, text, withUnit, type Partly } from "./read";
import { changeText, fold, pairs, table, vectorCell, type Cell, type Column } from "./table";

export function jointPart(impact: Partly<ImpactReport>): HTMLElement[] {
  const result: HTMLElement[] = [];
  const joints = list(impact.joints);
  const peaks = joints.some((joint) => num(joint.peak_force));
  const columns: Column[] = [
    { head: "Joint" },
    { head: "Impulse", unit: "N s", numeric: true },
    { head: "Angular impulse", unit: "N m s", numeric: true },
    { head: "Along its axis", unit: "N m s; N s", numeric: true },
    ...(peaks
      ? [
          { head: "Peak force", unit: "N", numeric: true },
          { head: "Peak moment", unit: "N m", numeric: true },
          { head: "Peak driving", unit: "N m; N", numeric: true },
        ]
      : []),
    { head: "Change of rate", unit: "rad/s; m/s", numeric: true },
  ];
  const names = list(impact.joint_names);
  const rows = joints.map((joint): Cell[] => {
    const change = list(impact.joint_velocity_change)[names.indexOf(text(joint.joint))];
    return [
      text(joint.joint),
      number(size(joint.impulse)),
      number(size(joint.angular_impulse)),
      number(num(joint.along_axis), 3),
      ...(peaks
        ? [number(num(joint.peak_force)), number(num(joint.peak_moment)), number(num(joint.peak_driving))]
        : []),
      number(num(change)),
    ];
  });
  if (rows.length > 0)
    result.push(
      fold(
        `Joints: transmitted impulses (${rows.length})`,
        table("Joint impulses, from parent to child, at the joint", columns, rows),
      ),
    );
  const reaction = impact.base_reaction;
  if (reaction) {
    result.push(
      pairs([
        ["reaction on the base: impulse", changeText(reaction.impulse, "N s")],
        ["angular impulse about its origin", changeText(reaction.angular_impulse, "N m s")],
      ]),
    );
  }
  const bodies = list(impact.body_impulses).map((body): Cell[] => [
    text(body.body),
    number(size(body.impulse)),
    vectorCell(body.impulse),
    number(size(body.angular_impulse)),
    vectorCell(body.angular_impulse),
  ]);
  if (bodies.length > 0) {
    const heads: Column[] = [
      { head: "Body" },
      { head: "Impulse", unit: "N s", numeric: true },
      { head: "Vector", unit: "N s" },
      { head: "Angular impulse", unit: "N m s", numeric: true },
      { head: "about its centre of mass", unit: "N m s" },
    ];
    result.push(fold(`Bodies: total impulses (${bodies.length})`, table("Impulses per body", heads, bodies)));
  }
  const held = list(impact.held_joints).map((joint): Cell[] => [
    text(joint.joint),
    number(num(joint.impulse)),
    number(num(joint.work)),
  ]);
  if (held.length > 0)
    result.push(
      table(
        "Joints held by brakes or drives",
        [
          { head: "Joint" },
          { head: "Impulse", unit: "N m s; N s", numeric: true },
          { head: "Work", unit: "J", numeric: true },
        ],
        held,
      ),
    );
  return result;
}

export function brake(impact: Partly<ImpactReport>): HTMLElement[] {
  const one = impact.brake;
  if (!one) return [];
  const rows = list(one.joints).map((joint, i): Cell[] => [
    text(joint),
    number(num(list(one.impulse)[i])),
  ]);
  const grasps = list(one.grasps).map((grasp): Cell[] => [
    text(grasp.end_effector),
    number(num(grasp.impulse_magnitude)),
    vectorCell(grasp.impulse),
    vectorCell(grasp.angular_impulse),
  ]);
  return [
    element("h3", {}, "Brakes after the grasp"),
    pairs([
      ["kinetic energy", `${number(num(one.kinetic_energy_before))} → ${withUnit(num(one.kinetic_energy_after), "J")}`],
      ["base: change of rate", changeText(one.base_angular_velocity_change, "rad/s")],
      ["base: change of velocity", changeText(one.base_velocity_change, "m/s")],
    ]),
    grasps.length > 0
      ? table(
          "Impulses on the grasps because of the brakes",
          [
            { head: "End-effector" },
            { head: "Impulse", unit: "N s", numeric: true },
            { head: "Vector", unit: "N s" },
            { head: "Angular impulse", unit: "N m s" },
          ],
          grasps,
        )
      : element("span"),
    fold(
      "Impulse per joint",
      table("Brake impulses", [{ head: "Joint" }, { head: "Impulse", unit: "N m s; N s", numeric: true }], rows),
    ),
  ];
}
