// Influence: the share of an output's variance that each input explains alone, and the direction of its effect.
import * as Plot from "@observablehq/plot";
import { element } from "../dom";
import { number } from "../format";
import { css, lineColor, onThemeChange } from "../plots/theme_colors";
import { chartCard, type ChartCard } from "../study/chart_card";
import { rowsToText } from "../study/csv";
import { plural, shortened } from "../study/describe";
import type { LegendItem } from "../study/export";
import { kStyle } from "../study/scales";
import { hideTooltip, showTooltip } from "../study/tooltip";
import { onWidth, select, toggle } from "../study/ui";
import type { CampaignModel, Influence, Sensitivity } from "./model";
import { distinctNames } from "./names";

const kRow = 26; // [px]
const kGap = 16; // between panels [px]
const [kIndex, kUp, kDown] = ["#0072b2", "#009e73", "#cc79a7"];

export class InfluenceChart {
  readonly card: ChartCard;
  private of: Sensitivity;
  private grouped: boolean; // groups of inputs, and the design's axes
  private width = 0;

  // Null: the campaign has no sensitivities.
  static of(model: CampaignModel, study: string): InfluenceChart | null {
    return model.sensitivities.length > 0 && model.inputs.length > 0 ? new InfluenceChart(model, study) : null;
  }

  private constructor(
    private readonly model: CampaignModel,
    study: string,
  ) {
    const all = model.sensitivities;
    this.of = all.find((s) => s.output === "success" && tells(s)) ?? all.find(tells) ?? all[0];
    this.card = chartCard({ id: "influence", title: "What matters", study, csv: () => csv(this.of, this.grouped) });
    const tells_more = model.groups.some((g) => g.design || g.inputs.length > 1);
    this.grouped = tells_more && all.some((s) => s.groups.length > 0);
    this.card.controls.append(
      select("Output", all.map((s, k) => ({ value: String(k), text: s.of === "criterion" ? `criterion: ${s.output}` : s.output })), String(all.indexOf(this.of)), (k) => ((this.of = all[Number(k)] ?? this.of), this.draw())),
      ...(this.grouped ? [toggle("grouped", true, (on) => ((this.grouped = on), this.draw()))] : []),
    );
    onWidth(this.card.body, (width) => {
      this.width = width;
      this.draw();
    });
    onThemeChange(() => this.width > 0 && this.draw());
  }

  private draw(): void {
    const { of, width } = this;
    this.card.setTitle(`Influence on ${of.output === "success" ? "success" : of.output}`);
    const shown = this.grouped && of.groups.length > 0 ? of.groups : of.influences;
    this.card.note.textContent = note(of, shown, this.model.measuresLeftOut);
    const rows = sorted(shown);
    this.card.setLegend([]);
    if (!tells(of)) return this.card.body.replaceChildren(element("p", { class: "st-note" }, `${of.output} is the same in all cases: no input has an influence.`));
    // Side by side, the same rows at the same heights; names stand above the bars where beside them there is no room.
    const [beside, roomy] = [width >= 560, width >= 860];
    const names = roomy ? Math.min(290, 24 + 6.8 * Math.max(...rows.map((r) => r.input.length))) : 0;
    const rest = width - kGap - names;
    const [first, second] = !beside ? [width, width] : roomy ? [Math.floor(names + 0.44 * rest), Math.floor(0.56 * rest)] : [Math.floor(rest / 2), Math.floor(rest / 2)];
    this.card.body.replaceChildren(
      element("div", { class: "cp-pair" },
        this.panel(`Variance explained by each ${this.grouped ? "group of inputs" : "input"} alone`, this.indices(rows, { width: first, left: roomy ? names : 12, names: roomy ? "margin" : "above" }), first),
        this.panel("Direction of the effect", this.ranks(rows, { width: second, left: 12, names: roomy ? "across" : "above" }), second)),
    );
    const dot = (color: string, text: string): LegendItem => ({ color, text, shape: "dot" });
    const what = of.output === "success" ? "success" : "output";
    this.card.setLegend([
      dot(lineColor(kIndex), "share of the variance"),
      { color: css("--ink"), text: "two standard errors to both sides" },
      dot(lineColor(kUp), `${what} rises as the input rises`),
      dot(lineColor(kDown), `${what} falls as the input rises`),
    ]);
  }

  private panel(title: string, plot: SVGSVGElement, width: number): HTMLElement {
    const made = element("figure", { class: "st-panel", "data-panel-title": shortened(title, Math.floor(width / 6.4)) }, element("figcaption", {}, title), plot);
    made.style.width = `${width}px`; // else a long title would push the second panel below the first
    return made;
  }

  private frame(rows: Influence[], place: Place, x: Plot.ScaleOptions, domain: [number, number], marks: Plot.Markish[], description: string): SVGSVGElement {
    const step = stepOf(place);
    const ink = css("--ink");
    const plot = Plot.plot({
      width: place.width, height: rows.length * step + 52, marginLeft: place.left, marginRight: 18, marginTop: 4, marginBottom: 44, style: kStyle,
      x: { grid: true, labelAnchor: "center", labelArrow: "none", ...x, domain },
      y: { type: "band", domain: rows.map((r) => r.input), axis: null, padding: 0 },
      marks: [
        Plot.barX(rows.filter((_, k) => k % 2 === 0), { x1: domain[0], x2: domain[1], y: "input", fill: ink, fillOpacity: 0.045 }), // leads the eye across
        ...marks,
        ...namesOf(rows, place, ink),
      ],
    }) as SVGSVGElement & Plot.Plot;
    plot.setAttribute("role", "img");
    plot.setAttribute("aria-label", description);
    pointRows(plot, rows, step);
    return plot;
  }

  private indices(rows: Influence[], place: Place): SVGSVGElement {
    const known = rows.filter((r) => Number.isFinite(r.firstOrder));
    const ends = known.flatMap((r) => [r.firstOrder - error(r), r.firstOrder + error(r)]);
    const domain: [number, number] = [Math.min(0, ...ends), Math.max(0.1, ...ends)];
    const above = place.names === "above";
    const marks = [
      Plot.barX(known, { x1: 0, x2: "firstOrder", y: "input", fill: lineColor(kIndex), ...insetOf(place) }),
      Plot.link(known, { x1: (r: Influence) => r.firstOrder - error(r), x2: (r: Influence) => r.firstOrder + error(r), y1: "input", y2: "input", dy: above ? 8 : 0, stroke: css("--ink"), strokeWidth: 1.5 }),
      Plot.ruleX([0], { stroke: "currentColor" }),
    ];
    const said = rows.map((r) => `${r.input} ${number(r.firstOrder, 3)} ± ${number(r.error, 2)}`).join(", ");
    return this.frame(rows, place, { label: "first-order Sobol index", ticks: Math.max(3, (place.width - place.left) / 80) }, domain, marks, `First-order Sobol indices of ${this.of.output}: ${said}`);
  }

  private ranks(rows: Influence[], place: Place): SVGSVGElement {
    const known = rows.filter((r) => Number.isFinite(r.rank));
    const end = rankEnd(known);
    const marks = [
      Plot.barX(known, { x1: 0, x2: "rank", y: "input", fill: (r: Influence) => lineColor(r.rank < 0 ? kDown : kUp), ...insetOf(place) }),
      Plot.ruleX([0], { stroke: "currentColor" }),
    ];
    const ticks = [-end, -end / 2, 0, end / 2, end];
    const said = rows.map((r) => `${r.input} ${number(r.rank, 2)}`).join(", ");
    return this.frame(rows, place, { label: "Spearman's rank correlation", ticks, tickFormat: (v: number) => number(v, 3) }, [-end, end], marks, `Rank correlations with ${this.of.output}: ${said}`);
  }
}

// Where a panel's names stand: left of the bars, above each, or across zero from it.
interface Place {
  width: number;
  left: number; // its margin
  names: "margin" | "above" | "across";
}

function stepOf(place: Place): number {
  return place.names === "above" ? kRow + 16 : kRow;
}

function insetOf(place: Place): { insetTop: number; insetBottom: number } {
  return place.names === "above" ? { insetTop: 19, insetBottom: 3 } : { insetTop: 5, insetBottom: 5 };
}

function namesOf(rows: Influence[], place: Place, ink: string): Plot.Markish[] {
  const inputs = rows.map((r) => r.input);
  const halo = { fill: ink, stroke: css("--card"), strokeWidth: 4 };
  const named = (most: number): ((r: Influence) => string) => {
    const short = new Map(distinctNames(inputs, most).map((name, k) => [inputs[k], name]));
    return (r) => short.get(r.input) ?? r.input;
  };
  if (place.names === "above") return [Plot.text(rows, { y: "input", frameAnchor: "left", textAnchor: "start", dx: 3, dy: -13, text: named(Math.floor((place.width - 30) / 6.8)), ...halo })];
  if (place.names === "margin") return [Plot.text(rows, { y: "input", frameAnchor: "left", textAnchor: "end", dx: -8, text: named(Math.floor((place.left - 16) / 6.8)), fill: ink })];
  const text = named(Math.floor(((place.width - place.left - 18) / 2 - 10) / 6.4));
  const left = (r: Influence): boolean => !(r.rank < 0);
  return [true, false].map((side) => Plot.text(rows.filter((r) => left(r) === side), { x: 0, y: "input", textAnchor: side ? "end" : "start", dx: side ? -6 : 6, text, fontSize: 11.5, ...halo }));
}

// The axis of correlations: symmetric, as far as they reach.
function rankEnd(known: Influence[]): number {
  const most = Math.max(0, ...known.map((r) => Math.abs(r.rank)));
  return [0.1, 0.2, 0.4, 0.6, 0.8].find((end) => end >= most) ?? 1;
}

// Whiskers are two standard errors.
function error(r: Influence): number {
  return Number.isFinite(r.error) ? 2 * r.error : 0;
}

function tells(s: Sensitivity): boolean {
  return s.influences.some((i) => Number.isFinite(i.firstOrder) || Number.isFinite(i.rank));
}

function sorted(influences: Influence[]): Influence[] {
  const size = (i: Influence): number => (Number.isFinite(i.firstOrder) ? i.firstOrder : -1);
  const rank = (i: Influence): number => (Number.isFinite(i.rank) ? Math.abs(i.rank) : 0);
  return [...influences].sort((a, b) => size(b) - size(a) || rank(b) - rank(a));
}

function note(s: Sensitivity, shown: Influence[], leftOut: number): string {
  const known = shown.filter((i) => Number.isFinite(i.firstOrder));
  const sum = known.reduce((total, i) => total + Math.max(0, i.firstOrder), 0);
  const parts = [
    known.length > 0 ? `Indices sum to ${number(sum, 2)}: ${sumInWords(sum)}.` : "",
    shown === s.groups && Number.isFinite(s.unexplained) ? `Unexplained by them one by one: ${Math.round(100 * s.unexplained)} % of the variance. Related inputs form a group; for a group it is the variance explained by a quadratic function of its inputs.` : "",
    s.count > 0 ? `From ${plural(s.count, "case")}.` : "",
    known.length > 0 ? "Indices within two standard errors of 0 are not significant. Inputs are assumed to be independent." : "",
    leftOut > 0 ? `${plural(leftOut, "column")} left out in campaign.json.` : "",
  ];
  return parts.filter(Boolean).join(" ");
}

// Of independent inputs the sum is 1 at most; estimates of many small ones add up their errors.
function sumInWords(sum: number): string {
  if (sum > 1.2) return "more than 1, so inputs are correlated";
  return sum > 0.9 ? "inputs act independently" : `the other ${number(1 - sum, 2)} of the variance is due to interactions, or to influences that are not drawn`;
}

function pointRows(plot: SVGSVGElement, rows: Influence[], step: number): void {
  plot.addEventListener("pointermove", (event) => {
    const row = rows[Math.floor((event.clientY - plot.getBoundingClientRect().top - 4) / step)];
    if (!row) return hideTooltip();
    showTooltip([row.input, `first-order index ${number(row.firstOrder, 3)} ± ${number(row.error, 2)} (standard error)`, `rank correlation ${number(row.rank, 3)}`], event.clientX, event.clientY);
  });
  plot.addEventListener("pointerleave", hideTooltip);
}

function csv(s: Sensitivity, grouped: boolean): string {
  const rows = sorted(grouped && s.groups.length > 0 ? s.groups : s.influences).map((i) => [s.output, i.input, i.firstOrder, i.error, i.rank]);
  return rowsToText([["output", "input", "first-order index", "its standard error", "rank correlation"], ...rows]);
}
