// Maps on demand: a key number, or the probability of success, over two quantities; computed cell by cell in the page.
import "../study/study.css";
import { SuccessMapChart } from "../campaign/success_map_chart";
import { element } from "../dom";
import { withUnit } from "../format";
import { keyFacts } from "../page/facts";
import { decodedRun, type Run } from "../run";
import { sweepTable } from "../study/field";
import { HeatMap } from "../study/heat_map";
import { StudyState } from "../study/state";
import { Cancelled, type EngineQueue } from "./engine_queue";
import type { Group, Quantity } from "./groups";
import { axisQuantities, axisValues, cellRequest, type CellCount, type CellResult, type Current, defaultAxes, drawn, kConfidence, kMostPerAxis, mapSweep, type MapAxisRange, type Scatter, successMapOf } from "./map_cells";
import type { Settings } from "./settings";
import { type Linked, succeeds } from "./variants";

export interface MapContext {
  groups: Group[];
  settings: Settings;
  base: Run;
  title: string;
  queue: EngineQueue;
  current: () => Current; // the panel's changes, on which the map is based
  open: (variant: Linked) => void; // as the panel's variant
}

const kRedraw = 400; // least time between drawings while cells are computed [ms]
const kMostDraws = 500;

// Null: the scenario has no two quantities.
export function mapPanel(context: MapContext): HTMLElement | null {
  const quantities = axisQuantities(context.groups);
  return quantities.length < 2 ? null : new MapPanel(context, quantities).root;
}

interface AxisInputs {
  select: HTMLSelectElement;
  from: HTMLInputElement;
  to: HTMLInputElement;
  count: HTMLInputElement;
  root: HTMLElement;
}

class MapPanel {
  readonly root: HTMLElement;
  private readonly kind = chooser("Map of", []);
  private readonly x: AxisInputs;
  private readonly y: AxisInputs;
  private readonly draws = numberField("Draws per cell", 20, { min: "1", max: String(kMostDraws), step: "1" });
  private readonly position = numberField("Error of the target's position, standard deviation [m]", 0.01, { min: "0" });
  private readonly mass = numberField("Error of its mass and inertia, standard deviation [%]", 5, { min: "0" });
  private readonly scatter = element("div", { class: "wi-bar" }, this.draws.label, this.position.label, this.mass.label);
  private readonly start = chip("Compute the map", () => void this.compute());
  private readonly stop = chip("Stop", () => (this.stopped = true));
  private readonly progress = element("progress", { max: "1", "aria-label": "Progress of the map" });
  private readonly status = element("p", { class: "wi-status", role: "status" });
  private readonly chart = element("div", { class: "st-page wi-map" });
  private readonly cells = element("div", { class: "wi-bar" });
  private stopped = false;

  constructor(
    private readonly context: MapContext,
    private readonly quantities: Quantity[],
  ) {
    const facts = keyFacts(context.base).map((fact): [string, string] => [fact.key, fact.name]);
    for (const [value, text] of [...facts, ["", "Probability of success"]]) this.kind.select.append(element("option", { value }, text));
    this.x = this.axisInputs("across");
    this.y = this.axisInputs("up");
    this.kind.select.addEventListener("change", () => this.adopt());
    this.progress.hidden = this.stop.hidden = true;
    const hint = "The map is based on the values above. A cell becomes the variant when it is selected.";
    this.root = element(
      "details",
      { class: "wi-other wi-maps" },
      element("summary", {}, "Maps over two quantities"),
      element("p", { class: "hint" }, hint),
      element("div", { class: "wi-bar" }, this.kind.label, this.x.root, this.y.root),
      this.scatter,
      element("div", { class: "wi-bar" }, this.start, this.stop, this.progress, this.status),
      this.chart,
      this.cells,
    );
    this.adopt();
  }

  private get isProbability(): boolean {
    return this.kind.select.value === "";
  }

  // The usual axes of the selected kind.
  private adopt(): void {
    this.scatter.hidden = !this.isProbability;
    const axes = defaultAxes(this.quantities, this.isProbability);
    if (!axes) return;
    [this.x, this.y].forEach((inputs, k) => this.setAxis(inputs, axes[k]));
  }
  private axisInputs(side: string): AxisInputs {
    const options = this.quantities.map((one, i) => element("option", { value: String(i) }, one.name));
    const { select, label } = chooser("quantity", options);
    const [from, to, count] = [numberField("from", 0), numberField("to", 1), numberField("cells", 7, { min: "2", max: String(kMostPerAxis), step: "1" })];
    const inputs = { select, from: from.input, to: to.input, count: count.input, root: element("fieldset", { class: "wi-axis" }, element("legend", {}, `Axis ${side}`), label, from.label, to.label, count.label) };
    select.addEventListener("change", () => this.setAxis(inputs, this.quantities[Number(select.value)]));
    return inputs;
  }
  private setAxis(inputs: AxisInputs, quantity: Quantity): void {
    inputs.select.value = String(this.quantities.indexOf(quantity));
    const round = (value: number): string => String(Number(value.toPrecision(4)));
    inputs.from.value = round(quantity.log ? Number(quantity.base) / 2 : quantity.low);
    inputs.to.value = round(quantity.log ? Number(quantity.base) * 2 : quantity.high);
  }
  private axes(): [MapAxisRange, MapAxisRange] | string {
    const read = ({ select, from, to, count }: AxisInputs): MapAxisRange => ({ quantity: this.quantities[Number(select.value)], from: from.valueAsNumber, to: to.valueAsNumber, count: count.valueAsNumber });
    const [x, y] = [read(this.x), read(this.y)];
    if (x.quantity === y.quantity) return "Both axes have the same quantity.";
    if ([x, y].some(({ from, to, count }) => !(to > from) || !(count >= 2))) return "Each axis needs numbers with from < to, and at least 2 cells.";
    return [x, y];
  }

  // ---- Computing ----

  private async compute(): Promise<void> {
    const axes = this.axes();
    if (typeof axes === "string") return this.say(axes);
    const scatter: Scatter = { draws: Math.max(1, Math.min(kMostDraws, Math.round(this.draws.input.valueAsNumber) || 1)), position: Math.max(0, this.position.input.valueAsNumber || 0), mass: Math.max(0, this.mass.input.valueAsNumber || 0) / 100 };
    const map = this.isProbability ? new ProbabilityMap(this.context, axes, scatter) : new KeyNumberMap(this.context, axes, this.kind.select.value);
    this.stopped = false;
    this.start.disabled = true;
    this.progress.hidden = this.stop.hidden = false;
    let shown = 0;
    for (let k = 0; k < map.steps && !this.stopped; ++k) {
      this.progress.value = k / map.steps;
      this.say(`${k} of ${map.steps} variants computed.`);
      try {
        await map.step(k);
      } catch (error) {
        if (!(error instanceof Cancelled)) throw error;
        this.stopped = true;
      }
      if (performance.now() - shown < kRedraw) continue;
      this.chart.replaceChildren(...map.draw());
      shown = performance.now();
    }
    this.chart.replaceChildren(...map.draw());
    this.cells.replaceChildren(...cellChooser(axes, (at) => this.context.open(map.linked(at))));
    this.start.disabled = false;
    this.progress.hidden = this.stop.hidden = true;
    this.say(this.stopped ? "Stopped; the map shows the computed cells." : `All ${map.steps} variants computed.`);
  }
  private say(message: string): void {
    this.status.textContent = message;
  }
}

// The requests of a map's cells, in rows along the first axis.
abstract class CellMap {
  protected readonly values: [number[], number[]];
  protected readonly current: Current;

  constructor(
    protected readonly context: MapContext,
    protected readonly axes: [MapAxisRange, MapAxisRange],
  ) {
    this.values = [axisValues(axes[0]), axisValues(axes[1])];
    this.current = context.current();
  }
  abstract readonly steps: number;
  abstract step(k: number): Promise<void>;
  abstract draw(): HTMLElement[];

  protected get cellCount(): number {
    return this.values[0].length * this.values[1].length;
  }
  protected valuesAt(cell: number): [number, number] {
    const wide = this.values[0].length;
    return [this.values[0][cell % wide], this.values[1][Math.floor(cell / wide)]];
  }
  // The cell as a variant.
  linked(at: [number, number]): Linked {
    const [x, y] = this.axes.map((axis, k) => `${axis.quantity.name} ${withUnit(at[k], axis.quantity.unit)}`);
    return { name: `${x}, ${y}`, request: this.request(at) };
  }
  protected request(at: [number, number]): Linked["request"] {
    return cellRequest(this.context.groups, this.current, [this.axes[0].quantity, this.axes[1].quantity], at);
  }
  // The run of a request, or the reason why it has none.
  protected async result(request: Linked["request"]): Promise<CellResult> {
    try {
      const { run, summary } = await this.context.queue.run(request, false);
      return { run: decodedRun({ ...run, summary: summary ?? run.summary, series: null, scene: null }), reason: "" };
    } catch (error) {
      if (error instanceof Cancelled) throw error;
      return { run: null, reason: (error as Error).message.split("\n")[0] };
    }
  }
}

class KeyNumberMap extends CellMap {
  private readonly results: (CellResult | undefined)[] = new Array(this.cellCount).fill(undefined);

  constructor(
    context: MapContext,
    axes: [MapAxisRange, MapAxisRange],
    private readonly fact: string,
  ) {
    super(context, axes);
  }
  get steps(): number {
    return this.cellCount;
  }
  async step(k: number): Promise<void> {
    this.results[k] = await this.result(this.request(this.valuesAt(k)));
  }
  draw(): HTMLElement[] {
    const state = new StudyState(sweepTable(mapSweep(this.axes, this.results, this.fact, this.context.base)));
    state.listenSelect(() => state.selected !== null && this.context.open(this.linked(this.valuesAt(state.selected))));
    const map = HeatMap.of(state, this.context.title);
    return map ? [map.card.root] : [];
  }
}

class ProbabilityMap extends CellMap {
  private readonly counts: (CellCount | undefined)[] = new Array(this.cellCount).fill(undefined);

  constructor(
    context: MapContext,
    axes: [MapAxisRange, MapAxisRange],
    private readonly scatter: Scatter,
  ) {
    super(context, axes);
  }
  get steps(): number {
    return this.cellCount * this.scatter.draws;
  }
  async step(k: number): Promise<void> {
    const cell = Math.floor(k / this.scatter.draws);
    const request = drawn(this.request(this.valuesAt(cell)), this.context.settings, this.scatter, k % this.scatter.draws);
    const { run } = await this.result(request);
    const count = (this.counts[cell] ??= { successes: 0, trials: 0, failures: new Map() });
    ++count.trials;
    const failure = !run ? "no result" : succeeds(run.summary) ? "" : run.summary.ledger?.pass === false ? "ledger" : "capture";
    if (failure === "") ++count.successes;
    else count.failures.set(failure, (count.failures.get(failure) ?? 0) + 1);
  }
  draw(): HTMLElement[] {
    const successMap = successMapOf(this.axes, this.counts);
    if (successMap.points.length === 0) return [];
    const chart = SuccessMapChart.of({ confidence: kConfidence, successMap }, this.context.title, ([j, i]) => this.context.open(this.linked([this.values[0][i], this.values[1][j]])));
    return chart ? [chart.card.root] : [];
  }
}

// ---- Elements ----

// The cells by keyboard.
function cellChooser(axes: [MapAxisRange, MapAxisRange], choose: (at: [number, number]) => void): HTMLElement[] {
  const selects = axes.map((axis) => chooser(axis.quantity.name, axisValues(axis).map((value) => element("option", { value: String(value) }, withUnit(value, axis.quantity.unit)))));
  const show = chip("Show this cell as the variant", () => choose(selects.map(({ select }) => Number(select.value)) as [number, number]));
  return [...selects.map(({ label }) => label), show];
}

function chooser(text: string, options: HTMLOptionElement[]): { select: HTMLSelectElement; label: HTMLElement } {
  const select = element("select", {}, ...options);
  return { select, label: element("label", {}, `${text} `, select) };
}

function numberField(text: string, value: number, limits: Record<string, string> = {}): { input: HTMLInputElement; label: HTMLElement } {
  const input = element("input", { type: "number", step: "any", ...limits });
  input.value = String(value);
  return { input, label: element("label", {}, `${text} `, input) };
}

function chip(text: string, press: () => void): HTMLButtonElement {
  const made = element("button", { type: "button", class: "chip" }, text);
  made.addEventListener("click", press);
  return made;
}
