// The probability of success over two parameters of the design, with lines at 0.5, 0.9 and 0.99.
// Arrow keys select points; each is announced with its interval.
import * as Plot from "@observablehq/plot";
import { element, svgElement } from "../dom";
import { css, onThemeChange } from "../plots/theme_colors";
import { chartCard, type ChartCard } from "../study/chart_card";
import { counted, plural } from "../study/describe";
import { kStyle } from "../study/scales";
import { hideTooltip, showTooltip } from "../study/tooltip";
import type { StudyState } from "../study/state";
import { onWidth, select } from "../study/ui";
import { crosses, type LineLabel, type NamedLine, overlap, placeLabels } from "./contour_labels";
import { contourSegments, joined } from "./contours";
import { cellEdges, gridOf } from "./map_grid";
import { flatRamp, kProbabilityColor, kRampWidth, uprightRamp } from "./map_ramp";
import { axisOf, choosePoint, successMapCsv, kCriteria, nameOf, pointWords } from "./map_words";
import type { CampaignModel, SuccessMap, MapAxis, MapPoint } from "./model";
import { percent } from "./words";

const kLevels = [0.5, 0.9, 0.99];
const kDashes = ["2,3", "6,3", ""];
const kMargins = { marginTop: 26, marginBottom: 44, marginRight: 16 }; // [px]

// What a chosen point does: its cases alone are shown on the page, or the function is called with its place [y, x].
export type Choice = StudyState | ((at: [number, number]) => void) | null;
export type MapModel = Pick<CampaignModel, "confidence" | "successMap">;

type Shown = "lower" | "estimate" | "upper" | "deciding";
// The headline counts points by the lower bound; therefore the map of lower bounds is displayed first.
const kShown: Record<Shown, string> = { lower: "probability of success, lower end of its interval", estimate: "probability of success", upper: "upper end of its interval", deciding: "most frequent failure" };
const kLine: Record<Shown, string> = { estimate: "probability", lower: "lower end", upper: "upper end", deciding: "" };

export class SuccessMapChart {
  readonly card: ChartCard;
  private readonly x: MapAxis;
  private readonly y: MapAxis;
  private shown: Shown = "lower";
  private width = 0;
  private cursor: [number, number] = [0, 0];
  private readonly status = element("p", { class: "cp-said", role: "status", "aria-live": "polite" });
  private moveTo: (i: number, j: number) => void = () => undefined;

  // Null: no two axes.
  static of(model: MapModel, study: string, choice: Choice = null): SuccessMapChart | null {
    const { successMap } = model;
    return successMap && successMap.axes.length === 2 && successMap.axes.every((a) => a.values.length > 0) ? new SuccessMapChart(model, successMap, study, choice) : null;
  }

  private constructor(
    private readonly model: MapModel,
    private readonly successMap: SuccessMap,
    study: string,
    private readonly choice: Choice,
  ) {
    [this.y, this.x] = successMap.axes;
    this.card = chartCard({ id: "success-map", title: "Success map", study, csv: () => successMapCsv(successMap) });
    const options = (Object.keys(kShown) as Shown[]).filter((value) => value !== "deciding" || successMap.points.some((p) => p.deciding !== "")).map((value) => ({ value, text: kShown[value] }));
    this.card.controls.append(select("Show", options, this.shown, (value) => ((this.shown = value as Shown), this.draw())));
    this.card.body.after(this.status);
    this.card.note.textContent = note(model, successMap, typeof choice === "function");
    onWidth(this.card.body, (width) => {
      this.width = width;
      this.draw();
    });
    onThemeChange(() => this.width > 0 && this.draw());
  }

  private draw(): void {
    const { x, y } = this;
    const beside = this.width >= 560;
    const width = Math.min(this.width - (beside ? kRampWidth + 8 : 0), 860);
    const height = Math.round(Math.min(560, Math.max(260, width * 0.62)));
    const marginLeft = y.labels ? Math.min(140, 30 + 6.5 * Math.max(...y.labels.map((l) => l.length))) : 62;
    const [ex, ey] = [cellEdges(x.values), cellEdges(y.values)];
    this.card.setTitle(`Success map: ${kShown[this.shown]}`);
    const plot = Plot.plot({
      width, height, marginLeft, ...kMargins, style: kStyle,
      x: axisOf(x, width - marginLeft, [ex[0], ex[ex.length - 1]], 70, this.width),
      y: { ...axisOf(y, height, [ey[0], ey[ey.length - 1]], 50, this.width), labelAnchor: "top" },
      marks: [(_i, scales) => this.paint(scales as unknown as Places, ex, ey)],
    }) as SVGSVGElement & Plot.Plot;
    plot.setAttribute("role", "application");
    plot.setAttribute("tabindex", "0");
    plot.setAttribute("aria-label", `${kShown[this.shown]} over ${nameOf(x)} and ${nameOf(y)}; arrow keys walk over the points`);
    this.pointAt(plot, ex, ey);
    const ramp = this.shown === "deciding" ? null : beside ? uprightRamp(kShown[this.shown], height) : flatRamp(kShown[this.shown], this.width);
    const map = element("div", { class: `st-map cp-success-map${beside ? " cp-beside" : ""}` }, plot, ramp && element("div", { class: "st-ramp" }, ramp));
    map.style.setProperty("--cp-map", `${width}fr`); // in print, both scale in proportion
    map.style.setProperty("--cp-ramp", `${kRampWidth}fr`);
    this.card.body.replaceChildren(map);
    if (this.shown === "deciding") return this.card.setLegend([...this.deciders().map((text) => ({ color: this.decidingColor(text), text, shape: "dot" as const })), { color: css("--line"), text: "nothing fails", shape: "dot" as const }]);
    this.card.setLegend(this.drawsLines() ? kLevels.map((level, k) => ({ color: css("--ink"), text: `${kLine[this.shown]} ${level}`, dash: kDashes[k] })) : []);
  }

  // No interpolation between labels.
  private drawsLines(): boolean {
    return !this.x.labels && !this.y.labels && this.shown !== "deciding";
  }

  private value(p: MapPoint | undefined): number {
    return p && p.trials > 0 ? p[this.shown === "deciding" ? "estimate" : this.shown] : NaN;
  }

  private deciders(): string[] {
    return [...new Set(this.successMap.points.map((p) => p.deciding).filter((d) => d !== ""))].sort();
  }
  private decidingColor(criterion: string): string {
    return criterion === "" ? css("--line") : kCriteria[this.deciders().indexOf(criterion) % kCriteria.length];
  }

  private paint(scales: Places, ex: number[], ey: number[]): SVGElement {
    const grid = gridOf(this.successMap);
    const apply = Plot.scale({ color: kProbabilityColor })!.apply;
    const group = svgElement("g");
    const boxes: { x: number; y: number; width: number; height: number; p: MapPoint | undefined }[] = [];
    for (let j = 0; j < this.y.values.length; ++j)
      for (let i = 0; i < this.x.values.length; ++i) {
        const [a, b, c, d] = [scales.x(ex[i]), scales.x(ex[i + 1]), scales.y(ey[j + 1]), scales.y(ey[j])];
        boxes.push({ x: a, y: c, width: b - a, height: d - c, p: grid[j]?.[i] });
      }
    const lines = this.drawsLines() ? this.lines(scales, grid) : [];
    const labels = placeLabels(lines, { left: scales.x(ex[0]), right: scales.x(ex[ex.length - 1]), top: scales.y(ey[ey.length - 1]), bottom: scales.y(ey[0]) });
    const texts: SVGElement[] = [];
    for (const { x, y, width, height, p } of boxes) {
      const v = this.value(p);
      if (Number.isFinite(v)) group.append(svgElement("rect", { x, y, width, height, fill: this.shown === "deciding" ? this.decidingColor(p?.deciding ?? "") : String(apply(v)), "shape-rendering": "crispEdges" }));
      else group.append(svgElement("path", { d: `M${x + width / 2 - 4},${y + height / 2 - 4}l8,8m0,-8l-8,8`, stroke: "#d55e00", "stroke-width": 1.4, fill: "none" }));
      if (!Number.isFinite(v) || width < 34 || height < 18 || boxes.length > 400) continue;
      const text = shortProbability(v);
      const [middle, half] = [x + width / 2, 3.4 * text.length + 2];
      const box = { left: middle - half, right: middle + half, top: y + height / 2 - 8, bottom: y + height / 2 + 8 };
      if (labels.some((l) => overlap(l.box, box)) || lines.some((l) => crosses(l.points, box))) continue; // the colour suffices
      texts.push(svgElement("text", { class: "cp-cell", x: middle, y: y + height / 2 + 4, "text-anchor": "middle", "font-size": 11, fill: v > 0.6 || this.shown === "deciding" ? "#111111" : "#ffffff", "pointer-events": "none" }, text));
    }
    group.append(...texts, contours(lines, labels));
    return group;
  }

  private lines(scales: Places, grid: (MapPoint | undefined)[][]): ContourLine[] {
    const values = grid.map((row) => row.map((p) => this.value(p)));
    return kLevels.flatMap((level, k) =>
      joined(contourSegments(this.x.values, this.y.values, values, level)).map((line) => ({ text: String(level), dash: kDashes[k], points: line.map(([x, y]): [number, number] => [scales.x(x), scales.y(y)]) })),
    );
  }

  private pointAt(plot: SVGSVGElement & Plot.Plot, ex: number[], ey: number[]): void {
    const [sx, sy] = [plot.scale("x")!, plot.scale("y")!];
    const grid = gridOf(this.successMap);
    const ring = svgElement("rect", { fill: "none", stroke: css("--ink"), "stroke-width": 2.4, visibility: "hidden", "pointer-events": "none" });
    plot.append(ring);
    this.moveTo = (i, j) => {
      this.cursor = [i, j];
      const [a, b, c, d] = [sx.apply(ex[i]), sx.apply(ex[i + 1]), sy.apply(ey[j + 1]), sy.apply(ey[j])];
      for (const [key, v] of Object.entries({ x: a, y: c, width: b - a, height: d - c, visibility: "visible" })) ring.setAttribute(key, String(v));
      this.status.textContent = this.words(grid, i, j).join(" · ");
    };
    const cellAt = (event: PointerEvent): [number, number] | null => {
      const box = plot.getBoundingClientRect();
      const [u, v] = [sx.invert!(event.clientX - box.left), sy.invert!(event.clientY - box.top)];
      const [i, j] = [ex.findIndex((e, k) => k + 1 < ex.length && u >= e && u < ex[k + 1]), ey.findIndex((e, k) => k + 1 < ey.length && v >= e && v < ey[k + 1])];
      return i >= 0 && j >= 0 ? [i, j] : null;
    };
    const choose = (i: number, j: number): void => {
      if (typeof this.choice === "function") this.choice([j, i]);
      else if (this.choice) choosePoint(this.choice, [{ axis: this.x, edges: ex, at: i }, { axis: this.y, edges: ey, at: j }]);
    };
    plot.addEventListener("pointermove", (event) => {
      const cell = cellAt(event);
      if (!cell) return hideTooltip();
      if (event.pointerType !== "touch") showTooltip(this.words(grid, ...cell), event.clientX, event.clientY);
    });
    plot.addEventListener("click", (event) => {
      const cell = cellAt(event as PointerEvent);
      if (!cell) return;
      this.moveTo(...cell);
      choose(...cell);
    });
    plot.addEventListener("pointerleave", hideTooltip);
    plot.addEventListener("focus", () => this.moveTo(...this.cursor));
    plot.addEventListener("keydown", (event) => {
      const step: Record<string, [number, number]> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
      const by = step[event.key];
      if (event.key === "Enter" || event.key === " ") {
        event.preventDefault();
        choose(...this.cursor);
      }
      if (!by) return;
      event.preventDefault();
      this.moveTo(clamp(this.cursor[0] + by[0], this.x.values.length), clamp(this.cursor[1] + by[1], this.y.values.length));
    });
  }

  private words(grid: (MapPoint | undefined)[][], i: number, j: number): string[] {
    return pointWords(this.model, [this.y, this.x], grid[j]?.[i], [j, i]);
  }
}

interface ContourLine extends NamedLine {
  dash: string;
}

// Two strokes, visible on any colour.
function contours(lines: ContourLine[], labels: LineLabel[]): SVGElement {
  const group = svgElement("g", { fill: "none", "stroke-linejoin": "round", class: "cp-contours" });
  for (const { text, dash, points } of lines) {
    const d = `M${points.map(([x, y]) => `${x.toFixed(1)},${y.toFixed(1)}`).join("L")}`;
    group.append(svgElement("path", { d, stroke: "#ffffff", "stroke-width": 4.2, "stroke-opacity": 0.75 }));
    group.append(svgElement("path", { d, stroke: "#111111", "stroke-width": 1.9, "stroke-dasharray": dash, "data-level": text }));
  }
  for (const { text, x, y, box } of labels) {
    group.append(svgElement("rect", { x: box.left, y: box.top, width: box.right - box.left, height: box.bottom - box.top, rx: 4, fill: "#ffffff" }));
    group.append(svgElement("text", { class: "cp-level", x, y: y + 4, "text-anchor": "middle", "font-size": 11, "font-weight": 700, fill: "#111111" }, text));
  }
  return group;
}

// For a cell: marks values that would round to 0 or 1.
function shortProbability(v: number): string {
  if (v === 0 || v === 1) return String(v);
  return v >= 0.995 ? ">.99" : v < 0.005 ? "<.01" : v.toFixed(2);
}

interface Places {
  x: (v: number) => number;
  y: (v: number) => number;
}

function clamp(k: number, size: number): number {
  return Math.max(0, Math.min(size - 1, k));
}

function note(model: MapModel, e: SuccessMap, computes: boolean): string {
  const trials = e.points.map((p) => p.trials);
  const [least, most] = [Math.min(...trials), Math.max(...trials)];
  const cases = least === most ? `${plural(least, "case")} per point` : `${counted(least)} to ${plural(most, "case")} per point`;
  return `${cases}, ${plural(e.points.length, "point")}. Lines are straight between points; cells that one passes have no number. Point at a cell, or walk over it with the arrow keys, for its ${percent(model.confidence)} interval and what fails there; ${computes ? "a click or Enter computes it as the variant" : "a click or Enter keeps its cases alone in the charts and the table below"}.`;
}
