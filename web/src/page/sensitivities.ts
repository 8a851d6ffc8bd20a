// Derivatives of the impulse with respect to uncertain parameters, in a sortable table.
import { element } from "../dom";
import { number, unitText } from "../format";
import type { ImpactReport, ImpactSensitivity } from "../summary_types";
import { list, num, size, text, type Partly } from "./read";
import { fold, headCell, tableBox, tableRow, type Cell, type Column } from "./table";

interface Row {
  cells: Cell[];
  keys: (string | number)[]; // to sort by
}

export function sensitivitiesPart(impact: Partly<ImpactReport>): HTMLElement[] {
  const all = list(impact.sensitivities);
  if (all.length === 0) return [];
  const grasps = list(impact.grasps).map((grasp) => text(grasp.end_effector));
  const columns: Column[] = [
    { head: "Parameter" },
    { head: "Of" },
    { head: "Per" },
    ...grasps.map((name) => ({ head: `Impulse, ${name}`, unit: "N s per unit", numeric: true })),
    { head: "Base rate", unit: "rad/s per unit", numeric: true },
    { head: "Base velocity", unit: "m/s per unit", numeric: true },
  ];
  const rows = all.map((one) => row(one, grasps.length));
  const sorted = sortable(columns, rows, 3);
  return [
    fold(
      `Sensitivities of the impulse to uncertain parameters (${all.length})`,
      element(
        "p",
        { class: "small" },
        "Change of the impulse's magnitude and of the base's motion per unit of each parameter. Units differ from row to row; a heading sorts by its column, by size.",
      ),
      sorted,
    ),
  ];
}

function row(one: Partly<ImpactSensitivity>, grasps: number): Row {
  const of = one.end_effector ? text(one.end_effector) : text(one.target, "");
  if (one.undefined)
    return {
      cells: [text(one.parameter), of, unitText(text(one.unit)), `undefined: ${text(one.undefined)}`],
      keys: [text(one.parameter), of, text(one.unit), -1],
    };
  const slopes = Array.from({ length: grasps }, (_, i) => num(list(one.impulse_magnitude)[i]));
  const base = [size(one.base_angular_velocity_change), size(one.base_velocity_change)];
  return {
    cells: [text(one.parameter), of, unitText(text(one.unit)), ...[...slopes, ...base].map((value) => number(value))],
    keys: [text(one.parameter), of, text(one.unit), ...[...slopes, ...base].map((value) => Math.abs(value ?? -1))],
  };
}

function sortable(columns: Column[], rows: Row[], first: number): HTMLElement {
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
    const order = [...rows].sort((a, b) => {
      const [x, y] = [a.keys[by] ?? -1, b.keys[by] ?? -1];
      return typeof x === "number" && typeof y === "number" ? y - x : String(x).localeCompare(String(y));
    });
    body.replaceChildren(...order.map((one) => tableRow(columns, one.cells)));
    heads.forEach((head, i) =>
      i === by
        ? head.setAttribute("aria-sort", columns[i].numeric ? "descending" : "ascending")
        : head.removeAttribute("aria-sort"),
    );
  };
  sort(Math.min(first, columns.length - 1));
  return tableBox(
    "Sensitivities",
    element(
      "table",
      {},
      element("caption", {}, "Sensitivities"),
      element("thead", {}, element("tr", {}, ...heads)),
      body,
    ),
  );
}
