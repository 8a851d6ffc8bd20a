// The page of one run, or of two compared.
import type { ReportData } from "../data";
import { Clock } from "../clock";
import { element } from "../dom";
import { number } from "../format";
import { buildPlots, type PlotHandle, type Plots } from "../plots/plots_panel";
import { createReplay, type Replay } from "../replay/replay";
import { roving } from "../roving";
import { decodedRun, type Run } from "../run";
import type { VariantEngine } from "../whatif/engine_interface";
import { whatIfSection } from "../whatif/panel";
import { answers, differingScenarios, impactDifferences, otherNumbers } from "./compare";
import { contactsSection, hasContacts } from "./contacts";
import { drivenSection, isDriven } from "./driven";
import { loadsSection } from "./loads";
import { afterSection, costSection, feasibilitySection } from "./feasibility";
import { showsPublished } from "./facts";
import { header } from "./header";
import { impactSection } from "./impact";
import { ledgerOfBoth, ledgerSection } from "./ledger";
import { planSection } from "./plan";
import { publishedSection } from "./published";
import { list, text } from "./read";
import { absent, mark } from "./table";
import { scenarioSection } from "./scenario";
import { verdict } from "./verdict";

interface Section {
  id: string;
  title: string;
  short: string; // in the list of sections
  build: () => HTMLElement[];
}

// For tests and for the browser's console.
export interface Handles {
  clock: Clock;
  replay: Replay | null;
  runs: Run[];
  plots: PlotHandle[];
}

// `engine` simulates variants of the only run; null: the page shows what it contains.
export function buildRunPage(host: HTMLElement, data: ReportData, engine: VariantEngine | null): void {
  const runs = list(data.runs).map(decodedRun);
  if (runs.length === 0) throw new Error("the report contains no run");
  const moving = runs.filter((run) => run.samples > 1);
  const clock = new Clock(least(moving.map((run) => run.begin)), Math.max(0, ...moving.map((run) => run.end)));
  followAddress(clock);
  const handles: Handles = { clock, replay: null, runs: [...runs], plots: [] };
  (window as unknown as { __grapnel: Handles }).__grapnel = handles;

  const shown: { plots: Plots | null } = { plots: null };
  const sections = runs.length > 1 ? comparisonSections(runs) : runSections(runs[0]);
  const replay: Section = {
    id: "replay",
    title: "Replay",
    short: "Replay",
    build: () => replayPart(runs, clock, handles),
  };
  const plots: Section = {
    id: "plots",
    title: "Plots",
    short: "Plots",
    build: () => plotsPart(runs, clock, handles, shown, data.title),
  };
  sections.splice(1, 0, replay, plots);
  if (engine && runs.length === 1) sections.splice(3, 0, whatIf(data, runs[0], engine, (variant) => showBeside(variant, runs[0], handles, shown)));
  const made = sections.map(sectionElement);
  const workspace = element("div", { class: "workspace" }, ...made.slice(0, 3).map((one) => one.root));
  host.replaceChildren(
    header(data, runs),
    navigation(sections),
    ...notices(runs),
    workspace,
    ...made.slice(3).map((one) => one.root),
    footer(data),
  );
  for (const one of made) one.fill(); // inserted first: replay and plots need their sizes
}

function whatIf(data: ReportData, base: Run, engine: VariantEngine, show: (variant: Run | null) => void): Section {
  return { id: "whatif", title: "What if", short: "What if", build: () => whatIfSection({ base, engine, title: data.title, show }) };
}

// Replay and plots show the variant beside the run; null: the run alone.
function showBeside(variant: Run | null, base: Run, handles: Handles, { plots }: { plots: Plots | null }): void {
  handles.runs.splice(1, 1, ...(variant ? [variant] : []));
  handles.clock.end = Math.max(base.end, variant?.end ?? base.end);
  handles.replay?.compare(variant);
  plots?.compare(variant);
}

// report.html#t=20 opens at that instant [s], for links.
function followAddress(clock: Clock): void {
  const go = (): void => {
    const requested = /^#t=([-+.\deE]+)$/.exec(location.hash);
    if (requested) clock.time = Number(requested[1]);
  };
  go();
  window.addEventListener("hashchange", go);
}

function least(values: number[]): number {
  return values.length > 0 ? Math.min(...values) : 0;
}

// ---- Sections ----

function runSections(run: Run): Section[] {
  const s = run.summary;
  return [
    { id: "verdict", title: "Verdict", short: "Verdict", build: () => verdict(run) },
    { id: "ledger", title: "Ledger", short: "Ledger", build: () => ledgerSection(s) },
    ...(showsPublished(s)
      ? [{ id: "published", title: "Published beside consistent values", short: "As published", build: () => publishedSection(s) }]
      : []),
    { id: "impact", title: "Impact", short: "Impact", build: () => impactSection(s) },
    { id: "loads", title: "Loads over all phases", short: "Loads", build: () => loadsSection(s) },
    ...(hasContacts(s)
      ? [{ id: "contacts", title: "Contacts", short: "Contacts", build: () => contactsSection(s) }]
      : []),
    ...(isDriven(s)
      ? [{ id: "driven", title: "Control and actuators", short: "Control", build: () => drivenSection(s) }]
      : []),
    { id: "after", title: "After the impact", short: "After", build: () => afterSection(s) },
    {
      id: "feasibility",
      title: "Clearance and limits",
      short: "Clearance and limits",
      build: () => feasibilitySection(run),
    },
    { id: "plan", title: "Plan", short: "Plan", build: () => planSection(s) },
    { id: "scenario", title: "Scenario", short: "Scenario", build: () => scenarioSection(run) },
    { id: "cost", title: "Cost and samples", short: "Cost", build: () => costSection(s, samplesText(run)) },
  ];
}

function comparisonSections(runs: Run[]): Section[] {
  const [a, b] = runs;
  const numbers = () => [impactDifferences(runs), answers(runs), otherNumbers(runs), differingScenarios(runs)].filter((one) => one !== null);
  const details = runs.map((run, i): Section => {
    const label = run.data.label || "AB"[i];
    return {
      id: `run-${label}`,
      title: `Details of ${label}: ${text(run.summary.scenario?.name)}`,
      short: `Details of ${label}`,
      build: () => detailsOf(run),
    };
  });
  return [
    { id: "verdict", title: "A beside B", short: "A beside B", build: numbers },
    { id: "ledger", title: "Ledgers", short: "Ledgers", build: () => ledgerOfBoth(a.summary, b.summary) },
    ...details,
  ];
}

function detailsOf(run: Run): HTMLElement[] {
  return runSections(run)
    .filter((section) => section.id !== "ledger")
    .map((section) => element("details", {}, element("summary", {}, section.title), ...guarded(section)));
}

// A failed section shows its error; the others remain.
function guarded(section: Section): HTMLElement[] {
  try {
    return section.build();
  } catch (error) {
    console.warn(section.id, error);
    return [
      absent(
        `This part cannot be shown; the result may be damaged or from another version: ${(error as Error).message}`,
      ),
    ];
  }
}

function sectionElement(section: Section): { root: HTMLElement; fill: () => void } {
  const root = element(
    "section",
    { id: section.id, "aria-labelledby": `${section.id}-title`, class: "part" },
    element("h2", { id: `${section.id}-title` }, section.title),
  );
  return { root, fill: () => root.append(...guarded(section)) };
}

function navigation(sections: Section[]): HTMLElement {
  const links = sections.map((section) => element("a", { href: `#${section.id}` }, section.short));
  const nav = element("nav", { class: "page-nav", "aria-label": "Sections" }, ...links);
  roving(nav);
  return nav;
}

// ---- Replay and plots ----

function replayPart(runs: Run[], clock: Clock, handles: Handles): HTMLElement[] {
  if (!runs.some((run) => run.scene && run.samples > 0)) {
    return [absent("There is no replay: this result has no scene.json or no time series.")];
  }
  return filledLater("The replay", (stage) => (handles.replay = createReplay(stage, runs, clock)));
}

function plotsPart(runs: Run[], clock: Clock, handles: Handles, shown: { plots: Plots | null }, title: string): HTMLElement[] {
  if (!(clock.end > clock.begin) && runs.some((run) => run.samples > 0)) {
    return [absent("The run is a single instant without plots over time. The section Impact has the values before and after.")];
  }
  return filledLater("The plots", (panel) => {
    shown.plots = buildPlots(panel, runs, clock, title);
    handles.plots = shown.plots.handles;
  });
}

// Parts that depend on their size are filled after insertion.
function filledLater(what: string, build: (host: HTMLElement) => void): HTMLElement[] {
  const host = element("div", { class: "filled" });
  queueMicrotask(() => {
    try {
      build(host);
    } catch (error) {
      console.warn(what, error);
      host.replaceChildren(absent(`${what} cannot be shown: ${(error as Error).message}`));
    }
  });
  return [host];
}

// ---- Warnings and origin ----

function notices(runs: Run[]): HTMLElement[] {
  const entries = runs.flatMap((run) => {
    const who = run.data.label ? `${run.data.label}: ` : "";
    const failure =
      run.summary.status === "failed"
        ? [{ tone: "bad" as const, text: `${who}the run failed: ${text(run.summary.failure, "no reason is given")}` }]
        : [];
    const warnings = [...list(run.summary.warnings), ...run.data.notes].map((one) => ({
      tone: "warn" as const,
      text: `${who}${String(one)}`,
    }));
    return [...failure, ...warnings];
  });
  if (entries.length === 0) return [];
  return [
    element(
      "section",
      { class: "notices", "aria-label": "Warnings" },
      element("ul", {}, ...entries.map((one) => element("li", {}, mark(one.tone, one.text)))),
    ),
  ];
}

function samplesText(run: Run): string {
  const packed = run.data.series;
  if (!packed) return "No time series.";
  if (packed.samples === packed.of)
    return `All ${packed.of} samples of the time series are in this page, in single precision.`;
  return `${packed.samples} of ${packed.of} samples of the time series are in this page, in single precision; omitted samples deviate from the lines by at most ${number(packed.bound, 2)} of each series' range. All are in timeseries.h5.`;
}

function footer(data: ReportData): HTMLElement {
  return element(
    "footer",
    { class: "page-foot" },
    `Made by Grapnel ${data.version || "of unknown version"} from the result's own files; this page loads nothing. SI units and radians; vectors in the world frame W.`,
  );
}
