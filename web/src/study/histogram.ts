// Histogram of a column: all points, and those that pass the filter. A click on a bar filters by it.
import * as Plot from "@observablehq/plot";
import { mainColumn } from "./choice";
import { chartCard, type ChartCard } from "./chart_card";
import { rowsToText } from "./csv";
import { counted, fieldLabel, plural } from "./describe";
import { number, withUnit } from "../format";
import type { Field } from "./field";
import { axisOptions, kStyle } from "./scales";
import { type Bin, binsOf } from "./shape";
import type { StudyState } from "./state";
import { hideTooltip, showTooltip } from "./tooltip";
import { fieldOptions, onWidth, select, whileSeen } from "./ui";

// Counts of points are integers.
function wholeTicks(most: number): number[] | number {
  return most <= 5 ? Array.from({ length: most + 1 }, (_, k) => k) : 5;
}

export class Histogram {
  readonly card: ChartCard;
  private field: Field;
  private width = 0;
  private bins: Bin[] = [];

  constructor(
    private readonly state: StudyState,
    study: string,
  ) {
    const { fields } = state.table;
    this.field = mainColumn(state.table) ?? fields[0];
    const csv = (): string => rowsToText([["from", "to", "points", "kept"], ...this.bins.map((b) => [b.from, b.to, b.all, b.passing])]);
    this.card = chartCard({ id: "histogram", title: "Histogram", study, csv });
    this.card.controls.append(
      select("Column", fieldOptions(fields), this.field.key, (key) => {
        this.field = fields.find((f) => f.key === key) ?? this.field;
        this.draw();
      }),
    );
    onWidth(this.card.body, (width) => {
      this.width = width;
      this.draw();
    });
    state.listenFilter(whileSeen(this.card.root, () => this.draw()));
  }

  private draw(): void {
    if (this.width === 0 || !this.field) return;
    const { bins, missing } = binsOf(this.field, this.state.passing, this.width < 420 ? 18 : 30);
    this.bins = bins;
    this.card.setTitle(`Distribution of ${this.field.words}`);
    const missingNote = missing > 0 ? `${plural(missing, "point")} without a value.` : "";
    this.card.note.textContent = bins.length === 0 ? "No point has a value here." : `${missingNote} A click on a bar keeps only its points.`.trim();
    if (bins.length === 0) return this.card.body.replaceChildren();
    const [low, high] = [bins[0].from, bins[bins.length - 1].to];
    const plot = Plot.plot({
      width: this.width, height: 260, marginLeft: 52, marginBottom: 42, marginTop: 26, marginRight: 14, style: kStyle,
      x: { ...axisOptions(this.field.labels ? this.field : null, fieldLabel(this.field), false, this.width - 70), domain: [low, high], ...(this.field.labels ? {} : { ticks: this.width / 80 }) },
      y: { label: "points", labelArrow: "none", grid: true, ticks: wholeTicks(Math.max(...bins.map((b) => b.all))), tickFormat: counted },
      marks: [
        Plot.rectY(bins, { x1: "from", x2: "to", y: "all", fill: "#999999", fillOpacity: 0.35, insetLeft: 0.5, insetRight: 0.5 }),
        Plot.rectY(bins, { x1: "from", x2: "to", y: "passing", fill: "#0072b2", insetLeft: 0.5, insetRight: 0.5 }),
        Plot.ruleY([0], { stroke: "currentColor" }),
      ],
    }) as SVGSVGElement & Plot.Plot;
    plot.setAttribute("role", "img");
    plot.setAttribute("aria-label", `Distribution of ${fieldLabel(this.field)}`);
    this.pointAt(plot);
    this.card.body.replaceChildren(plot);
    this.card.setLegend(this.state.filtered ? [{ color: "#0072b2", text: "kept", shape: "dot" }, { color: "#bbbbbb", text: "all", shape: "dot" }] : []);
  }

  private pointAt(plot: SVGSVGElement & Plot.Plot): void {
    const scale = plot.scale("x")!;
    const at = (event: MouseEvent): Bin | undefined => {
      const x = scale.invert!(event.clientX - plot.getBoundingClientRect().left);
      return this.bins.find((b) => x >= b.from && x < b.to);
    };
    const range = (b: Bin): string => (this.field.labels ? (this.field.labelOf((b.from + b.to) / 2) ?? "") : `${number(b.from)} to ${withUnit(b.to, this.field.unit)}`);
    plot.addEventListener("pointermove", (event) => {
      const bin = at(event);
      if (!bin) return hideTooltip();
      const lines = [range(bin), plural(bin.all, "point"), ...(this.state.filtered ? [`${bin.passing} kept`] : [])];
      showTooltip(lines, event.clientX, event.clientY);
    });
    plot.addEventListener("pointerleave", hideTooltip);
    plot.addEventListener("click", (event) => {
      const bin = at(event);
      if (bin) this.state.setRange(this.field.key, this.toggled(bin));
    });
  }

  // A second click on the same bar removes the filter.
  private toggled(bin: Bin): { field: Field; from: number; to: number } | null {
    const now = this.state.filter.ranges.find((r) => r.field.key === this.field.key);
    return now && now.from === bin.from && now.to === bin.to ? null : { field: this.field, from: bin.from, to: bin.to };
  }
}
