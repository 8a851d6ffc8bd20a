// The success map of campaign.json: success over the points of a design. No DOM.
import type * as file from "../campaign_types";
import type { Partly } from "../data";
import type { SuccessMap, MapAxis } from "./model";
import { proportionOf } from "./wilson";

export function readSuccessMap(e: Partly<file.SuccessMap> | undefined, confidence: number): SuccessMap | null {
  if (!Array.isArray(e?.axes) || e.axes.length === 0) return null;
  const stated: MapAxis[] = e.axes.map(axis);
  // Maps require increasing values, regardless of the order in the file.
  const orders = stated.map((a) => a.values.map((_, k) => k).sort((i, j) => a.values[i] - a.values[j] || i - j));
  const ranks = orders.map((order) => order.map((_, k) => order.indexOf(k)));
  const axes = stated.map((a, k) => ({ ...a, values: orders[k].map((i) => a.values[i]) }));
  const points = [];
  const count = axes.reduce((product, a) => product * a.values.length, 1);
  for (let k = 0; k < count; ++k) {
    const interval = { estimate: e.estimate?.[k], lower: e.lower?.[k], upper: e.upper?.[k] };
    const trials = numberOf(e.trials?.[k]) || 0;
    points.push({ ...proportionOf(trials > 0 ? interval : null, numberOf(e.successes?.[k]), trials, confidence), at: placeOf(axes, k).map((i, a) => ranks[a][i]), deciding: textOf(e.deciding?.[k]), unmet: unmetAt(e.unmet, k) });
  }
  return { axes, points };
}

function unmetAt(unmet: Partly<file.UnmetCriterion>[] | undefined, k: number): { criterion: string; count: number }[] {
  const all = Array.isArray(unmet) ? unmet : [];
  return all.map((u) => ({ criterion: textOf(u?.criterion), count: numberOf(u?.counts?.[k]) || 0 }));
}

function axis(a: Partly<file.SuccessMapAxis>): MapAxis {
  const values = Array.isArray(a?.values) ? a.values : [];
  const numbers = values.filter((v) => typeof v === "number");
  const numeric = a?.is_numeric !== false && numbers.length === values.length;
  return { name: textOf(a?.name), unit: textOf(a?.unit), description: textOf(a?.description), values: numeric ? numbers : values.map((_, k) => k), labels: numeric ? null : values.map(String) };
}

// The first axis varies slowest.
export function placeOf(axes: MapAxis[], point: number): number[] {
  const at = axes.map(() => 0);
  let rest = point;
  for (let a = axes.length - 1; a >= 0; --a) {
    const n = Math.max(1, axes[a].values.length);
    at[a] = rest % n;
    rest = Math.floor(rest / n);
  }
  return at;
}

function textOf(value: unknown): string {
  return typeof value === "string" ? value : "";
}

function numberOf(value: unknown): number {
  return typeof value === "number" ? value : NaN;
}
