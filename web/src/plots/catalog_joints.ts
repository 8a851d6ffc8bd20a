// Plots of joints, arm by arm: angles, rates, tracking errors, motor torques, friction.
import { lineStyle } from "../colors";
import { columnHead, label } from "../format";
import type { Series } from "../run";
import { arms, shortJoint, type Arm } from "./arms";
import { column, componentLine, derivedLine, isZero, take, type Context } from "./lines";
import type { PlotSpec } from "./spec";

type Words = [title: string, axis: string, unit: string];
interface Quantity {
  path: string;
  group: string;
  turning: Words;
  sliding: Words;
}

const kQuantities: Quantity[] = [
  { path: "joints/position", group: "Joints", turning: ["Joint angles", "joint angle", "rad"], sliding: ["Joint positions", "joint position", "m"] },
  { path: "joints/velocity", group: "Joints", turning: ["Joint rates", "joint rate", "rad/s"], sliding: ["Joint speeds", "joint speed", "m/s"] },
  { path: "joints/effort", group: "Torques", turning: ["Joint torques", "motor torque", "N m"], sliding: ["Joint forces", "motor force", "N"] },
  { path: "joints/reaction_force", group: "Torques", turning: ["Force passed on by joints", "reaction force", "N"], sliding: ["Force passed on by sliding joints", "reaction force", "N"] },
  { path: "joints/reaction_moment", group: "Torques", turning: ["Moment passed on by joints", "reaction moment", "N m"], sliding: ["Moment passed on by sliding joints", "reaction moment", "N m"] },
  { path: "joints/friction", group: "Torques", turning: ["Joint friction", "friction torque", "N m"], sliding: ["Joint friction", "friction force", "N"] },
];

export function armPlots(context: Context): PlotSpec[] {
  const positions = context.run.series("joints/position") ?? context.run.series("joints/velocity");
  if (!positions) return [];
  const all = arms(positions.components, context.run.scene);
  const motion = kQuantities.filter((quantity) => quantity.group === "Joints");
  const torques = kQuantities.filter((quantity) => quantity.group === "Torques");
  const of = (quantities: Quantity[]) =>
    all.flatMap((arm) => quantities.flatMap((quantity) => quantityPlots(context, arm, quantity)));
  return [...of(motion), ...trackingPlots(context, all), ...of(torques)];
}

function quantityPlots(context: Context, arm: Arm, quantity: Quantity): PlotSpec[] {
  const series = take(context, quantity.path);
  if (!series || (quantity.path === "joints/friction" && isZero(series))) return [];
  return [false, true].flatMap((sliding) => {
    const joints = arm.joints.filter((joint) => joint.sliding === sliding && joint.index < series.width);
    const [title, axis, unit] = sliding ? quantity.sliding : quantity.turning;
    if (joints.length === 0) return [];
    const lines = joints.map((joint, i) => {
      const line = componentLine(context, series, joint.index, { label: shortJoint(joint.name, arm), ...lineStyle(i) });
      return { ...line, unit, column: columnHead(line.key, unit) };
    });
    const id = `${quantity.path.replace("/", "-")}-${arm.name}${sliding ? "-sliding" : ""}`;
    return [{ id, group: quantity.group, title: `${title}, ${arm.name}`, axis: label(axis, unit), unit, lines }];
  });
}

// Tracking errors of the joint angles; no values without a reference.
function trackingPlots(context: Context, all: Arm[]): PlotSpec[] {
  const position = context.run.series("joints/position");
  const reference = take(context, "joints/reference_position");
  take(context, "joints/reference_velocity");
  if (!position || !reference || reference.width !== position.width) return [];
  return all.flatMap((arm) => {
    const joints = arm.joints.filter((joint) => !joint.sliding && follows(reference, joint.index));
    if (joints.length === 0) return [];
    const lines = joints.map((joint, i) =>
      derivedLine(
        context,
        `joints/tracking_error/${joint.name}`,
        "rad",
        { label: shortJoint(joint.name, arm), ...lineStyle(i) },
        () => {
          const is = column(position.data, position.width, joint.index);
          const wanted = column(reference.data, reference.width, joint.index);
          return is.map((value, k) => value - wanted[k]);
        },
      ),
    );
    const note =
      "Joint angle minus the reference that the controller follows; no line where it follows none. Series are stored in single precision.";
    return [
      {
        id: `joints-tracking-${arm.name}`,
        group: "Joints",
        title: `Tracking error, ${arm.name}`,
        axis: label("angle − reference", "rad"),
        unit: "rad",
        lines,
        note,
      },
    ];
  });
}

function follows(reference: Series, joint: number): boolean {
  for (let i = joint; i < reference.data.length; i += reference.width)
    if (Number.isFinite(reference.data[i])) return true;
  return false;
}
