// The plots that a run offers, given its series. Nothing is drawn or computed here.
import { lineStyle } from "../colors";
import { NamedRoles, roleStyles } from "../roles";
import type { Run, Series } from "../run";
import { label } from "../format";
import { controlPlots } from "./catalog_control";
import { armPlots } from "./catalog_joints";
import { overviewOf } from "./catalog_key";
import { kPlainGroups, otherPlots, plainPlots } from "./catalog_plain";
import { touchPlots } from "./catalog_contacts";
import { contactPlots, endEffectorPlots, loopPlots } from "./catalog_grasps";
import { rotationVectors, turnBetween } from "./kinematics";
import {
  axisStyle,
  column,
  componentLine,
  components,
  derivedLine,
  isZero,
  kAxes,
  take,
  vectorLines,
  type Context,
} from "./lines";
import { lazily, type PlotSpec } from "./spec";

// In the order of a capture: motion, contact, results.
const kGroups = [
  "Joints",
  "End-effectors",
  "Grasp loads",
  "Contacts",
  "Momentum",
  "Base",
  "Energy",
  "Torques",
  "Control",
  "Sensors",
  "Loops",
  "Clearance",
  "Targets",
  ...kPlainGroups,
  "Other",
];

// The overview first; `absent`: missing plots, with reasons.
export interface Catalog {
  plots: PlotSpec[];
  absent: string[];
}

export function plotsOf(run: Run, index: number): Catalog {
  const context: Context = { run, index, planar: run.scene?.planar ?? false, used: new Set(), roles: new NamedRoles(run.scene) };
  const known = [
    ...armPlots(context),
    ...endEffectorPlots(context),
    ...contactPlots(context),
    ...touchPlots(context),
    ...momentumPlots(context),
    ...basePlots(context),
    ...targetPlots(context),
    ...energyPlots(context),
    ...controlPlots(context),
    ...loopPlots(context),
    ...clearancePlots(context),
    ...plainPlots(context),
  ];
  const all = [...known, ...otherPlots(context)].filter((plot) => plot.lines.length > 0);
  const overview = overviewOf(context, all);
  const first = new Set(overview.plots.map((plot) => plot.id));
  const rest = all.filter((plot) => !first.has(plot.id));
  return { plots: [...overview.plots, ...kGroups.flatMap((group) => rest.filter((plot) => plot.group === group))], absent: overview.absent };
}

export function targetNames(run: Run): string[] {
  const names = run.all().map((series) => /^targets\/(.+)\/position$/.exec(series.path)?.[1]);
  return names.filter((name) => name !== undefined);
}

function momentumPlots(context: Context): PlotSpec[] {
  const result: PlotSpec[] = [];
  for (const [kind, rotation, unit] of [
    ["linear", false, "N s"],
    ["angular", true, "N m s"],
  ] as const) {
    const total = take(context, `system/${kind}_momentum`);
    const bodies = [
      { name: "robot", role: "robot", series: take(context, `robot/${kind}_momentum`) },
      ...targetNames(context.run).map((name) => ({
        name,
        role: context.roles.target(name),
        series: take(context, `targets/${name}/${kind}_momentum`),
      })),
    ];
    for (const c of components(context, rotation)) {
      const style = roleStyles();
      const lines = bodies.flatMap(({ name, role, series }) =>
        series ? [componentLine(context, series, c, { label: name, ...style(role) })] : [],
      );
      if (total)
        lines.push(componentLine(context, total, c, { label: "total", color: "ink", width: 2.2, dash: [7, 3] }));
      result.push({
        id: `momentum-${kind}-${kAxes[c]}`,
        group: "Momentum",
        title: `${kind === "linear" ? "Linear" : "Angular"} momentum, ${kAxes[c]}`,
        axis: label(`${kind} momentum ${kAxes[c]}`, unit),
        unit,
        lines,
        note: rotation ? "About the system's centre of mass, in W." : undefined,
      });
    }
  }
  return result;
}

function basePlots(context: Context): PlotSpec[] {
  const attitude = take(context, "base/quaternion_wxyz");
  const plots: PlotSpec[] = [];
  if (attitude) {
    const vectors = lazily(() => rotationVectors(attitude.data));
    const lines = components(context, true).map((c) =>
      derivedLine(
        context,
        `base/rotation_vector/${kAxes[c]}`,
        "rad",
        { label: context.planar ? "angle" : kAxes[c], ...axisStyle(c) },
        () => column(vectors(), 3, c),
      ),
    );
    plots.push({
      id: "base-attitude",
      group: "Base",
      title: context.planar ? "Base angle" : "Base attitude",
      axis: label(context.planar ? "angle about z" : "rotation vector", "rad"),
      unit: "rad",
      lines,
      note: context.planar
        ? undefined
        : "Rotation vector from W to the base: unit axis times angle, in W; full turns are counted on.",
    });
  }
  if (attitude && context.run.series("base/control_torque")) plots.push(pointingPlot(context, attitude));
  const vectorPlot = (path: string, title: string, axis: string, rotation: boolean): void => {
    const series = take(context, path);
    if (!series) return;
    const lines = vectorLines(context, series, rotation);
    plots.push({
      id: path.replace(/\//g, "-"),
      group: "Base",
      title,
      axis: label(axis, series.unit),
      unit: series.unit,
      lines,
    });
  };
  vectorPlot("base/angular_velocity", "Base rate", "base rate", true);
  vectorPlot("base/position", "Base position", "base position", false);
  vectorPlot("base/velocity", "Base velocity", "base velocity", false);
  return plots;
}

// With attitude control: the angle from the attitude at the start, which the control keeps unless another is commanded.
function pointingPlot(context: Context, attitude: Series): PlotSpec {
  const angles = (): Float64Array => {
    const first = [...attitude.data.subarray(0, 4)];
    return Float64Array.from({ length: attitude.data.length / 4 }, (_, i) => turnBetween(first, attitude.data.subarray(4 * i, 4 * i + 4)));
  };
  const line = derivedLine(context, "base/pointing_error", "rad", { label: "angle from the initial attitude", color: "base" }, angles);
  return {
    id: "base-pointing",
    group: "Base",
    title: "Pointing error of the base",
    axis: label("angle", "rad"),
    unit: "rad",
    lines: [line],
    note: "Angle between the base's attitude and that at the start of the run.",
  };
}

function targetPlots(context: Context): PlotSpec[] {
  const names = targetNames(context.run);
  const plot = (name: string, path: string, title: string, rotation: boolean): PlotSpec[] => {
    const series = take(context, `targets/${name}/${path}`);
    if (!series) return [];
    const id = `target-${name}-${path}`;
    const axis = label(title.toLowerCase(), series.unit);
    return [
      {
        id,
        group: "Targets",
        title: `${title}, ${name}`,
        axis,
        unit: series.unit,
        lines: vectorLines(context, series, rotation),
      },
    ];
  };
  return names.flatMap((name) => {
    context.used.add(`targets/${name}/position`).add(`targets/${name}/quaternion_wxyz`);
    return [
      ...plot(name, "angular_velocity", "Target rate", true),
      ...plot(name, "velocity", "Target velocity", false),
    ];
  });
}

function clearancePlots(context: Context): PlotSpec[] {
  const series = take(context, "clearance/minimum");
  if (!series) return [];
  return [
    {
      id: "clearance",
      group: "Clearance",
      title: "Minimum clearance",
      axis: label("distance", series.unit),
      unit: series.unit,
      lines: [componentLine(context, series, 0, { label: "minimum over all bodies", ...lineStyle(0) })],
      note: "Distance between the bodies' shapes; negative if they overlap.",
    },
  ];
}

function energyPlots(context: Context): PlotSpec[] {
  const wanted: [string, string][] = [
    ["system/kinetic_energy", "kinetic energy"],
    ["system/motor_work", "work of the motors"],
    ["system/friction_work", "work of joint friction"],
    ["system/external_work", "external work"],
  ];
  const lines = wanted.flatMap(([path, name], i) => {
    const series = take(context, path);
    if (!series || (i > 1 && isZero(series))) return [];
    return [
      componentLine(
        context,
        series,
        0,
        i === 0 ? { label: name, color: "ink", width: 2 } : { label: name, ...lineStyle(i - 1) },
      ),
    ];
  });
  const zero = wanted.slice(2).filter(([path]) => isZero(context.run.series(path)) && context.run.series(path));
  const note = `Work: since the start.${zero.length > 0 ? ` Zero throughout: ${zero.map(([, name]) => name).join(", ")}.` : ""}`;
  const kinetic = lines
    .filter((line) => line.key === "system/kinetic_energy")
    .map((line) => ({ ...line, label: "kinetic energy" }));
  const plots: PlotSpec[] = [
    {
      id: "kinetic-energy",
      group: "Energy",
      title: "Kinetic energy",
      axis: label("kinetic energy", "J"),
      unit: "J",
      lines: kinetic,
      note: "Of all bodies, including rotors.",
    },
    {
      id: "energy",
      group: "Energy",
      title: "Energy and work",
      axis: label("energy, work", "J"),
      unit: "J",
      lines,
      note,
    },
  ];
  return [...plots, ...externalPlots(context)];
}

// Impulses of external forces, if any.
function externalPlots(context: Context): PlotSpec[] {
  const plots: PlotSpec[] = [];
  for (const [path, title, rotation] of [
    ["system/external_impulse", "External impulse", false],
    ["system/external_angular_impulse", "External angular impulse", true],
  ] as const) {
    const series = take(context, path);
    if (!series || isZero(series)) continue;
    const axis = label(title.toLowerCase(), series.unit);
    plots.push({
      id: path.replace(/\//g, "-"),
      group: "Energy",
      title,
      axis,
      unit: series.unit,
      lines: vectorLines(context, series, rotation),
    });
  }
  return plots;
}
