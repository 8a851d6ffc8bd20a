// One box beside the pointer for all charts of the page. Its texts are never interpreted as HTML.
import { element } from "../dom";

let box: HTMLElement | null = null;

export function showTooltip(lines: string[], clientX: number, clientY: number): void {
  if (!box?.isConnected) document.body.append((box = element("div", { class: "st-tooltip", "aria-hidden": "true" })));
  box.replaceChildren(...lines.map((text, k) => element("div", k === 0 ? { class: "st-tooltip-head" } : {}, text)));
  box.hidden = false;
  const { width, height } = box.getBoundingClientRect();
  const left = clientX + 14 + width > window.innerWidth ? clientX - 14 - width : clientX + 14;
  const top = clientY + 14 + height > window.innerHeight ? clientY - 14 - height : clientY + 14;
  box.style.left = `${Math.max(4, left)}px`;
  box.style.top = `${Math.max(4, top)}px`;
}

export function hideTooltip(): void {
  if (box) box.hidden = true;
}
