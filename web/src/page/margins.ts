// Loads relative to ratings, worst first, as bars.
import { element } from "../dom";
import { number } from "../format";
import type { ImpactMargin, ImpactReport } from "../summary_types";
import { ratingUnit } from "./facts";
import { list, num, text, words, type Partly } from "./read";
import { absent, fold, mark, table, type Cell, type Column } from "./table";

const kShown = 6;

export function marginsPart(impact: Partly<ImpactReport>): HTMLElement[] {
  const margins = list(impact.margins).filter((one) => num(one.margin) !== null);
  const result: HTMLElement[] = [element("h3", {}, "Margins to ratings")];
  if (margins.length === 0)
    return [...result, absent("The robot file gives no ratings, so there are no margins."), ...speedLimits(impact)];
  const sorted = [...margins].sort((a, b) => (num(a.margin) ?? 0) - (num(b.margin) ?? 0));
  result.push(table("Largest loads against their ratings", kColumns, sorted.slice(0, kShown).map(cells)));
  if (sorted.length > kShown)
    result.push(
      fold(
        `${sorted.length - kShown} more with larger margins`,
        table("All other loads", kColumns, sorted.slice(kShown).map(cells)),
      ),
    );
  return [...result, ...speedLimits(impact)];
}

const kColumns: Column[] = [
  { head: "Of" },
  { head: "Quantity" },
  { head: "Load", numeric: true },
  { head: "Rating", numeric: true },
  { head: "Unit" },
  { head: "Used" },
  { head: "Margin", unit: "%", numeric: true },
];

function cells(one: Partly<ImpactMargin>): Cell[] {
  const margin = num(one.margin) ?? 0; // only loads with a rating
  return [
    text(one.of),
    words(one.quantity),
    number(num(one.load)),
    number(num(one.rating)),
    ratingUnit(one.quantity),
    bar(1 - margin),
    margin < 0 ? mark("bad", `${number(100 * margin, 3)}, exceeded`) : number(100 * margin, 3),
  ];
}

// The bar is full at the rating and striped beyond it.
export function bar(used: number): HTMLElement {
  const width = Math.min(100, Math.max(0, 100 * used));
  const fill = element("span", { style: `width:${width.toFixed(1)}%` });
  const kind = used > 1 ? "bad" : used > 0.9 ? "warn" : "";
  return element(
    "span",
    { class: `bar ${kind}`, role: "img", "aria-label": `${number(100 * used, 3)} % of the rating` },
    fill,
  );
}

function speedLimits(impact: Partly<ImpactReport>): HTMLElement[] {
  const rows = list(impact.speed_limits).map((one): Cell[] => [
    text(one.end_effector),
    one.factor === null ? "no load" : number(num(one.factor)),
    number(num(one.largest_speed)),
    one.of ? `${text(one.of)}: ${words(one.quantity)}` : null,
  ]);
  if (rows.length === 0) return [];
  const columns: Column[] = [
    { head: "End-effector" },
    { head: "Admissible factor of relative motion", numeric: true },
    { head: "Speed then", unit: "m/s", numeric: true },
    { head: "Rating reached first" },
  ];
  return [table("Speed limits by ratings", columns, rows)];
}
