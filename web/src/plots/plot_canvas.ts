// One plot drawn by uPlot: axes, lines, shaded phases, the shared cursor, zoom.
import uPlot from "uplot";
import type { Clock } from "../clock";
import { phaseTint } from "../colors";
import { element } from "../dom";
import type { Run } from "../run";
import { decadeText, decadeTicks, logFloor, logValues, padded, tickTexts, ticks } from "./axes";
import { onCommonTime, setApart } from "./jumps";
import { shades } from "./phases";
import type { Line } from "./spec";
import { css, lineColor } from "./theme_colors";

export interface CanvasSettings {
  runs: Run[];
  clock: Clock;
  lines: Line[];
  shown: boolean[]; // per line
  log: boolean;
  shaded: boolean; // phases are
  xTitle: string;
  yTitle: string;
  window: [number, number];
  width: number;
  height: number;
  zoomed: (min: number, max: number) => void; // the user chose a part of time
  reset: () => void; // the user wants all of it
}

const kFont = '11.5px system-ui, -apple-system, "Segoe UI", Roboto, sans-serif';

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
  // The instant at the cursor, or null where it is outside of what is shown.
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
      const floor = logFloor(values);
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
        y: { range: (_, low, high) => (settings.log ? decades(low, high) : flat(low, high)) },
      },
      axes: [axis(settings.xTitle, 2), axis(settings.yTitle, 3, settings.log)],
      series: [{}, ...settings.lines.map((line, i) => seriesOf(line, settings.shown[i]))],
      hooks: {
        drawClear: [(plot) => settings.shaded && shadePhases(plot, settings.runs, true)],
        drawAxes: [(plot) => shadePhases(plot, settings.runs, false)],
        setSelect: [(plot) => this.selected(plot)],
        draw: [(plot) => this.moveCursor(plot)], // uPlot knows its scales and size only when it draws
      },
    };
  }

  private selected(plot: uPlot): void {
    const { left, width } = plot.select;
    plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    if (width > 5) this.settings.zoomed(plot.posToVal(left, "x"), plot.posToVal(left + width, "x"));
  }

  // The pointer leads the clock: hovering while nothing plays, a click always, a finger drawn along the plot.
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
    // A finger that begins to scroll the page presses too: of fingers only a tap counts.
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

function flat(low: number | null, high: number | null): [number, number] {
  const range = low === null || high === null ? { min: -1, max: 1 } : padded(low, high);
  return [range.min, range.max];
}

function decades(low: number | null, high: number | null): [number, number] {
  if (low === null || high === null) return [-18, 0];
  return [Math.floor(low), Math.floor(high) + 1];
}

function seriesOf(line: Line, shown: boolean): uPlot.Series {
  return {
    label: line.label,
    show: shown,
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

// Phases that last are shaded below everything; instants are lines above the grid.
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
