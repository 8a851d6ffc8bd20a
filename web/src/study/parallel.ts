// Parallel coordinates: every point is a line over axes and columns. Dragging along an axis filters points by range, on
// the whole page.
import * as Plot from "@observablehq/plot";
import { element, svgElement } from "../dom";
import { onThemeChange } from "../plots/theme_colors";
import { mainColumn, informativeColumns } from "./choice";
import { chartCard, type ChartCard } from "./chart_card";
import { pointsToText } from "./csv";
import { clipped, describePoint, fieldLabel, plural, shown } from "./describe";
import type { Field } from "./field";
import { thinned } from "./filter";
import { heightOf, kBottom, kTop, nearestLine, parallelAxes, type ParallelAxis, ticksOf, valueAt, wrapped } from "./parallel_layout";
import { isApart, kStyle, levelColor, markColor } from "./scales";
import { span } from "./shape";
import type { StudyState } from "./state";
import { hideTooltip, showTooltip } from "./tooltip";
import { button, fieldOptions, onWidth, select, whileSeen } from "./ui";

const kMaxLines = 4000;
const kHeight = 400;
const kMinStep = 104; // [px] between axes

export class ParallelCoordinates {
  readonly card: ChartCard;
  private fields: Field[];
  private color: Field | undefined;
  private width = 0;
  private axes: ParallelAxis[] = [];
  private drawn: number[] = []; // passing points with a line
  private readonly canvas = element("canvas", { "aria-hidden": "true" });
  private readonly overlay = svgElement("svg", { class: "st-parallel-axes", role: "img" });
  private readonly marked = svgElement("g");

  constructor(
    private readonly state: StudyState,
    study: string,
    private readonly best: number | null = null, // a highlighted point
    color?: Field, // initial colour of the lines; default: the main column
  ) {
    const { table } = state;
    this.fields = [...table.axes.filter((a) => a.levels.length > 1).slice(0, 7), ...informativeColumns(table, 4)].slice(0, 9);
    this.color = color ?? mainColumn(table);
    const csv = (): string => pointsToText(table, [...state.passing.keys()].filter((k) => state.passing[k]), [...table.axes, ...this.fields.filter((f) => f.role !== "axis")]);
    this.card = chartCard({ id: "parallel", title: "Parallel coordinates", study, csv });
    const stage = element("div", { class: "st-parallel" }, this.canvas, this.overlay);
    this.card.body.append(stage);
    this.card.body.classList.add("st-scroll");
    Object.assign(this.card.body, { tabIndex: 0, role: "group", ariaLabel: "Parallel coordinates" }); // it scrolls sideways
    this.buildControls();
    this.listenPointer();
    onWidth(this.card.body, (width) => {
      this.width = width;
      this.draw();
    });
    state.listenSelect(() => this.drawMarked());
    state.listenFilter(whileSeen(this.card.root, () => this.draw()));
    onThemeChange(() => this.draw());
  }

  private buildControls(): void {
    const { fields } = this.state.table;
    const left = fields.filter((f) => !this.fields.includes(f));
    const change = (): void => {
      this.buildControls();
      this.draw();
    };
    const chips = this.fields.map((f) =>
      button(`${f.words} ×`, () => ((this.fields = this.fields.filter((o) => o !== f)), change()), { class: "st-chip", "aria-label": `Take away ${f.words}` }),
    );
    this.card.controls.replaceChildren(
      select("Add", [{ value: "", text: "an axis or column …" }, ...fieldOptions(left)], "", (key) => {
        const field = left.find((f) => f.key === key);
        if (field) this.fields = [...this.fields, field];
        change();
      }),
      select("coloured by", [{ value: "", text: "–" }, ...fieldOptions(fields)], this.color?.key ?? "", (key) => {
        this.color = fields.find((f) => f.key === key);
        this.draw();
      }),
      element("details", { class: "st-chips" }, element("summary", {}, `${plural(this.fields.length, "axis", "axes")} shown`), element("div", {}, ...chips)),
    );
  }

  // ---- Drawing ----

  private draw(): void {
    if (this.width === 0) return;
    const wide = Math.max(this.width, 128 + kMinStep * (this.fields.length - 1));
    this.axes = parallelAxes(this.fields, wide);
    this.canvas.width = wide * 2;
    this.canvas.height = kHeight * 2;
    for (const part of [this.canvas, this.overlay]) Object.assign(part.style, { width: `${wide}px`, height: `${kHeight}px` });
    this.drawLines();
    this.drawAxes(wide);
    this.drawMarked();
    this.ramp();
  }

  private drawLines(): void {
    const { passing, table } = this.state;
    const [on, off]: [number[], number[]] = [[], []];
    for (let k = 0; k < table.size; ++k) (passing[k] ? on : off).push(k);
    this.drawn = thinned(on, kMaxLines);
    const pen = this.canvas.getContext("2d")!;
    pen.setTransform(2, 0, 0, 2, 0, 0);
    pen.clearRect(0, 0, this.canvas.width, this.canvas.height);
    pen.lineWidth = 1;
    pen.globalAlpha = off.length > 300 ? 0.08 : 0.2;
    pen.strokeStyle = "#888888";
    for (const k of thinned(off, kMaxLines / 2)) this.stroke(pen, k);
    pen.globalAlpha = Math.max(0.12, Math.min(0.8, 60 / Math.sqrt(this.drawn.length + 1) / 10 + 0.1));
    pen.lineWidth = this.drawn.length > 500 ? 1 : 1.3;
    const color = this.colorOf();
    for (const k of this.drawn) {
      pen.strokeStyle = color(k);
      this.stroke(pen, k);
    }
    const thin = on.length > this.drawn.length ? `${plural(this.drawn.length, "line")} of ${plural(on.length, table.noun)} drawn, evenly picked. ` : "";
    const hint = "Drag along an axis to keep the lines that pass there, click it to release.";
    this.card.note.textContent = `${thin}${this.state.filtered ? `${plural(on.length, table.noun)} kept. ` : ""}${hint}`;
  }

  private stroke(pen: CanvasRenderingContext2D, point: number): void {
    pen.beginPath();
    this.axes.forEach((axis, k) => {
      const y = heightOf(axis, axis.field.values[point], kHeight);
      if (k === 0) pen.moveTo(axis.x, y);
      else pen.lineTo(axis.x, y);
    });
    pen.stroke();
  }

  private colorOf(): (point: number) => string {
    const by = this.color;
    if (!by) return () => "#0072b2";
    if (isApart(by)) {
      const color = levelColor(by);
      return (k) => color(by.values[k]);
    }
    const scale = Plot.scale({ color: this.colorScale(by) })!;
    return (k) => (Number.isFinite(by.values[k]) ? String(scale.apply(by.values[k])) : "#d55e00");
  }

  private colorScale(by: Field): Plot.ScaleOptions {
    const { least, greatest } = span(by.values);
    return markColor(least, greatest);
  }

  private ramp(): void {
    this.card.body.querySelector(".st-ramp")?.remove();
    const by = this.color;
    const color = by ? levelColor(by) : null;
    const apart = by && isApart(by);
    this.card.setLegend(by && color && apart ? by.levels.map((v) => ({ color: color(v), text: clipped(by.colors ? shown(by, v) : `${by.words} ${shown(by, v)}`, 60) })) : []);
    if (!by || apart || span(by.values).numbers === 0) return;
    const made = Plot.legend({ color: { ...this.colorScale(by), label: fieldLabel(by) }, width: Math.min(300, this.width - 20), marginLeft: 12, marginRight: 12, ticks: 4, style: kStyle });
    this.card.body.append(element("div", { class: "st-ramp" }, made as unknown as Node));
  }

  private drawAxes(wide: number): void {
    this.overlay.replaceChildren();
    this.overlay.setAttribute("aria-label", `Parallel coordinates over ${this.fields.map(fieldLabel).join(", ")}`);
    const chars = Math.max(9, Math.min(18, Math.floor((wide - 128) / Math.max(1, this.axes.length - 1) / 7)));
    this.axes.forEach((axis, k) => {
      const group = svgElement("g", { class: "st-axis" });
      const lines = wrapped(fieldLabel(axis.field), chars, 4);
      lines.forEach((text, row) => group.append(svgElement("text", { class: "st-axis-name", x: axis.x, y: kTop - 14 - (lines.length - 1 - row) * 14, "text-anchor": "middle" }, text)));
      group.append(svgElement("title", {}, `${axis.field.name}: ${axis.field.description}`));
      group.append(svgElement("path", { class: "st-axis-line", d: `M${axis.x},${kTop}V${kHeight - kBottom}` }));
      this.drawTicks(group, axis, k === this.axes.length - 1);
      this.drawBrush(group, axis);
      this.overlay.append(group);
    });
    this.overlay.append(this.marked);
  }

  private drawTicks(group: SVGGElement, axis: ParallelAxis, last: boolean): void {
    // The space beside the last axis suffices for numbers, not for labels.
    const [dx, anchor] = last && axis.field.labels ? [-6, "end"] : [6, "start"];
    for (const tick of ticksOf(axis)) {
      const y = heightOf(axis, tick, kHeight);
      group.append(svgElement("text", { class: "st-axis-tick", x: axis.x + dx, y: y + 4, "text-anchor": anchor }, wrapped(shown(axis.field, tick), 14, 1)[0]));
    }
    const none = heightOf(axis, NaN, kHeight);
    if (axis.field.values.some(Number.isNaN)) group.append(svgElement("text", { class: "st-axis-tick st-axis-none", x: axis.x + dx, y: none + 4, "text-anchor": anchor }, "none"));
  }

  private drawBrush(group: SVGGElement, axis: ParallelAxis): void {
    const range = this.state.filter.ranges.find((r) => r.field.key === axis.field.key);
    if (range) {
      const clamp = (v: number): number => heightOf(axis, Math.min(axis.greatest, Math.max(axis.least, v)), kHeight);
      const [y1, y2] = [clamp(range.to), clamp(range.from)];
      group.append(svgElement("rect", { class: "st-brush", x: axis.x - 7, y: y1, width: 14, height: Math.max(2, y2 - y1) }));
    }
    const grasp = svgElement("rect", { class: "st-brush-grip", x: axis.x - 14, y: kTop - 6, width: 28, height: kHeight - kTop - kBottom + 12 });
    grasp.addEventListener("pointerdown", (event) => this.brush(event, axis, grasp));
    group.append(grasp);
  }

  private brush(event: PointerEvent, axis: ParallelAxis, grasp: SVGRectElement): void {
    event.preventDefault();
    grasp.setPointerCapture(event.pointerId);
    const top = this.overlay.getBoundingClientRect().top;
    const from = event.clientY - top;
    let to = from;
    const shade = svgElement("rect", { class: "st-brush", x: axis.x - 7, width: 14, y: from, height: 0 });
    grasp.before(shade);
    grasp.addEventListener("pointermove", (moved) => {
      to = Math.min(kHeight - kBottom, Math.max(kTop, moved.clientY - top));
      shade.setAttribute("y", String(Math.min(from, to)));
      shade.setAttribute("height", String(Math.abs(to - from)));
    });
    const end = (): void => {
      const ends = [valueAt(axis, from, kHeight), valueAt(axis, to, kHeight)].sort((a, b) => a - b);
      const slack = 1e-9 * (axis.greatest - axis.least);
      this.state.setRange(axis.field.key, Math.abs(to - from) < 4 ? null : { field: axis.field, from: ends[0] - slack, to: ends[1] + slack });
    };
    grasp.addEventListener("pointerup", end, { once: true });
    grasp.addEventListener("pointercancel", () => this.draw(), { once: true });
  }

  private drawMarked(): void {
    this.marked.replaceChildren();
    const path = (point: number, kind: string): void => {
      if (point < 0 || point >= this.state.table.size) return;
      const places = this.axes.map((axis) => `${axis.x},${heightOf(axis, axis.field.values[point], kHeight)}`);
      this.marked.append(svgElement("polyline", { class: kind, points: places.join(" "), fill: "none" }));
    };
    if (this.best !== null) path(this.best, "st-best-line");
    if (this.state.selected !== null) path(this.state.selected, "st-selected-line");
  }

  private listenPointer(): void {
    const at = (event: MouseEvent): number => {
      const box = this.overlay.getBoundingClientRect();
      return nearestLine(this.axes, this.drawn, event.clientX - box.left, event.clientY - box.top, kHeight);
    };
    this.overlay.addEventListener("pointermove", (event) => {
      const k = event.buttons === 0 && event.pointerType !== "touch" ? at(event) : -1;
      this.overlay.style.cursor = k < 0 ? "" : "pointer";
      if (k < 0) hideTooltip();
      else showTooltip(describePoint(this.state.table, k, this.fields), event.clientX, event.clientY);
    });
    this.overlay.addEventListener("pointerleave", hideTooltip);
    this.overlay.addEventListener("click", (event) => {
      if ((event.target as Element).classList.contains("st-brush-grip")) return;
      const k = at(event);
      if (k >= 0) this.state.select(k);
    });
  }
}
