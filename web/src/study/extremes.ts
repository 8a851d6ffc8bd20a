// Minimum and maximum of every column, with their points.
import { download, element } from "../dom";
import { informativeColumns } from "./choice";
import { rowsToText } from "./csv";
import { breakable, fieldLabel } from "./describe";
import { fileName } from "./export";
import type { Field } from "./field";
import { number } from "../format";
import { span } from "./shape";
import type { StudyState } from "./state";
import { button, toggle } from "./ui";

export function extremesCard(state: StudyState, study: string): HTMLElement {
  const columns = state.table.fields.filter((f) => f.role !== "axis");
  const body = element("tbody");
  const fill = (all: boolean): void => body.replaceChildren(...(all ? columns : informativeColumns(state.table, 10)).map((f) => row(state, f)));
  fill(false);
  const csv = (): string =>
    rowsToText([
      ["column", "least", "at point", "greatest", "at point"],
      ...columns.map((f) => {
        const s = span(f.values);
        return s.numbers > 0 ? [fieldLabel(f), s.least, s.leastAt, s.greatest, s.greatestAt] : [fieldLabel(f), NaN, "", NaN, ""];
      }),
    ]);
  const head = element("tr", {}, ...["column", "least", "at", "greatest", "at"].map((text) => element("th", { scope: "col" }, text)));
  return element(
    "section",
    { class: "card st-card", id: "study-extremes", "aria-label": "Extremes" },
    element(
      "div",
      { class: "st-card-head" },
      element("h2", { class: "st-card-title" }, "Extremes"),
      element("div", { class: "st-downloads" }, button("CSV", () => download(`${fileName(study, "extremes")}.csv`, csv(), "text/csv"), { title: "Download the extremes of all columns" })),
    ),
    element("div", { class: "st-controls" }, toggle("all columns", false, fill)),
    element("div", { class: "st-scroll" }, element("table", { class: "st-grid" }, element("thead", {}, head), body)),
  );
}

function row(state: StudyState, field: Field): HTMLElement {
  const s = span(field.values);
  const at = (point: number): HTMLElement => element("td", {}, point >= 0 && button(`point ${point}`, () => state.select(point), { class: "st-link" }));
  return element(
    "tr",
    {},
    element("th", { scope: "row", title: `${field.name}: ${field.description}` }, breakable(fieldLabel(field))),
    element("td", {}, number(s.numbers > 0 ? s.least : null)),
    at(s.leastAt),
    element("td", {}, number(s.numbers > 0 ? s.greatest : null)),
    at(s.greatestAt),
  );
}
