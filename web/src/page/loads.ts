// Largest loads of all phases, with ratings if given.
import { element } from "../dom";
import { number } from "../format";
import type { PeakLoad } from "../summary_types";
import { isSaturated, ratingUnit } from "./facts";
import { bar } from "./margins";
import { list, num, text, words, type Partly, type PartlySummary } from "./read";
import { absent, fold, mark, table, type Cell, type Column } from "./table";

const kShown = 8;

export function loadsSection(s: PartlySummary): HTMLElement[] {
  const all = list(s.loads);
  if (all.length === 0) return [absent("The summary has no loads.")];
  const rated = all.filter((one) => num(one.margin) !== null).sort((a, b) => (num(a.margin) ?? 0) - (num(b.margin) ?? 0));
  const result: HTMLElement[] = [];
  if (rated.length === 0) result.push(element("p", {}, "The robot file gives no ratings: loads have no margins."));
  else result.push(table("Least margins", kRated, rated.slice(0, kShown).map(ratedCells)));
  if (rated.length > kShown)
    result.push(
      fold(`${rated.length - kShown} more with larger margins`, table("All other rated loads", kRated, rated.slice(kShown).map(ratedCells))),
    );
  if (rated.some((one) => one.assumed_duration))
    result.push(
      element("p", { class: "small" }, "* a mean over impact.duration, which is an assumption: the impact itself takes no time."),
    );
  const phases = [...new Set(all.map((one) => text(one.phase)))];
  for (const phase of phases) {
    const rows = all.filter((one) => text(one.phase) === phase).map(cells);
    result.push(fold(`All ${rows.length} loads in ${words(phase)}`, table(`Largest loads, ${words(phase)}`, kColumns, rows)));
  }
  return result;
}

const kColumns: Column[] = [
  { head: "Of" },
  { head: "Quantity" },
  { head: "Largest", numeric: true },
  { head: "Unit" },
  { head: "at", unit: "s", numeric: true },
];
const kRated: Column[] = [
  { head: "Of" },
  { head: "Quantity" },
  { head: "Phase" },
  { head: "at", unit: "s", numeric: true },
  { head: "Largest", numeric: true },
  { head: "Rating", numeric: true },
  { head: "Unit" },
  { head: "Used" },
  { head: "Margin", unit: "%", numeric: true },
];

function cells(one: Partly<PeakLoad>): Cell[] {
  return [text(one.of), words(one.quantity), assumed(one), ratingUnit(one.quantity), number(num(one.time))];
}

function ratedCells(one: Partly<PeakLoad>): Cell[] {
  const margin = num(one.margin) ?? 0; // only loads with a rating
  const percent = number(100 * margin, 3);
  return [
    text(one.of),
    words(one.quantity),
    words(one.phase),
    number(num(one.time)),
    assumed(one),
    number(num(one.rating)),
    ratingUnit(one.quantity),
    bar(1 - margin),
    isSaturated(one.quantity, margin) ? mark("warn", "saturated") : margin < 0 ? mark("bad", `${percent}, exceeded`) : percent,
  ];
}

function assumed(one: Partly<PeakLoad>): string {
  return number(num(one.peak)) + (one.assumed_duration ? " *" : "");
}
