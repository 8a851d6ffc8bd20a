// The ledger: every check with its largest value and its bound.
import { element } from "../dom";
import { number, unitText } from "../format";
import { ledgerRows, type LedgerRow } from "./facts";
import { num, withUnit, words, type PartlySummary } from "./read";
import { absent, fold, mark, pairs, table, type Cell, type Column } from "./table";

const kColumns: Column[] = [
  { head: "Quantity" },
  { head: "Largest value", numeric: true },
  { head: "Bound", numeric: true },
  { head: "Unit" },
  { head: "Result" },
  { head: "Compared quantities" },
];

export function ledgerSection(s: PartlySummary): HTMLElement[] {
  const rows = ledgerRows(s);
  if (rows.length === 0) return [absent("This result has no ledger: its conservation was not checked.")];
  const part = (kind: string, applies: boolean) =>
    rows.filter((row) => (row.kind === "feasibility") === (kind === "feasibility") && (row.applies || row.notChecked !== "") === applies);
  const idle = rows.filter((row) => !row.applies && row.notChecked === "");
  const result = [
    element(
      "p",
      { class: "lead" },
      "Momentum and energy are recomputed body by body from the recorded motion and compared with the conservation laws. A failure means that the result is not valid.",
    ),
    table("Conservation", kColumns, part("conservation", true).map(cells)),
  ];
  if (part("feasibility", true).length > 0)
    result.push(table("Feasibility", kColumns, part("feasibility", true).map(cells)));
  if (idle.length > 0) {
    const listed = table(
      "Nothing to check in this run",
      [{ head: "Quantity" }, { head: "Why" }],
      idle.map((row) => [name(row.key), row.note]),
    );
    result.push(fold(`${idle.length} ${idle.length === 1 ? "check" : "checks"} with nothing to check in this run`, listed));
  }
  const scales = scalesOf(s);
  if (scales) result.push(scales);
  return result;
}

function cells(row: LedgerRow): Cell[] {
  return [
    name(row.key),
    !row.applies ? "–" : row.value === null ? "not a number" : number(row.value, 3),
    number(row.bound, 3),
    row.unit === "1" ? "relative" : unitText(row.unit),
    outcome(row),
    element("span", { class: "note" }, row.notChecked ? `Not checked: ${row.notChecked}. ${row.note}` : row.note),
  ];
}

function outcome(row: LedgerRow): HTMLElement {
  if (row.notChecked) return mark("warn", "not checked");
  return row.pass ? mark("good", "pass") : mark("bad", "fail");
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

function scalesOf(s: PartlySummary): HTMLElement | null {
  const scale = s.ledger?.scale;
  if (!scale) return null;
  return element(
    "div",
    { class: "scales" },
    element("p", {}, "Relative values refer to these scales, which cannot vanish:"),
    pairs([
      ["linear momentum", withUnit(num(scale.linear_momentum), "N s")],
      ["angular momentum", withUnit(num(scale.angular_momentum), "N m s")],
      ["energy", withUnit(num(scale.energy), "J")],
    ]),
  );
}

// Two ledgers side by side.
export function ledgerOfBoth(a: PartlySummary, b: PartlySummary): HTMLElement[] {
  const [rowsA, rowsB] = [ledgerRows(a), ledgerRows(b)];
  const keys = [...new Set([...rowsA, ...rowsB].map((row) => row.key))];
  if (keys.length === 0) return [absent("Neither result has a ledger.")];
  const columns: Column[] = [
    { head: "Quantity" },
    { head: "A", numeric: true },
    { head: "Result of A" },
    { head: "B", numeric: true },
    { head: "Result of B" },
    { head: "Bound", numeric: true },
    { head: "Unit" },
  ];
  const result = (row: LedgerRow | undefined) =>
    !row
      ? "absent"
      : !row.applies && !row.notChecked
        ? mark("none", "nothing to check")
        : outcome(row);
  const rows = keys.map((key) => {
    const [x, y] = [rowsA.find((row) => row.key === key), rowsB.find((row) => row.key === key)];
    const unit = (x ?? y)!.unit;
    const bounds = [x, y].filter((row) => row !== undefined).map((row) => number(row.bound, 3));
    return [
      name(key),
      number(x?.applies ? x.value : null, 3),
      result(x),
      number(y?.applies ? y.value : null, 3),
      result(y),
      [...new Set(bounds)].join(" / "),
      unit === "1" ? "relative" : unitText(unit),
    ];
  });
  return [table("Ledgers of A and B", columns, rows)];
}
