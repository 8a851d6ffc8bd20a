// The running estimate of the probability of success, with its interval, over the completed cases.
import uPlot from "uplot";
import { element } from "../dom";
import { kFont } from "../plots/plot_canvas";
import { css } from "../plots/theme_colors";
import type { Estimate } from "./progress";

export class EstimateChart {
  readonly root: HTMLElement;
  private readonly text = element("p", { class: "watch-estimate" });
  private readonly body = element("div", { class: "watch-chart" });
  private plot: uPlot | null = null;

  constructor() {
    this.root = element("div", { hidden: "" }, this.text, this.body);
  }

  // Null: the work is no campaign.
  show(estimate: Estimate | null, total: number): void {
    const n = estimate?.cases.length ?? 0;
    this.root.hidden = !estimate || n === 0;
    if (!estimate || n === 0) return;
    const last = (values: number[]) => values[n - 1].toFixed(4);
    this.text.textContent = `Success so far: ${last(estimate.estimate)} (95 % interval ${last(estimate.lower)} to ${last(estimate.upper)}) after ${estimate.cases[n - 1]} cases`;
    const data: uPlot.AlignedData = [estimate.cases, estimate.upper, estimate.lower, estimate.estimate];
    if (this.plot) this.plot.setData(data);
    else if (this.body.clientWidth > 0) this.plot = new uPlot(this.options(total), data, this.body);
  }

  private options(total: number): uPlot.Options {
    const axis = { stroke: () => css("--muted"), font: kFont, grid: { stroke: () => css("--line"), width: 1 } };
    return {
      width: Math.min(this.body.clientWidth, 720),
      height: 240,
      legend: { show: false },
      cursor: { show: false },
      scales: { x: { time: false, range: () => [0, Math.max(total, 1)] }, y: { range: (plot) => shownRange(plot.data as number[][]) } },
      axes: [
        { ...axis, label: "completed cases", labelFont: kFont },
        { ...axis, label: "probability of success", labelFont: kFont, size: 60, values: (_, ticks) => ticks.map((tick) => tick.toFixed(3)) },
      ],
      bands: [{ series: [1, 2], fill: () => `${css("--accent")}33` }],
      series: [{}, { stroke: () => css("--accent"), width: 0.5 }, { stroke: () => css("--accent"), width: 0.5 }, { stroke: () => css("--accent"), width: 2 }],
    };
  }
}

// Without the first fifth of the cases, whose intervals are wide.
function shownRange([cases, upper, lower]: number[][]): [number, number] {
  const from = cases.findIndex((count) => count >= cases[cases.length - 1] / 5);
  const [least, most] = [Math.min(...lower.slice(from)), Math.max(...upper.slice(from))];
  const margin = 0.2 * (most - least) + 0.005;
  return [Math.max(0, least - margin), Math.min(1, most + margin)];
}
