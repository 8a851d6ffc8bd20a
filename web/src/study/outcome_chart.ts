// Objective over the search, and over each variable: filled dots meet all limits, hollow ones do not, crosses have no
// objective.
import * as Plot from "@observablehq/plot";
import { element } from "../dom";
import { lineColor, onThemeChange } from "../plots/theme_colors";
import { chartCard, type ChartCard } from "./chart_card";
import { pointsToText } from "./csv";
import { failureStrip, kStrip } from "./failure_strip";
import { describePoint, fieldLabel, plural } from "./describe";
import type { LegendItem } from "./export";
import { Field } from "./field";
import { axisOptions, columnsFor, domainOf, kStyle } from "./scales";
import { kOutcomeColors, type Search } from "./search";
import { span } from "./shape";
import { makePointable, Spots } from "./spots";
import type { StudyState } from "./state";
import { onWidth, toggle, whileSeen } from "./ui";

const kMaxVectorDots = 3000;

export interface OutcomeSpec {
  id: string;
  title: string;
  study: string;
  search: Search;
  objective: Field;
  searches: string[]; // per evaluation: "sample", "local 1"
  before: number | null; // objective before
  against: (Field | null)[]; // a panel each; null: the number of the evaluation
}

const kSearchColors = ["#777777", "#0072b2", "#009e73", "#cc79a7", "#8a7400", "#56b4e9", "#e69f00"];

export class OutcomeChart {
  readonly card: ChartCard;
  private width = 0;
  private log = false;
  private rings: (() => void)[] = [];
  private readonly kinds: string[];

  constructor(
    private readonly state: StudyState,
    private readonly spec: OutcomeSpec,
  ) {
    this.kinds = [...new Set(spec.searches)];
    const csv = (): string => pointsToText(state.table, Array.from({ length: state.table.size }, (_, k) => k), [...state.table.axes, spec.objective]);
    this.card = chartCard({ id: spec.id, title: spec.title, study: spec.study, csv });
    const positive = span(spec.objective.values).least > 0;
    if (positive) this.card.controls.append(toggle("log scale", false, (on) => ((this.log = on), this.draw())));
    onWidth(this.card.body, (width) => {
      this.width = width;
      this.draw();
    });
    state.listenSelect(() => this.rings.forEach((ring) => ring()));
    state.listenFilter(whileSeen(this.card.root, () => this.draw()));
    onThemeChange(() => this.draw());
  }

  private color(point: number): string {
    return lineColor(kSearchColors[Math.max(0, this.kinds.indexOf(this.spec.searches[point])) % kSearchColors.length]);
  }

  private draw(): void {
    if (this.width === 0) return;
    const { against } = this.spec;
    const columns = columnsFor(against.length, this.width, 260);
    const width = Math.floor((this.width - 16 * (columns - 1)) / columns);
    this.rings = [];
    const panels = against.map((field) => element("figure", { class: "st-panel" }, this.panel(field, width, against.length > 1)));
    this.card.body.replaceChildren(element("div", { class: "st-panels" }, ...panels));
    this.card.setLegend(this.legend());
    const many = this.state.table.size > kMaxVectorDots;
    this.card.note.textContent = many ? `${plural(kMaxVectorDots, "dot")} of ${plural(this.state.table.size, "evaluation")} drawn, evenly picked.` : "";
  }

  private legend(): LegendItem[] {
    const { outcome, best } = this.spec.search;
    const items: LegendItem[] = this.kinds.slice(0, 8).map((kind, k) => ({ color: lineColor(kSearchColors[k % kSearchColors.length]), text: kind, shape: "dot" }));
    if (outcome.includes("beyond")) items.push({ color: kOutcomeColors.beyond, text: "beyond a limit", shape: "ring" });
    if (outcome.includes("none")) items.push({ color: kOutcomeColors.none, text: "failed or unreachable", shape: "cross" });
    if (this.spec.against.includes(null)) items.push({ color: "#d55e00", text: "best so far" });
    if (this.spec.before !== null) items.push({ color: "#777777", text: "before", dash: "4,3" });
    if (best !== null) items.push({ color: "#e69f00", text: "the best", shape: "ring" });
    return items;
  }

  private panel(field: Field | null, width: number, small: boolean): SVGSVGElement {
    const { objective, search } = this.spec;
    const height = small ? 230 : Math.round(Math.min(380, Math.max(250, width * 0.5)));
    const x = (k: number): number => (field ? field.values[k] : k);
    const y = (k: number): number => objective.values[k];
    const { least, greatest } = span([...objective.values, this.spec.before ?? NaN]);
    const step = Math.ceil(this.state.table.size / kMaxVectorDots);
    const points = Array.from({ length: this.state.table.size }, (_, k) => k).filter((k) => k % step === 0 || k === search.best);
    const margin = { left: 62, bottom: 42, right: 14 };
    const strip = points.some((k) => search.outcome[k] === "none");
    const plot = Plot.plot({
      width, height, marginLeft: margin.left, marginBottom: margin.bottom, marginTop: 26, marginRight: margin.right, insetBottom: strip ? kStrip : 0, style: kStyle,
      x: axisOptions(field, "evaluation", false, width - 76),
      y: { ...axisOptions(objective, "", this.log, height, width - 20), domain: domainOf(least, greatest, this.log), grid: true, nice: !this.log, ...(this.log ? {} : { ticks: Math.max(3, height / 60) }) },
      color: { type: "identity" },
      marks: [...(strip ? [failureStrip(width, height, margin)] : []), ...this.marks(points, x, y, field === null)],
    }) as SVGSVGElement & Plot.Plot;
    plot.setAttribute("role", "img");
    plot.setAttribute("aria-label", `${fieldLabel(objective)} against ${field ? fieldLabel(field) : "evaluation"}`);
    const spots = new Spots();
    const [sx, sy] = [plot.scale("x"), plot.scale("y")];
    for (const k of points) {
      const py = Number.isFinite(y(k)) ? sy!.apply(y(k)) : height - margin.bottom - kStrip / 2;
      const px = sx?.apply(x(k));
      if (Number.isFinite(px) && Number.isFinite(py)) spots.add(k, px, py);
    }
    const describe = (k: number): string[] => [...describePoint(this.state.table, k, [objective]), this.spec.searches[k] ?? ""];
    this.rings.push(makePointable({ svg: plot, spots, state: this.state, describe }));
    return plot;
  }

  private marks(points: number[], x: (k: number) => number, y: (k: number) => number, history: boolean): Plot.Markish[] {
    const { search, before } = this.spec;
    const passing = this.state.passing;
    const marks: Plot.Markish[] = [];
    if (before !== null) marks.push(Plot.ruleY([before], { stroke: "#777777", strokeDasharray: "4,3" }));
    const of = (outcome: string): number[] => points.filter((k) => search.outcome[k] === outcome);
    const dotStyle = { x, y, r: points.length > 400 ? 2 : 3.2, opacity: (k: number) => (passing[k] ? 1 : 0.2) };
    marks.push(Plot.dot(of("beyond"), { ...dotStyle, stroke: kOutcomeColors.beyond, strokeWidth: 1.2, fill: "none" }));
    marks.push(Plot.dot(of("acceptable"), { ...dotStyle, fill: (k: number) => this.color(k), stroke: "none" }));
    marks.push(Plot.dot(of("none"), { x, frameAnchor: "bottom", dy: -kStrip / 2, symbol: "times", r: 3, stroke: kOutcomeColors.none, strokeWidth: 1.3 }));
    if (history) marks.push(Plot.line(points, { x, y: (k: number) => search.bestSoFar[k], curve: "step-after", stroke: "#d55e00", strokeWidth: 1.8 }));
    if (search.best !== null) marks.push(Plot.dot([search.best], { x, y, r: 6, stroke: "#e69f00", strokeWidth: 2.2, fill: "none" }));
    return marks;
  }
}
