// Assembles a study's page: the first screen immediately, other parts when they scroll into view.
import { element } from "../dom";
import { rowName } from "./describe";
import type { StudyState } from "./state";
import { lightOnPaper } from "./paper";
import { button, whenSeen } from "./ui";

export interface Parts {
  state: StudyState;
  head: HTMLElement;
  first: (() => HTMLElement)[]; // built immediately
  filter: HTMLElement;
  later: [string, () => HTMLElement | null][]; // by id; null: nothing to show
  table: () => HTMLElement;
  card: HTMLElement;
  empty: string; // message if there is nothing to draw
}

export function assemble(host: HTMLElement, parts: Parts): void {
  lightOnPaper(); // before the parts that are built for printing
  const main = element("div", { class: "st-main" });
  const aside = element("aside", { class: "st-aside" }, parts.card);
  host.replaceChildren(element("div", { class: "st-page" }, parts.head, element("div", { class: "st-columns" }, main, aside), jumpBar(parts)));
  for (const build of parts.first) place(main, build);
  if (parts.first.length === 0) main.append(element("section", { class: "card st-card" }, element("p", { class: "st-note" }, parts.empty)));
  main.append(parts.filter);
  for (const [id, build] of [...parts.later, ["table", parts.table] as [string, () => HTMLElement]]) {
    const slot = element("div", { class: "st-slot", "data-slot": id });
    main.append(slot);
    whenSeen(slot, () => {
      slot.classList.add("st-built");
      place(slot, build);
    });
  }
  expose(parts.state);
}

// A failed part shows its error; the others remain.
function place(host: HTMLElement, build: () => HTMLElement | null): void {
  try {
    const made = build();
    if (made) host.append(made);
  } catch (error) {
    console.warn(error);
    host.append(element("section", { class: "card st-card" }, element("p", { class: "st-note" }, `This part cannot be shown: ${(error as Error).message}`)));
  }
}

// On narrow pages the selected point lies elsewhere: a bar at the bottom leads to it.
function jumpBar({ state, card }: Parts): HTMLElement {
  const said = element("span", {});
  const bar = element("div", { class: "st-jump" }, said, button("Show case", () => card.scrollIntoView({ behavior: "smooth", block: "start" })));
  const tell = (): void => {
    bar.hidden = state.selected === null;
    said.textContent = state.selected === null ? "" : `${rowName(state.table, state.selected)} · ${state.table.status[state.selected]}`;
  };
  state.listenSelect(tell);
  tell();
  return bar;
}

export interface StudyHandle {
  readonly selected: number | null;
  select(point: number | null): void;
  readonly kept: number;
  readonly points: number;
  charts(): string[]; // ids of the parts that are built
}

// For tests and for the browser's console.
function expose(state: StudyState): void {
  const handle: StudyHandle = {
    get selected() {
      return state.selected;
    },
    select: (point) => state.select(point),
    get kept() {
      return state.keptCount;
    },
    points: state.table.size,
    charts: () => [...document.querySelectorAll('.st-page [id^="study-"]')].map((e) => e.id.replace(/^study-/, "")),
  };
  const page = window as unknown as { __grapnel?: Record<string, unknown> };
  page.__grapnel = { ...page.__grapnel, study: handle };
}
