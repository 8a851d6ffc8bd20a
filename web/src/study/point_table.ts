// All points as a table: a click on a head sorts; filtered; only visible rows are created. Arrow keys move, Enter
// selects.
import { download, element } from "../dom";
import { badgeOf } from "./badge";
import { informativeColumns } from "./choice";
import { pointsToText } from "./csv";
import { breakable, counted, fieldLabel, plural, rowNumber, shown } from "./describe";
import { fileName } from "./export";
import type { Field } from "./field";
import { type Order, orderedPoints } from "./filter";
import type { StudyState } from "./state";
import { button, copyButton, toggle } from "./ui";

const kRow = 30; // [px], as in study.css
const kTallest = 8_000_000; // [px] that browsers lay out without loss; longer tables scroll in larger steps
const kHeight = 480;

type Column = Field | "point" | "status";

function isText(column: Column): boolean {
  return column === "point" || column === "status" || column.labels !== null;
}

export class PointTable {
  readonly root: HTMLElement;
  private readonly scroller = element("div", { class: "st-table-scroll" });
  private readonly head = element("div", { class: "st-tr st-thead", role: "row" });
  private readonly space = element("div", { class: "st-table-space", role: "rowgroup" });
  private readonly count = element("span", { class: "st-count", role: "status" });
  private order: Order = { field: "point", descending: false };
  private points: Int32Array = new Int32Array();
  private columns: Column[] = [];
  private all = false;
  private cursor = 0; // row with the focus
  private focusNext = false;

  constructor(
    private readonly state: StudyState,
    private readonly study: string,
    private readonly extra: { name: string; text: (point: number) => string } | null = null, // a column of texts
  ) {
    this.scroller.append(this.head, this.space);
    for (const [name, value] of Object.entries({ role: "grid", "aria-label": this.title, tabindex: "-1" })) this.scroller.setAttribute(name, value);
    this.root = element(
      "section",
      { class: "card st-card", id: "study-table", "aria-label": `Table of ${state.table.noun}s` },
      element("div", { class: "st-card-head" }, element("h2", { class: "st-card-title" }, this.title), this.downloads()),
      element("div", { class: "st-controls" }, this.count, toggle("all columns", false, (on) => ((this.all = on), this.rebuild()))),
      this.scroller,
      element("p", { class: "st-note" }, "A click on a row, or Enter, shows its case. What is filtered above is filtered here."),
    );
    this.scroller.addEventListener("scroll", () => requestAnimationFrame(() => this.drawRows()));
    this.scroller.addEventListener("keydown", (event) => this.key(event));
    window.addEventListener("beforeprint", () => this.drawRows());
    state.listenFilter(() => this.reorder());
    state.listenSelect(() => this.drawRows());
    this.rebuild();
  }

  private downloads(): HTMLElement {
    const text = (separator: string): string => pointsToText(this.state.table, this.points, this.state.table.fields, separator);
    return element(
      "div",
      { class: "st-downloads" },
      copyButton(() => text("\t"), `Copy these ${this.state.table.noun}s with all columns`),
      button("CSV", () => download(`${fileName(this.study, `${this.state.table.noun}s`)}.csv`, text(","), "text/csv"), { title: `Download these ${this.state.table.noun}s with all columns` }),
    );
  }

  private rebuild(): void {
    const { table } = this.state;
    const chosen = this.all ? table.fields.filter((f) => f.role !== "axis") : informativeColumns(table, 8);
    this.columns = ["point", ...table.axes, "status", ...chosen];
    this.buildHead();
    this.reorder();
  }

  private get title(): string {
    return this.state.table.noun === "point" ? "Points" : `${this.state.table.noun[0].toUpperCase()}${this.state.table.noun.slice(1)}s`;
  }

  private width(column: Column): number {
    if (column === "point") return 72;
    if (column === "status") return 108;
    const labels = column.labels?.reduce((most, l) => Math.max(most, l.length), 0) ?? 0;
    return Math.min(240, Math.max(112, 7.5 * labels + 20, Math.min(170, 3.2 * fieldLabel(column).length)));
  }

  private buildHead(): void {
    const cells = this.columns.map((column) => {
      const name = column === "point" ? this.state.table.noun : typeof column === "string" ? column : fieldLabel(column);
      const title = typeof column === "string" ? name : `${column.name}: ${column.description}`;
      const press = button(breakable(name), () => this.sortBy(column), { class: "st-sort", title });
      return this.sized(element("div", { class: isText(column) ? "st-th st-text" : "st-th", role: "columnheader" }, press), this.width(column));
    });
    if (this.extra) cells.splice(1, 0, this.sized(element("div", { class: "st-th st-text", role: "columnheader" }, element("span", { class: "st-sort" }, this.extra.name)), 96));
    this.head.replaceChildren(...cells);
    const total = this.columns.reduce((sum, c) => sum + this.width(c), this.extra ? 96 : 0);
    for (const part of [this.head, this.space]) part.style.minWidth = `${total}px`;
  }

  private sized<T extends HTMLElement>(cell: T, width: number): T {
    cell.style.flex = `1 0 ${width}px`;
    cell.style.width = `${width}px`;
    return cell;
  }

  private sortBy(column: Column): void {
    const same = this.order.field === column;
    this.order = { field: column, descending: same ? !this.order.descending : false };
    this.cursor = 0;
    this.scroller.scrollTop = 0;
    this.reorder();
  }

  private reorder(): void {
    this.points = orderedPoints(this.state.table, this.state.passing, this.order);
    const heads = [...this.head.children].filter((c) => c.querySelector("button"));
    this.columns.forEach((column, k) => {
      const sort = this.order.field === column ? (this.order.descending ? "descending" : "ascending") : "none";
      heads[k]?.setAttribute("aria-sort", sort);
    });
    const { size, noun } = this.state.table;
    this.count.textContent = this.points.length === size ? plural(size, noun) : `${counted(this.points.length)} of ${plural(size, noun)}`;
    this.scroller.setAttribute("aria-rowcount", String(this.points.length + 1));
    this.space.style.height = `${Math.min(kTallest, this.points.length * kRow)}px`;
    this.scroller.style.height = `${Math.min(kHeight, this.points.length * kRow + 62)}px`;
    this.cursor = Math.min(this.cursor, Math.max(0, this.points.length - 1));
    this.drawRows();
  }

  // Row at the top of the view; tables taller than browsers allow are scrolled in proportion.
  private firstRow(): number {
    const tall = this.points.length * kRow;
    const reach = Math.max(1, Math.min(kTallest, tall) - kHeight);
    const part = tall > kTallest ? (this.scroller.scrollTop / reach) * (tall - kHeight) : this.scroller.scrollTop;
    return Math.max(0, Math.floor(part / kRow) - 4);
  }

  private drawRows(): void {
    const first = this.firstRow();
    const last = Math.min(this.points.length, first + Math.ceil(kHeight / kRow) + 8);
    const tall = this.points.length * kRow;
    const top = tall > kTallest ? this.scroller.scrollTop - 4 * kRow : first * kRow;
    const hadFocus = this.focusNext || this.space.contains(document.activeElement);
    const rows: HTMLElement[] = [];
    for (let row = first; row < last; ++row) {
      const made = this.row(row);
      made.style.top = `${Math.max(0, top) + (row - first) * kRow}px`;
      rows.push(made);
    }
    this.space.replaceChildren(...rows);
    if (hadFocus) this.space.querySelector<HTMLElement>('[tabindex="0"]')?.focus({ preventScroll: true });
    this.focusNext = false;
  }

  private row(row: number): HTMLElement {
    const { table, selected } = this.state;
    const k = this.points[row];
    const cells = this.columns.map((column) => {
      const text = column === "point" ? String(rowNumber(table, k)) : column === "status" ? table.status[k] : shown(column, column.values[k]);
      const kind = isText(column) ? "st-td st-text" : "st-td";
      const cell = this.sized(element("div", { class: kind, role: "gridcell" }, text), this.width(column));
      if (column === "status") {
        const badge = badgeOf(table, k);
        cell.classList.add(`st-status-${badge.kind}`);
        cell.title = table.reason[k] || badge.text;
      }
      return cell;
    });
    if (this.extra) cells.splice(1, 0, this.sized(element("div", { class: "st-td st-text", role: "gridcell" }, this.extra.text(k)), 96));
    const chosen = k === selected;
    const attributes = { role: "row", class: `st-tr${chosen ? " st-chosen" : ""}`, tabindex: row === this.cursor ? "0" : "-1", "aria-rowindex": String(row + 2), "aria-selected": String(chosen) };
    const made = element("div", attributes, ...cells);
    made.addEventListener("click", () => {
      this.cursor = row;
      this.state.select(k);
    });
    return made;
  }

  private key(event: KeyboardEvent): void {
    if (!this.space.contains(event.target as Node)) return;
    const page = Math.floor(kHeight / kRow) - 2;
    const steps: Record<string, number> = { ArrowDown: 1, ArrowUp: -1, PageDown: page, PageUp: -page, Home: -Infinity, End: Infinity };
    if (event.key === "Enter" || event.key === " ") this.state.select(this.points[this.cursor] ?? null);
    else if (event.key in steps) {
      this.cursor = Math.min(this.points.length - 1, Math.max(0, this.cursor + steps[event.key]));
      this.focusNext = true;
      this.reveal(this.cursor);
      this.drawRows();
    } else return;
    event.preventDefault();
  }

  private reveal(row: number): void {
    const tall = this.points.length * kRow;
    const scale = tall > kTallest ? (kTallest - kHeight) / (tall - kHeight) : 1;
    const at = row * kRow * scale;
    const view = kHeight - 62 - kRow;
    if (at < this.scroller.scrollTop) this.scroller.scrollTop = at;
    else if (at > this.scroller.scrollTop + view) this.scroller.scrollTop = at - view;
  }
}
