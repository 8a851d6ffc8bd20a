// The cells of maps over two quantities: values of the axes, overrides, random draws, and their results. No DOM.
import type { SweepData } from "../data";
import { wilson } from "../campaign/wilson";
import type { MapAxis, SuccessMap } from "../campaign/model";
import { keyFacts } from "../page/facts";
import type { Run } from "../run";
import type { Override, VariantRequest } from "./engine_interface";
import { type Group, overridesOf, type Quantity, type Value } from "./groups";
import { hasNumbers, isVector, scaled, type Settings, type Vec3 } from "./settings";

export interface MapAxisRange {
  quantity: Quantity;
  from: number;
  to: number;
  count: number;
}

export interface Current {
  values: ReadonlyMap<string, Value>;
  others: Override[];
  plan: VariantRequest["plan"];
}

export const kMostPerAxis = 41;

export function axisValues({ from, to, count }: MapAxisRange): number[] {
  const n = Math.max(2, Math.min(kMostPerAxis, Math.round(count)));
  return Array.from({ length: n }, (_, k) => Number((from + ((to - from) * k) / (n - 1)).toPrecision(6)));
}

// Quantities that an axis can have: numbers.
export function axisQuantities(groups: Group[]): Quantity[] {
  return groups.flatMap((group) => group.quantities).filter((one) => typeof one.base === "number");
}

// Speed over angle for key numbers, speed over spin for probabilities; where a scenario has none, the first ones.
export function defaultAxes(quantities: Quantity[], probability: boolean): [Quantity, Quantity] | null {
  const named = (...patterns: RegExp[]): Quantity[] => patterns.flatMap((pattern) => quantities.filter((one) => pattern.test(one.name)));
  const speed = named(/^Speed at contact/, /^Time to capture/);
  const other = probability ? named(/^Spin rate/) : named(/^Angle of approach/, /^Direction of the velocity/, /^Spin rate/);
  const x = speed[0] ?? quantities[0];
  const y = other.find((one) => one !== x) ?? quantities.find((one) => one !== x);
  return x && y ? [x, y] : null;
}

// The request of a cell: the panel's present changes and the values of both axes.
export function cellRequest(groups: Group[], current: Current, axes: [Quantity, Quantity], at: [number, number]): VariantRequest {
  const values = new Map<string, Value>([...current.values, [axes[0].key, at[0]], [axes[1].key, at[1]]]);
  return { overrides: [...overridesOf(groups, values), ...current.others], plan: current.plan };
}

// ---- Key numbers over a grid ----

export interface CellResult {
  run: Run | null; // null: no result
  reason: string;
}

// As the data of a sweep with one column: the key number.
export function mapSweep(axes: [MapAxisRange, MapAxisRange], results: (CellResult | undefined)[], fact: string, base: Run): SweepData {
  const described = keyFacts(base).find((one) => one.key === fact);
  const [x, y] = axes.map(axisValues);
  const of = (get: (i: number, j: number) => number): number[] => y.flatMap((_, j) => x.map((_, i) => get(i, j)));
  const value = (cell: CellResult | undefined): number | null => (cell?.run ? (keyFacts(cell.run).find((one) => one.key === fact)?.value ?? null) : null);
  return {
    settings: {},
    command: "",
    axes: axes.map(({ quantity }) => ({ name: quantity.name, unit: quantity.unit, description: "" })),
    axis_values: [of((i) => x[i]), of((_, j) => y[j])],
    status: results.map((cell) => (!cell ? "not computed" : cell.run ? "ok" : "failed")),
    reason: results.map((cell) => cell?.reason ?? ""),
    columns: [{ name: described?.name ?? fact, unit: described?.unit ?? "1", description: "" }],
    values: [results.map(value)],
  };
}

// ---- Probability of success by draws ----

export interface Scatter {
  draws: number; // per cell
  position: number; // standard deviation of the estimate of each target's position, per axis [m]
  mass: number; // standard deviation of each target's mass and inertia, relative
}

// Draw k, the same in every cell, so that cells differ by their axes alone: the target's position that the approach
// assumes differs from the true one, and mass and inertia differ from their values in the request.
export function drawn(request: VariantRequest, settings: Settings, scatter: Scatter, k: number): VariantRequest {
  const random = normals(k + 1);
  const valueOf = (path: string): unknown => request.overrides.filter((one) => one.path === path).at(-1)?.value ?? settings.value(path);
  const overrides = settings.match("targets.*.state").flatMap(({ path: state }): Override[] => {
    const target = state.replace(/\.state$/, "");
    const error: Vec3 = [random(), random(), random()].map((x) => scatter.position * x) as Vec3;
    const given = valueOf(`${target}.estimate.position_error`);
    const factor = Math.max(0.05, 1 + scatter.mass * random());
    const bodies = ["mass", "inertia"].flatMap((key) => {
      const value = valueOf(`${target}.${key}`);
      return scatter.mass > 0 && hasNumbers(value) ? [{ path: `${target}.${key}`, value: scaled(value, factor) }] : [];
    });
    const estimate = { path: `${target}.estimate.position_error`, value: error.map((x, c) => x + (isVector(given) ? given[c] : 0)) };
    return [...(scatter.position > 0 ? [estimate] : []), ...bodies];
  });
  return { ...request, overrides: [...request.overrides, ...overrides] };
}

// Standard normal numbers by Box and Muller's method, from a generator of 32 bits (mulberry32).
export function normals(seed: number): () => number {
  let state = Math.imul(seed, 0x9e3779b9) >>> 0;
  const uniform = (): number => {
    state = (state + 0x6d2b79f5) >>> 0;
    let t = Math.imul(state ^ (state >>> 15), state | 1);
    t ^= t + Math.imul(t ^ (t >>> 7), t | 61);
    return (((t ^ (t >>> 14)) >>> 0) + 0.5) / 4294967296;
  };
  return () => Math.sqrt(-2 * Math.log(uniform())) * Math.cos(2 * Math.PI * uniform());
}

export interface CellCount {
  successes: number;
  trials: number;
  failures: Map<string, number>; // reason: count
}

export const kConfidence = 0.95;

// `counts` in the order of cells: the first axis of `axes` varies fastest.
export function successMapOf(axes: [MapAxisRange, MapAxisRange], counts: (CellCount | undefined)[]): SuccessMap {
  const asAxis = (axis: MapAxisRange): MapAxis => ({ name: axis.quantity.name, unit: axis.quantity.unit, description: "", values: axisValues(axis), labels: null });
  const [x, y] = axes.map(asAxis);
  const points = counts.flatMap((cell, k) => {
    if (!cell) return [];
    const unmet = [...cell.failures].map(([criterion, count]) => ({ criterion, count })).sort((a, b) => b.count - a.count);
    const at = [Math.floor(k / x.values.length), k % x.values.length];
    return [{ ...wilson(cell.successes, cell.trials, kConfidence), at, deciding: unmet[0]?.criterion ?? "", unmet }];
  });
  return { axes: [y, x], points };
}
