// The distribution of a column over all cases: histogram or distribution function, with quantiles and the criteria's
// limits.
import * as Plot from "@observablehq/plot";
import { element } from "../dom";
import { css, lineColor, onThemeChange } from "../plots/theme_colors";
import { chartCard, type ChartCard } from "../study/chart_card";
import { rowsToText } from "../study/csv";
import { counted, plural, shortened } from "../study/describe";
import { columnHead, label, number, withUnit } from "../format";
import type { LegendItem } from "../study/export";
import { plainName } from "../study/field";
import { kStyle } from "../study/scales";
import { hideTooltip, showTooltip } from "../study/tooltip";
import { onWidth, select } from "../study/ui";
import { bandWidth, cumulative, shareAt, type CumulativePoint } from "./cumulative";
import { type CampaignModel, type Described, describedOf, kindOf, type Limit, type Quantile } from "./model";
import { mainDescribed, optionsOf } from "./pick";
import { kSuccessColors } from "./sample";
import { percent, probability, tickOf } from "./words";

type View = "histogram" | "cumulative";

interface Mark {
  value: number;
  text: string;
}

export class DistributionChart {
  readonly card: ChartCard;
  private of: Described;
  private view: View = "histogram";
  private width = 0;
  private readonly quantiles = element("div", { class: "st-scroll cp-quantiles", role: "group", "aria-label": "Quantiles" });

  // Null: no column has a distribution.
  static of(model: CampaignModel, study: string): DistributionChart | null {
    const main = mainDescribed(model);
    return main ? new DistributionChart(model, study, main) : null;
  }

  private constructor(
    private readonly model: CampaignModel,
    study: string,
    main: Described,
  ) {
    this.of = main;
    this.card = chartCard({ id: "distribution", title: "Distribution", study, csv: () => (this.view === "histogram" ? binsCsv(this.of) : cumulativeCsv(this.of)) });
    this.card.body.after(this.quantiles);
    const all = describedOf(model);
    this.card.controls.append(
      select("Column", optionsOf(model), kindOf(this.of), (kind) => ((this.of = all.find((d) => kindOf(d) === kind) ?? this.of), this.draw())),
      select("as", [{ value: "histogram", text: "histogram" }, { value: "cumulative", text: "distribution function" }], this.view, (view) => ((this.view = view as View), this.draw())),
    );
    onWidth(this.card.body, (width) => {
      this.width = width;
      this.draw();
    });
    onThemeChange(() => this.width > 0 && this.draw());
  }

  private draw(): void {
    const { of } = this;
    this.card.setTitle(`Distribution of ${plainName(of.name)}`);
    this.card.note.textContent = summary(of);
    const { histogram } = of;
    this.quantiles.replaceChildren(...quantileTable(of, this.model.confidence, this.width < 480));
    if (!histogram) return this.card.body.replaceChildren();
    const limits = this.model.limits.filter((l) => l.column === of.name && Number.isFinite(l.value));
    const domain = domainOf(histogram.begin, histogram.end, limits);
    const plot = this.view === "histogram" ? this.histogram(domain, limits) : this.function(domain, limits);
    plot.setAttribute("role", "img");
    plot.setAttribute("aria-label", `Distribution of ${label(plainName(of.name), of.unit)}. ${summary(of)}`);
    this.card.body.replaceChildren(plot);
    this.legend(limits, domain);
  }

  private options(domain: [number, number], y: Plot.ScaleOptions): Plot.PlotOptions {
    const { of, width } = this;
    return {
      width, height: 330, marginLeft: 58, marginBottom: 42, marginTop: 48, marginRight: 16, style: kStyle,
      x: { domain, label: axisName(of, width), labelArrow: "none", labelAnchor: "center", ticks: Math.max(3, width / 90), ...tickOf(Math.max(...domain.map(Math.abs))) },
      y: { labelArrow: "none", grid: true, ...y },
    };
  }

  private histogram(domain: [number, number], limits: Limit[]): SVGSVGElement & Plot.Plot {
    const bins = binsOf(this.of);
    const inset = bins.length > 80 ? {} : { insetLeft: 0.5, insetRight: 0.5 };
    const plot = Plot.plot({
      ...this.options(domain, { label: "cases", tickFormat: counted, ticks: 5 }),
      marks: [
        Plot.rectY(bins, { x1: "from", x2: "to", y1: 0, y2: "successes", fill: lineColor(kSuccessColors[1]), ...inset }),
        Plot.rectY(bins, { x1: "from", x2: "to", y1: "successes", y2: "count", fill: lineColor(kSuccessColors[0]), ...inset }),
        Plot.ruleY([0], { stroke: "currentColor" }),
        ...this.lines(domain, limits),
      ],
    }) as SVGSVGElement & Plot.Plot;
    const x = plot.scale("x")!;
    const total = bins.reduce((sum, b) => sum + b.count, 0);
    pointAlong(plot, (px) => {
      const value = x.invert!(px);
      const bin = bins.find((b) => value >= b.from && value < b.to);
      return bin ? [`${number(bin.from)} to ${withUnit(bin.to, this.of.unit)}`, `${plural(bin.count, "case")}, ${number((100 * bin.count) / total, 3)}\u202f%`, ...(this.of.histogram?.successes ? [`${plural(bin.count - bin.successes, "case")} without success`] : [])] : null;
    });
    return plot;
  }

  private function(domain: [number, number], limits: Limit[]): SVGSVGElement & Plot.Plot {
    const { of } = this;
    const points = cumulative(of);
    const half = bandWidth(of.count, this.model.confidence);
    const band = (p: CumulativePoint): [number, number] => [Math.max(0, p.share - half), Math.min(1, p.share + half)];
    const blue = lineColor("#0072b2");
    const plot = Plot.plot({
      ...this.options(domain, { label: "share of cases up to", domain: [0, 1], ticks: 5 }),
      marks: [
        Plot.areaY(points, { x: "value", y1: (p: CumulativePoint) => band(p)[0], y2: (p: CumulativePoint) => band(p)[1], fill: blue, fillOpacity: 0.18, clip: true }),
        Plot.line(points, { x: "value", y: "share", stroke: blue, strokeWidth: 2, clip: true }),
        Plot.ruleY([0], { stroke: "currentColor" }),
        ...this.lines(domain, limits),
      ],
    }) as SVGSVGElement & Plot.Plot;
    const x = plot.scale("x")!;
    pointAlong(plot, (px) => {
      const value = x.invert!(px);
      if (!(value >= domain[0] && value <= domain[1])) return null;
      const share = shareAt(points, value);
      return [`up to ${withUnit(value, of.unit)}`, `${probability(share)} of cases`, `above it ${probability(1 - share)}`];
    });
    return plot;
  }

  // Quantiles and limits as lines, named above the frame; names that would overlap appear in the legend only.
  private lines(domain: [number, number], limits: Limit[]): Plot.Markish[] {
    const ink = css("--ink");
    const marks = quantileMarks(this.of).filter((m) => m.value >= domain[0] && m.value <= domain[1]);
    const pixels = (v: number): number => ((v - domain[0]) / (domain[1] - domain[0])) * (this.width - 74);
    const named: Mark[] = [];
    const order = [...marks].sort((a, b) => Math.abs(0.5 - Number(a.text)) - Math.abs(0.5 - Number(b.text)));
    for (const m of order) if (named.every((n) => Math.abs(pixels(n.value) - pixels(m.value)) > 38)) named.push(m);
    const red = lineColor("#d55e00");
    return [
      Plot.ruleX(marks, { x: "value", stroke: ink, strokeDasharray: "3,3", strokeOpacity: 0.75 }),
      Plot.text(named, { x: "value", frameAnchor: "top", dy: -14, text: "text", fill: ink, fontSize: 11, stroke: css("--card"), strokeWidth: 4 }),
      Plot.ruleX(limits, { x: "value", stroke: red, strokeWidth: 2 }),
      Plot.text(limits, { x: "value", frameAnchor: "top", dy: -30, text: (l: Limit) => `limit ${number(l.value)}`, fill: red, fontWeight: 600 }),
    ].flat();
  }

  private legend(limits: Limit[], domain: [number, number]): void {
    const dot = (color: string, text: string): LegendItem => ({ color: lineColor(color), text, shape: "dot" });
    const items: LegendItem[] = [
      ...(this.view === "histogram" && this.of.histogram?.successes ? [dot(kSuccessColors[1], "success"), dot(kSuccessColors[0], "no success")] : []),
      ...(this.of.quantiles.length > 0 ? [{ color: css("--ink"), text: "quantiles", dash: "3,3" }] : []),
      ...[...new Set(limits.map((l) => l.criterion))].map((name) => ({ color: lineColor("#d55e00"), text: `limit of “${shortened(name, 60)}”` })),
      ...(this.view === "cumulative" ? [{ color: lineColor("#0072b2"), text: `share of cases, with a ${percent(this.model.confidence)} band for the whole line` }] : []),
    ];
    this.card.setLegend(domain[1] > domain[0] ? items : []);
  }
}

interface Bin {
  from: number;
  to: number;
  count: number;
  successes: number; // all if not known
}

export function binsOf(of: Described): Bin[] {
  const { histogram } = of;
  if (!histogram || histogram.counts.length === 0) return [];
  const flat = !(histogram.end > histogram.begin); // all values are equal
  const half = flat ? Math.abs(histogram.begin) * 0.05 || 0.5 : 0;
  const [begin, end] = [histogram.begin - half, histogram.end + half];
  const n = flat ? 1 : histogram.counts.length;
  const sum = (v: number[]): number[] => (flat ? [v.reduce((a, b) => a + b, 0)] : v);
  const counts = sum(histogram.counts);
  const successes = sum(histogram.successes ?? histogram.counts);
  return counts.map((count, k) => ({ from: begin + (k * (end - begin)) / n, to: begin + ((k + 1) * (end - begin)) / n, count, successes: successes[k] }));
}

function quantileMarks(of: Described): Mark[] {
  return of.quantiles.filter((q) => Number.isFinite(q.value)).map((q) => ({ value: q.value, text: String(Number(q.probability.toPrecision(6))) }));
}

// All bins, and limits close to them.
function domainOf(begin: number, end: number, limits: Limit[]): [number, number] {
  const half = end > begin ? 0 : Math.abs(begin) * 0.05 || 0.5;
  let [low, high] = [begin - half, end + half];
  const size = high - low;
  for (const { value } of limits) if (value > low - size && value < high + size) [low, high] = [Math.min(low, value), Math.max(high, value)];
  const room = 0.02 * (high - low);
  return [low - (low < begin ? room : 0), high + (high > end ? room : 0)];
}

export function summary(of: Described): string {
  const parts = [
    of.description ? `${of.description[0].toUpperCase()}${of.description.slice(1)}.` : "",
    of.count > 0 ? `${plural(of.count, "case")}; mean ${withUnit(of.mean, of.unit)}, standard deviation ${number(of.deviation)}, from ${number(of.least)} to ${number(of.largest)}.` : "No case has a number here.",
    beyond(of),
    of.missing > 0 ? `${plural(of.missing, "case")} without a number.` : "",
  ];
  return parts.filter(Boolean).join(" ");
}

// With intervals for sufficiently large samples. `upright`: one quantile per row, for narrow screens.
function quantileTable(of: Described, confidence: number, upright: boolean): HTMLElement[] {
  const known = of.quantiles.filter((q) => Number.isFinite(q.value));
  if (known.length === 0) return [];
  const interval = known.some((q) => Number.isFinite(q.lower));
  const columns: [string, (q: Quantile) => string][] = [
    ["quantile", (q) => String(Number(q.probability.toPrecision(6)))],
    [label("value", of.unit), (q) => number(q.value)],
    ...(interval ? ([[`${percent(confidence)} interval from`, (q) => number(q.lower)], ["to", (q) => number(q.upper)]] as [string, (q: Quantile) => string][]) : []),
  ];
  const cells = columns.map(([head, cell]) => [head, ...known.map(cell)]);
  const lines = upright ? cells[0].map((_, k) => cells.map((line) => line[k])) : cells;
  const line = (texts: string[], first: boolean): HTMLElement => element("tr", {}, ...texts.map((text, k) => element(first || k === 0 ? "th" : "td", first || k === 0 ? { scope: first ? "col" : "row" } : {}, text)));
  return [element("table", { class: upright ? "st-grid cp-upright" : "st-grid" }, element("thead", {}, line(lines[0], true)), element("tbody", {}, ...lines.slice(1).map((texts) => line(texts, false))))];
}

function beyond(of: Described): string {
  const out = (of.histogram?.below ?? 0) + (of.histogram?.above ?? 0);
  return out > 0 ? `${plural(out, "case")} beyond the picture (${counted(of.histogram!.below)} below, ${counted(of.histogram!.above)} above).` : "";
}

function axisName(of: Described, width: number): string {
  const letters = Math.max(14, Math.floor((width - 90) / 6.6));
  return label(shortened(plainName(of.name), letters - of.unit.length - 3), of.unit);
}

function pointAlong(plot: SVGSVGElement, linesAt: (px: number) => string[] | null): void {
  plot.addEventListener("pointermove", (event) => {
    const lines = linesAt(event.clientX - plot.getBoundingClientRect().left);
    if (lines) showTooltip(lines, event.clientX, event.clientY);
    else hideTooltip();
  });
  plot.addEventListener("pointerleave", hideTooltip);
}

function binsCsv(of: Described): string {
  return rowsToText([["from", "to", "cases", "successes"], ...binsOf(of).map((b) => [b.from, b.to, b.count, b.successes])]);
}

function cumulativeCsv(of: Described): string {
  return rowsToText([[columnHead(of.name, of.unit), "share of cases up to it"], ...cumulative(of).map((p) => [p.value, p.share])]);
}
