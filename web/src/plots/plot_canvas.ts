// One plot drawn by uPlot: axes, lines, shaded phases, the shared cursor, zoom.
import uPlot from "uplot";
import type { Clock } from "../clock";
import { phaseTint } from "../colors";
import { element } from "../dom";
import { number } from "../format";
import type { Run } from "../run";
import { decadeText, decadeTicks, limitAt, logFloor, logValues, offScale, padded, tickTexts, ticks, withLimits } from "./axes";
import { onCommonTime, setApart } from "./jumps";
import { shades } from "./phases";
import type { Limit, Line } from "./spec";
import { css, lineColor } from "./theme_colors";

export interface CanvasSettings {
  runs: Run[];
  clock: Clock;
  lines: Line[];
  shown: boolean[]; // per line
  log: boolean;
  floor?: number; // of a logarithmic axis
  shaded: boolean; // whether phases are shaded
  xTitle: string;
  yTitle: string;
  limits: Limit[];
  window: [number, number];
  width: number;
  height: number;
  zoomed: (min: number, max: number) => void; // the user selected a time window
  reset: () => void; // the user requested the full range
  offScale: (limits: string[]) => void; // limits beyond the axis, at every drawing
}

// uPlot scales fonts by the screen's pixels only if their size is a whole number of px.
export const kFont = '12px system-ui, -apple-system, "Segoe UI", Roboto, sans-serif';

export class PlotCanvas {
  private readonly plot: uPlot;
  private readonly cursor = element("div", { class: "time-cursor" });

  constructor(
    host: HTMLElement,
    private readonly settings: CanvasSettings,
  ) {
    this.plot = new uPlot(this.options(), this.data(), host);
    this.plot.over.append(this.cursor);
    this.follow();
    this.moveCursor();
  }

  destroy(): void {
    this.plot.destroy();
  }
  resize(width: number, height: number): void {
    this.plot.setSize({ width, height });
    this.moveCursor();
  }
  setWindow(min: number, max: number): void {
    this.plot.setScale("x", { min, max });
    this.moveCursor();
  }
  show(line: number, shown: boolean): void {
    this.plot.setSeries(line + 1, { show: shown });
  }
  recolor(): void {
    this.plot.redraw(false, true);
  }
  // The instant at the cursor, or null if it is outside the displayed range.
  cursorTime(): number | null {
    return this.cursor.hidden ? null : this.plot.posToVal(parseFloat(this.cursor.dataset.left ?? "0"), "x");
  }

  moveCursor(plot = this.plot): void {
    const { min, max } = plot.scales.x;
    const time = this.settings.clock.time;
    this.cursor.hidden = typeof min !== "number" || typeof max !== "number" || time < min || time > max;
    if (this.cursor.hidden) return;
    const left = plot.valToPos(time, "x");
    this.cursor.dataset.left = String(left);
    this.cursor.style.transform = `translateX(${Math.round(left)}px)`;
  }

  private data(): uPlot.AlignedData {
    const { runs, lines, log, clock } = this.settings;
    const span = clock.end - clock.begin;
    let values = lines.map((line) => line.values());
    if (log) {
      const floor = logFloor(values, this.settings.floor);
      values = values.map((one) => logValues(one, floor));
    }
    const times = runs.map((run) => setApart(run.time, span));
    const rows = onCommonTime(
      times,
      lines.map((line, i) => ({ run: line.run, values: values[i] })),
    );
    return [rows.time, ...rows.values] as unknown as uPlot.AlignedData;
  }

  private options(): uPlot.Options {
    const { settings } = this;
    return {
      width: settings.width,
      height: settings.height,
      padding: [8, 10, 0, 0],
      legend: { show: false },
      cursor: {
        x: false,
        y: false,
        points: { show: false },
        drag: { x: true, y: false, dist: 6, setScale: false },
        bind: { dblclick: () => () => (settings.reset(), null) },
      },
      select: { show: true, left: 0, top: 0, width: 0, height: 0 },
      scales: {
        x: { time: false, auto: false, min: settings.window[0], max: settings.window[1] },
        y: { range: (_, low, high) => (settings.log ? decades(low, high) : flat(low, high, settings.limits.map((limit) => limit.value))) },
      },
      axes: [
        axis(settings.xTitle, 2),
        axis(settings.yTitle, 3, settings.log),
      ],
      series: [{}, ...settings.lines.map((line, i) => seriesOf(line, settings.shown[i]))],
      hooks: {
        drawClear: [(plot) => settings.shaded && shadePhases(plot, settings.runs, true)],
        drawAxes: [(plot) => shadePhases(plot, settings.runs, false)],
        setSelect: [(plot) => this.selected(plot)],
        draw: [(plot) => this.drawLimits(plot), (plot) => this.moveCursor(plot)], // uPlot knows its scales and size only when it draws
      },
    };
  }

  private drawLimits(plot: uPlot): void {
    const { limits, log } = this.settings;
    const { min, max } = plot.scales.y;
    if (limits.length === 0 || typeof min !== "number" || typeof max !== "number") return;
    this.settings.offScale(offScale(limits, { min, max }, log));
    drawLimits(plot, limits.map((limit) => ({ ...limit, at: limitAt(limit.value, log) })).filter(({ at }) => at >= min && at <= max));
  }

  private selected(plot: uPlot): void {
    const { left, width } = plot.select;
    plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    if (width > 5) this.settings.zoomed(plot.posToVal(left, "x"), plot.posToVal(left + width, "x"));
  }

  // The pointer sets the clock: by hovering during pauses, by a click at any time, or by dragging with a finger.
  private follow(): void {
    const { over } = this.plot;
    const { clock } = this.settings;
    const lead = (event: PointerEvent): void => {
      clock.time = this.plot.posToVal(event.clientX - over.getBoundingClientRect().left, "x");
    };
    over.addEventListener("pointermove", (event) => {
      if (event.pointerType === "mouse" && (clock.playing || event.buttons !== 0)) return;
      lead(event);
    });
    // Scrolling begins with a press, too: for touch only a tap sets the clock.
    const press = (event: PointerEvent): void => {
      if (event.button !== 0) return;
      clock.pause();
      lead(event);
    };
    over.addEventListener("pointerdown", (event) => {
      if (event.pointerType === "mouse") press(event);
    });
    over.addEventListener("click", (event) => {
      if ((event as PointerEvent).pointerType !== "mouse") press(event as PointerEvent);
    });
  }
}

function flat(low: number | null, high: number | null, limits: number[]): [number, number] {
  const wide = withLimits(low ?? NaN, high ?? NaN, limits);
  const range = wide.high >= wide.low ? padded(wide.low, wide.high) : { min: -1, max: 1 };
  return [range.min, range.max];
}

// Horizontal lines with names and values; `at`: on the axis.
function drawLimits(plot: uPlot, limits: (Limit & { at: number })[]): void {
  const { ctx, bbox } = plot;
  const px = devicePixelRatio || 1;
  const taken: number[] = [];
  ctx.save();
  ctx.font = `600 ${Math.round(11 * px)}px system-ui, -apple-system, "Segoe UI", Roboto, sans-serif`;
  ctx.strokeStyle = ctx.fillStyle = lineColor("limit");
  ctx.lineWidth = 1.25 * px;
  for (const limit of limits) {
    const y = plot.valToPos(limit.at, "y", true);
    const text = `${limit.label} ${number(limit.value)}`;
    ctx.setLineDash([7 * px, 3 * px, 1.5 * px, 3 * px]);
    ctx.beginPath();
    ctx.moveTo(bbox.left, y);
    ctx.lineTo(bbox.left + bbox.width, y);
    ctx.stroke();
    ctx.textAlign = "left";
    const at = clear(y - bbox.top > 18 * px ? y - 4 * px : y + 13 * px, taken, 13 * px);
    const x = bbox.left + 5 * px;
    ctx.lineWidth = 3 * px;
    ctx.setLineDash([]);
    ctx.strokeStyle = css("--card");
    ctx.strokeText(text, x, at);
    ctx.strokeStyle = lineColor("limit");
    ctx.lineWidth = 1.25 * px;
    ctx.fillText(text, x, at);
  }
  ctx.restore();
}

// Texts must not overlap.
function clear(wish: number, taken: number[], height: number): number {
  let at = wish;
  while (taken.some((other) => Math.abs(other - at) < height)) at += height;
  taken.push(at);
  return at;
}

function decades(low: number | null, high: number | null): [number, number] {
  if (low === null || high === null) return [-18, 0];
  return [Math.floor(low), Math.floor(high) + 1];
}

function seriesOf(line: Line, shown: boolean): uPlot.Series {
  return {
    label: line.label,
    show: shown,
    scale: "y",
    stroke: () => lineColor(line.color),
    width: line.width,
    dash: line.dash.length > 0 ? line.dash : undefined,
    points: { show: false },
    pxAlign: 0,
  };
}

function axis(title: string, side: uPlot.Axis.Side, log = false): uPlot.Axis {
  const horizontal = side === 2;
  const pixels = horizontal ? 62 : 34; // per tick
  return {
    side,
    label: title,
    labelFont: kFont,
    font: kFont,
    labelSize: 20,
    size: horizontal ? 30 : 58,
    gap: 4,
    stroke: () => css("--muted"),
    grid: { stroke: () => css("--line"), width: 1 },
    ticks: { stroke: () => css("--line"), width: 1, size: 5 },
    splits: (plot, _axis, min, max) => {
      const count = Math.max(2, (horizontal ? plot.bbox.width : plot.bbox.height) / devicePixelRatio / pixels);
      return log ? decadeTicks({ min, max }, count) : ticks({ min, max }, count);
    },
    values: (_, splits) => (log ? splits.map(decadeText) : tickTexts(splits)),
  };
}

// Phases with a duration are shaded below everything; instants are lines above the grid.
function shadePhases(plot: uPlot, runs: Run[], lasting: boolean): void {
  const { ctx, bbox } = plot;
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  for (const phase of shades(runs)) {
    const left = plot.valToPos(phase.begin, "x", true);
    const width = plot.valToPos(phase.end, "x", true) - left;
    if (width >= 1 !== lasting) continue;
    ctx.fillStyle = lasting ? phaseTint(phase.name) : css("--impact");
    ctx.fillRect(left, bbox.top, lasting ? width : devicePixelRatio, bbox.height);
  }
  ctx.restore();
}
