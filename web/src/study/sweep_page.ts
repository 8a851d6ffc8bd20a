// The page of a sweep.
import type { ReportData, SweepData } from "../data";
import { element } from "../dom";
import { number, pasted, unitText } from "../format";
import { mainColumn } from "./choice";
import { breakable, counted, plural, shown } from "./describe";
import { extremesCard } from "./extremes";
import { type Field, type StudyTable, sweepTable } from "./field";
import { filterBar } from "./filter_bar";
import { header, text, type Tile } from "./header";
import { HeatMap } from "./heat_map";
import { Histogram } from "./histogram";
import { LineChart } from "./line_chart";
import { ParallelCoordinates } from "./parallel";
import { firstPoint, pointCard } from "./point_card";
import { PointTable } from "./point_table";
import { assemble } from "./assemble";
import { verdictsOf } from "./badge";
import { Scatter } from "./scatter";
import { span } from "./shape";
import { StudyState } from "./state";

export function buildSweepPage(host: HTMLElement, data: ReportData): void {
  const sweep = data.sweep;
  if (!sweep) throw new Error("the report contains no sweep");
  const table = sweepTable(sweep);
  const state = new StudyState(table);
  const name = text(sweep.settings?.study?.name) || data.title;
  const card = pointCard({ state, command: (k) => commandFor(sweep, k), remark: (k) => remark(table, k), steps: true });
  state.select(firstPoint(state));
  const later: [string, () => HTMLElement | null][] = [
    ["map", () => HeatMap.of(state, name)?.card.root ?? null],
    ["parallel", () => new ParallelCoordinates(state, name).card.root],
    ["scatter", () => new Scatter(state, name).card.root],
    ["histogram", () => new Histogram(state, name).card.root],
    ["extremes", () => extremesCard(state, name)],
  ];
  assemble(host, {
    state,
    head: sweepHeader(data, sweep, table),
    first: table.size > 0 && mainColumn(table) ? [() => new LineChart(state, name).card.root] : [],
    filter: filterBar(state),
    later: table.size > 0 && mainColumn(table) ? later : [],
    table: () => new PointTable(state, name).root,
    card,
    empty: table.size === 0 ? "The study has no points." : "The study has no columns.",
  });
}

export function commandFor(sweep: SweepData, point: number): string {
  return pasted(text(sweep.command).split("{K}").join(String(point)));
}

function remark(table: StudyTable, point: number): string {
  const main = mainColumn(table);
  if (!main || table.size < 2) return "";
  const s = span(main.values);
  if (s.greatestAt === point) return `Maximum of all points: ${breakable(main.words)}.`;
  return s.leastAt === point ? `Minimum of all points: ${breakable(main.words)}.` : "";
}

const kSimulated: Record<string, string> = {
  impact: "Planning and the impact at the planned final configuration, without integration after the impact.",
  run: "Whole captures, as in the scenario.",
};

function sweepHeader(data: ReportData, sweep: SweepData, table: StudyTable): HTMLElement {
  const count = (status: string): number => table.status.reduce((sum, s) => sum + Number(s === status), 0);
  const [ok, failed, unreachable] = [count("ok"), count("failed"), count("unreachable")];
  const { against, clean } = verdictsOf(table);
  const tone = clean === table.size && clean > 0 ? "good" : ok === 0 ? "bad" : "warn";
  const simulate = text(sweep.settings?.study?.simulate);
  const completed = ok === table.size && ok > 0 ? `All ${plural(ok, "point")} completed` : `${counted(ok)} of ${plural(table.size, "point")} completed`;
  const verdict = [completed, ...against].join("; ");
  const main = mainColumn(table);
  return header({
    kind: "Study",
    title: data.title,
    verdict,
    tone,
    explanation: kSimulated[simulate] ?? "",
    tiles: [
      { name: "points", value: counted(table.size), detail: [table.axes.map((a) => a.levels.length).join(" × "), failed + unreachable === 0 ? "none failed or unreachable" : ""].filter(Boolean).join(", ") },
      ...(failed > 0 ? [{ name: "failed", value: counted(failed), tone: "bad" as const }] : []),
      ...(unreachable > 0 ? [{ name: "unreachable", value: counted(unreachable), tone: "warn" as const, detail: "no configuration found that reaches the goals" }] : []),
      ...(main ? extremeTiles(table, main) : []),
    ],
    facts: [
      simulate === "impact" ? "impact only" : simulate === "run" ? "whole captures" : simulate,
      `Grapnel ${text(sweep.settings?.version) || data.version}`,
      text(sweep.settings?.study?.sha256) && `study ${text(sweep.settings?.study?.sha256).slice(0, 12)}`,
    ],
    about: [
      ["Simulated", simulate],
      ["Grapnel", text(sweep.settings?.version) || data.version],
      ["Schema", text(sweep.settings?.schema)],
      ["SHA-256", text(sweep.settings?.study?.sha256)],
    ],
    text: text(sweep.settings?.text),
    more: axesList(table),
  });
}

function extremeTiles(table: StudyTable, main: Field): Tile[] {
  const s = span(main.values);
  if (s.numbers === 0) return [];
  const unit = main.unit === "1" ? "" : main.unit;
  const where = (k: number): string => table.axes.slice(0, 4).map((a) => `${shown(a, a.values[k])}${a.labels || a.unit === "1" || !a.unit ? "" : ` ${unitText(a.unit)}`}`).join(", ");
  return [
    { name: "least", value: number(s.least), unit, detail: `${breakable(main.words)} at ${where(s.leastAt)}` },
    { name: "greatest", value: number(s.greatest), unit, detail: `${breakable(main.words)} at ${where(s.greatestAt)}` },
  ];
}

function axesList(table: StudyTable): HTMLElement {
  const values = (a: Field): string => {
    const v = a.levels;
    const few = v.length <= 8 ? v.map((x) => shown(a, x)).join(", ") : `${shown(a, v[0])} … ${shown(a, v[v.length - 1])} (${v.length})`;
    return a.unit && a.unit !== "1" ? `${few} ${unitText(a.unit)}` : few;
  };
  const rows = table.axes.map((a) => element("tr", {}, element("th", { scope: "row", title: a.name }, a.words), element("td", { class: "st-left" }, values(a)), element("td", { class: "st-left" }, a.description)));
  return element("div", { class: "st-scroll" }, element("table", { class: "st-grid" }, element("tbody", {}, ...rows)));
}
