// Loads relative to ratings, worst first, as bars.
import { element } from "../dom";
import { number } from "../format";
import { kImpactMargin, kSpeedLimit, type FieldNote, type ImpactReport } from "../summary_types";
import { describedTable } from "./described";
import { isSaturated, ratingUnit } from "./facts";
import { list, num, type Partly } from "./read";
import { absent, mark, type Cell } from "./table";

// Columns behind those of a load.
export const kUsed: FieldNote[] = [
  ["unit", "", "of load and rating"],
  ["used", "", "share of the rating"],
];

interface Margin {
  quantity?: string;
  margin?: number | null;
}
export const marginCells = {
  margin: (one: Margin): Cell => {
    const margin = num(one.margin) ?? 0; // only loads with a rating
    const percent = `${number(100 * margin, 3)}\u00a0%`;
    return isSaturated(one.quantity, margin) ? mark("warn", "saturated") : margin < 0 ? mark("bad", `${percent}, exceeded`) : percent;
  },
  used: (one: Margin): Cell => bar(1 - (num(one.margin) ?? 0)),
};

export function marginsPart(impact: Partly<ImpactReport>): HTMLElement[] {
  const margins = list(impact.margins)
    .filter((one) => num(one.margin) !== null)
    .sort((a, b) => (num(a.margin) ?? 0) - (num(b.margin) ?? 0))
    .map((one) => ({ ...one, unit: ratingUnit(one.quantity) }));
  return [
    element("h3", {}, "Margins to ratings"),
    ...(margins.length === 0
      ? [absent("The robot file gives no ratings, so there are no margins.")]
      : describedTable("Largest loads against their ratings", [...kImpactMargin, ...kUsed], margins, { cells: marginCells, few: 6 })),
    ...describedTable("Speed limits by ratings", kSpeedLimit, list(impact.speed_limits)),
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
