// Plots of joints, arm by arm: angles, rates, tracking errors, motor torques, friction.
import { lineStyle } from "../colors";
import { columnHead, label } from "../format";
import type { Series } from "../run";
import { arms, shortJoint, type Arm } from "./arms";
import { column, componentLine, derivedLine, isZero, take, type Context } from "./lines";
import type { Limit, PlotSpec } from "./spec";

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
    const limits = jointLimits(context, series, quantity.path, joints.map((joint) => ({ ...joint, label: shortJoint(joint.name, arm) })));
    return [{ id, group: quantity.group, title: `${title}, ${arm.name}`, axis: label(axis, unit), unit, lines, limits }];
  });
}

const kMaxLimits = 3; // lines per side of a plot

// The limits of joints that a series comes closest to, above and below: equal ones are one line.
function jointLimits(context: Context, series: Series, path: string, joints: { name: string; label: string; index: number }[]): Limit[] {
  const key = kLimitKeys[path];
  const known = context.run.scene?.limits?.joints;
  if (!key || !Array.isArray(known)) return [];
  const sides = [true, false].map((upper) => {
    const found = joints.flatMap((joint): Near[] => {
      const limits = known.find((one) => one.joint === joint.name);
      const bound = limits?.[upper ? key[0] : key[1]];
      if (typeof bound !== "number" || !Number.isFinite(bound)) return [];
      const value = upper || key[0] !== key[1] ? bound : -bound;
      return [{ label: joint.label, value, room: roomTo(series, joint.index, value, upper) }];
    });
    return nearest(found, joints.length);
  });
  return sides.flat();
}

const kLimitKeys: Record<string, readonly [upper: "upper" | "rate" | "effort", lower: "lower" | "rate" | "effort"] | undefined> = {
  "joints/position": ["upper", "lower"],
  "joints/velocity": ["rate", "rate"],
  "joints/effort": ["effort", "effort"],
};

interface Near {
  label: string;
  value: number;
  room: number; // smallest distance of the series from the limit; negative beyond it
}

function roomTo(series: Series, index: number, value: number, upper: boolean): number {
  let room = Infinity;
  for (let i = index; i < series.data.length; i += series.width) {
    const left = upper ? value - series.data[i] : series.data[i] - value;
    if (left < room) room = left;
  }
  return room;
}

function nearest(found: Near[], joints: number): Limit[] {
  const values = [...new Set([...found].sort((a, b) => a.room - b.room).map((one) => one.value))].slice(0, kMaxLimits);
  return values.map((value) => {
    const names = found.filter((one) => one.value === value).map((one) => one.label);
    return { label: names.length === joints ? "limit" : `limit of ${names.join(", ")}`, value };
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
