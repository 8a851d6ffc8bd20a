// The page of an optimization.
import type { OptimizationData, ReportData } from "../data";
import { element } from "../dom";
import { number, pasted, unitText } from "../format";
import { assemble } from "./assemble";
import { beforeAfterCard, change } from "./before_after";
import { counted, plural } from "./describe";
import { extremesCard } from "./extremes";
import { type Field, optimizationTable, type StudyTable } from "./field";
import { filterBar } from "./filter_bar";
import { header, text, type Tone } from "./header";
import { Histogram } from "./histogram";
import { OutcomeChart, type OutcomeSpec } from "./outcome_chart";
import { ParallelCoordinates } from "./parallel";
import { pointCard } from "./point_card";
import { PointTable } from "./point_table";
import { Scatter } from "./scatter";
import { type Search, searchOf } from "./search";
import { StudyState } from "./state";
import { commandLine } from "./ui";

type Comparison = OptimizationData["comparison"];

export function buildOptimizationPage(host: HTMLElement, data: ReportData): void {
  const found = data.optimization;
  if (!found) throw new Error("the report contains no optimization");
  const table = optimizationTable(found);
  const state = new StudyState(table);
  const search = searchOf(table, found.comparison);
  const name = text(found.comparison?.optimization?.name) || data.title;
  const objective = table.find("objective");
  const best = search.best;
  const card = pointCard({
    state,
    command: (k) => (k === best ? pasted(text(found.command)) : ""),
    remark: (k) => (k === best ? "The best point found." : search.outcome[k] === "beyond" ? "Beyond a limit." : found.search[k] ? `Search: ${found.search[k]}.` : ""),
    steps: false,
  });
  state.select(best ?? (table.size > 0 ? 0 : null));
  const drawn = objective !== undefined && table.size > 0;
  const chart = (id: string, title: string, against: (Field | null)[]) => (): HTMLElement => new OutcomeChart(state, outcomeSpec(id, title, name, found, search, objective!, against)).card.root;
  const later: [string, () => HTMLElement | null][] = [
    ["variables", chart("variables", "Objective against each variable", table.axes)],
    ["parallel", () => new ParallelCoordinates(state, name, best).card.root],
    ["scatter", () => new Scatter(state, name).card.root],
    ["histogram", () => new Histogram(state, name).card.root],
    ["extremes", () => extremesCard(state, name)],
  ];
  assemble(host, {
    state,
    head: optimizationHeader(data, found, table),
    first: [...(drawn ? [chart("convergence", "Objective over the search", [null])] : []), () => beforeAfterCard(found.comparison, name)],
    filter: filterBar(state),
    later: drawn ? later : [],
    table: () => new PointTable(state, name, { name: "search", text: (k) => found.search[k] ?? "" }).root,
    card,
    empty: "The optimization has no evaluations.",
  });
}

function outcomeSpec(id: string, title: string, study: string, found: OptimizationData, search: Search, objective: Field, against: (Field | null)[]): OutcomeSpec {
  const before = found.comparison?.objective?.before;
  return { id, title, study, search, objective, searches: found.search, before: typeof before === "number" ? before : null, against };
}

function optimizationHeader(data: ReportData, found: OptimizationData, table: StudyTable): HTMLElement {
  const c = found.comparison;
  const { before = null, after = null } = c?.objective ?? {};
  const unit = text(c?.objective?.unit) === "1" ? "" : text(c?.objective?.unit);
  const limits = Array.isArray(c?.limits) ? c.limits : [];
  const kept = typeof c?.best === "number" && after !== null && !isBeyond(found, table, c.best);
  const [verdict, tone] = verdictOf(c, before, after, kept, limits.length > 0);
  const count = (name: "evaluations" | "failed" | "unreachable" | "beyond_limits"): number => Number(c?.[name] ?? 0);
  const without = count("failed") + count("unreachable");
  return header({
    kind: "Optimization",
    title: data.title,
    verdict,
    tone,
    said: said(c, before, after, unit),
    tiles: [
      { name: "objective before", value: number(before), unit, detail: c?.before_acceptable === false ? "beyond a limit" : "the unchanged scenario" },
      { name: "objective after", value: number(after), unit, detail: before !== null && after !== null ? change({ before, after }) : undefined, tone: kept ? "good" : "bad" },
      ...limits.slice(0, 3).map((l) => ({ name: text(l?.name), value: number(l?.after), unit: text(l?.unit) === "1" ? "" : text(l?.unit), detail: `before ${number(l?.before)}` })),
      { name: "evaluations", value: counted(count("evaluations") || table.size), detail: `${count("beyond_limits")} violate limits, ${without} failed or unreachable` },
    ],
    facts: [
      text(c?.optimization?.simulate) === "impact" ? "impact only" : text(c?.optimization?.simulate) === "run" ? "whole captures" : "",
      `Grapnel ${text(c?.version) || data.version}`,
      text(c?.optimization?.sha256) && `optimization ${text(c?.optimization?.sha256).slice(0, 12)}`,
    ],
    about: [
      ["Objective", text(c?.objective?.name)],
      ["Simulated", text(c?.optimization?.simulate)],
      ["Variables", plural(table.axes.length, "variable")],
      ["Grapnel", text(c?.version) || data.version],
      ["SHA-256", text(c?.optimization?.sha256)],
    ],
    text: text(c?.text),
    more: found.command ? element("div", {}, element("h2", { class: "st-sub" }, "Run the best"), commandLine(pasted(text(found.command)))) : null,
  });
}

function verdictOf(c: Comparison, before: number | null, after: number | null, kept: boolean, limited: boolean): [string, Tone] {
  if (after === null) return ["No best point found", "bad"];
  if (!kept) return ["No point meets all limits", "bad"];
  const limits = limited ? ", all limits met" : "";
  if (before === null) return [`Best point found${limits}`, "good"];
  const better = text(c?.objective?.name).startsWith("maximize") ? after > before : after < before;
  if (!better) return c?.before_acceptable === false ? [`Best point found${limits}`, "good"] : [`No better point found${limits}`, "warn"];
  return [`Improved by ${change({ before, after }).replace(/^[+−]/, "")}${limits}`, "good"];
}

function isBeyond(found: OptimizationData, table: StudyTable, best: number): boolean {
  return searchOf(table, found.comparison).outcome[best] === "beyond";
}

function said(c: Comparison, before: number | null, after: number | null, unit: string): string {
  const name = text(c?.objective?.name);
  if (before === null || after === null) return name ? `Asked: ${name}.` : "";
  return `Objective: ${name}. From ${number(before)} to ${number(after)} ${unitText(unit)}`.trim() + ". This is the best evaluated point, not a proven optimum.";
}
