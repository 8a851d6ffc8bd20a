// All plots of a report: in groups that can be switched off, drawn when scrolled to, led by one clock.
import type { Clock } from "../clock";
import { element } from "../dom";
import { words } from "../page/read";
import type { Run } from "../run";
import { plotsOf } from "./catalog";
import { differences, overlay } from "./compare_specs";
import { PlotView, type PlotEnvironment } from "./plot_view";
import type { PlotSpec } from "./spec";
import { onThemeChange } from "./theme_colors";
import { TimeWindow } from "./time_window";

export interface PlotHandle {
  id: string;
  title: string;
  group: string;
  readonly series: string[];
  readonly built: boolean;
  cursorTime(): number | null; // null: not drawn, or the instant is outside of what it shows
}

export function buildPlots(host: HTMLElement, runs: Run[], clock: Clock, fileName: string): PlotHandle[] {
  const specs = specsOf(runs);
  if (specs.length === 0) {
    host.append(
      element("p", { class: "empty" }, "There is no time series in this result, so there is nothing to plot."),
    );
    return [];
  }
  const window = new TimeWindow(clock.begin, clock.end);
  const environment: PlotEnvironment = { runs, clock, window, fileName };
  const views = specs.map((spec) => new PlotView(spec, environment));
  const groups = groupSections(views);
  host.append(controls(runs, views, groups, window), ...groups.values());
  drawWhenSeen(views);
  followClock(views, clock);
  window.listen(() => views.forEach((view) => view.followWindow()));
  onThemeChange(() => views.forEach((view) => view.recolor()));
  forPrinting(views);
  return views.map(handle);
}

function specsOf(runs: Run[]): PlotSpec[] {
  const each = runs.map((run, i) => (run.samples > 1 ? plotsOf(run, i) : []));
  return each.length > 1 ? overlay(each[0], each[1]) : (each[0] ?? []);
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

function groupSections(views: PlotView[]): Map<string, HTMLElement> {
  const sections = new Map<string, HTMLElement>();
  for (const view of views) {
    const { group } = view.spec;
    if (!sections.has(group)) {
      const grid = element("div", { class: "plot-grid" });
      sections.set(
        group,
        element("section", { class: "plot-group", "aria-label": `Plots: ${group}` }, element("h3", {}, group), grid),
      );
    }
    sections.get(group)!.lastElementChild!.append(view.root);
  }
  return sections;
}

// ---- Controls above the plots ----

function controls(runs: Run[], views: PlotView[], groups: Map<string, HTMLElement>, window: TimeWindow): HTMLElement {
  const chips = [...groups].map(([name, section]) => {
    const chip = element("button", { type: "button", class: "chip", "aria-pressed": "true" }, name);
    chip.addEventListener("click", () => {
      section.hidden = !section.hidden;
      chip.setAttribute("aria-pressed", String(!section.hidden));
    });
    return chip;
  });
  return element(
    "div",
    { class: "plot-controls", role: "group", "aria-label": "Plots shown" },
    element("div", { class: "chips" }, ...chips),
    element(
      "div",
      { class: "plot-options" },
      rangeChoice(runs[0], window),
      linkChoice(window),
      runs.length > 1 && differenceChoice(views, runs),
    ),
    element(
      "p",
      { class: "hint touch" },
      "Draw a finger along a plot to scrub the replay; tap a name to hide its line.",
    ),
    element(
      "p",
      { class: "hint mouse" },
      "Move over a plot to scrub the replay, drag to zoom, double click for all, click a name to hide its line.",
    ),
  );
}

function rangeChoice(run: Run, window: TimeWindow): HTMLElement {
  const choices: [string, number, number][] = [["whole run", window.begin, window.end]];
  for (const phase of run.phases) {
    if (/^contact/.test(phase.name)) {
      const around = Math.max(phase.end - phase.begin, 0.02 * (window.end - window.begin)) / 2;
      choices.push([
        phase.name === "contact" ? "around the impact" : `around ${words(phase.name)}`,
        phase.begin - around,
        phase.end + around,
      ]);
    } else if (phase.end > phase.begin) choices.push([words(phase.name), phase.begin, phase.end]);
  }
  const select = element(
    "select",
    { id: "time-range" },
    ...choices.map(([name], i) => element("option", { value: String(i) }, name)),
  );
  select.addEventListener("change", () => {
    const [, min, max] = choices[Number(select.value)];
    window.set(min, max);
  });
  return element("label", {}, "Time ", select);
}

function linkChoice(window: TimeWindow): HTMLElement {
  const box = element("input", { type: "checkbox" });
  box.addEventListener("change", () => (window.linked = box.checked));
  return element("label", {}, box, " zoom all together");
}

function differenceChoice(views: PlotView[], runs: Run[]): HTMLElement {
  const select = element(
    "select",
    { id: "overlay-or-difference" },
    element("option", { value: "both" }, "A solid, B dashed"),
    element("option", { value: "difference" }, "difference B − A"),
  );
  select.addEventListener("change", () => {
    for (const view of views) {
      const subtract = select.value === "difference";
      view.setLines(subtract ? differences(view.spec, runs) : view.spec.lines, subtract);
    }
  });
  return element("label", {}, "Lines ", select);
}

// ---- When plots are drawn ----

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

// Cursors move with every change; texts, which cost more, at most every 60 ms and once more at the end.
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
        view.moveCursor(); // also out of sight: it may come into view before its observer says so
        if (view.visible) view.readValues();
      }
    }, 60);
  });
}

// On paper every plot is a drawing of its own, in black on white, seen before or not.
function forPrinting(views: PlotView[]): void {
  window.addEventListener("beforeprint", () => views.forEach((view) => view.preparePrint()));
  window.addEventListener("afterprint", () => views.forEach((view) => view.endPrint()));
}
