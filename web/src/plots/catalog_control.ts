// Plots of base control: torque, reaction wheels against their limits, gyros and thrusters; and of sensor readings.
import { label } from "../format";
import { list, num } from "../page/read";
import { column, componentLine, derivedLine, take, vectorLines, type Context } from "./lines";
import type { Limit, Line, PlotSpec } from "./spec";

export function controlPlots(context: Context): PlotSpec[] {
  return [...torquePlot(context), ...wheelPlots(context), ...gyroPlots(context), ...sensorPlots(context)];
}

// Grouped by the last part of the series' path.
const kRead: Record<string, [title: string, axis: string]> = {
  measured_position: ["Position as read", "position"],
  measured_velocity: ["Rates that the laws see", "rate"],
  measured_angular_velocity: ["Angular velocity as read", "angular velocity"],
  measured_rate: ["Rates as read", "rate"],
  measured_force: ["Force as read", "force"],
  measured_torque: ["Torque as read", "torque"],
};

function sensorPlots(context: Context): PlotSpec[] {
  return context.run.all().flatMap((known): PlotSpec[] => {
    const parts = known.path.split("/"), words = kRead[parts[parts.length - 1]];
    const series = words && take(context, known.path);
    if (!series) return [];
    const of = parts.length > 2 ? parts[1] : parts[0];
    const isVector = series.components.join() === "x,y,z";
    const lines = isVector
      ? vectorLines(context, series, /angular|torque/.test(known.path))
      : series.components.map((name, k) => componentLine(context, series, k, { label: name, color: `step ${k}` }));
    return [{ id: known.path.replace(/\//g, "-"), group: "Sensors", title: `${words[0]}, ${of}`, axis: label(words[1], series.unit), unit: series.unit, lines, note: series.description }];
  });
}

function torquePlot(context: Context): PlotSpec[] {
  const torque = take(context, "base/control_torque");
  if (!torque) return [];
  const rated = list(context.run.summary?.loads).filter((one) => one.of === "base control");
  const limits = common(rated.map((one) => num(one.rating)), "limit");
  return [
    {
      id: "base-control_torque",
      group: "Control",
      title: "Control torque on the base",
      axis: label("torque", torque.unit),
      unit: torque.unit,
      lines: vectorLines(context, torque, true),
      limits,
      note: "In the base's axes.",
    },
  ];
}

function wheelPlots(context: Context): PlotSpec[] {
  const reports = list(context.run.summary?.wheels);
  const plot = (path: string, title: string, axis: string, limits: Limit[], note?: string) => plotOfAll(context, path, title, axis, limits, note);
  return [
    ...plot("wheels/rate", "Wheel rates", "rate relative to the base", common(reports.map((one) => num(one.rate_limit)), "largest rate")),
    ...plot("wheels/momentum", "Wheel momentum", "inertia times rate", []),
    ...capacityPlot(context),
    ...plot("thrusters/impulse", "Impulse of thrusters", "impulse since the start", []),
    ...plot("thrusters/force", "Thrusters at the samples", "force", [], "At the samples: a pulse that is shorter than their interval is missed, or seems to last."),
    ...plot("thrusters/propellant", "Propellant used", "propellant", []),
    ...plot("wheels/torque", "Wheel motors", "torque", common(reports.map((one) => num(one.torque_limit)), "largest torque")),
  ];
}

function gyroPlots(context: Context): PlotSpec[] {
  const gyros = context.run.summary?.gyros;
  const reports = list(gyros?.each);
  const near = num(gyros?.near);
  const plot = (path: string, title: string, axis: string, limits: Limit[]) => plotOfAll(context, path, title, axis, limits);
  return [
    ...plot("gyros/angle", "Gimbal angles of the gyros", "angle", []),
    ...plot("gyros/rate", "Gimbal rates of the gyros", "rate relative to the base", common(reports.map((one) => num(one.rate_limit)), "largest rate")),
    ...plot("gyros/torque", "Gimbal motors of the gyros", "torque", common(reports.map((one) => num(one.torque_limit)), "largest torque")),
    ...plot("gyros/singularity_measure", "Singularity measure of the gyros", "measure", near === null ? [] : [{ label: "near a singularity", value: near }]),
  ];
}

// One line for each actuator of an array.
function plotOfAll(context: Context, path: string, title: string, axis: string, limits: Limit[], note?: string): PlotSpec[] {
  const series = take(context, path);
  if (!series) return [];
  const lines = series.components.map((name, k) => componentLine(context, series, k, { label: name, color: `step ${k}` }));
  return [{ id: path.replace("/", "-"), group: "Control", title, axis: label(axis, series.unit), unit: series.unit, lines, limits, note }];
}

// Wheels may differ: each relative to its own capacity.
function capacityPlot(context: Context): PlotSpec[] {
  const rate = take(context, "wheels/rate");
  if (!rate) return [];
  const lines = rate.components.flatMap((name, k): Line[] => {
    const limit = num(list(context.run.summary?.wheels).find((one) => one.name === name)?.rate_limit);
    if (limit === null || limit <= 0) return [];
    const share = () => column(rate.data, rate.width, k).map((value) => (100 * Math.abs(value)) / limit);
    return [derivedLine(context, `wheels/capacity_used/${name}`, "%", { label: name, color: `step ${k}` }, share)];
  });
  return [
    {
      id: "wheels-capacity_used",
      group: "Control",
      title: "Momentum of wheels against their capacity",
      axis: label("capacity used", "%"),
      unit: "%",
      lines,
      limits: [{ label: "saturated", value: 100 }],
    },
  ];
}

// A limit common to all, on both sides of zero; none if they differ.
function common(values: (number | null)[], text: string): Limit[] {
  const first = values[0];
  if (first === undefined || first === null || values.some((value) => value !== first)) return [];
  return [{ label: text, value: first }, { label: text, value: -first }];
}
