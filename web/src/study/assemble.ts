// Assembles a study's page: the first screen immediately, other parts one after the other once the browser is idle, or
// when they scroll into view; a search of the browser then finds everything.
import { element } from "../dom";
import { rowName } from "./describe";
import type { StudyState } from "./state";
import { lightOnPaper } from "./paper";
import { roving } from "../roving";
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
  const nav = element("nav", { class: "page-nav", "aria-label": "Sections" });
  roving(nav);
  host.replaceChildren(element("div", { class: "st-page" }, parts.head, nav, element("div", { class: "st-columns" }, main, aside), jumpBar(parts)));
  for (const build of parts.first) place(main, build);
  if (parts.first.length === 0) main.append(element("section", { class: "card st-card" }, element("p", { class: "st-note" }, parts.empty)));
  for (const card of main.querySelectorAll<HTMLElement>(":scope > [id]")) link(nav, card);
  main.append(parts.filter);
  const waiting: (() => void)[] = [];
  for (const [id, build] of [...parts.later, ["table", parts.table] as [string, () => HTMLElement]]) {
    const slot = element("div", { class: "st-slot", "data-slot": id });
    main.append(slot);
    const named = link(nav, slot);
    waiting.push(
      whenSeen(slot, () => {
        slot.classList.add("st-built");
        place(slot, build);
        named(slot.querySelector<HTMLElement>("[id]"));
      }),
    );
  }
  buildInIdle(waiting);
  expose(parts.state);
}

// One part per idle period, so that the page stays responsive.
function buildInIdle(waiting: (() => void)[]): void {
  const idle = window.requestIdleCallback ?? ((next: () => void) => window.setTimeout(next, 50));
  const next = (): void => {
    waiting.shift()?.();
    if (waiting.length > 0) idle(next);
  };
  idle(next);
}

// Adds a link to a part. Returns the function that names it after the part is built; null: there is nothing to show.
function link(nav: HTMLElement, part: HTMLElement): (built: HTMLElement | null) => void {
  const made = element("a", { href: "#" });
  const name = (built: HTMLElement | null): void => {
    const title = built?.querySelector("h2")?.textContent ?? "";
    made.hidden = title === "";
    made.textContent = title;
    if (built) made.href = `#${built.id}`;
  };
  name(part.id === "" ? null : part);
  nav.append(made);
  return name;
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
  const description = element("span", {});
  const bar = element("div", { class: "st-jump" }, description, button("Show case", () => card.scrollIntoView({ behavior: "smooth", block: "start" })));
  const refresh = (): void => {
    bar.hidden = state.selected === null;
    description.textContent = state.selected === null ? "" : `${rowName(state.table, state.selected)} · ${state.table.status[state.selected]}`;
  };
  state.listenSelect(refresh);
  refresh();
  return bar;
}

export interface StudyHandle {
  readonly selected: number | null;
  select(point: number | null): void;
  readonly passing: number;
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
    get passing() {
      return state.passingCount;
    },
    points: state.table.size,
    charts: () => [...document.querySelectorAll('.st-page [id^="study-"]')].map((e) => e.id.replace(/^study-/, "")),
  };
  const page = window as unknown as { __grapnel?: Record<string, unknown> };
  page.__grapnel = { ...page.__grapnel, study: handle };
}
