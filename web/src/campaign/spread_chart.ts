// An output against an input, a dot per case of the sample, coloured by success, with quantiles of the output along the input.
import * as Plot from "@observablehq/plot";
import { element, svgElement } from "../dom";
import { css, lineColor, onThemeChange } from "../plots/theme_colors";
import { chartCard, type ChartCard } from "../study/chart_card";
import { pointsToText } from "../study/csv";
import { counted, describePoint, fieldLabel, plural } from "../study/describe";
import type { Field } from "../study/field";
import { axisOptions, domainOf, kStyle } from "../study/scales";
import { span } from "../study/shape";
import { makePointable, Spots } from "../study/spots";
import type { StudyState } from "../study/state";
import { fieldOptions, onWidth, select, toggle, whileSeen } from "../study/ui";
import { type Band, quantileBands } from "./bands";
import type { CampaignModel } from "./model";
import { mainDescribed } from "./pick";
import { kSuccessColors, type Sample } from "./sample";
import { tickOf } from "./words";

export class SpreadChart {
  readonly card: ChartCard;
  private x: Field;
  private y: Field;
  private bands = true;
  private width = 0;
  private ring: () => void = () => undefined;

  // Null: no inputs, no columns, or no sample.
  static of(state: StudyState, sample: Sample, model: CampaignModel, study: string): SpreadChart | null {
    const { table } = state;
    const y = table.find(mainDescribed(model)?.name ?? "") ?? table.fields.find((f) => f.role !== "axis" && !f.labels);
    const most = mostInfluential(model, y?.name ?? "");
    const x = table.axes.find((a) => a.name === most) ?? table.axes[0];
    return x && y && table.size > 0 ? new SpreadChart(state, sample, model, study, x, y) : null;
  }

  private constructor(
    private readonly state: StudyState,
    private readonly sample: Sample,
    private readonly model: CampaignModel,
    study: string,
    x: Field,
    y: Field,
  ) {
    [this.x, this.y] = [x, y];
    const { table } = state;
    this.card = chartCard({ id: "spread", title: "Output against input", study, csv: () => pointsToText(table, this.shown(), [...table.axes, sample.successField, this.y]) });
    const options = fieldOptions(table.fields.filter((f) => f !== sample.successField));
    const pick = (key: string): Field | undefined => table.fields.find((f) => f.key === key);
    this.card.controls.append(
      select("Column", options, this.y.key, (key) => ((this.y = pick(key) ?? this.y), this.draw())),
      select("against", options, this.x.key, (key) => ((this.x = pick(key) ?? this.x), this.draw())),
      toggle("quantiles", this.bands, (on) => ((this.bands = on), this.draw())),
    );
    onWidth(this.card.body, (width) => {
      this.width = width;
      this.draw();
    });
    state.listenSelect(() => this.ring());
    state.listenFilter(whileSeen(this.card.root, () => this.draw()));
    onThemeChange(() => this.draw());
  }

  private shown(): number[] {
    const [x, y] = [this.x.values, this.y.values];
    return Array.from(x.keys()).filter((k) => Number.isFinite(x[k]) && Number.isFinite(y[k]));
  }

  private draw(): void {
    if (this.width === 0) return;
    const points = this.shown();
    this.card.setTitle(`${this.y.words} against ${this.x.words}`);
    // Of the even sample only: cases included because they failed would bias the quantiles.
    const even = points.filter((k) => this.sample.drawn[k] === 1 && this.state.passing[k] === 1);
    const bands = this.bands ? quantileBands(this.x.values, this.y.values, even) : [];
    this.updateNote(points.length, bands);
    if (points.length === 0) return this.card.body.replaceChildren();
    const limits = this.model.limits.filter((l) => l.column === this.y.name);
    const ends = (f: Field, more: number[]): [number, number] => {
      const s = span([...points.map((k) => f.values[k]), ...more]);
      return domainOf(s.least, s.greatest, false);
    };
    const height = Math.round(Math.min(440, Math.max(280, this.width * 0.55)));
    const room = this.width - 40;
    const spots = new Spots();
    const ink = css("--ink");
    const near = limits.map((l) => l.value).filter((v) => isNear(v, points.map((k) => this.y.values[k])));
    const plot = Plot.plot({
      width: this.width, height, marginLeft: 58, marginBottom: 42, marginTop: 26, marginRight: 16, style: kStyle,
      x: { ...axisOptions(this.x, "", false, this.width - 58, room), ...tickOf(largest(this.x)), grid: true, labelAnchor: "center", domain: tight(points.map((k) => this.x.values[k]), this.x) },
      y: { ...axisOptions(this.y, "", false, height, room), ...tickOf(largest(this.y)), grid: true, domain: ends(this.y, near) },
      marks: [
        (_i, scales) => this.dots(points, scales as unknown as Places, spots),
        Plot.areaY(bands, { x: "x", y1: "low", y2: "high", fill: ink, fillOpacity: 0.13 }),
        Plot.line(bands, { x: "x", y: "low", stroke: ink, strokeWidth: 1.2, strokeDasharray: "4,3" }),
        Plot.line(bands, { x: "x", y: "high", stroke: ink, strokeWidth: 1.2, strokeDasharray: "4,3" }),
        Plot.line(bands, { x: "x", y: "middle", stroke: css("--card"), strokeWidth: 4.5 }),
        Plot.line(bands, { x: "x", y: "middle", stroke: ink, strokeWidth: 2 }),
        Plot.ruleY(near, { stroke: lineColor("#d55e00"), strokeWidth: 2 }),
      ],
    }) as SVGSVGElement & Plot.Plot;
    plot.setAttribute("role", "img");
    plot.setAttribute("aria-label", `${fieldLabel(this.y)} against ${fieldLabel(this.x)}, ${plural(points.length, "case")}`);
    const describe = (k: number): string[] => describePoint(this.state.table, k, [this.x, this.y, this.sample.successField]);
    this.ring = makePointable({ svg: plot, spots, state: this.state, describe, reach: 16 });
    this.card.body.replaceChildren(element("div", {}, plot));
    const dot = (color: string, text: string): { color: string; text: string; shape: "dot" } => ({ color: lineColor(color), text, shape: "dot" });
    this.card.setLegend([
      dot(kSuccessColors[1], "success"),
      dot(kSuccessColors[0], "no success"),
      ...(bands.length > 0 ? [{ color: ink, text: "median" }, { color: ink, text: "quantiles 0.05 and 0.95", dash: "4,3" }] : []),
      ...(near.length > 0 ? [{ color: lineColor("#d55e00"), text: "limit of a criterion" }] : []),
    ]);
  }

  private updateNote(shown: number, bands: Band[]): void {
    const { table } = this.state;
    const sampled = this.sample.complete ? "" : `${counted(table.size)} of ${plural(this.model.rows, "case")}: an even sample with failed and worst ones added. `;
    const without = table.size - shown;
    const quantiles = bands.length > 0 ? `Quantiles among about ${bands[0].count} neighbours${this.sample.complete ? "" : ", added cases left out"}. ` : this.bands ? "Too few cases for quantiles. " : "";
    this.card.note.textContent = `${sampled}${quantiles}${without > 0 ? `${plural(without, "case")} without a place here.` : ""}`.trim();
  }

  // The rarer outcome is drawn on top.
  private dots(points: number[], scales: Places, spots: Spots): SVGElement {
    const { passing } = this.state;
    const { success } = this.sample;
    const [good, bad] = [lineColor(kSuccessColors[1]), lineColor(kSuccessColors[0])];
    for (const k of points) spots.add(k, scales.x(this.x.values[k]), scales.y(this.y.values[k]));
    const above = points.reduce((sum, k) => sum + success[k], 0) > points.length / 2 ? 0 : 1;
    const rank = (i: number): number => (passing[points[i]] ? 2 : 0) + (success[points[i]] === above ? 1 : 0);
    const order = points.map((_, i) => i).sort((a, b) => rank(a) - rank(b) || a - b);
    const canvas = document.createElement("canvas");
    const [width, height] = [span(spots.x).greatest + 8, span(spots.y).greatest + 8];
    canvas.width = Math.ceil(width * 3);
    canvas.height = Math.ceil(height * 3);
    const pen = canvas.getContext("2d")!;
    pen.scale(3, 3);
    const size = points.length > 2000 ? 1.7 : points.length > 500 ? 2.2 : 3;
    for (const i of order) {
      const on = passing[points[i]] === 1;
      pen.globalAlpha = on ? 0.65 : 0.12;
      pen.fillStyle = !on ? "#999999" : success[points[i]] ? good : bad;
      pen.beginPath();
      if (success[points[i]]) pen.arc(spots.x[i], spots.y[i], size, 0, 2 * Math.PI);
      else diamond(pen, spots.x[i], spots.y[i], size * 1.35); // distinguishable by shape too
      pen.fill();
    }
    return svgElement("image", { x: 0, y: 0, width: canvas.width / 3, height: canvas.height / 3, href: canvas.toDataURL() });
  }
}

interface Places {
  x: (v: number) => number;
  y: (v: number) => number;
}

function diamond(pen: CanvasRenderingContext2D, x: number, y: number, r: number): void {
  pen.moveTo(x - r, y);
  pen.lineTo(x, y - r);
  pen.lineTo(x + r, y);
  pen.lineTo(x, y + r);
  pen.closePath();
}

// From minimum to maximum with a margin; labels have their own.
function tight(values: number[], field: Field): [number, number] {
  if (field.labels) return [-0.5, field.labels.length - 0.5];
  const { least, greatest } = span(values);
  const room = greatest > least ? 0.02 * (greatest - least) : Math.abs(least) * 0.1 || 1;
  return [least - room, greatest + room];
}

function largest(field: Field): number {
  const { least, greatest } = span(field.values);
  return field.labels ? 0 : Math.max(-least, greatest);
}

function isNear(limit: number, values: number[]): boolean {
  const { least, greatest } = span(values);
  const size = greatest - least;
  return limit >= least - 0.5 * size && limit <= greatest + 0.5 * size;
}

// The input, or axis of the design, that explains most of a column.
function mostInfluential(model: CampaignModel, column: string): string {
  const of = model.sensitivities.find((s) => s.output === column) ?? model.sensitivities[0];
  const axes = (of?.groups ?? []).filter((g) => model.groups.some((one) => one.design && one.name === g.input));
  const known = [...(of?.influences ?? []), ...axes].filter((i) => Number.isFinite(i.firstOrder));
  return known.length === 0 ? "" : known.reduce((best, i) => (i.firstOrder > best.firstOrder ? i : best)).input;
}
