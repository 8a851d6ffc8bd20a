// Drawn inputs, one per panel: histogram of values and probability of success.
import * as Plot from "@observablehq/plot";
import { element } from "../dom";
import { columnHead, label, number, withUnit } from "../format";
import { css, lineColor, onThemeChange } from "../plots/theme_colors";
import { chartCard, type ChartCard } from "../study/chart_card";
import { rowsToText } from "../study/csv";
import { breakable, counted, plural } from "../study/describe";
import { columnsFor, kStyle } from "../study/scales";
import { hideTooltip, showTooltip } from "../study/tooltip";
import { onWidth } from "../study/ui";
import { binsOf } from "./distribution";
import type { CampaignModel, Described, Group } from "./model";
import { kSuccessColors } from "./sample";
import { interval, percent, probability, tickOf } from "./words";

const kLeast = 250; // [px] of a panel

export class InputsChart {
  readonly card: ChartCard;
  private width = 0;

  // Null: no drawn inputs.
  static of(model: CampaignModel, study: string): InputsChart | null {
    return model.inputs.some((d) => d.histogram) ? new InputsChart(model, study) : null;
  }

  private constructor(
    private readonly model: CampaignModel,
    study: string,
  ) {
    this.card = chartCard({ id: "inputs", title: "Inputs as drawn, and success along each", study, csv: () => csv(model) });
    this.card.note.textContent = `Below: success among cases in groups of equal number by the input (from the smallest to the largest value of each), with ${percent(model.confidence)} intervals; the thin line is the success of all.`;
    onWidth(this.card.body, (width) => {
      this.width = width;
      this.draw();
    });
    onThemeChange(() => this.width > 0 && this.draw());
  }

  private draw(): void {
    const shown = this.model.inputs.filter((d) => d.histogram);
    const columns = columnsFor(shown.length, this.width, kLeast);
    const width = Math.floor((this.width - 16 * (columns - 1)) / columns);
    const low = leastSuccess(shown);
    this.card.body.replaceChildren(element("div", { class: "st-panels cp-inputs" }, ...shown.map((d) => this.panel(d, width, low))));
    this.card.setLegend([
      { color: lineColor(kSuccessColors[1]), text: "success", shape: "dot" },
      { color: lineColor(kSuccessColors[0]), text: "no success", shape: "dot" },
    ]);
  }

  private panel(d: Described, width: number, low: number): HTMLElement {
    const title = label(d.name, d.unit);
    const parts: Node[] = [element("figcaption", { title: d.description }, breakable(title)), this.histogram(d, width, d.successBy.length > 1)];
    if (d.successBy.length > 1) parts.push(this.success(d, width, low));
    const made = element("figure", { class: "st-panel cp-input", "data-panel-title": title }, ...parts);
    made.style.width = `${width}px`;
    return made;
  }

  private histogram(d: Described, width: number, shared: boolean): SVGSVGElement {
    const bins = binsOf(d);
    const [good, bad] = [lineColor(kSuccessColors[1]), lineColor(kSuccessColors[0])];
    const inset = { insetLeft: 0.5, insetRight: 0.5 };
    const plot = Plot.plot({
      width, height: shared ? 122 : 134, marginLeft: 46, marginRight: 12, marginTop: 24, marginBottom: shared ? 10 : 22, style: kStyle,
      x: { domain: [bins[0].from, bins[bins.length - 1].to], label: null, ticks: Math.max(2, width / 90), ...tickOf(furthest(bins)), ...(shared ? { tickFormat: () => "" } : {}) }, // numbers stand below the second picture
      y: { label: "cases", labelArrow: "none", grid: true, ticks: 3, tickFormat: short },
      marks: [
        Plot.rectY(bins, { x1: "from", x2: "to", y1: 0, y2: "successes", fill: good, ...inset }),
        Plot.rectY(bins, { x1: "from", x2: "to", y1: "successes", y2: "count", fill: bad, ...inset }),
        Plot.ruleY([0], { stroke: "currentColor" }),
      ],
    }) as SVGSVGElement & Plot.Plot;
    describe(plot, `Distribution of ${label(d.name, d.unit)} as drawn: mean ${number(d.mean)}, standard deviation ${number(d.deviation)}, ${number(d.least)} to ${number(d.largest)}`);
    pointAlong(plot, (value) => {
      const bin = bins.find((b) => value >= b.from && value < b.to);
      return bin ? [`${number(bin.from)} to ${withUnit(bin.to, d.unit)}`, plural(bin.count, "case"), `${plural(bin.count - bin.successes, "case")} without success`] : null;
    });
    return plot;
  }

  private success(d: Described, width: number, low: number): SVGSVGElement {
    const bins = binsOf(d);
    const ink = css("--ink");
    const middle = (g: Group): number => (g.from + g.to) / 2;
    const plot = Plot.plot({
      width, height: 120, marginLeft: 46, marginRight: 12, marginTop: 22, marginBottom: 22, style: kStyle,
      x: { domain: [bins[0].from, bins[bins.length - 1].to], label: null, ticks: Math.max(2, width / 90), ...tickOf(furthest(bins)) },
      y: { domain: [low, 1], label: "success", labelArrow: "none", grid: true, ticks: 3 },
      marks: [
        Plot.ruleY([this.model.success.estimate].filter(Number.isFinite), { stroke: css("--muted"), strokeWidth: 1 }),
        Plot.ruleY(d.successBy, { y: "estimate", x1: "from", x2: "to", stroke: lineColor(kSuccessColors[1]), strokeOpacity: 0.45, strokeWidth: 1.5 }),
        Plot.ruleX(d.successBy, { x: middle, y1: "lower", y2: "upper", stroke: ink, strokeOpacity: 0.55, strokeWidth: 1.5, clip: true }),
        Plot.dot(d.successBy, { x: middle, y: "estimate", r: 2.8, fill: lineColor(kSuccessColors[1]), stroke: css("--card"), strokeWidth: 0.7 }),
      ],
    }) as SVGSVGElement & Plot.Plot;
    describe(plot, `Success along ${d.name}: ${d.successBy.map((g) => `${number(middle(g))}: ${probability(g.estimate)}`).join(", ")}`);
    pointAlong(plot, (value) => {
      const g = d.successBy.reduce<Group | null>((best, one) => (best && Math.abs(middle(best) - value) <= Math.abs(middle(one) - value) ? best : one), null);
      return g ? [`${number(g.from)} to ${withUnit(g.to, d.unit)}`, `success ${probability(g.estimate)} (${interval(g)})`, plural(g.trials, "case")] : null;
    });
    return plot;
  }
}

function furthest(bins: { from: number; to: number }[]): number {
  return Math.max(Math.abs(bins[0].from), Math.abs(bins[bins.length - 1].to));
}

// 800, 12k, 1.5M: the margin is narrow.
function short(count: number): string {
  if (count >= 1e6) return `${count / 1e6}M`;
  return count >= 1e4 ? `${count / 1e3}k` : counted(count);
}

// All panels have one axis, from a little below the least.
function leastSuccess(inputs: Described[]): number {
  const least = Math.min(1, ...inputs.flatMap((d) => d.successBy.map((g) => g.lower)));
  return Math.max(0, Math.floor(least * 20 - 0.5) / 20);
}

function describe(plot: SVGSVGElement, text: string): void {
  plot.setAttribute("role", "img");
  plot.setAttribute("aria-label", text);
}

function pointAlong(plot: SVGSVGElement & Plot.Plot, say: (value: number) => string[] | null): void {
  const x = plot.scale("x")!;
  plot.addEventListener("pointermove", (event) => {
    const lines = say(x.invert!(event.clientX - plot.getBoundingClientRect().left));
    if (lines) showTooltip(lines, event.clientX, event.clientY);
    else hideTooltip();
  });
  plot.addEventListener("pointerleave", hideTooltip);
}

function csv(model: CampaignModel): string {
  const rows = model.inputs.flatMap((d) => binsOf(d).map((b) => [columnHead(d.name, d.unit), b.from, b.to, b.count, b.successes]));
  return rowsToText([["input", "from", "to", "cases", "successes"], ...rows]);
}
