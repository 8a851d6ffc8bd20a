// Before and after, row by row: variables, objective, limits, columns, with their changes.
import type { OptimizationData, Partly } from "../data";
import { download, element } from "../dom";
import { columnHead, label, number } from "../format";
import type { Change } from "../optimization_types";
import { rowsToText } from "./csv";
import { breakable } from "./describe";
import { fileName } from "./export";
import { plainName } from "./field";
import { button, toggle } from "./ui";

interface Row {
  name: string;
  unit: string;
  before: number | null;
  after: number | null;
  remark?: string;
}

export function beforeAfterCard(comparison: OptimizationData["comparison"], study: string): HTMLElement {
  const read = (list: Partly<Change>[] | undefined): Row[] => (Array.isArray(list) ? list : []).map(row);
  const variables = (Array.isArray(comparison?.variables) ? comparison.variables : []).map(
    (v): Row => ({ name: String(v?.name), unit: String(v?.unit ?? ""), before: null, after: v?.best ?? null, remark: `from ${number(v?.from)} to ${number(v?.to)}` }),
  );
  const columns = read(comparison?.columns);
  const body = element("div", { class: "st-scroll" });
  const parts: [string, Row[]][] = [
    ["Objective", comparison?.objective ? [row(comparison.objective)] : []],
    ["Limits", read(comparison?.limits)],
    ["Variables", variables],
  ];
  const fill = (all: boolean): void => {
    const shown = all ? columns : columns.filter(isInformative);
    const made = [...parts, ["Columns", shown] as [string, Row[]]].filter(([, rows]) => rows.length > 0);
    const head = element("tr", {}, ...["what", "before", "after", "change"].map((text) => element("th", { scope: "col" }, text)));
    body.replaceChildren(element("table", { class: "st-grid st-change" }, element("thead", {}, head), ...made.map(([name, rows]) => section(name, rows))));
  };
  fill(false);
  const csv = (): string => rowsToText([["quantity", "before", "after"], ...[...parts.flatMap(([, rows]) => rows), ...columns].map((r) => [columnHead(r.name, r.unit), r.before ?? NaN, r.after ?? NaN])]);
  return element(
    "section",
    { class: "card st-card", id: "study-change", "aria-label": "Before and after" },
    element(
      "div",
      { class: "st-card-head" },
      element("h2", { class: "st-card-title" }, "Before and after"),
      element("div", { class: "st-downloads" }, button("CSV", () => download(`${fileName(study, "before-after")}.csv`, csv(), "text/csv"), { title: "Download before and after" })),
    ),
    element("div", { class: "st-controls" }, toggle("all columns", false, fill)),
    body,
  );
}

function row(one: Partly<Change>): Row {
  return { name: String(one?.name ?? "?"), unit: String(one?.unit ?? ""), before: one?.before ?? null, after: one?.after ?? null };
}

// Components and values without changes (within rounding) are displayed on demand.
function isInformative(r: Row): boolean {
  if (/\/[xyz]$/.test(r.name) || /^(joints|margins)\//.test(r.name)) return false;
  if (r.before === null || r.after === null) return r.before !== r.after;
  return Math.abs(r.after - r.before) > 1e-6 * Math.max(Math.abs(r.before), Math.abs(r.after));
}

function section(name: string, rows: Row[]): HTMLElement {
  const made = rows.map((r) =>
    element(
      "tr",
      {},
      element("th", { scope: "row" }, breakable(label(plainName(r.name), r.unit))),
      element("td", {}, r.remark ? element("span", { class: "st-muted" }, r.remark) : number(r.before)),
      element("td", {}, number(r.after)),
      element("td", {}, r.remark ? "" : change(r)),
    ),
  );
  return element("tbody", {}, element("tr", { class: "st-section" }, element("th", { scope: "rowgroup", colspan: "4" }, name)), ...made);
}

// In per cent if meaningful, else the difference.
export function change(r: { before: number | null; after: number | null }): string {
  if (r.before === null || r.after === null) return "–";
  const difference = r.after - r.before;
  if (difference === 0) return "=";
  const sign = difference > 0 ? "+" : "−";
  const part = Math.abs(difference / r.before);
  const sameSign = r.before * r.after > 0;
  return sameSign && part < 10 ? `${sign}${number(100 * part, 3)} %` : `${sign}${number(Math.abs(difference), 3)}`;
}
