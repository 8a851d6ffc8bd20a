// The filter as text, usable by keyboard: text, status, a range of a column.
import { element } from "../dom";
import { number, unitText } from "../format";
import { counted, plural } from "./describe";
import { kNoFilter, type Range } from "./filter";
import { span } from "./shape";
import type { StudyState } from "./state";
import { button, fieldOptions, select } from "./ui";

// `of`: the origin of the table's rows, if they are a part: "100 000 cases, a sample".
export function filterBar(state: StudyState, of = ""): HTMLElement {
  const chips = element("div", { class: "st-filter-chips" });
  const text = element("input", { type: "search", class: "st-select", placeholder: "number, reason or label", "aria-label": `Keep ${state.table.noun}s that mention` });
  let waiting = 0;
  text.addEventListener("input", () => {
    clearTimeout(waiting);
    waiting = window.setTimeout(() => state.setFilter({ text: text.value }), 150);
  });
  const { noun } = state.table;
  const statuses = [...new Set(state.table.status)].sort();
  const statusBox = select("Status", [{ value: "", text: "any" }, ...statuses.map((s) => ({ value: s, text: s }))], "", (status) => state.setFilter({ status }));
  const reset = (): void => {
    text.value = "";
    (statusBox.querySelector("select") as HTMLSelectElement).value = "";
    state.setFilter(kNoFilter);
  };
  const refresh = (): void => {
    const { ranges } = state.filter;
    const summary = state.filtered ? `${plural(state.passingCount, noun)} of ${counted(state.table.size)} kept` : of ? `${counted(state.table.size)} of ${of}` : `All ${plural(state.table.size, noun)}`;
    chips.replaceChildren(
      element("strong", { role: "status" }, summary),
      ...ranges.map((r) => button(`${rangeText(r)} ×`, () => state.setRange(r.field.key, null), { class: "st-chip", "aria-label": `Let go: ${rangeText(r)}` })),
      ...(state.filtered ? [button("Keep all", reset)] : []),
    );
  };
  state.listenFilter(refresh);
  refresh();
  return element(
    "section",
    { class: "card st-card st-filter", id: "study-filter", "aria-label": "Filter" },
    chips,
    element("details", {}, element("summary", {}, "Filter"), element("div", { class: "st-controls" }, element("label", { class: "st-field" }, element("span", { class: "st-field-name" }, "Mentions"), text), statuses.length > 1 && statusBox, rangeForm(state))),
  );
}

function rangeText(r: Range): string {
  if (r.field.labels) {
    const names = r.field.labels.filter((_, k) => k >= r.from && k <= r.to);
    return `${r.field.words}: ${names.join(", ") || "none"}`;
  }
  const end = (v: number): string => (Number.isFinite(v) ? number(v) : "any");
  return `${r.field.words}: ${end(r.from)} … ${end(r.to)} ${unitText(r.field.unit)}`.trim();
}

function rangeForm(state: StudyState): HTMLElement {
  const { fields } = state.table;
  const [from, to] = ["from", "to"].map((name) => element("input", { type: "number", step: "any", class: "st-select st-number", "aria-label": name, placeholder: name }));
  let field = fields[0];
  const offer = (): void => {
    const s = span(field?.values ?? []);
    from.placeholder = s.numbers > 0 ? number(s.least) : "from";
    to.placeholder = s.numbers > 0 ? number(s.greatest) : "to";
  };
  const apply = (): void => {
    const [low, high] = [from.value === "" ? -Infinity : Number(from.value), to.value === "" ? Infinity : Number(to.value)];
    if (field) state.setRange(field.key, { field, from: low, to: high });
  };
  offer();
  const box = select("Column", fieldOptions(fields), field?.key ?? "", (key) => {
    field = fields.find((f) => f.key === key) ?? field;
    from.value = to.value = "";
    offer();
  });
  return element("span", { class: "st-joined" }, box, from, to, button("Keep", apply));
}
