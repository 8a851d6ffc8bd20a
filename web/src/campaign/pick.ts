// Which column a campaign's charts show first, and how columns are offered. No DOM.
import type { CampaignModel, Described } from "./model";
import { describedOf, kindOf } from "./model";

const kTelling = [/impulse_magnitude$/, /^margins\//, /angular_velocity_change/, /mean_force$/, /^end\/base\/angular_velocity/, /kinetic_energy/, /^clearance\//];

export function varies(d: Described): boolean {
  return d.count > 0 && d.largest > d.least;
}

// A column that a criterion limits, else an informative one.
export function mainDescribed(model: CampaignModel): Described | undefined {
  return tellingDescribed(model, 1)[0] ?? describedOf(model).find((d) => d.histogram !== null);
}

// Columns in order of information, without inputs.
export function tellingDescribed(model: CampaignModel, most: number): Described[] {
  const columns = model.columns.filter((d) => d.histogram !== null && varies(d));
  const limited = model.limits.map((l) => columns.find((d) => d.name === l.column && d.largest > d.least));
  const read = model.criteria.flatMap((c) => c.reads).map((name) => columns.find((d) => d.name === name && d.unit !== "1"));
  const known = kTelling.flatMap((pattern) => columns.filter((d) => pattern.test(d.name)));
  const found = new Set([...limited, ...read, ...known, ...columns].filter((d) => d !== undefined));
  return [...found].slice(0, most);
}

export interface Offer {
  value: string;
  text: string;
  group: string;
}

export function optionsOf(model: CampaignModel): Offer[] {
  const limited = new Set([...model.limits.map((l) => l.column), ...model.criteria.flatMap((c) => c.reads)]);
  return describedOf(model).map((d) => ({
    value: kindOf(d),
    text: d.name,
    group: d.role === "input" ? "Inputs" : limited.has(d.name) ? "In the criteria" : "Columns",
  })).sort((a, b) => rank(a.group) - rank(b.group));
}

function rank(group: string): number {
  return ["In the criteria", "Columns", "Inputs"].indexOf(group);
}
