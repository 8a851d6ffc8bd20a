// Plots of end-effectors and their grasps: motion against the grasp points', distances, loads, closure of loops.
import type { Vec3 } from "../data";
import { label } from "../format";
import { checkOf } from "../page/facts";
import { roleStyles } from "../roles";
import type { PhaseSpan, Run } from "../run";
import {
  axisStyle,
  column,
  componentLine,
  components,
  derivedLine,
  isZero,
  kAxes,
  magnitudeLine,
  take,
  type Context,
} from "./lines";
import { pointVelocities } from "./kinematics";
import { lazily, type Line, type PlotSpec } from "./spec";

function names(run: Run, group: string): string[] {
  const found = run.all().map((series) => new RegExp(`^${group}/(.+)/[^/]+$`).exec(series.path)?.[1]);
  return [...new Set(found.filter((name) => name !== undefined))];
}

interface Grasp {
  target: string;
  grasp_point: string;
  position: Vec3; // of the grasp point in the target's frame
}

// What an end-effector is to grasp, by the scene.
function graspOf(run: Run, endEffector: string): Grasp | null {
  const grasp = run.scene?.grasps?.find((one) => one.end_effector === endEffector);
  const point = run.scene?.grasp_points?.find((one) => one.target === grasp?.target && one.name === grasp?.grasp_point);
  return grasp && point ? { target: grasp.target, grasp_point: grasp.grasp_point, position: point.position } : null;
}

// Velocity of its grasp point; null: not known.
function graspPointVelocity(context: Context, endEffector: string): (() => Float64Array) | null {
  const grasp = graspOf(context.run, endEffector);
  if (!grasp) return null;
  const [velocity, rate, attitude] = ["velocity", "angular_velocity", "quaternion_wxyz"].map((name) =>
    context.run.series(`targets/${grasp.target}/${name}`),
  );
  if (!velocity || !rate || !attitude) return null;
  return lazily(() => pointVelocities(velocity.data, rate.data, attitude.data, grasp.position));
}

export function endEffectorPlots(context: Context): PlotSpec[] {
  const all = names(context.run, "end_effectors");
  return [
    ...all.flatMap((name) => velocityPlots(context, name)),
    ...closingPlots(context, all),
    ...distancePlot(context),
  ];
}

function velocityPlots(context: Context, name: string): PlotSpec[] {
  const grasp = graspOf(context.run, name);
  context.used.add(`end_effectors/${name}/position`);
  return [false, true].flatMap((rotation) => {
    const series = take(context, `end_effectors/${name}/${rotation ? "angular_velocity" : "velocity"}`);
    if (!series) return [];
    const rate = grasp && context.run.series(`targets/${grasp.target}/angular_velocity`);
    const other = rotation ? rate && (() => Float64Array.from(rate.data)) : graspPointVelocity(context, name);
    const lines = components(context, rotation).flatMap((c): Line[] => {
      const style = axisStyle(c);
      const own = componentLine(context, series, c, { label: kAxes[c], ...style });
      if (!other || !grasp) return [own];
      const of = rotation ? "target" : "grasp point";
      const key = rotation
        ? `targets/${grasp.target}/angular_velocity/${kAxes[c]}`
        : `grasps/${name}/grasp_point_velocity/${kAxes[c]}`;
      return [
        own,
        derivedLine(
          context,
          key,
          series.unit,
          { label: `${kAxes[c]} of ${of}`, ...style, dash: [5, 3], width: 1.3 },
          () => column(other(), 3, c),
        ),
      ];
    });
    const what = rotation ? "Angular velocity" : "Velocity";
    const against = grasp
      ? rotation
        ? `and of ${grasp.target}`
        : `and of grasp point ${grasp.grasp_point} on ${grasp.target}`
      : "";
    return [
      {
        id: `end-effector-${rotation ? "rate" : "velocity"}-${name}`,
        group: "End-effectors",
        title: `${what}, ${name}`,
        axis: label(what.toLowerCase(), series.unit),
        unit: series.unit,
        lines,
        note: grasp ? `Solid: end-effector; dashed: ${against.slice(4)}. In W.` : undefined,
      },
    ];
  });
}

// How fast the end-effectors move against their grasp points.
function closingPlots(context: Context, all: string[]): PlotSpec[] {
  const style = roleStyles();
  const lines = all.flatMap((name) => {
    const series = context.run.series(`end_effectors/${name}/velocity`);
    const point = graspPointVelocity(context, name);
    if (!series || !point) return [];
    const values = (): Float64Array => {
      const other = point();
      return Float64Array.from({ length: other.length / 3 }, (_, k) =>
        Math.hypot(
          series.data[3 * k] - other[3 * k],
          series.data[3 * k + 1] - other[3 * k + 1],
          series.data[3 * k + 2] - other[3 * k + 2],
        ),
      );
    };
    return [
      derivedLine(context, `grasps/${name}/relative_speed`, series.unit, { label: name, ...style(context.roles.endEffector(name)) }, values),
    ];
  });
  return [
    {
      id: "relative-speed",
      group: "End-effectors",
      title: "Speed against the grasp points",
      axis: label("relative speed", "m/s"),
      unit: "m/s",
      lines,
      note: "Of each end-effector's origin against its own grasp point.",
    },
  ];
}

function distancePlot(context: Context): PlotSpec[] {
  const style = roleStyles();
  const lines = names(context.run, "grasps").flatMap((name) => {
    const series = take(context, `grasps/${name}/distance`);
    return series ? [componentLine(context, series, 0, { label: name, ...style(context.roles.endEffector(name)) })] : [];
  });
  return [
    {
      id: "grasp-distance",
      group: "End-effectors",
      title: "Distance to the grasp points",
      axis: label("distance", "m"),
      unit: "m",
      lines,
    },
  ];
}

// Loads on grasps while they hold; for a compliant impact also during the impact.
export function contactPlots(context: Context): PlotSpec[] {
  const all = names(context.run, "grasps");
  const magnitudePlot = (quantity: "force" | "moment"): PlotSpec => {
    const unit = quantity === "force" ? "N" : "N m";
    const style = roleStyles();
    const lines = all.flatMap((name) => {
      const series = take(context, `grasps/${name}/${quantity}`);
      context.used.add(`grasps/${name}/holds`);
      return series && !isZero(series) ? [magnitudeLine(context, series, { label: name, ...style(context.roles.endEffector(name)) })] : [];
    });
    return {
      id: `grasp-${quantity}`,
      group: "Grasp loads",
      title: `Grasp ${quantity}`,
      axis: label(`magnitude of the ${quantity}`, unit),
      unit,
      lines,
      note: "What the grasps pass on while they hold, besides impulses that take no time.",
    };
  };
  const plots = [magnitudePlot("force"), magnitudePlot("moment")];
  const during = context.run.phases.filter((phase) => /^contact(_\d+)?$/.test(phase.name) && phase.end > phase.begin);
  return [...plots, ...during.flatMap((phase, k) => historyPlots(context, all, phase, k))];
}

// Nothing but the samples of a phase: those of its neighbours have the same times where it begins and ends.
function within(line: Line, phase: PhaseSpan): Line {
  return {
    ...line,
    values: lazily(() => line.values().map((value, i) => (i >= phase.first && i <= phase.last ? value : NaN))),
  };
}

function historyPlots(context: Context, all: string[], phase: PhaseSpan, k: number): PlotSpec[] {
  return (["force", "moment"] as const).map((quantity) => {
    const unit = quantity === "force" ? "N" : "N m";
    const style = roleStyles();
    const lines = all.flatMap((name) => {
      const series = context.run.series(`grasps/${name}/${quantity}`);
      if (!series || isZero(series)) return [];
      const parts = [0, 1, 2].map((c) =>
        componentLine(context, series, c, {
          label: `${name} ${kAxes[c]}`,
          color: context.roles.endEffector(name),
          dash: [
            [5, 2],
            [2, 2],
            [7, 2, 2, 2],
          ][c],
          width: 1,
          hidden: true,
        }),
      );
      return [
        magnitudeLine(context, series, { label: `${name} magnitude`, ...style(context.roles.endEffector(name)), width: 1.8 }),
        ...parts,
      ].map((line) => within(line, phase));
    });
    return {
      id: `${phase.name}-${quantity}-${k}`,
      group: "Grasp loads",
      title: `Contact ${quantity} history`,
      axis: label(`contact ${quantity}`, unit),
      unit,
      lines,
      window: [phase.begin, phase.end] as [number, number],
      note: `The phase ${phase.name} only, on the robot, in W. Components: switch on in the legend.`,
    };
  });
}

export function loopPlots(context: Context): PlotSpec[] {
  const all = names(context.run, "loops");
  return (
    [
      ["position_defect", "m", "Loop closure, position"],
      ["angle_defect", "rad", "Loop closure, angle"],
    ] as const
  ).map(([path, unit, title]) => {
    const silent: string[] = [];
    const style = roleStyles();
    const lines = all.flatMap((name) => {
      const series = take(context, `loops/${name}/${path}`);
      if (series && isZero(series)) silent.push(name);
      return series && !isZero(series) ? [componentLine(context, series, 0, { label: name, ...style(context.roles.endEffector(name)) })] : [];
    });
    if (lines.length > 0) lines.push(...boundLine(context, `loop_closure_${path.split("_")[0]}`, unit));
    const none = silent.length > 0 ? ` Closes none, or zero: ${silent.join(", ")}.` : "";
    return {
      id: `loop-${path}`,
      group: "Loops",
      title,
      axis: label(path.replace("_", " "), unit),
      unit,
      lines,
      log: true,
      note: `After projection; what is zero (no loop closed, or nothing left) or below the axis lies on its bottom.${none}`,
    };
  });
}

// The ledger's bound, to see how far below it everything stays.
function boundLine(context: Context, row: string, unit: string): Line[] {
  const bound = checkOf(context.run.summary, row)?.bound;
  if (typeof bound !== "number" || !(bound > 0)) return [];
  const options = { label: "bound", color: "ink", dash: [2, 3], width: 1 };
  return [
    derivedLine(context, `ledger/${row}/bound`, unit, options, () => new Float64Array(context.run.samples).fill(bound)),
  ];
}
