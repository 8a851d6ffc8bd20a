// Two columns against each other, one dot per point; painted on a canvas if there are many.
import * as Plot from "@observablehq/plot";
import { element, svgElement } from "../dom";
import { onThemeChange } from "../plots/theme_colors";
import { linePlan, mainColumn, informativeColumns } from "./choice";
import { chartCard, type ChartCard } from "./chart_card";
import { pointsToText } from "./csv";
import { clipped, describePoint, fieldLabel, plural, shownWithUnit } from "./describe";
import type { LegendItem } from "./export";
import type { Field } from "./field";
import { axisOptions, domainOf, isApart, kStyle, levelColor, markColor } from "./scales";
import { span } from "./shape";
import { makePointable, Spots } from "./spots";
import type { StudyState } from "./state";
import { fieldOptions, onWidth, select, toggle, whileSeen } from "./ui";

const kMaxVectorDots = 2500;

export class Scatter {
  readonly card: ChartCard;
  private x: Field;
  private y: Field;
  private color: Field | null;
  private log = { x: false, y: false };
  private width = 0;
  private ring: () => void = () => undefined;

  constructor(
    private readonly state: StudyState,
    study: string,
  ) {
    const { table } = state;
    const informative = informativeColumns(table, 6);
    this.y = mainColumn(table) ?? table.fields[0];
    this.x = informative.find((f) => f !== this.y && f.unit !== this.y.unit) ?? informative[1] ?? table.axes[0] ?? this.y;
    this.color = linePlan(table).lines ?? table.axes[0] ?? null;
    const csv = (): string => pointsToText(table, this.shown(), [...table.axes, this.x, this.y]);
    this.card = chartCard({ id: "scatter", title: "Scatter", study, csv });
    this.buildControls();
    onWidth(this.card.body, (width) => {
      this.width = width;
      this.draw();
    });
    state.listenSelect(() => this.ring());
    state.listenFilter(whileSeen(this.card.root, () => this.draw()));
    onThemeChange(() => this.draw());
  }

  private buildControls(): void {
    const { fields } = this.state.table;
    const pick = (key: string): Field | null => fields.find((f) => f.key === key) ?? null;
    const options = fieldOptions(fields);
    this.card.controls.replaceChildren(
      select("Column", options, this.y.key, (key) => ((this.y = pick(key) ?? this.y), this.draw())),
      select("against", options, this.x.key, (key) => ((this.x = pick(key) ?? this.x), this.draw())),
      select("coloured by", [{ value: "", text: "–" }, ...options], this.color?.key ?? "", (key) => ((this.color = pick(key)), this.draw())),
      toggle("log x", this.log.x, (on) => ((this.log.x = on), this.draw())),
      toggle("log y", this.log.y, (on) => ((this.log.y = on), this.draw())),
    );
  }

  // Points with values on both axes.
  private shown(): number[] {
    const [x, y] = [this.x.values, this.y.values];
    const points: number[] = [];
    for (let k = 0; k < x.length; ++k) {
      if (Number.isFinite(x[k]) && Number.isFinite(y[k]) && !(this.log.x && x[k] <= 0) && !(this.log.y && y[k] <= 0)) points.push(k);
    }
    return points;
  }

  private draw(): void {
    if (this.width === 0) return;
    const points = this.shown();
    const without = this.state.table.size - points.length;
    this.card.setTitle(`${this.y.words} against ${this.x.words}`);
    this.card.note.textContent = points.length === 0 ? "No point has both values." : without > 0 ? `${plural(without, "point")} not shown here.` : "";
    this.card.setLegend(points.length > 0 ? this.legend() : []);
    if (points.length === 0) return this.card.body.replaceChildren();
    const domain = (f: Field, log: boolean): [number, number] => {
      const { least, greatest } = span(points.map((k) => f.values[k]));
      return domainOf(least, greatest, log);
    };
    const height = Math.round(Math.min(420, Math.max(260, this.width * 0.6)));
    const axis = (f: Field, side: "x" | "y", pixels: number): Plot.ScaleOptions => {
      const made: Plot.ScaleOptions = { ...axisOptions(f, "", this.log[side], pixels, this.width - 40), grid: true };
      return f.labels ? made : { ...made, domain: domain(f, this.log[side]), nice: !this.log[side] };
    };
    const spots = new Spots();
    const marginLeft = this.y.labels ? 110 : 58;
    const plot = Plot.plot({
      width: this.width, height, marginLeft, marginBottom: 42, marginTop: 26, marginRight: 16, style: kStyle,
      x: axis(this.x, "x", this.width - marginLeft),
      y: axis(this.y, "y", this.y.labels ? 800 : height),
      marks: [(_i, scales) => this.paint(points, scales as unknown as PaintScales, spots)],
    }) as SVGSVGElement & Plot.Plot;
    plot.setAttribute("role", "img");
    plot.setAttribute("aria-label", `${fieldLabel(this.y)} against ${fieldLabel(this.x)}`);
    const extra = this.color ? [this.x, this.y, this.color] : [this.x, this.y];
    this.ring = makePointable({ svg: plot, spots, state: this.state, describe: (k) => describePoint(this.state.table, k, extra), reach: 16 });
    this.card.body.replaceChildren(element("div", { class: "st-map" }, plot, this.ramp()));
  }

  private legend(): LegendItem[] {
    const by = this.color;
    if (!by || !isApart(by)) return [];
    const color = levelColor(by);
    return by.levels.map((v, k) => ({ color: color(v), text: clipped(`${k === 0 ? `${by.words} ` : ""}${shownWithUnit(by, v)}`, 60), shape: "dot" as const }));
  }

  private ramp(): HTMLElement | null {
    if (!this.color || isApart(this.color) || span(this.color.values).numbers === 0) return null;
    const color = { ...colorScale(this.color), label: fieldLabel(this.color) };
    const made = Plot.legend({ color, width: Math.min(300, this.width - 20), marginLeft: 12, marginRight: 12, ticks: 4, style: kStyle });
    return element("div", { class: "st-ramp" }, made as unknown as Node);
  }

  private paint(points: number[], scales: PaintScales, spots: Spots): SVGElement {
    const passing = this.state.passing;
    const color = this.dotColor();
    for (const k of points) spots.add(k, scales.x(this.x.values[k]), scales.y(this.y.values[k]));
    // Points that pass the filter are drawn on top.
    const order: number[] = [];
    for (const pass of [0, 1]) for (let k = 0; k < points.length; ++k) if (passing[points[k]] === pass) order.push(k);
    if (points.length > kMaxVectorDots) return paintedDots(order, points, spots, passing, color);
    const group = svgElement("g");
    for (const k of order) {
      const on = passing[points[k]] === 1;
      group.append(svgElement("circle", { cx: spots.x[k], cy: spots.y[k], r: points.length > 600 ? 2.4 : 3.4, fill: on ? color(points[k]) : "#999999", "fill-opacity": on ? 0.85 : 0.18 }));
    }
    return group;
  }

  private dotColor(): (point: number) => string {
    const by = this.color;
    if (!by) return () => "#0072b2";
    if (isApart(by)) {
      const color = levelColor(by);
      return (k) => color(by.values[k]);
    }
    const scale = Plot.scale({ color: colorScale(by) })!;
    return (k) => (Number.isFinite(by.values[k]) ? String(scale.apply(by.values[k])) : "#888888");
  }
}

function colorScale(field: Field): Plot.ScaleOptions {
  const { least, greatest } = span(field.values);
  return markColor(least, greatest);
}

interface PaintScales {
  x: (v: number) => number;
  y: (v: number) => number;
}

function paintedDots(order: number[], points: number[], spots: Spots, passing: Uint8Array, color: (k: number) => string): SVGElement {
  const [right, bottom] = [span(spots.x).greatest + 4, span(spots.y).greatest + 4];
  const canvas = document.createElement("canvas");
  canvas.width = Math.ceil(right * 2);
  canvas.height = Math.ceil(bottom * 2);
  const pen = canvas.getContext("2d")!;
  pen.scale(2, 2);
  const size = points.length > 20000 ? 1.8 : 3;
  for (const k of order) {
    const on = passing[points[k]] === 1;
    pen.globalAlpha = on ? 0.7 : 0.12;
    pen.fillStyle = on ? color(points[k]) : "#999999";
    pen.fillRect(spots.x[k] - size / 2, spots.y[k] - size / 2, size, size);
  }
  return svgElement("image", { x: 0, y: 0, width: canvas.width / 2, height: canvas.height / 2, href: canvas.toDataURL() });
}
