// A column over two axes as colours, with crosses where there is no value.
import * as Plot from "@observablehq/plot";
import { element, svgElement } from "../dom";
import { heldValues, isGeometric, mainColumn, mapPlan } from "./choice";
import { chartCard, type ChartCard } from "./chart_card";
import { pointsToText } from "./csv";
import { clipped, describePoint, fieldLabel, powerTick, shownWithUnit } from "./describe";
import type { Field } from "./field";
import { axisOptions, kStyle, valueColor } from "./scales";
import { type Cell, cellsOf, span } from "./shape";
import { makePointable, Spots } from "./spots";
import type { StudyState } from "./state";
import { fieldOptions, onWidth, select, toggle, whileSeen } from "./ui";

const kMaxVectorCells = 4000; // with more cells, they are painted

export class HeatMap {
  readonly card: ChartCard;
  private value: Field;
  private held: Map<string, number>;
  private log = false;
  private width = 0;
  private cells: Cell[] = [];
  private ring: () => void = () => undefined;

  // Null: the study has fewer than two axes with several values.
  static of(state: StudyState, study: string): HeatMap | null {
    const plan = mapPlan(state.table);
    const value = mainColumn(state.table);
    return plan && value ? new HeatMap(state, study, plan.x, plan.y, value) : null;
  }

  private constructor(
    private readonly state: StudyState,
    study: string,
    private x: Field,
    private y: Field,
    value: Field,
  ) {
    this.value = value;
    this.held = this.heldNow();
    const csv = (): string => pointsToText(state.table, this.cells.map((c) => c.point), [...state.table.axes, this.value]);
    this.card = chartCard({ id: "map", title: "Map", study, csv });
    this.buildControls();
    onWidth(this.card.body, (width) => {
      this.width = width;
      this.draw();
    });
    state.listenSelect(() => this.ring());
    state.listenFilter(whileSeen(this.card.root, () => this.draw()));
  }

  private heldNow(): Map<string, number> {
    return heldValues(this.state.table.axes.filter((a) => a !== this.x && a !== this.y && a.levels.length > 1));
  }

  private buildControls(): void {
    const { axes, fields } = this.state.table;
    const open = axes.filter((a) => a.levels.length > 1);
    const columns = fields.filter((f) => f.role !== "axis");
    const options = open.map((a) => ({ value: a.key, text: a.words }));
    const pick = (key: string): Field => open.find((a) => a.key === key) ?? open[0];
    const take = (role: "x" | "y", axis: Field): void => {
      const other = role === "x" ? "y" : "x";
      if (this[other] === axis) this[other] = this[role];
      this[role] = axis;
      this.held = this.heldNow();
      this.buildControls();
      this.draw();
    };
    const held = open.filter((a) => this.held.has(a.key)).map((axis) => {
      const values = axis.levels.map((v) => ({ value: String(v), text: shownWithUnit(axis, v) }));
      return select(axis.words, values, String(this.held.get(axis.key)), (v) => (this.held.set(axis.key, Number(v)), this.draw()));
    });
    this.card.controls.replaceChildren(
      select("Column", fieldOptions(columns), this.value.key, (key) => {
        this.value = columns.find((f) => f.key === key) ?? this.value;
        this.draw();
      }),
      select("across", options, this.x.key, (key) => take("x", pick(key))),
      select("up", options, this.y.key, (key) => take("y", pick(key))),
      ...held,
      toggle("log colours", this.log, (on) => ((this.log = on), this.draw())),
    );
  }

  private draw(): void {
    if (this.width === 0) return;
    const logs: [boolean, boolean] = [isGeometric(this.x), isGeometric(this.y)];
    this.cells = cellsOf(this.state.table, this.x, this.y, this.value, this.held, logs);
    const { least, greatest, numbers } = span(this.cells.map((c) => c.value));
    const color = valueColor(least, greatest, this.log);
    const width = Math.min(this.width, 760);
    const height = Math.round(Math.min(460, Math.max(220, width * 0.6, 60 + 16 * Math.min(24, this.y.levels.length))));
    const marginLeft = this.y.labels ? Math.min(140, 30 + 6.5 * Math.max(...this.y.labels.map((l) => l.length))) : 58;
    const plot = Plot.plot({
      width, height, marginLeft, marginTop: 26, marginBottom: 42, marginRight: 14, style: kStyle,
      x: { ...axisOptions(this.x, "", logs[0], width - marginLeft), domain: this.domain("x") },
      y: { ...axisOptions(this.y, "", logs[1], (height - 60) * (this.y.labels ? 7 : 2), width - 20), ...this.labelsUp(marginLeft), domain: this.domain("y") },
      color,
      marks: [(_i, scales) => this.paint(scales as PaintScales, color)],
    }) as SVGSVGElement & Plot.Plot;
    plot.setAttribute("role", "img");
    plot.setAttribute("aria-label", `${fieldLabel(this.value)} over ${fieldLabel(this.x)} and ${fieldLabel(this.y)}`);
    this.pointAt(plot);
    const grid = element("div", { class: "st-map" }, plot, numbers > 0 && this.ramp(color));
    this.card.body.replaceChildren(grid);
    this.card.setTitle(`${this.value.words} over ${this.x.words} and ${this.y.words}`);
    const without = this.cells.length - numbers;
    this.card.setLegend(without > 0 ? [{ color: "#d55e00", text: "failed, unreachable or without a value", shape: "cross" }] : []);
    this.card.note.textContent = this.log && least <= 0 ? "Colours stay linear: not all values are positive." : "";
  }

  // Label names are limited to the margin's width.
  private labelsUp(room: number): Plot.ScaleOptions {
    const { labels } = this.y;
    return labels ? { tickFormat: (k: number) => clipped(labels[k] ?? "", Math.floor((room - 14) / 6.4)) } : {};
  }

  private domain(side: "x" | "y"): [number, number] {
    const lows = this.cells.map((c) => (side === "x" ? c.x1 : c.y1));
    const highs = this.cells.map((c) => (side === "x" ? c.x2 : c.y2));
    return this.cells.length === 0 ? [0, 1] : [span(lows).least, span(highs).greatest];
  }

  private ramp(color: Plot.ScaleOptions): HTMLElement {
    const tickFormat = color.type === "log" ? powerTick : undefined;
    const made = Plot.legend({ color: { ...color, label: fieldLabel(this.value) }, width: Math.min(320, this.width - 20), marginLeft: 12, marginRight: 12, ticks: 5, tickFormat, style: kStyle });
    return element("div", { class: "st-ramp" }, made as unknown as Node);
  }

  private paint(scales: PaintScales, color: Plot.ScaleOptions): SVGElement {
    const apply = Plot.scale({ color })!.apply;
    const boxes = this.cells.map((c) => {
      const [a, b, d, e] = [scales.x(c.x1), scales.x(c.x2), scales.y(c.y2), scales.y(c.y1)];
      return { x: a, y: d, width: b - a, height: e - d, fill: Number.isFinite(c.value) ? String(apply(c.value)) : "", passing: this.state.passing[c.point] === 1 };
    });
    const vector = boxes.length <= kMaxVectorCells;
    const group = svgElement("g", {}, !vector && painted(boxes));
    for (const box of boxes) {
      const { x, y, width, height, fill, passing } = box;
      if (vector && fill) group.append(svgElement("rect", { x, y, width, height, fill, "fill-opacity": passing ? 1 : 0.18, "shape-rendering": "crispEdges" }));
      if (fill) continue;
      const r = Math.min(4, width / 3, height / 3);
      const d = `M${x + width / 2 - r},${y + height / 2 - r}l${2 * r},${2 * r}m0,${-2 * r}l${-2 * r},${2 * r}`;
      group.append(svgElement("path", { d, stroke: "#d55e00", "stroke-width": 1.4, fill: "none" }));
    }
    return group;
  }

  private pointAt(plot: SVGSVGElement & Plot.Plot): void {
    const spots = new Spots();
    const [sx, sy] = [plot.scale("x")!, plot.scale("y")!];
    let size = 28;
    for (const c of this.cells) {
      const [x1, x2, y1, y2] = [sx.apply(c.x1), sx.apply(c.x2), sy.apply(c.y1), sy.apply(c.y2)];
      spots.add(c.point, (x1 + x2) / 2, (y1 + y2) / 2);
      size = Math.max(size, Math.hypot(x2 - x1, y2 - y1) / 2 + 1);
    }
    const describe = (k: number): string[] => describePoint(this.state.table, k, [this.value]);
    this.ring = makePointable({ svg: plot, spots, state: this.state, describe, reach: size });
  }
}

interface PaintScales {
  x: (v: number) => number;
  y: (v: number) => number;
}

interface Box {
  x: number;
  y: number;
  width: number;
  height: number;
  fill: string;
  passing: boolean;
}

// All cells as one picture, at twice the resolution.
function painted(boxes: Box[]): SVGElement {
  const [left, top] = [span(boxes.map((b) => b.x)).least, span(boxes.map((b) => b.y)).least];
  const width = span(boxes.map((b) => b.x + b.width)).greatest - left;
  const height = span(boxes.map((b) => b.y + b.height)).greatest - top;
  const canvas = document.createElement("canvas");
  canvas.width = Math.ceil(width * 2);
  canvas.height = Math.ceil(height * 2);
  const pen = canvas.getContext("2d")!;
  pen.scale(2, 2);
  for (const b of boxes) {
    if (!b.fill) continue;
    pen.globalAlpha = b.passing ? 1 : 0.18;
    pen.fillStyle = b.fill;
    pen.fillRect(b.x - left, b.y - top, b.width + 0.5, b.height + 0.5);
  }
  return svgElement("image", { x: left, y: top, width, height, href: canvas.toDataURL() });
}
