// Small parts of the page: selects, switches, buttons, cards of charts.
import { element } from "../dom";
import { breakable } from "./describe";
import type { Field } from "./field";

export interface Option {
  value: string;
  text: string;
  group?: string;
}

// A labelled select. Returns it with a function that changes its options.
export function select(text: string, options: Option[], value: string, change: (value: string) => void): HTMLLabelElement {
  const box = element("select", { class: "st-select" });
  const groups = new Map<string, HTMLElement>();
  for (const option of options) {
    const made = element("option", { value: option.value }, option.text);
    if (option.value === value) made.selected = true;
    if (option.group && !groups.has(option.group)) groups.set(option.group, box.appendChild(element("optgroup", { label: option.group })));
    (option.group ? groups.get(option.group)! : box).append(made);
  }
  box.addEventListener("change", () => change(box.value));
  return element("label", { class: "st-field" }, element("span", { class: "st-field-name" }, breakable(text)), box);
}

export function toggle(text: string, on: boolean, change: (on: boolean) => void): HTMLLabelElement {
  const box = element("input", { type: "checkbox" });
  box.checked = on;
  box.addEventListener("change", () => change(box.checked));
  return element("label", { class: "st-toggle" }, box, element("span", {}, text));
}

export function button(text: string, press: () => void, attributes: Record<string, string> = {}): HTMLButtonElement {
  const made = element("button", { type: "button", class: "st-button", ...attributes }, text);
  made.addEventListener("click", press);
  return made;
}

const kGroups: Record<Field["role"], string> = { axis: "Axes", combined: "Combined", column: "Columns" };

// All columns of a table, grouped by subject.
export function fieldOptions(fields: Field[]): Option[] {
  return fields.map((f) => {
    const owner = f.name.match(/^(grasps\/[^/]+|joints|margins|base|end|ledger)\//)?.[1];
    return { value: f.key, text: f.words, group: f.role === "column" && owner ? owner : kGroups[f.role] };
  });
}

// A button that copies a text and confirms it.
export function copyButton(text: () => string, title: string): HTMLButtonElement {
  const made = button("Copy", () => void copy(), { "aria-label": title, title });
  const confirm = (message: string): void => {
    made.textContent = message;
    setTimeout(() => (made.textContent = "Copy"), 1500);
  };
  const copy = async (): Promise<void> => {
    try {
      await navigator.clipboard.writeText(text());
      confirm("Copied");
    } catch {
      confirm(copyBySelection(text()) ? "Copied" : "Not allowed");
    }
  };
  return made;
}

// For pages from disk without access to the clipboard.
function copyBySelection(text: string): boolean {
  const area = element("textarea", { class: "st-offscreen" });
  area.value = text;
  document.body.append(area);
  area.select();
  const done = document.execCommand("copy");
  area.remove();
  return done;
}

// A command line for a shell.
export function commandLine(command: string): HTMLElement {
  return element("div", { class: "st-command" }, element("code", { tabindex: "0" }, command), copyButton(() => command, "Copy the command"));
}

// Builds a part when it scrolls into view, or before the page is printed, so that the first screen is fast.
export function whenSeen(host: HTMLElement, build: () => void): () => void {
  let done = false;
  const once = (): void => {
    if (done) return;
    done = true;
    observer.disconnect();
    build();
  };
  const observer = new IntersectionObserver((seen) => seen.some((one) => one.isIntersecting) && once(), { rootMargin: "300px" });
  observer.observe(host);
  window.addEventListener("beforeprint", () => {
    once();
    for (const check of widths) check(); // printing does not wait for the next layout
  });
  return once;
}

// Draws visible parts immediately, and others when they scroll into view: 100 000 points are not drawn off screen.
export function whileSeen(host: HTMLElement, draw: () => void): () => void {
  let [seen, due] = [true, false];
  const catchUp = (): void => {
    if (!due) return;
    due = false;
    draw();
  };
  new IntersectionObserver(
    (entries) => {
      seen = entries[entries.length - 1].isIntersecting;
      if (seen) catchUp();
    },
    { rootMargin: "200px" },
  ).observe(host);
  window.addEventListener("beforeprint", catchUp);
  return () => {
    due = true;
    if (seen) catchUp();
  };
}

const widths = new Set<() => void>();

// Calls at the first layout and whenever the width has changed.
export function onWidth(host: HTMLElement, draw: (width: number) => void): void {
  let width = 0;
  let waiting = 0;
  const check = (): void => {
    waiting = 0;
    const now = Math.floor(host.clientWidth);
    if (now <= 0 || now === width) return;
    width = now;
    draw(now);
  };
  new ResizeObserver(() => (waiting ||= requestAnimationFrame(check))).observe(host);
  widths.add(check);
  check();
}
