// The plots that a report displays first, with the relevant limits: distance and relative speed at the grasp points,
// grasp force, base rate, clearance, energy, worst margin to a rating; and those of what else the run uses: attitude
// control, wheels, gyros, thrusters, an orbit, flexible parts.
import { label } from "../format";
import { allImpacts } from "../page/facts";
import type { PhaseSpan, Run } from "../run";
import { derivedLine, isZero, type Context } from "./lines";
import { magnitudes } from "./kinematics";
import type { Limit, Line, PlotSpec } from "./spec";

export const kOverview = "Overview";

// Shown first where the run has them: their lines exist only then.
const kUsed = ["base-pointing", "wheels-capacity_used", "gyros-angle", "gyros-singularity_measure", "thrusters-impulse", "thrusters-propellant", "orbit-base", "elastic-deflection"];

// Selects these plots of all plots of a run, with reasons for missing ones of the first kind.
export function overviewOf(context: Context, all: PlotSpec[]): { plots: PlotSpec[]; absent: string[] } {
  const absent: string[] = [];
  const plots: PlotSpec[] = [];
  const add = (plot: PlotSpec | undefined, otherwise?: string): void => {
    if (plot && plot.lines.length > 0) plots.push({ ...plot, group: kOverview });
    else if (otherwise) absent.push(otherwise);
  };
  const of = (id: string) => all.find((plot) => plot.id === id);
  const span = contactSpan(context.run.phases);
  add(distancePlot(context, of("grasp-distance"), span), "distance: there is no grasp");
  add(speedPlot(context, of("relative-speed"), span), "relative speed: there is no grasp");
  add(forcePlot(context, of("grasp-force"), span), "grasp force: no grasp carries any");
  add(of("base-angular_velocity"), "base rate: it is not recorded");
  for (const id of kUsed) add(of(id));
  add(limited(of("clearance"), clearanceLimit(context.run)), "clearance: it was not watched");
  add(of("energy"), "energy: it is not recorded");
  add(marginPlot(context), "worst margin: the robot has no ratings that a recorded load could be held against");
  return { plots, absent };
}

// From the start of the approach to the last impact; null: no impact, or nothing beside it.
interface ContactSpan {
  begin: number; // of the run [s]
  first: number; // impact
  last: number;
  end: number; // of the run
}
export function contactSpan(phases: readonly PhaseSpan[]): ContactSpan | null {
  const contacts = phases.filter((phase) => /^contact/.test(phase.name));
  if (contacts.length === 0) return null;
  const [begin, end] = [phases[0].begin, phases[phases.length - 1].end];
  return { begin, first: contacts[0].begin, last: contacts[contacts.length - 1].end, end };
}

const kBeyond = 0.05; // of the shown part: margin on the other side of the impact

// Distances and closing speeds matter until the last impact, loads of grasps from the first one on.
export function until({ begin, last, end }: ContactSpan): [number, number] | undefined {
  return last > begin ? [begin, Math.min(end, last + kBeyond * (last - begin))] : undefined;
}
export function since({ begin, first, end }: ContactSpan): [number, number] | undefined {
  return end > first ? [Math.max(begin, first - kBeyond * (end - first)), end] : undefined;
}

function limited(plot: PlotSpec | undefined, limits: Limit[]): PlotSpec | undefined {
  return plot && { ...plot, limits };
}

// ---- Distance, relative speed, force ----

const kDecades = 1e-4; // of the largest distance: the bottom of the logarithmic axis

function distancePlot(context: Context, plot: PlotSpec | undefined, span: ContactSpan | null): PlotSpec | undefined {
  if (!plot || plot.lines.length === 0) return undefined;
  const limits = envelopeLimits(context.run, "position", "allowed distance");
  const largest = Math.max(0, ...context.run.all().map((one) => (/^grasps\/.+\/distance$/.test(one.path) ? largestOf(one.data) : 0)));
  const closes = span !== null && largest > 0;
  return {
    ...plot,
    id: "closing",
    limits,
    log: closes,
    floor: closes ? Math.min(kDecades * largest, ...limits.filter(({ value }) => value > 0).map(({ value }) => value / 10)) : undefined,
    start: span ? until(span) : undefined,
    note: `Of each end-effector's origin from its grasp point.${closes ? " Logarithmic; smaller distances lie on the bottom." : ""}`,
  };
}

function largestOf(data: Float32Array): number {
  return data.reduce((most, value) => (value > most ? value : most), 0);
}

function speedPlot(context: Context, plot: PlotSpec | undefined, span: ContactSpan | null): PlotSpec | undefined {
  return plot && { ...plot, id: "closing-speed", limits: envelopeLimits(context.run, "velocity", "allowed speed"), start: span ? until(span) : undefined };
}

function forcePlot(context: Context, plot: PlotSpec | undefined, span: ContactSpan | null): PlotSpec | undefined {
  return plot && { ...plot, limits: ratingLimits(context.run, "force"), start: span ? since(span) : undefined };
}

function envelopeLimits(run: Run, key: "position" | "velocity", what: string): Limit[] {
  const grasps = records(run.scene?.limits?.grasps).filter((grasp) => run.scene!.grasps.some((one) => one.end_effector === grasp.end_effector));
  return merged(grasps.map((grasp) => ({ name: String(grasp.end_effector), value: grasp[key] })), what);
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
