// The numbers that sum up a capture, from its summary; the same for one run, and for two side by side.
import { number, quiet } from "../format";
import type { Run } from "../run";
import type { Answer, GraspImpulse, ImpactReport, ImpactMargin, LedgerEntry, LimitEvent } from "../summary_types";
import { list, num, size, text, vector, withUnit, words, type Partly, type PartlySummary } from "./read";

export interface Fact {
  key: string; // the same quantity in two runs has the same key
  name: string;
  value: number | null; // null: not known or not defined
  unit: string;
  detail: string;
  tone?: "bad" | "warn";
  word?: string; // meaning of the tone
  percent?: boolean; // shown as a percentage
}

export function keyFacts(run: Run): Fact[] {
  const s = run.summary ?? {};
  return [...graspFacts(s), ...energyFacts(s), ...baseFacts(run), ...identifiedFacts(s), marginFact(s), clearanceFact(s)];
}

// Of a held target: its mass, the parameter with the plainest meaning.
function identifiedFacts(s: PartlySummary): Fact[] {
  const found = s.post_impact?.identification;
  if (!found) return [];
  const mass = list(found.parameters).find((one) => one.name === "mass");
  const value = num(mass?.value);
  const deviation = num(mass?.deviation);
  const spread = deviation !== null ? `; standard deviation ${withUnit(deviation, "kg", 2)}` : "";
  const detail = value === null ? `${words(found.mass)} by the motion` : `true mass ${withUnit(num(mass?.truth), "kg")}${spread}`;
  return [{ key: "identified mass", name: `Identified mass, ${text(found.target)}`, value, unit: "kg", detail }];
}

// The first impact and those of grasps that closed later.
export function allImpacts(s: PartlySummary): Partly<ImpactReport>[] {
  return [...(s.impact ? [s.impact] : []), ...list(s.later_impacts)];
}

function graspFacts(s: PartlySummary): Fact[] {
  const momentum = num(s.ledger?.scale?.linear_momentum) ?? 0;
  return allImpacts(s).flatMap((impact, k) =>
    list(impact.grasps).flatMap((grasp): Fact[] => {
      const who = text(grasp.end_effector);
      const key = `${who}${k > 0 ? `#${k}` : ""}`;
      const time = k > 0 ? `, at ${withUnit(num(impact.time), "s")}` : "";
      const impulse: Fact = {
        key: `impulse ${key}`,
        name: `Impulse, ${who}`,
        value: quieted(num(grasp.impulse_magnitude) ?? size(grasp.impulse), momentum),
        unit: "N s",
        detail: `on ${text(grasp.target)}${time}; angular ${withUnit(size(grasp.angular_impulse), "N m s")}${byBrakes(impact, who)}`,
      };
      return [impulse, ...forceFacts(impact, grasp, who, key)];
    }),
  );
}

function quieted(value: number | null, scale: number): number | null {
  return value === null ? null : quiet(value, scale);
}

// Joints that brake after the grasp cause a separate impulse.
function byBrakes(impact: Partly<ImpactReport>, who: string): string {
  const own = list(impact.brake?.grasps).find((grasp) => grasp.end_effector === who);
  return own ? `; then ${withUnit(num(own.impulse_magnitude), "N s")} by the brakes` : "";
}

// The peak of a compliant impact, and the mean.
function forceFacts(impact: Partly<ImpactReport>, grasp: Partly<GraspImpulse>, who: string, key: string): Fact[] {
  const duration = num(grasp.profile?.duration) ?? num(impact.duration);
  const mean: Fact = {
    key: `mean force ${key}`,
    name: `Mean force, ${who}`,
    value: num(grasp.mean_force),
    unit: "N",
    detail: `over ${withUnit(duration, "s")}`,
  };
  const peak = num(grasp.profile?.peak_force);
  if (peak === null) return [mean];
  const detail = `mean ${withUnit(mean.value, "N")} over ${withUnit(duration, "s")}; peak moment ${withUnit(num(grasp.profile?.peak_moment), "N m")}`;
  return [{ key: `peak force ${key}`, name: `Peak force, ${who}`, value: peak, unit: "N", detail }, mean];
}

function energyFacts(s: PartlySummary): Fact[] {
  if (!s.impact) return [];
  const before = num(s.impact.kinetic_energy_before);
  const after = num(s.impact.kinetic_energy_after);
  if (before === null || after === null) return [];
  const share = before > 0 ? (before - after) / before : 0;
  const part = Math.abs(share) > 1e-12 ? ` (${number(100 * share, 3)} %)` : ""; // larger than rounding error
  const brake = num(s.impact.brake?.kinetic_energy_after);
  const braked = brake !== null ? `; then the brakes take ${withUnit(after - brake, "J")}` : "";
  const work = list(s.impact.held_joints).reduce((sum, joint) => sum + (num(joint.work) ?? 0), 0);
  const held = work > 0 ? `; drives that hold the joints add ${withUnit(work, "J")}` : "";
  const detail = `of ${withUnit(before, "J")} before it${part}${held}${braked}`;
  const which = list(s.later_impacts).length > 0 ? "first impact" : "impact";
  return [
    {
      key: "energy",
      name: `Energy lost in the ${which}`,
      value: quiet(before - after, before),
      unit: "J",
      detail,
      ...(after - Math.max(0, work) > before * (1 + 1e-9) ? { tone: "bad", word: "gained" } : {}),
    },
  ];
}

function baseFacts(run: Run): Fact[] {
  const s = run.summary ?? {};
  const end = size(s.post_impact?.end?.base?.angular_velocity);
  const after = baseRateAfter(run);
  const change = size(withBrake(s.impact));
  const which = list(s.later_impacts).length > 0 ? "first impact" : "impact";
  const facts: Fact[] = [];
  if (s.impact && (after !== null || change !== null)) {
    const detail = `changed by ${withUnit(quieted(change, after ?? 0), "rad/s")}${end !== null ? `; ${withUnit(end, "rad/s")} at the end` : ""}`;
    facts.push({ key: "base rate", name: `Base rate after the ${which}`, value: after, unit: "rad/s", detail });
  } else if (end !== null) {
    facts.push({ key: "base rate", name: "Base rate at the end", value: end, unit: "rad/s", detail: "" });
  }
  return facts;
}

// The base's change of rate by an impact, and by the brakes that close after it.
function withBrake(impact: Partly<ImpactReport> | undefined): number[] | null {
  const change = vector(impact?.base_angular_velocity_change);
  const brake = list(impact?.brake?.base_angular_velocity_change);
  return change && change.map((d, i) => d + (num(brake[i]) ?? 0));
}

// The value before the impact plus its change (and that of the brake); if there is another event in between, from the
// time series.
export function baseRateAfter(run: Run): number | null {
  const s = run.summary ?? {};
  const before = s.approach?.end;
  const change = withBrake(s.impact);
  const rate = before?.base?.angular_velocity;
  if (Array.isArray(rate) && change && before?.time === s.impact?.time && s.impact?.law !== "compliant")
    return size(change.map((d, i) => d + rate[i]));
  const series = run.series("base/angular_velocity");
  const contact = run.phases.findIndex((phase) => phase.name === "contact");
  if (!series || contact < 0) return null;
  const sample = run.phases[contact + 1]?.first ?? run.phases[contact].last;
  return Math.hypot(...[0, 1, 2].map((c) => series.data[sample * series.width + c]));
}

// Over all phases; for results without loads, over the impacts.
export interface WorstMargin extends Partly<ImpactMargin> {
  margin: number;
  phase?: string;
}
export function worstMargin(s: PartlySummary): WorstMargin | null {
  const { rating, ...worst } = s.worst_margin ?? {};
  const margin = num(worst.margin);
  if (margin !== null) return { ...worst, margin, load: worst.peak, rating: rating ?? undefined };
  let least: WorstMargin | null = null;
  for (const one of allImpacts(s).flatMap((impact) => list(impact.margins))) {
    const own = num(one.margin);
    if (own !== null && (least === null || own < least.margin)) least = { ...one, margin: own };
  }
  return least;
}

// A drive that is saturated at its effort limit has no margin, and does not exceed a rating.
export function isSaturated(quantity: unknown, margin: number): boolean {
  return text(quantity).startsWith("driving") && Math.abs(margin) <= 1e-9;
}

function marginFact(s: PartlySummary): Fact {
  const worst = worstMargin(s);
  const fact: Fact = {
    key: "margin",
    name: "Worst margin to ratings",
    value: null,
    unit: "%",
    percent: true,
    detail: "the robot has no ratings",
  };
  if (!worst) return s.impact || s.loads ? fact : { ...fact, detail: "no impact" };
  const unit = ratingUnit(worst.quantity);
  return {
    ...fact,
    value: 100 * worst.margin,
    detail: `${text(worst.of)}: ${words(worst.quantity)} ${number(num(worst.load))} of ${withUnit(num(worst.rating), unit)}${worst.phase ? ` (${words(worst.phase)})` : ""}${worst.assumed_duration ? ", over an assumed duration" : ""}`,
    ...(isSaturated(worst.quantity, worst.margin)
      ? { tone: "warn", word: "saturated:" }
      : worst.margin < 0
      ? { tone: "bad", word: "exceeded:" }
      : worst.margin < 0.1
        ? { tone: "warn", word: "close:" }
        : {}),
  };
}

function clearanceFact(s: PartlySummary): Fact {
  const least = s.clearance?.minimum;
  const fact: Fact = {
    key: "clearance",
    name: "Minimum clearance",
    value: null,
    unit: "m",
    detail: clearanceUnseen(s),
  };
  if (!least) return fact;
  const value = num(least.distance);
  const detail = `${list(least.bodies).join(" – ")} at ${withUnit(num(least.time), "s")}`;
  if (list(s.clearance?.events).length === 0) return { ...fact, value, detail };
  return { ...fact, value, detail, tone: "bad", word: value !== null && value < 0 ? "overlap:" : "too near:" };
}

// Reason for a missing clearance.
function clearanceUnseen(s: PartlySummary): string {
  const reason = text(checkOf(s, "clearance_violation")?.not_checked, "");
  if (reason) return `not checked: ${reason}`;
  return s.status === "completed" ? "no two bodies with shapes that move" : "not known";
}

// Unit of an event of `limits.events`.
export function limitUnit(run: Run, event: Partly<LimitEvent>): string {
  const joint = list(run.scene?.bodies).find((body) => body.joint?.name === event.joint)?.joint;
  if (!joint) return "";
  const [position, effort] = joint.type === "prismatic" ? ["m", "N"] : ["rad", "N m"];
  if (event.kind === "position") return position;
  return event.kind === "rate" ? `${position}/s` : effort;
}

export function ratingUnit(quantity: unknown): string {
  const units: Record<string, string> = {
    force: "N",
    moment: "N m",
    impulse: "N s",
    angular_impulse: "N m s",
    driving: "N m",
    driving_impulse: "N m s",
  };
  return units[String(quantity).split("/")[0]] ?? ""; // "driving/x" of base control
}

// Results of the thesis's formulas are shown only on request of the scenario; summaries of earlier versions always show
// them.
export function showsPublished(s: PartlySummary): boolean {
  return Boolean(s.impact) && s.impact?.show_as_published !== false;
}

// A scenario that states a goal asks about it first; then a run without grasps need not say that it captures nothing.
export function goalFirst(answers: Partly<Answer>[]): Partly<Answer>[] {
  const goal = answers.filter((one) => one.question === "Goal");
  const rest = answers.filter((one) => one.question !== "Goal" && !(goal.length > 0 && one.question === "Capture" && one.tone === "none"));
  return [...goal, ...rest];
}

// ---- The ledger ----

// A check with its key in the summary.
export type LedgerRow = Partly<LedgerEntry> & { key: string };

export function ledgerRows(s: PartlySummary): LedgerRow[] {
  return Object.keys(s.ledger ?? {}).flatMap((key) => {
    const row = checkOf(s, key);
    return row ? [{ ...row, key }] : [];
  });
}

// The check of that name; other keys of the ledger are not checks.
export function checkOf(s: PartlySummary, name: string): Partly<LedgerEntry> | null {
  const row: unknown = s.ledger?.[name];
  return name !== "scale" && row !== null && typeof row === "object" ? row : null;
}
