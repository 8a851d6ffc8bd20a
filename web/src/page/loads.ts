// Largest loads of all phases, with ratings if given.
import { element } from "../dom";
import { number } from "../format";
import { kPeakLoad, type PeakLoad } from "../summary_types";
import { describedTable, without } from "./described";
import { ratingUnit } from "./facts";
import { kUsed, marginCells } from "./margins";
import { list, num, text, words, type Partly, type PartlySummary } from "./read";
import { absent, fold } from "./table";

const kLoads = without(kPeakLoad, "assumed_duration"); // a mark on the peak

export function loadsSection(s: PartlySummary): HTMLElement[] {
  const all = list(s.loads).map((one) => ({ ...one, unit: ratingUnit(one.quantity) }));
  if (all.length === 0) return [absent("The summary has no loads.")];
  const rated = all.filter((one) => num(one.margin) !== null).sort((a, b) => (num(a.margin) ?? 0) - (num(b.margin) ?? 0));
  const result =
    rated.length === 0
      ? [element("p", {}, "The robot file gives no ratings: loads have no margins.")]
      : describedTable("Least margins", [...kLoads, ...kUsed], rated, { cells: { ...marginCells, peak }, few: 8 });
  if (rated.some((one) => one.assumed_duration))
    result.push(
      element("p", { class: "small" }, "* a mean over impact.duration, which is an assumption: the impact itself takes no time."),
    );
  for (const phase of new Set(all.map((one) => text(one.phase)))) {
    const rows = all.filter((one) => text(one.phase) === phase);
    const notes = [...without(kLoads, "phase", "rating", "margin"), ...kUsed.slice(0, 1)];
    result.push(fold(`All ${rows.length} loads in ${words(phase)}`, ...describedTable(`Largest loads, ${words(phase)}`, notes, rows, { cells: { peak } })));
  }
  return result;
}

function peak(one: Partly<PeakLoad>): string {
  return number(num(one.peak)) + (one.assumed_duration ? " *" : "");
}
