// Control and actuators: the on-board computer, control laws of joints, actuators. Each part of the summary is shown
// with its description; a new part needs one line of kParts.
import { element } from "../dom";
import { number } from "../format";
import * as described from "../summary_types"; // by name: types not yet generated (scripts/tables) cause no error
import { describedPairs, describedTable } from "./described";
import { bar } from "./margins";
import { list, num, text, type PartlySummary } from "./read";
import { absent, mark, table, type Cell, type Column } from "./table";

interface Part {
  title: string;
  of: (s: PartlySummary) => unknown; // one structure, or a list of structures: one row each
  notes: described.FieldNote[];
  listed?: boolean; // a list of names and values per structure, not a row
  sums?: (all: Structure[], s: PartlySummary) => Cell[]; // summary of its numbers
}
type Structure = Record<string, unknown>;

// Phases whose stability was evaluated; undefined without any.
function evaluated(reports: PartlySummary["stability"]): unknown {
  const some = list(reports).filter((report) => report?.verdict !== "not_evaluated");
  return some.length ? some : undefined;
}

// The margins of all channels, each with the time and the phase of its linear model.
function margins(s: PartlySummary): Structure[] {
  return list(s.control_loops).flatMap((loop) => list(loop?.margins).map((margin) => ({ time: loop?.time, motion: loop?.phase, ...margin })));
}

// The reports of control laws that move all joints together, each with its name.
function laws(s: PartlySummary): Structure[] {
  const after = s.post_impact ?? {};
  const reports = { "impedance in the approach": s.approach?.impedance, detumbling: after.detumbling, base_keeping: after.base_keeping, impedance: after.impedance, grasp_force: after.grasp_force };
  return Object.entries(reports).flatMap(([law, report]) => (report ? [{ law, ...report }] : []));
}

const kParts: Part[] = [
  { title: "On-board computer", of: (s) => s.control, notes: described.kControlReport },
  { title: "Sensors: readings minus true values", of: (s) => s.sensors, notes: described.kSensorReport },
  { title: "Identification of the held target", of: (s) => s.post_impact?.identification, notes: described.kIdentificationReport },
  { title: "Numbers identified", of: (s) => s.post_impact?.identification?.parameters, notes: described.kIdentifiedParameter },
  { title: "Control laws that move all joints", of: laws, notes: [["law", "", "control law"], ...described.kLawReport], listed: true },
  { title: "Effective masses in the contact", of: (s) => s.impact?.effective_masses, notes: described.kEffectiveMass },
  { title: "Squeezes", of: (s) => s.post_impact?.grasp_force?.pairs, notes: described.kSqueeze },
  { title: "Actuators at their limits", of: (s) => s.saturation, notes: described.kSaturationReport },
  { title: "Stability of control", of: (s) => evaluated(s.stability), notes: described.kStabilityReport },
  { title: "Linear models of control", of: (s) => s.control_loops, notes: described.kControlLoopReport },
  { title: "Margins of control, one channel at a time", of: margins, notes: [["time", "s", "time of the linear model"], ["motion", "", "phase of motion"], ...described.kLoopMargin] },
  { title: "Rest after the impact", of: (s) => s.post_impact?.at_rest, notes: described.kRestReport },
  { title: "Reaction wheels", of: (s) => s.wheels, notes: described.kWheelReport, sums: wheelsUsed },
  { title: "Array of control moment gyros", of: (s) => s.gyros, notes: described.kGyrosReport },
  { title: "Control moment gyros", of: (s) => s.gyros?.each, notes: described.kGyroReport },
  { title: "Gyros near a singularity", of: (s) => s.gyros?.hazards, notes: described.kSingularityHazard },
  { title: "Propellant", of: (s) => s.thrusters, notes: described.kThrustersReport },
  { title: "Thrusters", of: (s) => s.thrusters?.each, notes: described.kThrusterReport },
  { title: "Momentum dumping", of: (s) => s.thrusters?.dumping, notes: described.kDumpingReport },
  { title: "Bodies in plumes", of: (s) => s.thrusters?.hazards, notes: described.kPlumeHazard },
  { title: "Other actuators of the base", of: (s) => s.actuators, notes: described.kActuatorUse },
  { title: "Tendons", of: (s) => s.tendons, notes: described.kTendonReport },
  { title: "Joints: friction, stops and motors", of: (s) => s.joints, notes: described.kJointReport },
  { title: "Impacts on stops", of: (s) => s.stop_impacts, notes: described.kStopImpact, sums: stopsCounted },
];

export function isDriven(s: PartlySummary): boolean {
  return kParts.some((part) => structuresOf(part.of(s)).length > 0);
}

export function drivenSection(s: PartlySummary): HTMLElement[] {
  const shown = kParts.filter((part) => structuresOf(part.of(s)).length > 0);
  if (shown.length === 0) return [absent("The summary has no control laws, actuators or on-board computer.")];
  return shown.flatMap((part) => [element("h3", {}, part.title), ...partOf(part, s)]);
}

function partOf(part: Part, s: PartlySummary): HTMLElement[] {
  const value = part.of(s);
  const all = structuresOf(value);
  const sums = (part.sums?.(all, s) ?? []).map((sum) => element("div", {}, sum ?? ""));
  if (part.listed) return all.flatMap((one) => describedPairs(part.notes, one));
  return [...sums, ...(Array.isArray(value) ? describedTable(part.title, part.notes, all) : describedPairs(part.notes, all[0]))];
}

function structuresOf(value: unknown): Structure[] {
  const all: unknown[] = Array.isArray(value) ? value : [value];
  return all.filter((one): one is Structure => typeof one === "object" && one !== null && !Array.isArray(one));
}

// ---- Sums ----

// Largest used share of each wheel's capacity.
function wheelsUsed(all: Structure[]): Cell[] {
  const used = all.flatMap((one) => {
    const largest = num(one.largest_rate), limit = num(one.rate_limit);
    return largest === null || limit === null || limit === 0 ? [] : [{ name: text(one.name), share: largest / limit }];
  });
  if (used.length === 0) return [];
  const columns: Column[] = [{ head: "Wheel" }, { head: "Largest share of its momentum capacity", unit: "%", numeric: true }, { head: "Used" }];
  const rows = used.map(({ name, share }): Cell[] => {
    const percent = number(100 * share, 3);
    return [name, share >= 1 - 1e-9 ? mark("warn", `${percent}, saturated`) : percent, bar(share)];
  });
  return [table("Momentum of wheels against their capacity", columns, rows)];
}

// If the list is incomplete.
function stopsCounted(all: Structure[], s: PartlySummary): Cell[] {
  const count = num(s.stop_impact_count);
  return count !== null && count > all.length ? [`${number(count)} in all, of which these are the first.`] : [];
}
