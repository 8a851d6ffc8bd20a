// Probabilities with their intervals: the campaign's success, and the share of each criterion alone, over one axis. If
// all are close together the axis can be zoomed.
import * as Plot from "@observablehq/plot";
import { element } from "../dom";
import { css, lineColor, onThemeChange } from "../plots/theme_colors";
import { chartCard, type ChartCard } from "../study/chart_card";
import { rowsToText } from "../study/csv";
import { clipped } from "../study/describe";
import { kStyle } from "../study/scales";
import { hideTooltip, showTooltip } from "../study/tooltip";
import { onWidth, toggle } from "../study/ui";
import type { CampaignModel, Proportion } from "./model";
import { interval, percent, probability, samplingName, share, successName } from "./words";

interface Row extends Proportion {
  key: string;
  name: string;
  detail: string; // the expression
  main: boolean;
}

const kRow = 46; // [px]

export function intervalCard(model: CampaignModel, study: string): HTMLElement {
  return new IntervalChart(model, study).card.root;
}

class IntervalChart {
  readonly card: ChartCard;
  private readonly rows: Row[];
  private near = false;
  private width = 0;

  constructor(
    private readonly model: CampaignModel,
    study: string,
  ) {
    this.rows = rowsOf(model);
    this.card = chartCard({ id: "probability", title: model.successMap ? "Success over all points of the design" : successName(model), study, csv: () => csv(this.rows) });
    if (spread(this.rows) < 0.4) this.card.controls.append(toggle("enlarged", false, (on) => ((this.near = on), this.draw())));
    this.card.note.textContent = note(model);
    onWidth(this.card.body, (width) => {
      this.width = width;
      this.draw();
    });
    onThemeChange(() => this.width > 0 && this.draw());
  }

  private draw(): void {
    const { rows, width } = this;
    const [ink, blue, gray] = [css("--ink"), lineColor("#0072b2"), css("--muted")];
    const right = width < 560 ? 14 : 250;
    const domain = this.near ? nearDomain(rows) : [0, 1];
    const shown = rows.filter((r) => Number.isFinite(r.estimate));
    const color = (r: Row): string => (r.main ? blue : gray);
    const height = rows.length * kRow + 44;
    const plot = Plot.plot({
      width, height, marginLeft: 12, marginRight: right, marginTop: 6, marginBottom: 38, style: kStyle, clip: false,
      x: { domain, label: "probability", labelAnchor: "center", labelArrow: "none", grid: true, ticks: Math.max(3, (width - right) / 90), tickFormat: (v: number) => String(Number(v.toPrecision(8))) },
      y: { type: "band", domain: rows.map((r) => r.key), axis: null, padding: 0 },
      marks: [
        Plot.ruleX([domain[0]], { stroke: ink, strokeOpacity: 0.5 }),
        Plot.link(shown, { x1: "lower", x2: "upper", y1: "key", y2: "key", dy: 8, stroke: color, strokeWidth: (r: Row) => (r.main ? 7 : 5), strokeOpacity: 0.45 }),
        Plot.tickX(shown.flatMap((r) => [{ ...r, x: r.lower }, { ...r, x: r.upper }]), { x: "x", y: "key", dy: 8, stroke: color, strokeWidth: 1.5, insetTop: 16, insetBottom: 16 }),
        Plot.dot(shown, { x: "estimate", y: "key", dy: 8, r: (r: Row) => (r.main ? 5 : 4), fill: color, stroke: css("--card"), strokeWidth: 1 }),
        ...[true, false].map((main) => Plot.text(rows.filter((r) => r.main === main), { frameAnchor: "left", dx: 4, y: "key", dy: -10, fontWeight: main ? 700 : 400, text: (r: Row) => clipped(caption(r, width), Math.floor((width - 24) / 6.7)), textAnchor: "start", fill: ink, stroke: css("--card"), strokeWidth: 4 })),
        ...(width < 560 ? [] : [true, false]).map((main) => Plot.text(rows.filter((r) => r.main === main), { frameAnchor: "right", dx: 12, y: "key", dy: 8, fontWeight: main ? 700 : 400, text: (r: Row) => `${probability(r.estimate)}  (${interval(r)})`, textAnchor: "start", fill: ink })),
      ],
    }) as SVGSVGElement & Plot.Plot;
    plot.setAttribute("role", "img");
    plot.setAttribute("aria-label", rows.map((r) => `${r.name}: ${probability(r.estimate)}, ${percent(this.model.confidence)} interval ${interval(r)}`).join("; "));
    this.pointAt(plot);
    this.card.body.replaceChildren(element("div", {}, plot));
  }

  private pointAt(plot: SVGSVGElement): void {
    plot.addEventListener("pointermove", (event) => {
      const row = this.rows[Math.floor((event.clientY - plot.getBoundingClientRect().top - 6) / kRow)];
      if (!row) return hideTooltip();
      const lines = [row.name, row.detail, `${probability(row.estimate)} (${percent(this.model.confidence)}: ${interval(row)})`, `${share(row)} cases`];
      showTooltip(lines.filter((l) => l !== ""), event.clientX, event.clientY);
    });
    plot.addEventListener("pointerleave", hideTooltip);
  }
}

function rowsOf(model: CampaignModel): Row[] {
  const rows: Row[] = [{ ...model.success, key: "success", name: model.criteria.length > 1 ? "Success: all criteria hold" : "Success", detail: "", main: true }];
  const allOk = model.completed.successes === model.completed.trials;
  if (!allOk) rows.push({ ...model.completed, key: "completed", name: "The simulation completed", detail: "status ok", main: false });
  const one = model.criteria.length === 1 && allOk; // says the same as the row above
  model.criteria.forEach((c, k) => rows.push({ ...c, key: `criterion-${k}`, name: c.name, detail: c.text === c.name ? "" : c.text, main: false }));
  if (one) {
    rows[0].detail = rows[1].detail || rows[1].name;
    rows.pop();
  }
  return rows;
}

function caption(row: Row, width: number): string {
  const name = row.detail && row.main ? `${row.name}: ${row.detail}` : row.detail ? `${row.name}: ${row.detail}` : row.name;
  return width < 560 ? `${probability(row.estimate)}  ${name}` : name;
}

function spread(rows: Row[]): number {
  const [low, high] = nearDomain(rows);
  return high - low;
}

function nearDomain(rows: Row[]): [number, number] {
  const low = Math.min(...rows.map((r) => r.lower));
  const high = Math.max(...rows.map((r) => r.upper));
  const room = 0.1 * (high - low) || 0.05;
  return [Math.max(0, low - room), Math.min(1, high + room)];
}

function note(model: CampaignModel): string {
  const independent = model.sampling && model.sampling !== "random" ? ` They assume independent cases: with ${samplingName(model.sampling)} sampling they are usually wider than necessary.` : "";
  const alone = model.criteria.length > 1 ? " A criterion's row is the share of cases that complete and meet it, independently of the others." : "";
  return `Bars are ${percent(model.confidence)} intervals (Wilson's score).${independent}${alone}`;
}

function csv(rows: Row[]): string {
  const head = ["criterion", "expression", "successes", "trials", "estimate", "lower", "upper"];
  return rowsToText([head, ...rows.map((r) => [r.name, r.detail, r.successes, r.trials, r.estimate, r.lower, r.upper])]);
}
