// Impulses that the arms transmit in an impact: at joints, on the base, on every body; brakes.
import { element } from "../dom";
import { number } from "../format";
import { kBaseReaction, kBodyImpulse, kBrakeGrasp, kBrakeReport, kHardContactImpulse, kHeldJoint, kJointImpulse, type FieldNote, type ImpactReport } from "../summary_types";
import { describedPairs, describedTable, without } from "./described";
import { list, num, text, type Partly } from "./read";
import { fold, table, type Cell } from "./table";

const kRate: FieldNote = ["change_of_rate", "rad/s or m/s", "change of the joint's rate"];

export function jointPart(impact: Partly<ImpactReport>): HTMLElement[] {
  const [names, changes] = [list(impact.joint_names), list(impact.joint_velocity_change)];
  const joints = list(impact.joints).map((joint) => ({ ...joint, change_of_rate: changes[names.indexOf(text(joint.joint))] }));
  const peaks = joints.some((joint) => num(joint.peak_force));
  const notes = [...kJointImpulse.filter(([key]) => peaks || !key.startsWith("peak_")), kRate];
  const bodies = list(impact.body_impulses);
  return [
    ...(joints.length > 0
      ? [fold(`Joints: transmitted impulses (${joints.length})`, ...describedTable("Joint impulses, from parent to child, at the joint", notes, joints, { sizes: true }))]
      : []),
    ...(impact.base_reaction ? [element("h3", {}, "Reaction on the base"), ...describedPairs(kBaseReaction, impact.base_reaction)] : []),
    ...(bodies.length > 0 ? [fold(`Bodies: total impulses (${bodies.length})`, ...describedTable("Impulses per body", kBodyImpulse, bodies))] : []),
    ...describedTable("Joints held by brakes or drives", kHeldJoint, list(impact.held_joints)),
    ...describedTable("Hard contacts in the impact", kHardContactImpulse, list(impact.hard_contacts)),
  ];
}

export function brake(impact: Partly<ImpactReport>): HTMLElement[] {
  const one = impact.brake;
  if (!one) return [];
  const rows = list(one.joints).map((joint, i): Cell[] => [text(joint), number(num(list(one.impulse)[i]))]);
  return [
    element("h3", {}, "Brakes after the grasp"),
    ...describedPairs(without(kBrakeReport, "joints", "impulse"), one),
    ...describedTable("Impulses on the grasps because of the brakes", kBrakeGrasp, list(one.grasps)),
    fold(
      "Impulse per joint",
      table("Brake impulses", [{ head: "Joint" }, { head: "Impulse", unit: "N m s; N s", numeric: true }], rows),
    ),
  ];
}
