// The case of the selected point: its values, the reason of a failure, and the command that replays it.
import { element } from "../dom";
import { unitText } from "../format";
import { badgeOf } from "./badge";
import { breakable, rowName, shown, shownWithUnit } from "./describe";
import type { Field } from "./field";
import { Neighbours } from "./shape";
import type { StudyState } from "./state";
import { mainColumn, informativeColumns } from "./choice";
import { button, commandLine } from "./ui";

export interface PointCardSpec {
  state: StudyState;
  command: (point: number) => string; // "": none
  remark: (point: number) => string; // "best point found"; "": none
  more?: (point: number) => Node | null; // further links
  steps: boolean; // whether points are on a grid with neighbours
}

export function pointCard(spec: PointCardSpec): HTMLElement {
  const root = element("section", { class: "card st-card st-point", id: "study-point", "aria-label": `Selected ${spec.state.table.noun}`, "aria-live": "polite" });
  const neighbours = new Neighbours(spec.state.table);
  const open = new Set<string>(["informative"]);
  const draw = (): void => {
    const point = spec.state.selected;
    if (point === null) root.replaceChildren(element("h2", { class: "st-card-title" }, `No ${spec.state.table.noun} selected`), element("p", { class: "st-note" }, `Click a ${spec.state.table.noun} in any chart, or a row of the table.`));
    else {
      const held = root.contains(document.activeElement) ? document.activeElement?.getAttribute("aria-label") : null;
      root.replaceChildren(...content(spec, neighbours, point, open));
      // The pressed button retains the focus, for another step.
      if (held) [...root.querySelectorAll<HTMLElement>("[aria-label]")].find((e) => e.getAttribute("aria-label") === held)?.focus();
    }
  };
  spec.state.listenSelect(draw);
  draw();
  return root;
}

function content(spec: PointCardSpec, neighbours: Neighbours, point: number, open: Set<string>): (Node | string)[] {
  const { table } = spec.state;
  const parts: Node[] = [head(spec, point)];
  const remark = spec.remark(point);
  if (remark) parts.push(element("p", { class: "st-remark" }, remark));
  if (table.reason[point]) parts.push(element("p", { class: "st-reason" }, table.reason[point]));
  parts.push(axes(spec, neighbours, point));
  const command = spec.command(point);
  if (command) parts.push(element("h3", { class: "st-sub" }, "Replay this case"), commandLine(command));
  const more = spec.more?.(point);
  if (more) parts.push(element("p", { class: "st-more" }, more));
  const informative = informativeColumns(table, 6);
  if (informative.length > 0) parts.push(group("Telling columns", "informative", informative, point, open, (f) => f.words));
  for (const [name, fields] of grouped(table.fields.filter((f) => f.role === "column"))) {
    parts.push(group(name || "other columns", `group:${name}`, fields, point, open, (f) => within(name, f.words)));
  }
  return parts;
}

function head(spec: PointCardSpec, point: number): HTMLElement {
  const { state } = spec;
  const badge = badgeOf(state.table, point);
  const pill = element("span", { class: `st-pill st-status-${badge.kind}` }, badge.text);
  const go = (by: number): HTMLButtonElement => {
    const made = button(by < 0 ? "‹" : "›", () => state.select(point + by), { "aria-label": `${state.table.noun} ${by < 0 ? "before" : "after"}` });
    made.disabled = point + by < 0 || point + by >= state.table.size;
    return made;
  };
  return element("div", { class: "st-card-head" }, element("h2", { class: "st-card-title" }, `${rowName(state.table, point)} `, pill), element("div", { class: "st-downloads" }, go(-1), go(1)));
}

function axes(spec: PointCardSpec, neighbours: Neighbours, point: number): HTMLElement {
  const { state } = spec;
  const rows = state.table.axes.map((axis, k) => {
    const step = (by: number): HTMLButtonElement => {
      const to = neighbours.step(point, k, by);
      const made = button(by < 0 ? "−" : "+", () => to !== undefined && state.select(to), { class: "st-button st-step", "aria-label": `${by < 0 ? "Less" : "More"} ${axis.words}` });
      made.disabled = to === undefined;
      return made;
    };
    const steps = spec.steps && axis.levels.length > 1 && element("span", { class: "st-steps" }, step(-1), step(1));
    return element("tr", {}, element("th", { scope: "row", title: `${axis.name}: ${axis.description}` }, breakable(axis.words)), element("td", axis.labels ? {} : { class: "st-unbroken" }, shownWithUnit(axis, axis.values[point])), spec.steps && element("td", { class: "st-steps-cell" }, steps));
  });
  return element("table", { class: `st-values st-axes-values${spec.steps ? "" : " st-stepless"}` }, element("tbody", {}, ...rows));
}

function group(title: string, key: string, fields: Field[], point: number, open: Set<string>, name: (f: Field) => string): HTMLElement {
  const made = element("details", { class: "st-group" }, element("summary", {}, title, element("span", { class: "st-count" }, ` ${fields.length}`)));
  const fill = (): void => {
    if (made.childElementCount > 1) return;
    const rows = fields.map((f) =>
      element("tr", {}, element("th", { scope: "row", title: `${f.name}: ${f.description}` }, breakable(name(f))), element("td", {}, shown(f, f.values[point])), element("td", { class: "st-unit" }, unitText(f.unit))),
    );
    made.append(element("table", { class: "st-values" }, element("tbody", {}, ...rows)));
  };
  // Groups remain open or closed when another point is selected.
  made.open = open.has(key);
  if (made.open) fill();
  made.addEventListener("toggle", () => {
    if (made.open) open.add(key);
    else open.delete(key);
    fill();
  });
  return made;
}

// "impulse magnitude" for "tip-1: impulse magnitude" in the group "grasps/tip-1".
function within(folder: string, words: string): string {
  const owner = `${folder.slice(folder.lastIndexOf("/") + 1)}: `;
  return words.startsWith(owner) ? words.slice(owner.length) : words;
}

// By the first parts of the name: "grasps/tip-1", "base", "margins/arm-1-joint-1".
function grouped(fields: Field[]): Map<string, Field[]> {
  const found = new Map<string, Field[]>();
  for (const field of fields) {
    const parts = field.name.split("/");
    const own = parts[0] === "grasps" ? 2 : parts.length > 1 ? 1 : 0;
    const name = parts.slice(0, own).join("/");
    found.set(name, [...(found.get(name) ?? []), field]);
  }
  return found;
}

// The initial point: the maximum of the main column, else the first.
export function firstPoint(state: StudyState, greatest = true): number | null {
  const main = mainColumn(state.table);
  if (!main || state.table.size === 0) return state.table.size > 0 ? 0 : null;
  let best = 0;
  const sign = greatest ? 1 : -1;
  for (let k = 0; k < main.values.length; ++k) {
    if (!(sign * main.values[k] <= sign * main.values[best]) && Number.isFinite(main.values[k])) best = k;
  }
  return best;
}
