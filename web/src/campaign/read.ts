// campaign.json as the page's model. Whatever is missing or of another type becomes empty, null or NaN. No DOM.
import type * as file from "../campaign_types";
import type { CampaignData, Partly } from "../data";
import { pasted } from "../format";
import type { CampaignModel, Counts, CriterionResult, Described, Failure, GraspCount, Group, Influence, Limit, Quantile, Sensitivity, WorstList } from "./model";
import { readSuccessMap } from "./read_success_map";
import { proportionOf, wilson } from "./wilson";
import { samplingName } from "./words";

export function campaignModel(data: CampaignData): CampaignModel {
  const s: Partly<file.CampaignReport> = data.statistics ?? {};
  const c = s.campaign ?? {};
  const counts = s.counts ?? {};
  const confidence = num(s.success?.confidence, 0.95);
  const rows = num(s.rows, data.rows);
  const statuses = (["ok", "failed", "unreachable"] as const).map((status) => ({ status, count: num(counts[status], 0) }));
  const successes = num(counts.success);
  return {
    name: text(c.name),
    description: text(c.description),
    confidence,
    total: num(c.total, rows),
    rows,
    counts: statuses,
    success: proportionOf(s.success, successes, rows, confidence),
    completed: wilson(statuses[0].count, rows, confidence),
    criteria: list(s.criteria).map((one) => criterion(one, rows, confidence)),
    limits: list(s.criteria).flatMap(limitsOf),
    inputs: list(s.inputs).map((d) => described(d, "input", confidence)),
    columns: list(s.columns).map((d) => described(d, "column", confidence)),
    sensitivities: sensitivities(s.sensitivity),
    worst: list(s.worst).map(worst),
    failures: list(s.failures ?? s.reasons).map(failure),
    failuresAreAll: Array.isArray(s.failures),
    failuresLeftOut: num(s.failures_left_out ?? s.reasons_left_out, 0),
    grasps: list(s.grasps).map(grasp),
    groups: list(s.sensitivity?.groups).map((g) => ({ name: text(g?.name), design: g?.design === true, inputs: list(g?.inputs).map(text) })),
    assumed: num(s.success?.assumed, 0),
    warnings: list(s.warnings).map(text).filter((w) => w !== ""),
    saved: new Set(list(data.saved).map((k) => num(k)).filter(Number.isFinite)),
    measuresLeftOut: num(s.sensitivity?.left_out, 0),
    successMap: readSuccessMap(s.success_map, confidence),
    settings: settings(s, c),
    text: text(s.text),
    sampling: text(c.sampling),
  };
}

function criterion(one: Partly<file.CriterionResult>, rows: number, confidence: number): CriterionResult {
  const said = text(one?.text);
  return { ...proportionOf(one, num(one?.met), rows, confidence), name: text(one?.name) || said, text: said, onlyThis: num(one?.only_this), notChecked: num(one?.not_checked, 0), reads: list(one?.reads).map(text) };
}

// Of a magnitude both signs are limits.
function limitsOf(one: Partly<file.CriterionResult>): Limit[] {
  return list(one?.limits).flatMap((limit) => {
    const atMost = typeof limit?.at_most === "number";
    const value = num(limit?.at_most, num(limit?.at_least));
    const made = { column: text(limit?.name), value, atMost, criterion: text(one?.name) || text(one?.text) };
    return limit?.magnitude === true ? [made, { ...made, value: -value, atMost: !atMost }] : [made];
  });
}

function described(d: Partly<file.Distribution>, role: "input" | "column", confidence: number): Described {
  return {
    name: text(d?.name),
    unit: text(d?.unit),
    description: text(d?.description),
    role,
    count: num(d?.count, 0),
    missing: num(d?.missing, 0),
    mean: num(d?.mean),
    deviation: num(d?.standard_deviation),
    least: num(d?.least),
    largest: num(d?.largest),
    quantiles: list(d?.quantiles).map(quantile),
    histogram: histogram(d?.histogram),
    successBy: groups(d?.success_by, confidence),
  };
}

function quantile(q: Partly<file.Quantile>): Quantile {
  return { probability: num(q?.probability), value: num(q?.value), lower: num(q?.lower), upper: num(q?.upper) };
}

function histogram(h: Partly<file.Histogram> | undefined): Counts | null {
  const counts = list(h?.counts).map((v) => num(v, 0));
  const [begin, end] = [num(h?.begin), num(h?.end)];
  if (counts.length === 0 || !(end >= begin)) return null;
  const successes = list(h?.successes).map((v) => num(v, 0));
  return { begin, end, counts, successes: successes.length === counts.length ? successes : null, below: num(h?.below, 0), above: num(h?.above, 0) };
}

// Groups between the same two values are one: an input with few values has many.
function groups(g: Partly<file.SuccessBy> | undefined, confidence: number): Group[] {
  const made: { from: number; to: number; trials: number; successes: number }[] = [];
  list(g?.from).forEach((from, k) => {
    const one = { from: num(from), to: num(g?.to?.[k]), trials: num(g?.trials?.[k], 0), successes: num(g?.successes?.[k], 0) };
    const before = made[made.length - 1];
    if (before && before.from === one.from && before.to === one.to && one.from === one.to) {
      before.trials += one.trials;
      before.successes += one.successes;
    } else made.push(one);
  });
  return made.filter((m) => m.trials > 0).map((m) => ({ from: m.from, to: m.to, ...wilson(m.successes, m.trials, confidence) }));
}

function sensitivities(s: Partly<file.SensitivityOfAll> | undefined): Sensitivity[] {
  const inputs = list(s?.inputs).map(text);
  const groups = list(s?.groups).map((g) => text(g?.name));
  const of = (names: string[], m: Partly<file.Measure | file.GroupIndices>): Influence[] => names.map((input, k) => ({ input, firstOrder: num(m?.first_order?.[k]), error: num(m?.error?.[k]), rank: num(m?.rank_correlation?.[k]) }));
  return list(s?.measures).map((m) => ({
    output: text(m?.name),
    of: text(m?.of),
    count: num(m?.count, 0),
    influences: of(inputs, m),
    groups: m?.groups ? of(groups, m.groups) : [],
    unexplained: num(m?.unexplained),
  }));
}

function grasp(g: Partly<file.GraspCount>): GraspCount {
  const tolerances = list(g?.tolerances).map((t) => ({ name: text(t?.name), exceeded: num(t?.exceeded, 0), limiting: num(t?.limiting, 0) }));
  return { endEffector: text(g?.end_effector), captured: num(g?.captured, 0), missed: num(g?.missed, 0), tolerances };
}

function worst(w: Partly<file.WorstCases>): WorstList {
  const cases = list(w?.cases).map((one) => ({
    index: num(one?.index),
    value: num(one?.value),
    success: typeof one?.success === "boolean" ? one.success : null,
    inputs: list(one?.inputs).map((v) => num(v)),
    command: pasted(text(one?.replay)),
  }));
  return { by: text(w?.by), unit: text(w?.unit), direction: text(w?.direction), magnitude: w?.magnitude === true, cases };
}

function failure(f: Partly<file.Reason>): Failure {
  const examples = list(f?.examples).map((e) => ({ index: num(e?.index), reason: text(e?.reason), command: pasted(text(e?.replay)) }));
  return { status: text(f?.status), reason: text(f?.reason), count: num(f?.count, 0), examples };
}

const kSimulated: Record<string, string> = { impact: "only planning and the impact", run: "whole captures" };
const kPlanned: Record<string, string> = { nominal: "once, for the nominal scenario: the planner does not know the true values", per_case: "for each case, from its true values" };

function settings(s: Partly<file.CampaignReport>, c: Partly<file.CampaignSettings>): [string, string][] {
  return [
    ["Simulated", kSimulated[text(c.simulate)] ?? text(c.simulate)],
    ["Planned", kPlanned[text(c.plan)] ?? text(c.plan)],
    ["Seed", text(c.seed)],
    ["Sampling", samplingName(text(c.sampling))],
    ["Cases", text(c.total ?? c.cases)],
    ["File", text(c.file)],
    ["Grapnel", text(s.version)],
    ["SHA-256", text(c.sha256)],
  ];
}

// ---- Values of unknown type ----

export function num(value: unknown, otherwise = NaN): number {
  return typeof value === "number" ? value : otherwise;
}

export function text(value: unknown): string {
  return typeof value === "string" ? value : typeof value === "number" ? String(value) : "";
}

export function list<T>(value: readonly T[] | null | undefined): T[] {
  return Array.isArray(value) ? (value as T[]) : [];
}
