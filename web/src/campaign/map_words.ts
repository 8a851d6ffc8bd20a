// Shared by the charts of a success map: names and numbers of its points, its CSV, and the selection of a point.
import type * as Plot from "@observablehq/plot";
import { columnHead, label, withUnit } from "../format";
import { rowsToText } from "../study/csv";
import { clipped, plural, shortened } from "../study/describe";
import type { StudyState } from "../study/state";
import type { CampaignModel, SuccessMap, MapAxis, MapPoint } from "./model";
import { interval, percent, probability, share } from "./words";

export const kCriteria = ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#f0e442"];

export function nameOf(a: MapAxis): string {
  return label(a.name, a.unit);
}

function valueOf(a: MapAxis, k: number): string {
  return a.labels ? (a.labels[k] ?? "?") : withUnit(a.values[k], a.unit);
}

// An axis of the design over `pixels`, with at most one tick per `each` pixels, in a card of `width`.
export function axisOf(a: MapAxis, pixels: number, domain: [number, number], each: number, width: number): Plot.ScaleOptions {
  const title = shortened(nameOf(a), Math.max(14, Math.floor((width - 90) / 6.6)));
  const few = a.values.length <= pixels / each;
  const ticks = few ? a.values : Math.max(3, Math.floor(pixels / each));
  const format = a.labels ? { tickFormat: (k: number) => clipped(a.labels![k] ?? "", 18) } : few ? { tickFormat: (v: number) => String(Number(v.toPrecision(6))) } : {};
  return { label: title, labelArrow: "none", labelAnchor: "center", domain, ticks: a.labels ? a.values : ticks, ...format };
}

// The description of the point at value `at[a]` of each axis; undefined: it has no cases.
export function pointWords(model: Pick<CampaignModel, "confidence">, axes: MapAxis[], p: MapPoint | undefined, at: number[]): string[] {
  const where = axes.map((axis, a) => `${axis.name}: ${valueOf(axis, at[a])}`).reverse();
  if (!p || p.trials === 0) return [...where, "no cases"];
  const fails = p.deciding === "" ? [] : [`most frequent failure: ${p.deciding}${p.unmet.filter((u) => u.criterion === p.deciding).map((u) => ` (${plural(u.count, "case")})`).join("")}`];
  return [`success ${probability(p.estimate)}`, `${percent(model.confidence)}: ${interval(p)}`, `${share(p)} cases`, ...fails, ...where];
}

// Selecting a point filters its cases in all charts and the table; selecting it again removes the filter.
export function choosePoint(state: StudyState, places: { axis: MapAxis; edges: number[]; at: number }[]): void {
  const ranges = places.map(({ axis, edges, at }) => {
    const field = state.table.axes.find((f) => f.name === axis.name);
    return field && { field, from: edges[at], to: edges[at + 1] };
  });
  if (ranges.some((r) => r === undefined)) return;
  const chosen = state.filter.ranges.filter((r) => ranges.some((one) => one!.field === r.field && one!.from === r.from && one!.to === r.to)).length === ranges.length;
  for (const r of ranges) state.setRange(r!.field.key, chosen ? null : r!);
  const first = chosen ? -1 : state.passing.indexOf(1);
  if (first >= 0) state.select(first);
}

export function successMapCsv(e: SuccessMap): string {
  const head = [...e.axes.map((a) => columnHead(a.name, a.unit)), "successes", "cases", "probability", "lower", "upper", "most frequent failure"];
  const rows = e.points.map((p) => [...p.at.map((k, a) => e.axes[a].labels?.[k] ?? e.axes[a].values[k]), p.successes, p.trials, p.estimate, p.lower, p.upper, p.deciding]);
  return rowsToText([head, ...rows]);
}
