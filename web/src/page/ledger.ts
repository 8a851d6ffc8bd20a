// The ledger: every check with its largest value and its bound.
import { element } from "../dom";
import { number, unitText } from "../format";
import { kLedgerEntry, kLedgerScale, type FieldNote } from "../summary_types";
import { describedPairs, describedTable, those } from "./described";
import { ledgerRows, type LedgerRow } from "./facts";
import { kComparison, type Names } from "./names";
import { num, text, words, type PartlySummary } from "./read";
import { absent, fold, mark, table, type Cell, type Column } from "./table";

const kColumns: FieldNote[] = [["key", "", "its key in the summary"], ...those(kLedgerEntry, "value", "bound", "unit", "pass", "note")];
const kShown = {
  heads: { key: "Quantity", value: "Largest value", pass: "Result", note: "Compared quantities" },
  cells: {
    key: ({ key }: LedgerRow): Cell => name(key),
    value: (row: LedgerRow): Cell => (row.applies === false ? "–" : num(row.value) === null ? "not a number" : number(num(row.value), 3)),
    bound: (row: LedgerRow): Cell => number(num(row.bound), 3),
    unit: ledgerUnit,
    pass: outcome,
    note: (row: LedgerRow): Cell =>
      element("span", { class: "note" }, notChecked(row) ? `Not checked: ${notChecked(row)}. ${text(row.note, "")}` : text(row.note, "")),
  },
};

export function ledgerSection(s: PartlySummary): HTMLElement[] {
  const rows = ledgerRows(s);
  if (rows.length === 0) return [absent("This result has no ledger: its conservation was not checked.")];
  const evaluated = rows.filter((row) => row.applies !== false || notChecked(row) !== "");
  const idle = rows.filter((row) => !evaluated.includes(row));
  const result = [
    element(
      "p",
      { class: "lead" },
      "Momentum and energy are recomputed body by body from the recorded motion and compared with the conservation laws. A failure means that the result is not valid.",
    ),
    ...describedTable("Conservation", kColumns, evaluated.filter((row) => row.kind !== "feasibility"), kShown),
    ...describedTable("Feasibility", kColumns, evaluated.filter((row) => row.kind === "feasibility"), kShown),
  ];
  if (idle.length > 0) {
    const listed = describedTable("Nothing to check in this run", those(kColumns, "key", "note"), idle, {
      heads: { ...kShown.heads, note: "Why" },
      cells: { key: kShown.cells.key },
    });
    result.push(fold(`${idle.length} ${idle.length === 1 ? "check" : "checks"} with nothing to check in this run`, ...listed));
  }
  const scale = s.ledger?.scale;
  if (scale)
    result.push(element("div", { class: "scales" }, element("p", {}, "Relative values refer to these scales, which cannot vanish:"), ...describedPairs(kLedgerScale, scale)));
  return result;
}

// Reason for which the check was not evaluated; "": it was.
function notChecked(row: LedgerRow): string {
  return row.pass === null ? text(row.not_checked, "") : "";
}

function ledgerUnit(row: LedgerRow): string {
  return row.unit === "1" ? "relative" : unitText(text(row.unit, ""));
}

function outcome(row: LedgerRow): HTMLElement {
  if (notChecked(row)) return mark("warn", "not checked");
  return row.pass === true ? mark("good", "pass") : mark("bad", "fail");
}

// Readable name, and key of the summary.
export function name(key: string): HTMLElement {
  const readable = words(key);
  return element(
    "span",
    { class: "quantity" },
    readable.charAt(0).toUpperCase() + readable.slice(1),
    element("code", {}, key),
  );
}

// Two ledgers side by side.
export function ledgerOfBoth(a: PartlySummary, b: PartlySummary, [nameA, nameB]: Names = kComparison): HTMLElement[] {
  const [rowsA, rowsB] = [ledgerRows(a), ledgerRows(b)];
  const keys = [...new Set([...rowsA, ...rowsB].map((row) => row.key))];
  if (keys.length === 0) return [absent("Neither result has a ledger.")];
  const columns: Column[] = [
    { head: "Quantity" },
    { head: nameA, numeric: true },
    { head: `Result of ${nameA}` },
    { head: nameB, numeric: true },
    { head: `Result of ${nameB}` },
    { head: "Bound", numeric: true },
    { head: "Unit" },
  ];
  const result = (row: LedgerRow | undefined) =>
    !row ? "absent" : row.applies === false && !notChecked(row) ? mark("none", "nothing to check") : outcome(row);
  const value = (row: LedgerRow | undefined) => number(row && row.applies !== false ? num(row.value) : null, 3);
  const rows = keys.map((key) => {
    const [x, y] = [rowsA.find((row) => row.key === key), rowsB.find((row) => row.key === key)];
    const bounds = [x, y].filter((row) => row !== undefined).map((row) => number(num(row.bound), 3));
    return [name(key), value(x), result(x), value(y), result(y), [...new Set(bounds)].join(" / "), ledgerUnit((x ?? y)!)];
  });
  return [table(`Ledgers of ${nameA} and ${nameB}`, columns, rows)];
}
