// One plot on the page: frame, legend with values at the cursor, buttons; drawn when it first becomes visible.
import type { Clock } from "../clock";
import { element, download } from "../dom";
import { number } from "../format";
import type { Run } from "../run";
import { differenceName, type Names } from "../page/names";
import { plotCsv } from "./csv";
import { valueAt } from "./jumps";
import { PlotCanvas } from "./plot_canvas";
import { pictureOf, pngOf } from "./plot_picture";
import { roving } from "../roving";
import type { Limit, Line, PlotSpec } from "./spec";
import { lineColor } from "./theme_colors";
import type { TimeWindow } from "./time_window";

export interface PlotEnvironment {
  runs: Run[]; // the second may change
  names: Names; // of two runs
  clock: Clock;
  window: TimeWindow;
  fileName: string; // prefix of the names of exported files
}

const kFileSize = { width: 560, height: 330 };
const kPrintSize = { width: 400, height: 250 };

export class PlotView {
  readonly root: HTMLElement;
  visible = false;
  private lines: Line[];
  private shown: boolean[];
  private log: boolean;
  private subtracted = ""; // prefix of titles of differences
  private canvas: PlotCanvas | null = null;
  private own: [number, number] | null = null; // zoomed separately
  private readonly heading = element("h3");
  private readonly body = element("div", { class: "plot-body", tabindex: "0", role: "slider" });
  private readonly strip = element("p", { class: "plot-strip" });
  private readonly legend = element("div", { class: "plot-legend" });
  private readonly print = element("div", { class: "plot-print" });
  private readonly whole = button("show all", "Show the whole run again (double click on the plot)", () =>
    this.resetZoom(),
  );
  private readonly windowCsv = button("CSV part", "Save the part of time shown as CSV", () => this.saveCsv(true));
  private readouts: HTMLElement[] = [];

  constructor(
    private current: PlotSpec,
    private readonly environment: PlotEnvironment,
  ) {
    this.lines = current.lines;
    this.log = current.log ?? false;
    this.shown = this.lines.map((line) => !line.hidden);
    this.own = current.start ?? null;
    this.root = this.frame();
    this.body.addEventListener("keydown", (event) => this.key(event));
    this.fillLegend();
  }

  get spec(): PlotSpec {
    return this.current;
  }
  get built(): boolean {
    return this.canvas !== null;
  }
  get series(): string[] {
    return this.lines.map((line) => line.label);
  }
  cursorTime(): number | null {
    return this.canvas?.cursorTime() ?? null;
  }

  build(): void {
    if (this.canvas || this.body.clientWidth === 0) return;
    const [min, max] = this.window();
    this.canvas = new PlotCanvas(this.body, {
      ...this.environment,
      lines: this.lines,
      shown: this.shown,
      log: this.log,
      floor: this.spec.floor,
      xTitle: "time [s]",
      yTitle: `${this.subtracted}${this.spec.axis}`,
      limits: this.limits(),
      shaded: this.spec.window === undefined,
      window: [min, max],
      width: this.body.clientWidth,
      height: this.body.clientHeight,
      zoomed: (from, to) => this.zoom(from, to),
      reset: () => this.resetZoom(),
      offScale: (limits) => this.showStrip(limits),
    });
    this.showZoom();
    this.readValues();
  }

  // Replaces the lines of the quantity: those of one run or two, or their difference. Hidden lines remain hidden.
  setLines(spec: PlotSpec, lines: Line[], difference: boolean): void {
    const was = new Map(this.lines.map((line, i) => [`${line.run} ${line.key}`, this.shown[i]]));
    this.current = spec;
    this.lines = lines;
    this.log = !difference && (this.spec.log ?? false);
    if (this.own) this.own = this.environment.window.allowed(...this.own); // its end may have changed
    if ((spec.limits ?? []).length > 0) this.body.parentElement!.before(this.strip); // a variant may be the first with limits
    this.showStrip([]);
    this.subtracted = difference ? `${differenceName(this.environment.names)}: ` : "";
    this.heading.textContent = this.title();
    this.shown = lines.map((line) => was.get(`${line.run} ${line.key}`) ?? was.get(`0 ${line.key}`) ?? !line.hidden);
    this.body.setAttribute("aria-valuemax", String(this.environment.clock.end));
    this.canvas?.destroy();
    this.canvas = null;
    this.fillLegend();
    if (this.visible) this.build();
  }

  // Of a view that leaves the page.
  destroy(): void {
    this.canvas?.destroy();
    this.canvas = null;
  }
  resize(): void {
    if (this.body.clientWidth > 0) this.canvas?.resize(this.body.clientWidth, this.body.clientHeight);
  }
  recolor(): void {
    this.canvas?.recolor();
    this.legend.querySelectorAll<HTMLElement>(".swatch").forEach((swatch, i) => paint(swatch, this.lines[i]));
  }
  moveCursor(): void {
    this.canvas?.moveCursor();
  }
  readValues(): void {
    const { runs, clock } = this.environment;
    this.lines.forEach((line, i) => {
      if (!this.shown[i]) return;
      const text = number(valueAt(runs[line.run].time, line.values(), clock.time, clock.back));
      if (this.readouts[i].textContent !== text) this.readouts[i].textContent = text;
    });
    this.body.setAttribute("aria-valuenow", clock.time.toFixed(4));
    this.body.setAttribute("aria-valuetext", `${number(clock.time)} s`);
  }
  // The window of all plots has changed.
  followWindow(): void {
    this.own = null;
    this.applyWindow();
  }
  private applyWindow(): void {
    const [min, max] = this.window();
    this.canvas?.setWindow(min, max);
    this.showZoom();
  }
  private showZoom(): void {
    const zoomed = !this.isWhole();
    this.whole.hidden = !zoomed;
    this.windowCsv.hidden = !zoomed;
  }
  // Limits beyond the axis have a strip above the plot: on the plot they would be labels without lines.
  private showStrip(limits: string[]): void {
    const text = limits.join(" · ");
    if (this.strip.textContent !== text) this.strip.textContent = text;
  }

  preparePrint(): void {
    const parsed = new DOMParser().parseFromString(this.picture(kPrintSize), "image/svg+xml").documentElement;
    this.print.replaceChildren(document.importNode(parsed, true));
  }
  endPrint(): void {
    this.print.replaceChildren();
  }

  // ---- Time ----

  private window(): [number, number] {
    const { window } = this.environment;
    return this.own ?? this.spec.window ?? [window.min, window.max];
  }
  private isWhole(): boolean {
    const { window } = this.environment;
    const [min, max] = this.window();
    const [begin, end] = this.spec.window ?? [window.begin, window.end];
    return min <= begin && max >= end;
  }
  private zoom(min: number, max: number): void {
    const { window } = this.environment;
    if (window.linked && !this.spec.window) {
      window.set(min, max);
      return;
    }
    this.own = window.allowed(min, max);
    this.applyWindow();
    this.environment.clock.enter(...this.own);
  }
  private resetZoom(): void {
    const { window } = this.environment;
    this.own = null;
    if (this.spec.window) this.applyWindow();
    else if (window.linked) window.reset();
    else {
      if (!this.isWhole()) this.own = [window.begin, window.end];
      this.applyWindow();
    }
  }

  private key(event: KeyboardEvent): void {
    const { clock } = this.environment;
    const [min, max] = this.window();
    const step = ((max - min) / 100) * (event.shiftKey ? 10 : 1);
    const middle = Math.min(max, Math.max(min, clock.time));
    const zoomBy = (factor: number) => this.zoom(middle - (middle - min) * factor, middle + (max - middle) * factor);
    const actions: Record<string, () => void> = {
      ArrowLeft: () => (clock.time -= step),
      ArrowRight: () => (clock.time += step),
      Home: () => (clock.time = min),
      End: () => (clock.time = max),
      " ": () => clock.toggle(),
      "+": () => zoomBy(0.5),
      "-": () => zoomBy(2),
      Escape: () => this.resetZoom(),
      "0": () => this.resetZoom(),
    };
    const action = event.ctrlKey || event.metaKey || event.altKey ? undefined : actions[event.key];
    if (!action) return;
    event.preventDefault();
    event.stopPropagation();
    action();
  }

  // ---- Elements around the plot ----

  private frame(): HTMLElement {
    const { spec, environment } = this;
    const id = `plot-${spec.id}`;
    this.heading.id = `${id}-title`;
    this.heading.textContent = this.title();
    this.whole.hidden = true;
    this.windowCsv.hidden = true;
    this.body.setAttribute("aria-label", `Time in ${spec.title}: arrow keys move it, + and − zoom, Escape shows all`);
    this.body.setAttribute("aria-valuemin", String(environment.clock.begin));
    this.body.setAttribute("aria-valuemax", String(environment.clock.end));
    this.body.setAttribute("aria-valuenow", String(environment.clock.time));
    const enlarge = button("⤢", "Enlarge this plot", () => {
      const large = this.root.classList.toggle("large");
      enlarge.setAttribute("aria-pressed", String(large));
    });
    enlarge.classList.add("enlarge");
    const tools = element(
      "div",
      { class: "plot-tools" },
      button("SVG", "Save as SVG picture", () => download(`${this.fileName()}.svg`, this.picture(), "image/svg+xml")),
      button("PNG", "Save as PNG picture", () => this.savePng()),
      button("CSV", "Save all samples as CSV", () => this.saveCsv(false)),
      this.windowCsv,
      enlarge,
    );
    tools.setAttribute("role", "toolbar");
    tools.setAttribute("aria-label", `Save or enlarge: ${spec.title}`);
    roving(tools);
    this.legend.setAttribute("role", "toolbar");
    this.legend.setAttribute("aria-label", `Lines of ${spec.title}`);
    roving(this.legend);
    const head = element("div", { class: "plot-head" }, this.heading, tools);
    const note = spec.note ? element("p", { class: "plot-note" }, spec.note) : null;
    return element(
      "figure",
      { class: "plot", "data-plot": spec.id, "aria-labelledby": `${id}-title` },
      head,
      (spec.limits ?? []).length > 0 && this.strip,
      element("div", { class: "plot-stage" }, this.body, this.whole),
      this.legend,
      this.print,
      note,
    );
  }

  private fillLegend(): void {
    this.readouts = this.lines.map(() => element("span", { class: "readout" }));
    const entries = this.lines.map((line, i) => {
      const swatch = element("span", { class: "swatch", "aria-hidden": "true" });
      paint(swatch, line);
      const entry = element(
        "button",
        { type: "button", "aria-pressed": String(this.shown[i]), title: `Hide or show ${line.label}` },
        swatch,
        line.label,
        this.readouts[i],
      );
      entry.addEventListener("click", () => this.toggle(i, entry));
      return entry;
    });
    this.legend.replaceChildren(...entries);
  }

  private toggle(line: number, entry: HTMLElement): void {
    this.shown[line] = !this.shown[line];
    entry.setAttribute("aria-pressed", String(this.shown[line]));
    this.readouts[line].textContent = "";
    this.canvas?.show(line, this.shown[line]);
    if (this.canvas) this.readValues();
  }

  // A difference has none.
  private limits(): Limit[] {
    return this.subtracted ? [] : (this.spec.limits ?? []);
  }

  private title(): string {
    return `${this.subtracted}${this.spec.title}`;
  }

  // ---- Files ----

  private fileName(): string {
    return `${this.environment.fileName}-${this.spec.id}`.replace(/[^\w.-]+/g, "-");
  }
  private picture(size = kFileSize): string {
    const lines = this.lines.filter((_, i) => this.shown[i]);
    const words = { title: this.title(), axis: `${this.subtracted}${this.spec.axis}` };
    return pictureOf({ ...this.spec, ...words, limits: this.limits(), lines, log: this.log }, this.environment.runs, this.window(), size);
  }
  private savePng(): void {
    pngOf(this.picture(), 3).then(
      (blob) => download(`${this.fileName()}.png`, blob),
      (error) => console.warn(error),
    );
  }
  private saveCsv(part: boolean): void {
    const shown = part ? this.window() : this.spec.window;
    const window = shown ? { min: shown[0], max: shown[1] } : null;
    download(`${this.fileName()}.csv`, plotCsv(this.lines, this.environment.runs, window), "text/csv");
  }
}

function button(text: string, title: string, action: () => void): HTMLButtonElement {
  const made = element("button", { type: "button", title, "aria-label": title }, text);
  made.addEventListener("click", action);
  return made;
}

// A sample of the line with its dashes.
function paint(swatch: HTMLElement, line: Line): void {
  const color = lineColor(line.color);
  const [on, off] = line.dash;
  swatch.style.background =
    line.dash.length === 0
      ? color
      : `repeating-linear-gradient(90deg, ${color} 0 ${on}px, transparent ${on}px ${on + (off ?? on)}px)`;
  swatch.style.height = `${Math.max(2, Math.round(line.width + 0.4))}px`;
}
