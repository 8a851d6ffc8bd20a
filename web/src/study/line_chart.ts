// The main chart: columns against an axis, one line per value of a second axis, one panel per value of a third.
import * as Plot from "@observablehq/plot";
import { element } from "../dom";
import { unitText } from "../format";
import { onThemeChange } from "../plots/theme_colors";
import { isGeometric, isWide, linePlan, mainColumn } from "./choice";
import { chartCard, type ChartCard } from "./chart_card";
import { pointsToText } from "./csv";
import { failureStrip, kStrip } from "./failure_strip";
import { clipped, describePoint, fieldLabel, plural, shownWithUnit } from "./describe";
import type { LegendItem } from "./export";
import type { Field } from "./field";
import { axisOptions, columnsFor, domainOf, kStyle, levelColor } from "./scales";
import { type Line, linesOf, type Panel } from "./shape";
import { makePointable, Spots } from "./spots";
import type { StudyState } from "./state";
import { button, fieldOptions, onWidth, select, toggle, whileSeen } from "./ui";

const kDashes = ["", "6,3", "2,3", "9,3,2,3"];
const kMaxLines = 60;
const kMaxDots = 3000;

export class LineChart {
  readonly card: ChartCard;
  private x: Field | null;
  private lines: Field | null;
  private panels: Field | null;
  private held: Map<string, number>; // an axis that is not here has all its values displayed
  private y: Field[];
  private log = false;
  private width = 0;
  private rings: (() => void)[] = [];
  private drawn: number[] = []; // points

  constructor(
    private readonly state: StudyState,
    study: string,
  ) {
    const plan = linePlan(state.table);
    [this.x, this.lines, this.panels, this.held] = [plan.x, plan.lines, plan.panels, plan.held];
    const main = mainColumn(state.table);
    this.y = main ? [main] : [];
    this.log = main !== undefined && this.x !== null && isGeometric(this.x) && isWide(main);
    this.card = chartCard({ id: "lines", title: "Lines", study, csv: () => this.csv() });
    this.buildControls();
    onWidth(this.card.body, (width) => {
      this.width = width;
      this.draw();
    });
    state.listenSelect(() => this.rings.forEach((ring) => ring()));
    state.listenFilter(whileSeen(this.card.root, () => this.draw()));
    onThemeChange(() => this.draw());
  }

  private csv(): string {
    const points = [...new Set(this.drawn)].sort((a, b) => a - b);
    return pointsToText(this.state.table, points, [...this.state.table.axes, ...this.y]);
  }

  // ---- Choices ----

  private change(): void {
    this.buildControls();
    this.draw();
  }

  private buildControls(): void {
    const { axes, fields } = this.state.table;
    const columns = fields.filter((f) => f.role !== "axis");
    const axis = (key: string): Field | null => axes.find((a) => a.key === key) ?? null;
    const options = (none: string): { value: string; text: string }[] => [
      { value: "", text: none },
      ...axes.map((a) => ({ value: a.key, text: a.words })),
    ];
    const controls: HTMLElement[] = this.y.map((one, k) => this.columnSelect(columns, one, k));
    if (this.y.length > 0 && this.y.length < kDashes.length && columns.length > this.y.length) controls.push(this.addColumn(columns));
    if (axes.length > 0) controls.push(select("against", options("number of the point"), this.x?.key ?? "", (key) => this.takeAxis("x", axis(key))));
    if (axes.length > 1) controls.push(select("a line per", options("–"), this.lines?.key ?? "", (key) => this.takeAxis("lines", axis(key))));
    if (axes.length > 2) controls.push(select("a panel per", options("–"), this.panels?.key ?? "", (key) => this.takeAxis("panels", axis(key))));
    for (const other of axes) {
      if (other === this.x || other === this.lines || other === this.panels || other.levels.length < 2) continue;
      controls.push(this.heldSelect(other));
    }
    controls.push(toggle("log scale", this.log, (on) => ((this.log = on), this.draw())));
    this.card.controls.replaceChildren(...controls);
  }

  private columnSelect(columns: Field[], one: Field, k: number): HTMLElement {
    const box = select(k === 0 ? "Column" : "and", fieldOptions(columns), one.key, (key) => {
      this.y[k] = columns.find((f) => f.key === key) ?? one;
      this.change();
    });
    if (k === 0) return box;
    const remove = button("×", () => (this.y.splice(k, 1), this.change()), { "aria-label": `Take away ${one.words}` });
    return element("span", { class: "st-joined" }, box, remove);
  }

  // A further column; those of the same unit are offered first.
  private addColumn(columns: Field[]): HTMLElement {
    const left = columns.filter((f) => !this.y.includes(f));
    const next = left.find((f) => f.unit === this.y[0].unit) ?? left[0];
    return button("+ column", () => (this.y.push(next), this.change()), { title: "Draw another column too" });
  }

  private heldSelect(axis: Field): HTMLElement {
    const options = [{ value: "", text: "all" }, ...axis.levels.map((v) => ({ value: String(v), text: shownWithUnit(axis, v) }))];
    return select(axis.words, options, String(this.held.get(axis.key) ?? ""), (value) => {
      if (value === "") this.held.delete(axis.key);
      else this.held.set(axis.key, Number(value));
      this.draw();
    });
  }

  // An axis has one role: its previous holder gets the replaced axis.
  private takeAxis(role: "x" | "lines" | "panels", axis: Field | null): void {
    const before = this[role];
    for (const other of ["x", "lines", "panels"] as const) if (axis && this[other] === axis) this[other] = before;
    this[role] = axis;
    const roles = [this.x, this.lines, this.panels];
    for (const a of this.state.table.axes) {
      if (roles.includes(a)) this.held.delete(a.key);
      else if (a === before) this.held.set(a.key, a.levels[0]);
    }
    this.change();
  }

  // ---- Drawing ----

  private draw(): void {
    if (this.width === 0 || this.y.length === 0) return;
    const query = { x: this.x, lines: this.lines, panels: this.panels, held: this.held, most: kMaxLines };
    const { panels, leftOut } = linesOf(this.state.table, query);
    const units = [...new Set(this.y.map((f) => f.unit))];
    const count = panels.length * units.length;
    const columns = columnsFor(count, this.width, 290);
    const width = Math.floor((this.width - 16 * (columns - 1)) / columns);
    this.rings = [];
    this.drawn = panels.flatMap((p) => p.lines.flatMap((l) => l.points));
    const grid = element("div", { class: "st-panels" });
    for (const unit of units) {
      const fields = this.y.filter((f) => f.unit === unit);
      for (const panel of panels) grid.append(this.panel(panel, fields, width, count > 1));
    }
    this.card.body.replaceChildren(grid);
    this.card.setTitle(`${this.y.map((f) => f.words).join(", ")} against ${this.x?.words ?? "the number of the point"}`);
    this.card.setLegend(this.legend(panels));
    this.card.note.textContent = this.note(panels, leftOut);
  }

  private note(panels: Panel[], leftOut: number): string {
    const notes: string[] = [];
    if (panels.length === 0) notes.push("No point has the held values.");
    else if (!this.drawn.some((k) => this.y.some((f) => Number.isFinite(f.values[k])))) notes.push("No point shown has a value.");
    if (leftOut > 0) notes.push(`${plural(leftOut, "line")} left out: at most ${kMaxLines} per panel are drawn, evenly picked.`);
    if (this.log && this.y.some((f) => this.drawn.some((k) => f.values[k] <= 0))) notes.push("Values that are not positive are not shown on the log scale.");
    return notes.join(" ");
  }

  private legend(panels: Panel[]): LegendItem[] {
    const items: LegendItem[] = [];
    const color = levelColor(this.lines);
    if (this.lines) {
      const levels = this.lines.levels;
      const few = levels.length <= 12 ? levels : [levels[0], levels[levels.length >> 1], levels[levels.length - 1]];
      const colored = this.lines;
      few.forEach((v, k) => items.push({ color: color(v), text: clipped(`${k === 0 ? `${colored.words} ` : ""}${shownWithUnit(colored, v)}`, 60) }));
    }
    if (this.y.length > 1) this.y.forEach((f, k) => items.push({ color: "#777777", dash: kDashes[k], text: f.words }));
    if (panels.some((p) => this.lacksValues(p, this.y))) items.push({ color: "#d55e00", text: "failed, unreachable or without a value", shape: "cross" });
    return items;
  }

  private lacksValues(panel: Panel, fields: Field[]): boolean {
    return panel.lines.some((line) => line.points.some((k) => fields.some((f) => !Number.isFinite(f.values[k]))));
  }

  private panel(panel: Panel, fields: Field[], width: number, small: boolean): HTMLElement {
    const height = Math.round(Math.min(small ? 270 : 400, Math.max(240, width * 0.62)));
    const title = this.panels ? clipped(`${this.panels.labels ? "" : `${this.panels.words} `}${shownWithUnit(this.panels, panel.level)}`, width / 7) : "";
    const plot = this.plot(panel, fields, width, height) as SVGSVGElement & Plot.Plot;
    plot.setAttribute("role", "img");
    plot.setAttribute("aria-label", `${fields.map(fieldLabel).join(", ")} against ${this.x ? fieldLabel(this.x) : "point"}${title ? `, ${title}` : ""}`);
    const spots = this.spots(panel, fields, plot, height);
    this.rings.push(makePointable({ svg: plot, spots, state: this.state, describe: (k) => describePoint(this.state.table, k, fields) }));
    const root = element("figure", { class: "st-panel" }, title && element("figcaption", {}, title), plot);
    if (title) root.dataset.panelTitle = title;
    return root;
  }

  private xOf(point: number): number {
    return this.x ? this.x.values[point] : point;
  }

  private domain(fields: Field[]): [number, number] {
    let [least, greatest] = [Infinity, -Infinity];
    for (const field of fields) {
      for (const k of this.drawn) {
        const v = field.values[k];
        if (!Number.isFinite(v) || (this.log && v <= 0)) continue;
        least = Math.min(least, v);
        greatest = Math.max(greatest, v);
      }
    }
    return domainOf(least, greatest, this.log);
  }

  private plot(panel: Panel, fields: Field[], width: number, height: number): SVGElement | HTMLElement {
    const name = fields.length === 1 ? fieldLabel(fields[0]) : `[${unitText(fields[0].unit) || "1"}]`;
    const y: Plot.ScaleOptions = { ...axisOptions(null, name, false, width - 30), domain: this.domain(fields), grid: true, nice: true, ticks: Math.max(3, height / 55) };
    if (this.log) Object.assign(y, axisOptions(fields[0], name, true, height), { label: clipped(name, (width - 30) / 6.6), nice: false });
    const x: Plot.ScaleOptions = axisOptions(this.x, "point", this.x !== null && isGeometric(this.x), width - 80);
    const margin = { left: 58, bottom: 42, right: 14 };
    const strip = this.lacksValues(panel, fields);
    const marks: Plot.Markish[] = strip ? [failureStrip(width, height, margin)] : [];
    if (!this.log) marks.push(Plot.ruleY([0], { stroke: "currentColor", strokeOpacity: 0.35 }));
    fields.forEach((field) => marks.push(...this.marks(panel, field)));
    return Plot.plot({ width, height, marginLeft: margin.left, marginBottom: margin.bottom, marginTop: 26, marginRight: margin.right, insetBottom: strip ? kStrip : 0, style: kStyle, x, y, color: { type: "identity" }, marks });
  }

  // Lines with dots; points that fail the filter are faint; crosses below the plot area mark missing values.
  private marks(panel: Panel, field: Field): Plot.Markish[] {
    const color = levelColor(this.lines);
    const passing = this.state.passing;
    const flat = (accept: (k: number) => boolean): { k: number; line: Line; id: number }[] =>
      panel.lines.flatMap((line, id) => line.points.filter(accept).map((k) => ({ k, line, id })));
    type Row = { k: number; line: Line; id: number };
    const y = (row: Row): number => (this.log && field.values[row.k] <= 0 ? NaN : field.values[row.k]);
    const all = flat(() => true);
    const channels = { x: (r: Row) => this.xOf(r.k), y, stroke: (r: Row) => color(r.line.level) };
    const dash = kDashes[this.y.indexOf(field)] || undefined;
    const marks: Plot.Markish[] = [];
    const faint = this.state.filtered ? 0.25 : 1;
    if (!this.x?.labels && this.x) marks.push(Plot.line(all, { ...channels, z: "id", strokeWidth: 1.7, strokeDasharray: dash, strokeOpacity: faint }));
    const withDots = all.filter((r) => passing[r.k] && Number.isFinite(y(r)));
    if (withDots.length <= kMaxDots) marks.push(Plot.dot(withDots, { ...channels, fill: channels.stroke, r: withDots.length > 400 ? 1.6 : this.x?.labels ? 4 : 2.6, stroke: null }));
    const none = all.filter((r) => !Number.isFinite(field.values[r.k]));
    if (none.length > 0 && none.length <= kMaxDots)
      marks.push(Plot.dot(none, { x: channels.x, frameAnchor: "bottom", dy: -kStrip / 2, symbol: "times", r: 3.5, stroke: "#d55e00", strokeWidth: 1.5 }));
    return marks;
  }

  private spots(panel: Panel, fields: Field[], plot: Plot.Plot, height: number): Spots {
    const spots = new Spots();
    const [sx, sy] = [plot.scale("x"), plot.scale("y")];
    if (!sx) return spots;
    for (const field of fields) {
      for (const line of panel.lines) {
        for (const k of line.points) {
          const v = field.values[k];
          const py = Number.isFinite(v) && sy ? sy.apply(v) : height - 42 - kStrip / 2;
          const px = sx.apply(this.xOf(k));
          if (Number.isFinite(px) && Number.isFinite(py)) spots.add(k, px, py);
        }
      }
    }
    return spots;
  }
}
