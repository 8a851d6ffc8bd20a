// The live page of a command with --watch: asks the program for its state, and becomes the report when it has ended.
import "./watch.css";
import { Clock } from "../clock";
import type { PackedSeries, ReportData } from "../data";
import { element } from "../dom";
import { number } from "../format";
import { kComparison } from "../page/names";
import { words } from "../page/read";
import { themeToggle } from "../page/theme";
import { plotsOf } from "../plots/catalog";
import { kOverview } from "../plots/catalog_key";
import { PlotView } from "../plots/plot_view";
import { TimeWindow } from "../plots/time_window";
import { Run } from "../run";
import { durationText, estimates, share, timeLeft, type LiveState } from "./progress";
import { EstimateChart } from "./estimate_chart";

const kStatePeriod = 500; // [ms]
const kPlotPeriod = 3000; // at least; longer in long work, since each update draws all plots again
const kConfidence = 0.95;
const kMostSilent = 5; // requests without an answer
const kPatience = 10000; // for an answer [ms]

// What the program answers; null: nothing in time, or an error.
async function ask<T>(what: string): Promise<T | null> {
  try {
    const answer = await fetch(what, { signal: AbortSignal.timeout(kPatience) });
    return answer.ok ? ((await answer.json()) as T) : null;
  } catch {
    return null;
  }
}

export function buildWatchPage(host: HTMLElement, data: ReportData): void {
  const page = new WatchPage(data);
  host.replaceChildren(...page.parts);
  void page.follow();
}

class WatchPage {
  readonly parts: HTMLElement[];
  private readonly status = element("p", { class: "watch-status", role: "status" });
  private readonly stop = element("button", { type: "button", class: "watch-stop" }, "Stop and keep the results so far");
  private readonly progress = element("div", { class: "watch-phases" });
  private readonly messages = element("ul", { class: "watch-messages" });
  private readonly notes = element("pre", { class: "watch-notes" });
  private readonly plots = element("div", { class: "plot-grid" });
  private readonly chart = new EstimateChart();
  private readonly command: string;
  private views: PlotView[] = [];
  private drawn = { samples: 0, at: -Infinity };

  constructor(data: ReportData) {
    const command = (this.command = data.watch?.command ?? "");
    this.stop.addEventListener("click", () => void this.requestStop());
    this.parts = [
      element(
        "header",
        { class: "page-head" },
        element("div", { class: "brand" }, element("span", { class: "kind" }, `Grapnel · ${command} in progress`), themeToggle()),
        element("h1", {}, data.title || "untitled"),
        this.status,
        this.stop,
      ),
      element("section", { class: "part", id: "progress" }, element("h2", {}, "Progress"), this.progress, this.chart.root),
      element("section", { class: "part watch-results", id: "so-far" }, element("h2", {}, "So far"), this.messages, this.plots, this.notes),
    ];
  }

  // Asks until the work has ended or the program no longer answers.
  async follow(): Promise<void> {
    for (let silent = 0; silent < kMostSilent; ) {
      const state = await ask<LiveState>("state");
      silent = state ? 0 : silent + 1;
      if (state?.ending) return this.end(state);
      if (state) {
        this.show(state);
        await this.updatePlots(state);
      }
      await new Promise((resolve) => setTimeout(resolve, kStatePeriod));
    }
    this.status.textContent = "The program has ended, or does not answer. Its terminal has the result.";
    this.stop.hidden = true;
  }

  private async requestStop(): Promise<void> {
    this.stop.disabled = true;
    this.stop.textContent = "Stopping …";
    await fetch("stop", { method: "POST" }).catch(() => undefined);
  }

  private end(state: LiveState): void {
    this.show(state);
    this.stop.hidden = true;
    this.status.textContent = `Ended after ${durationText(state.elapsed)}: ${state.ending}.`;
    if (state.report) location.reload(); // the program now sends the report
  }

  private show(state: LiveState): void {
    const left = timeLeft(state);
    this.status.textContent = `${state.stopping ? "stopping, " : ""}${durationText(state.elapsed)} elapsed${left === null ? "" : `, about ${durationText(left)} left${state.unit ? "" : ` of ${words(state.phases.at(-1)?.name ?? "")}`}`}`;
    this.progress.replaceChildren(...(state.unit ? [this.casesBar(state)] : state.phases.map((phase) => bar(words(phase.name), share(phase), `${number(phase.at)} of ${number(phase.end)} ${phase.unit}`))));
    this.chart.show(this.command === "campaign" && state.unit === "case" ? estimates(state, kConfidence) : null, state.total ?? 0);
    this.messages.replaceChildren(...state.messages.map((one) => element("li", { class: one.kind }, one.text)));
    if (this.notes.textContent !== state.notes) this.notes.textContent = state.notes;
  }

  private casesBar(state: LiveState): HTMLElement {
    const [, done, , failed] = state.history.at(-1) ?? [0, 0, 0, 0];
    const total = state.total ?? 0;
    const text = `${done} of ${total} ${state.unit}s${failed > 0 ? `, ${failed} without a valid result` : ""}`;
    return bar(`${state.unit}s`, total > 0 ? done / total : 0, text);
  }

  // The overview of a report, of the samples so far.
  private async updatePlots(state: LiveState): Promise<void> {
    const now = performance.now();
    const period = Math.max(kPlotPeriod, 20 * state.elapsed); // at most 50 times per doubling of the elapsed time
    if (state.samples < 2 || state.samples === this.drawn.samples || now - this.drawn.at < period) return;
    this.drawn = { samples: state.samples, at: now };
    const series = await ask<PackedSeries>("series");
    if (!series) return;
    const run = new Run({ label: "", summary: null, scene: null, series, notes: [] });
    if (run.samples < 2) return;
    const environment = { runs: [run], names: kComparison, clock: new Clock(run.begin, run.end), window: new TimeWindow(run.begin, run.end), fileName: "live" };
    const views = plotsOf(run, 0)
      .plots.filter((plot) => plot.group === kOverview)
      .map((plot) => new PlotView(plot, environment));
    const height = this.plots.offsetHeight;
    this.plots.style.minHeight = `${height}px`; // no jump of what follows
    this.plots.replaceChildren(...views.map((view) => view.root));
    for (const view of this.views) view.destroy();
    for (const view of views) view.build();
    this.views = views;
    this.plots.style.minHeight = "";
  }
}

function bar(name: string, part: number, text: string): HTMLElement {
  const meter = element("progress", { max: "1", value: String(part), "aria-label": name });
  return element("div", { class: "watch-phase" }, element("span", { class: "name" }, name), meter, element("span", { class: "at" }, text));
}
