// The six plots that a report displays first, with the relevant limits: distance and relative speed at the grasp
// points, grasp force, base rate, clearance, energy, worst margin to a rating.
import { label } from "../format";
import { allImpacts } from "../page/facts";
import type { Run } from "../run";
import { derivedLine, isZero, type Context } from "./lines";
import { magnitudes } from "./kinematics";
import type { Limit, Line, PlotSpec } from "./spec";

export const kOverview = "Overview";

// Selects these six of all plots of a run, as far as available, with reasons for the missing ones.
export function overviewOf(context: Context, all: PlotSpec[]): { plots: PlotSpec[]; absent: string[] } {
  const absent: string[] = [];
  const plots: PlotSpec[] = [];
  const add = (plot: PlotSpec | undefined, otherwise: string): void => {
    if (plot && plot.lines.length > 0) plots.push({ ...plot, group: kOverview });
    else absent.push(otherwise);
  };
  const of = (id: string) => all.find((plot) => plot.id === id);
  add(closingPlot(context, of("grasp-distance"), of("relative-speed")), "distance and relative speed: there is no grasp");
  add(limited(of("grasp-force"), ratingLimits(context.run, "force")), "grasp force: no grasp carries any");
  add(of("base-angular_velocity"), "base rate: it is not recorded");
  add(limited(of("clearance"), clearanceLimit(context.run)), "clearance: it was not watched");
  add(of("energy"), "energy: it is not recorded");
  add(marginPlot(context), "worst margin: the robot has no ratings that a recorded load could be held against");
  return { plots, absent };
}

function limited(plot: PlotSpec | undefined, limits: Limit[]): PlotSpec | undefined {
  return plot && { ...plot, limits };
}

// ---- Distance and relative speed ----

function closingPlot(context: Context, distance?: PlotSpec, speed?: PlotSpec): PlotSpec | undefined {
  if (!distance || !speed || distance.lines.length === 0 || speed.lines.length === 0) return undefined;
  const left = distance.lines.map((line): Line => ({ ...line, label: `${line.label} distance` }));
  const right = speed.lines.map((line): Line => ({ ...line, label: `${line.label} speed`, dash: [4, 3], right: true }));
  return {
    id: "closing",
    group: kOverview,
    title: "Distance and relative speed",
    axis: label("distance", "m"),
    rightAxis: label("relative speed", "m/s"),
    unit: "m",
    lines: [...left, ...right],
    limits: envelopeLimits(context.run),
    note: "Of each end-effector's origin to its grasp point (solid, left), and its speed relative to that point (dashed, right).",
  };
}

function envelopeLimits(run: Run): Limit[] {
  const grasps = records(run.scene?.limits?.grasps).filter((grasp) => run.scene!.grasps.some((one) => one.end_effector === grasp.end_effector));
  return [
    ...merged(grasps.map((grasp) => ({ name: String(grasp.end_effector), value: grasp.position })), "allowed distance"),
    ...merged(grasps.map((grasp) => ({ name: String(grasp.end_effector), value: grasp.velocity })), "allowed speed").map((limit) => ({ ...limit, right: true })),
  ];
}

function clearanceLimit(run: Run): Limit[] {
  const required = run.scene?.limits?.clearance ?? records(run.summary?.clearance?.events)[0]?.required ?? 0;
  if (typeof required !== "number" || !Number.isFinite(required)) return [];
  return [{ label: required > 0 ? "required" : "contact", value: required }];
}

// ---- Ratings ----

interface Rated {
  of: string;
  quantity: string;
  rating: number;
}

// For all phases; for results of earlier versions, for the impacts.
export function ratingsOf(run: Run): Rated[] {
  const s = run.summary ?? {};
  const found = new Map<string, Rated>();
  for (const one of [...records(s.loads), ...allImpacts(s).flatMap((impact) => records(impact.margins))]) {
    if (typeof one.rating !== "number" || !(one.rating > 0)) continue;
    const rated = { of: String(one.of), quantity: String(one.quantity), rating: one.rating };
    found.set(`${rated.of}\n${rated.quantity}`, rated);
  }
  return [...found.values()];
}

function ratingLimits(run: Run, quantity: string): Limit[] {
  const own = ratingsOf(run).filter((one) => one.quantity === quantity && run.series(`grasps/${one.of}/${quantity}`));
  return merged(own.map(({ of, rating }) => ({ name: of, value: rating })), "rating");
}

// One line if all values are equal.
function merged(values: { name: string; value: unknown }[], what: string): Limit[] {
  const known = values.filter((one): one is { name: string; value: number } => typeof one.value === "number" && Number.isFinite(one.value));
  const distinct = [...new Set(known.map((one) => one.value))];
  return distinct.map((value) => {
    const names = known.filter((one) => one.value === value).map((one) => one.name);
    return { label: distinct.length === 1 ? what : `${what} of ${names.join(", ")}`, value };
  });
}

// ---- Worst margin ----

function marginPlot(context: Context): PlotSpec | undefined {
  const lines = [...sampledMargin(context), ...phaseMargin(context)];
  if (lines.length === 0) return undefined;
  const assumed = records(context.run.summary?.loads).some((one) => one.assumed_duration === true);
  return {
    id: "worst-margin",
    group: kOverview,
    title: "Worst margin to a rating",
    axis: label("margin", "%"),
    unit: "%",
    lines,
    limits: [{ label: "rating", value: 0 }],
    note:
      "Minimum of 1 − load / rating over all rated loads; below zero a rating is exceeded." +
      (assumed ? " Impacts: mean loads over an assumed duration; peaks may be larger." : ""),
  };
}

// For the loads in the time series, at every sample.
function sampledMargin(context: Context): Line[] {
  const { run } = context;
  const loads = ratingsOf(run).flatMap(({ of, quantity, rating }) => {
    const values = loadSeries(run, of, quantity);
    return values ? [{ values, rating }] : [];
  });
  if (loads.length === 0) return [];
  const options = { label: "at the samples", color: "step 1" };
  return [
    derivedLine(context, "worst_margin/sampled", "%", options, () => {
      const series = loads.map((load) => load.values());
      return Float64Array.from({ length: run.samples }, (_, i) => {
        const margins = series.map((values, k) => 100 * (1 - Math.abs(values[i]) / loads[k].rating)).filter(Number.isFinite);
        return margins.length > 0 ? Math.min(...margins) : NaN;
      });
    }),
  ];
}

const kJointLoads: Record<string, string> = { driving: "joints/effort", force: "joints/reaction_force", moment: "joints/reaction_moment" };

function loadSeries(run: Run, of: string, quantity: string): (() => ArrayLike<number>) | null {
  const grasp = run.series(`grasps/${of}/${quantity}`);
  if (grasp && (quantity === "force" || quantity === "moment")) return isZero(grasp) ? null : () => magnitudes(grasp.data, grasp.width);
  const path = Object.hasOwn(kJointLoads, quantity) ? kJointLoads[quantity] : "";
  const series = run.series(path);
  const joint = series?.components.indexOf(of) ?? -1;
  if (!series || joint < 0) return null;
  return () => Float64Array.from({ length: run.samples }, (_, i) => series.data[i * series.width + joint]);
}

// For each phase as a whole, including the time between samples: one step per phase.
function phaseMargin(context: Context): Line[] {
  const { run } = context;
  const worst = new Map<string, number>();
  for (const one of records(run.summary?.loads)) {
    if (typeof one.margin !== "number" || !Number.isFinite(one.margin)) continue;
    const phase = String(one.phase);
    worst.set(phase, Math.min(worst.get(phase) ?? Infinity, 100 * one.margin));
  }
  if (!run.phases.some((phase) => worst.has(phase.name))) return [];
  const options = { label: "worst of the phase", color: "ink", width: 2 };
  return [
    derivedLine(context, "worst_margin/phase", "%", options, () => {
      const values = new Float64Array(run.samples).fill(NaN);
      for (const phase of run.phases) values.fill(worst.get(phase.name) ?? NaN, phase.first, phase.last + 1);
      return values;
    }),
  ];
}

function records<T>(value: readonly T[] | null | undefined): T[] {
  return Array.isArray(value) ? value.filter((one) => one !== null && typeof one === "object") : [];
}
