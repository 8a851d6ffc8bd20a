// All plots of a report: in groups that can be hidden, drawn when scrolled into view, synchronized by one clock.
import type { Clock } from "../clock";
import { element } from "../dom";
import { differenceName, kComparison, kVariant, type Names } from "../page/names";
import type { Run } from "../run";
import { plotsOf, type Catalog } from "./catalog";
import { kOverview } from "./catalog_key";
import { differences, overlay } from "./compare_specs";
import { PlotView, type PlotEnvironment } from "./plot_view";
import type { PlotSpec } from "./spec";
import { onThemeChange } from "./theme_colors";
import { timeRanges, TimeWindow } from "./time_window";

export interface PlotHandle {
  id: string;
  title: string;
  group: string;
  readonly series: string[];
  readonly built: boolean;
  cursorTime(): number | null; // null: not drawn, or the instant is outside the displayed range
}

export interface Plots {
  handles: PlotHandle[];
  compare(variant: Run | null): void; // shows the only run of the page beside a variant of it; null: alone
}

export function buildPlots(host: HTMLElement, runs: Run[], clock: Clock, fileName: string): Plots {
  const { plots: specs, absent } = specsOf(runs);
  if (specs.length === 0) {
    host.append(
      element("p", { class: "empty" }, "There is no time series in this result, so there is nothing to plot."),
    );
    return { handles: [], compare: () => {} };
  }
  const window = new TimeWindow(clock.begin, clock.end);
  const shown = [...runs];
  const names = runs.length > 1 ? kComparison : kVariant;
  const environment: PlotEnvironment = { runs: shown, names, clock, window, fileName };
  const views = specs.map((spec) => new PlotView(spec, environment));
  const groups = groupSections(views);
  const lines = linesChoice(views, shown, names);
  host.append(controls(environment, lines.host, groups), ...groups.values());
  if (absent.length > 0)
    groups.get(kOverview)?.append(element("p", { class: "hint" }, `Not shown here: ${absent.join("; ")}.`));
  drawWhenSeen(views);
  followClock(views, clock);
  window.listen(() => {
    views.forEach((view) => view.followWindow());
    clock.enter(window.min, window.max);
  });
  onThemeChange(() => views.forEach((view) => view.recolor()));
  forPrinting(views);
  const compare = (variant: Run | null): void => {
    shown.splice(1, 1, ...(variant ? [variant] : []));
    window.end = clock.end;
    const both = variant ? overlay(specs, plotsOf(variant, 1).plots, names) : specs;
    lines.show(views.map((view) => both.find((one) => one.id === view.spec.id)!));
  };
  return { handles: views.map(handle), compare };
}

function specsOf(runs: Run[]): Catalog {
  const each = runs.map((run, i) => (run.samples > 1 ? plotsOf(run, i) : { plots: [], absent: [] }));
  if (each.length < 2) return each[0] ?? { plots: [], absent: [] };
  const [a, b] = each;
  const lacking = (own: string[], other: string[]) => own.filter((one) => other.includes(one));
  return { plots: regrouped(overlay(a.plots, b.plots, kComparison)), absent: lacking(a.absent, b.absent) };
}

// Plots that only B has are placed in their group.
function regrouped(plots: PlotSpec[]): PlotSpec[] {
  const groups = [...new Set(plots.map((plot) => plot.group))].sort((x, y) => Number(y === kOverview) - Number(x === kOverview));
  return groups.flatMap((group) => plots.filter((plot) => plot.group === group));
}

function handle(view: PlotView): PlotHandle {
  return {
    id: view.spec.id,
    title: view.spec.title,
    group: view.spec.group,
    get series() {
      return view.series;
    },
    get built() {
      return view.built;
    },
    cursorTime: () => view.cursorTime(),
  };
}

// The overview is open, the other groups are folded.
function groupSections(views: PlotView[]): Map<string, HTMLElement> {
  const sections = new Map<string, HTMLElement>();
  const grids = new Map<string, HTMLElement>();
  for (const view of views) {
    const { group } = view.spec;
    if (!grids.has(group)) {
      const grid = element("div", { class: "plot-grid" });
      grids.set(group, grid);
      const count = views.filter((one) => one.spec.group === group).length;
      const folded = () =>
        element("details", { class: "plot-group" }, element("summary", {}, group, element("span", { class: "count" }, ` ${count}`)), grid);
      const open = () => element("section", { class: "plot-group", "aria-label": `Plots: ${group}` }, grid);
      sections.set(group, group === kOverview ? open() : folded());
    }
    grids.get(group)!.append(view.root);
  }
  return sections;
}

// ---- Controls above the plots ----

function controls({ runs, window, clock }: PlotEnvironment, lines: HTMLElement, groups: Map<string, HTMLElement>): HTMLElement {
  return element(
    "div",
    { class: "plot-controls", role: "group", "aria-label": "Plots shown" },
    element(
      "div",
      { class: "plot-options" },
      rangeChoice(runs[0], window, clock),
      linkChoice(window),
      lines,
      foldChoice([...groups.values()].filter((one) => one instanceof HTMLDetailsElement)),
    ),
    element(
      "p",
      { class: "hint touch" },
      "Drag along a plot to scrub the replay; tap a name to hide its line.",
    ),
    element(
      "p",
      { class: "hint mouse" },
      "Move over a plot to scrub the replay, drag to zoom, double click for all, click a name to hide its line.",
    ),
  );
}

function foldChoice(groups: HTMLDetailsElement[]): HTMLElement | null {
  if (groups.length === 0) return null;
  const button = element("button", { type: "button", class: "chip" });
  const allOpen = () => groups.every((group) => group.open);
  const name = () => (button.textContent = allOpen() ? "Fold all groups" : "Open all groups");
  button.addEventListener("click", () => {
    const open = !allOpen();
    for (const group of groups) group.open = open;
    name();
  });
  for (const group of groups) group.addEventListener("toggle", name);
  name();
  return button;
}

function rangeChoice(run: Run, window: TimeWindow, clock: Clock): HTMLElement {
  const choices = () => timeRanges(run.phases, window.begin, window.end); // the end may change
  const select = element(
    "select",
    { id: "time-range" },
    ...choices().map(({ name }, i) => element("option", { value: String(i) }, name)),
  );
  select.addEventListener("change", () => {
    const { begin, end, at } = choices()[Number(select.value)];
    if (at !== undefined) {
      clock.pause();
      clock.time = at;
    }
    window.set(begin, end);
  });
  return element("label", {}, "Time ", select);
}

function linkChoice(window: TimeWindow): HTMLElement {
  const box = element("input", { type: "checkbox" });
  box.addEventListener("change", () => (window.linked = box.checked));
  return element("label", {}, box, " zoom all together");
}

// Both runs, or their difference; hidden while there is one run. `runs` and the plots may change.
function linesChoice(views: PlotView[], runs: Run[], names: Names): { host: HTMLElement; show: (specs: PlotSpec[]) => void } {
  const select = element(
    "select",
    { id: "overlay-or-difference" },
    element("option", { value: "both" }, `${names[0]} solid, ${names[1]} dashed`),
    element("option", { value: "difference" }, `difference ${differenceName(names)}`),
  );
  const host = element("label", {}, "Lines ", select);
  host.hidden = runs.length < 2;
  const show = (specs: PlotSpec[]): void => {
    host.hidden = runs.length < 2;
    const subtract = select.value === "difference" && runs.length > 1;
    views.forEach((view, i) => view.setLines(specs[i], subtract ? differences(specs[i], runs, names) : specs[i].lines, subtract));
  };
  select.addEventListener("change", () => show(views.map((view) => view.spec)));
  return { host, show };
}

// ---- Deferred drawing ----

function drawWhenSeen(views: PlotView[]): void {
  const byRoot = new Map<Element, PlotView>(views.map((view) => [view.root, view]));
  const seen = new IntersectionObserver(
    (entries) => {
      for (const entry of entries) {
        const view = byRoot.get(entry.target)!;
        view.visible = entry.isIntersecting;
        if (!view.visible) continue;
        view.build();
        view.moveCursor();
        view.readValues();
      }
    },
    { rootMargin: "500px" },
  );
  const sized = new ResizeObserver((entries) => entries.forEach((entry) => byRoot.get(entry.target)!.resize()));
  for (const view of views) {
    seen.observe(view.root);
    sized.observe(view.root);
  }
}

// Cursors are updated at every change; texts, which are slower, at most every 60 ms and once at the end.
function followClock(views: PlotView[], clock: Clock): void {
  let due = 0;
  clock.listen(() => {
    const visible = views.filter((view) => view.visible && view.built);
    for (const view of visible) view.moveCursor();
    if (due !== 0) return;
    due = window.setTimeout(() => {
      due = 0;
      for (const view of views) {
        if (!view.built) continue;
        view.moveCursor(); // also off screen: it may become visible before its observer reports it
        if (view.visible) view.readValues();
      }
    }, 60);
  });
}

// In print every plot is a separate drawing in black on white, including plots that were not visible.
function forPrinting(views: PlotView[]): void {
  window.addEventListener("beforeprint", () => views.forEach((view) => view.preparePrint()));
  window.addEventListener("afterprint", () => views.forEach((view) => view.endPrint()));
}
