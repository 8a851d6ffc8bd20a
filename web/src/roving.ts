// Button groups with a single stop of the Tab key: arrow keys, Home and End move within a group that was reached by keys.

import { isFocusClicked } from "./focus_origin";

const kItems = "button, select, input, a[href]";

// Items may be added and removed; hidden and disabled ones are skipped. `vertical`: up and down move too (if no item
// uses them).
export function roving(group: HTMLElement, vertical = false): void {
  const items = (): HTMLElement[] => [...group.querySelectorAll<HTMLElement>(kItems)].filter((one) => !one.matches(":disabled"));
  const shown = (one: HTMLElement): boolean => one.checkVisibility?.() ?? one.offsetParent !== null;
  const choose = (chosen: HTMLElement | undefined): void => {
    for (const one of items()) one.tabIndex = one === chosen ? 0 : -1;
  };
  const first = (): HTMLElement | undefined => items().find((one) => !one.hidden) ?? items()[0];
  choose(first());
  new MutationObserver(() => {
    const now = items().find((one) => one.tabIndex === 0 && !one.hidden);
    if (!now || items().filter((one) => one.tabIndex === 0).length !== 1) choose(now ?? first());
  }).observe(group, { childList: true, subtree: true, attributes: true, attributeFilter: ["hidden", "disabled"] });
  group.addEventListener("focusin", (event) => {
    const held = event.target as HTMLElement;
    if (items().includes(held)) choose(held);
  });
  group.addEventListener("keydown", (event) => {
    if (isFocusClicked() || event.ctrlKey || event.metaKey || event.altKey || event.shiftKey) return;
    const list = items().filter(shown);
    const at = list.indexOf(event.target as HTMLElement);
    if (at < 0) return;
    const to = target(event, at, list.length, vertical);
    if (to === undefined) return;
    event.preventDefault();
    event.stopPropagation();
    list[to].focus();
  });
}

function target(event: KeyboardEvent, at: number, count: number, vertical: boolean): number | undefined {
  const own = event.target as HTMLElement;
  const needsArrows = own.tagName === "SELECT" || (own instanceof HTMLInputElement && own.type === "range");
  if (event.key === "Home" && !needsArrows) return 0;
  if (event.key === "End" && !needsArrows) return count - 1;
  if (event.key === "ArrowRight" || (vertical && event.key === "ArrowDown")) return needsArrows && event.key !== "ArrowRight" ? undefined : (at + 1) % count;
  if (event.key === "ArrowLeft" || (vertical && event.key === "ArrowUp")) return needsArrows && event.key !== "ArrowLeft" ? undefined : (at + count - 1) % count;
  return undefined;
}
