// Tables that scroll in their box on small screens, and other parts of sections.
import { element } from "../dom";
import { number, quiet, unitText } from "../format";
import { size, vector, withUnit } from "./read";

export type Cell = string | Node | null | undefined;

export interface Column {
  head: string;
  unit?: string;
  numeric?: boolean; // aligned right
  title?: string;
}

export function table(caption: string, columns: Column[], rows: Cell[][]): HTMLElement {
  const head = element("tr", {}, ...columns.map((column) => headCell(column)));
  const body = rows.map((row) => tableRow(columns, row));
  return tableBox(
    caption,
    element("table", {}, element("caption", {}, caption), element("thead", {}, head), element("tbody", {}, ...body)),
  );
}

// The heads sort the rows by their keys: texts by alphabet, numbers the largest first. A text in a column of numbers is
// the last. `first`: the column by which the rows are sorted at the start.
export function sortableTable(caption: string, columns: Column[], rows: Cell[][], keys: (string | number)[][], first: number): HTMLElement {
  const body = element("tbody");
  const heads = columns.map((column, i) => {
    const cell = headCell(column);
    const button = element("button", { type: "button", class: "sort" });
    button.append(...cell.childNodes);
    button.addEventListener("click", () => sort(i));
    cell.append(button);
    return cell;
  });
  const sort = (by: number): void => {
    const size = (row: number): number => (typeof keys[row][by] === "number" ? keys[row][by] : -1);
    const order = rows.map((_, i) => i).sort((a, b) => (columns[by].numeric ? size(b) - size(a) : String(keys[a][by]).localeCompare(String(keys[b][by]))));
    body.replaceChildren(...order.map((i) => tableRow(columns, rows[i])));
    heads.forEach((head, i) =>
      i === by
        ? head.setAttribute("aria-sort", columns[i].numeric ? "descending" : "ascending")
        : head.removeAttribute("aria-sort"),
    );
  };
  sort(first);
  return tableBox(caption, element("table", {}, element("caption", {}, caption), element("thead", {}, element("tr", {}, ...heads)), body));
}

// Only scrollable boxes get keyboard focus.
const scrolling = new ResizeObserver((entries) => {
  for (const { target } of entries) {
    if (target.scrollWidth > target.clientWidth) target.setAttribute("tabindex", "0");
    else target.removeAttribute("tabindex");
  }
});

export function tableBox(name: string, content: HTMLTableElement): HTMLElement {
  const box = element("div", { class: "table-box", role: "group", "aria-label": name }, content);
  scrolling.observe(box);
  return box;
}

export function headCell(column: Column): HTMLTableCellElement {
  const cell = column.head === "" ? element("td") : element("th", { scope: "col", ...(column.numeric ? { class: "numeric" } : {}) }, column.head);
  if (column.unit) cell.append(element("span", { class: "unit" }, ` [${unitText(column.unit)}]`));
  if (column.title) cell.title = column.title;
  return cell;
}

export function tableRow(columns: Column[], row: Cell[]): HTMLTableRowElement {
  return element(
    "tr",
    {},
    ...row.map((cell, i) => {
      const attributes: Record<string, string> = columns[i]?.numeric ? { class: "numeric" } : {};
      return i === 0
        ? element("th", { scope: "row", ...attributes }, cell || "–")
        : element("td", attributes, cell || "–");
    }),
  );
}

// "(0.04086, −0.1118, 0)"; components at the level of rounding error are 0; all digits on hover.
export function vectorCell(value: unknown): Cell {
  const v = vector(value);
  if (!v) return null;
  const largest = Math.max(...v.map(Math.abs));
  const shown = v.map((c) => number(quiet(c, largest)));
  return element("span", { class: "vector", title: v.map(String).join(", ") }, `(${shown.join(", ")})`);
}

export function fold(title: string, ...content: Cell[]): HTMLElement {
  return element("details", {}, element("summary", {}, title), ...content.map((one) => one ?? null));
}

// A verdict by sign and word in addition to colour.
export function mark(kind: "good" | "bad" | "warn" | "none", word: string): HTMLElement {
  const sign = { good: "✓", bad: "✗", warn: "!", none: "–" }[kind];
  return element(
    "span",
    { class: `mark ${kind}` },
    element("span", { class: "sign", "aria-hidden": "true" }, sign),
    word,
  );
}

export function absent(sentence: string): HTMLElement {
  return element("p", { class: "empty" }, sentence);
}

// Names and values in two columns.
export function pairs(entries: [string, Cell][]): HTMLElement {
  const shown = entries.filter(([, value]) => value !== null && value !== undefined && value !== "");
  return element(
    "dl",
    { class: "pairs" },
    ...shown.flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, value || "–")]),
  );
}

// "0.0002 rad/s (0, 0, −0.0002)"
export function changeText(value: unknown, unit: string): Cell {
  const length = size(value);
  return length === null ? null : element("span", {}, `${withUnit(length, unit)} `, vectorCell(value));
}
