// The success map over one parameter of the design: the probability of success with its interval, and the share of
// cases that fail each criterion. Arrow keys select points; each is announced with its interval.
import * as Plot from "@observablehq/plot";
import { element, svgElement } from "../dom";
import { css, lineColor, onThemeChange } from "../plots/theme_colors";
import { chartCard, type ChartCard } from "../study/chart_card";
import { clipped } from "../study/describe";
import { kStyle } from "../study/scales";
import { hideTooltip, showTooltip } from "../study/tooltip";
import type { StudyState } from "../study/state";
import { onWidth, toggle } from "../study/ui";
import { cellEdges } from "./map_grid";
import { axisOf, choosePoint, successMapCsv, kCriteria, nameOf, pointWords } from "./map_words";
import type { CampaignModel, SuccessMap, MapAxis, MapPoint } from "./model";
import { percent, probability } from "./words";

const kLevels = [0.5, 0.9, 0.99];

interface Stopped {
  criterion: string;
  x: number;
  share: number; // share of the point's cases that fail the criterion
}

export class SuccessCurve {
  readonly card: ChartCard;
  private readonly x: MapAxis;
  private readonly points: MapPoint[]; // points with cases, in the order of the axis
  private width = 0;
  private criteria = false;
  private cursor = 0;
  private readonly status = element("p", { class: "cp-said", role: "status", "aria-live": "polite" });
  private mark: (k: number) => void = () => undefined;

  // Null: another number of axes, or an axis without values.
  static of(model: CampaignModel, study: string, state: StudyState | null = null): SuccessCurve | null {
    const { successMap } = model;
    return successMap && successMap.axes.length === 1 && successMap.axes[0].values.length > 0 ? new SuccessCurve(model, successMap, study, state) : null;
  }

  private constructor(
    private readonly model: CampaignModel,
    private readonly successMap: SuccessMap,
    study: string,
    private readonly state: StudyState | null,
  ) {
    [this.x] = successMap.axes;
    this.points = successMap.points.filter((p) => p.trials > 0).sort((a, b) => a.at[0] - b.at[0]);
    this.card = chartCard({ id: "success-map", title: `Probability of success over ${nameOf(this.x)}`, study, csv: () => successMapCsv(successMap) });
    if (this.stopped().length > 0) this.card.controls.append(toggle("what fails", false, (on) => ((this.criteria = on), this.draw())));
    this.card.body.after(this.status);
    this.card.note.textContent = `Bars are ${percent(model.confidence)} intervals (Wilson's score), levels ${kLevels.join(", ")}. Point at a value, or walk with the arrow keys, for its numbers and what fails there; a click or Enter keeps its cases alone in the charts and the table below.`;
    onWidth(this.card.body, (width) => {
      this.width = width;
      this.draw();
    });
    onThemeChange(() => this.width > 0 && this.draw());
  }

  private draw(): void {
    const { x, points, width } = this;
    const [ink, blue] = [css("--ink"), lineColor("#0072b2")];
    const edges = cellEdges(x.values);
    const at = (p: MapPoint): number => x.values[p.at[0]];
    const stopped = this.criteria ? this.stopped() : [];
    const criteria = [...new Set(stopped.map((s) => s.criterion))];
    const color = (name: string): string => lineColor(kCriteria[(1 + criteria.indexOf(name)) % kCriteria.length]);
    const line = x.labels ? [] : [Plot.areaY(points, { x: at, y1: "lower", y2: "upper", fill: blue, fillOpacity: 0.16 }), Plot.line(points, { x: at, y: "estimate", stroke: blue, strokeWidth: 2 })];
    const plot = Plot.plot({
      width, height: Math.round(Math.min(420, Math.max(260, width * 0.45))), marginLeft: 52, marginRight: 42, marginTop: 14, marginBottom: 44, style: kStyle,
      x: axisOf(x, width - 94, [edges[0], edges[edges.length - 1]], 70, width),
      y: { domain: [0, 1], label: "probability of success", labelArrow: "none", labelAnchor: "center", grid: true },
      marks: [
        Plot.ruleY(kLevels, { stroke: ink, strokeDasharray: "5,3", strokeOpacity: 0.55 }),
        ...kLevels.map((level) => Plot.text([level], { frameAnchor: "right", dx: 6, y: level, dy: level > 0.95 ? -7 : 0, text: String, textAnchor: "start", fill: ink })),
        ...criteria.map((name) => Plot.line(stopped.filter((s) => s.criterion === name), { x: "x", y: "share", stroke: color(name), strokeWidth: 1.6, strokeDasharray: "2,2", marker: "dot" })),
        ...line,
        Plot.link(points, { x1: at, x2: at, y1: "lower", y2: "upper", stroke: blue, strokeWidth: 1.5 }),
        Plot.dot(points, { x: at, y: "estimate", r: 4, fill: blue, stroke: css("--card"), strokeWidth: 1 }),
      ],
    }) as SVGSVGElement & Plot.Plot;
    plot.setAttribute("role", "application");
    plot.setAttribute("tabindex", "0");
    plot.setAttribute("aria-label", `Probability of success over ${nameOf(x)}, ${points.map((p) => probability(p.estimate)).join(", ")}; arrow keys walk over the points`);
    this.pointAt(plot, edges);
    this.card.body.replaceChildren(element("div", {}, plot));
    const shares = criteria.map((name) => ({ color: color(name), text: `share of cases that fail “${clipped(name, 40)}”`, dash: "2,2" }));
    this.card.setLegend(this.criteria ? [{ color: blue, text: "probability of success" }, ...shares] : []);
  }

  // Of criteria that at least one case fails.
  private stopped(): Stopped[] {
    const names = [...new Set(this.points.flatMap((p) => p.unmet.filter((u) => u.count > 0).map((u) => u.criterion)))];
    return names.flatMap((criterion) =>
      this.points.map((p) => ({ criterion, x: this.x.values[p.at[0]], share: (p.unmet.find((u) => u.criterion === criterion)?.count ?? 0) / p.trials })),
    );
  }

  private words(k: number): string[] {
    return pointWords(this.model, this.successMap.axes, this.successMap.points.find((p) => p.at[0] === k), [k]);
  }

  private pointAt(plot: SVGSVGElement & Plot.Plot, edges: number[]): void {
    const [sx, sy] = [plot.scale("x")!, plot.scale("y")!];
    const rule = svgElement("line", { y1: sy.apply(0), y2: sy.apply(1), stroke: css("--ink"), "stroke-width": 1.6, "stroke-opacity": 0.6, visibility: "hidden", "pointer-events": "none" });
    plot.append(rule);
    this.mark = (k) => {
      this.cursor = k;
      for (const end of ["x1", "x2"]) rule.setAttribute(end, String(sx.apply(this.x.values[k])));
      rule.setAttribute("visibility", "visible");
      this.status.textContent = this.words(k).join(" · ");
    };
    const under = (event: PointerEvent): number => {
      const u = sx.invert!(event.clientX - plot.getBoundingClientRect().left);
      return edges.findIndex((e, k) => k + 1 < edges.length && u >= e && u < edges[k + 1]);
    };
    const choose = (k: number): void => {
      if (this.state) choosePoint(this.state, [{ axis: this.x, edges, at: k }]);
    };
    plot.addEventListener("pointermove", (event) => {
      const k = under(event);
      if (k < 0) return hideTooltip();
      if (event.pointerType !== "touch") showTooltip(this.words(k), event.clientX, event.clientY);
    });
    plot.addEventListener("pointerleave", hideTooltip);
    plot.addEventListener("click", (event) => {
      const k = under(event as PointerEvent);
      if (k < 0) return;
      this.mark(k);
      choose(k);
    });
    plot.addEventListener("focus", () => this.mark(this.cursor));
    plot.addEventListener("keydown", (event) => {
      if (event.key === "Enter" || event.key === " ") {
        event.preventDefault();
        choose(this.cursor);
      }
      const by = ({ ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 } as Record<string, number>)[event.key];
      if (!by) return;
      event.preventDefault();
      this.mark(Math.max(0, Math.min(this.x.values.length - 1, this.cursor + by)));
    });
  }
}
