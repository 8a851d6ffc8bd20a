// A text field with completion from a list, by mouse or keyboard (the combobox pattern of WAI-ARIA).
import { element } from "../dom";

export interface Suggestion {
  text: string; // what it completes to
  detail: string; // shown beside it
}

const kMost = 40; // suggestions shown

export function combobox(label: string, suggestions: () => Suggestion[], chosen: (text: string) => void): { root: HTMLElement; input: HTMLInputElement } {
  const id = `whatif-list-${label.replace(/\W+/g, "-")}`;
  const input = element("input", { type: "text", role: "combobox", "aria-label": label, "aria-expanded": "false", "aria-controls": id, "aria-autocomplete": "list", autocomplete: "off", spellcheck: "false", placeholder: label });
  const options = element("ul", { id, role: "listbox", "aria-label": `${label}: suggestions`, class: "wi-options" });
  options.hidden = true;
  let shown: Suggestion[] = [];
  let active = -1;
  const close = (): void => {
    options.hidden = true;
    active = -1;
    input.setAttribute("aria-expanded", "false");
    input.removeAttribute("aria-activedescendant");
  };
  const choose = (one: Suggestion): void => {
    input.value = one.text;
    close();
    chosen(one.text);
  };
  const activate = (index: number): void => {
    active = shown.length === 0 ? -1 : (index + shown.length) % shown.length;
    [...options.children].forEach((option, i) => option.setAttribute("aria-selected", String(i === active)));
    if (active < 0) return;
    input.setAttribute("aria-activedescendant", options.children[active].id);
    options.children[active].scrollIntoView({ block: "nearest" });
  };
  const open = (): void => {
    const words = input.value.toLowerCase().split(/\s+/).filter(Boolean);
    const fits = ({ text, detail }: Suggestion): boolean => words.every((word) => `${text} ${detail}`.toLowerCase().includes(word));
    shown = suggestions().filter(fits).slice(0, kMost);
    options.replaceChildren(
      ...shown.map((one, i) => {
        const option = element("li", { role: "option", id: `${id}-${i}`, "aria-selected": "false" }, element("code", {}, one.text), element("span", {}, one.detail));
        option.addEventListener("pointerdown", (event) => {
          event.preventDefault(); // the field keeps the focus
          choose(one);
        });
        return option;
      }),
    );
    options.hidden = shown.length === 0;
    input.setAttribute("aria-expanded", String(shown.length > 0));
    active = -1;
    input.removeAttribute("aria-activedescendant");
  };
  input.addEventListener("input", open);
  input.addEventListener("blur", close);
  input.addEventListener("keydown", (event) => {
    const isOpen = !options.hidden;
    if (event.key === "ArrowDown" || event.key === "ArrowUp") {
      if (!isOpen) open();
      activate(event.key === "ArrowDown" ? active + 1 : active < 0 ? -1 : active - 1);
    } else if (event.key === "Enter" && isOpen && active >= 0) choose(shown[active]);
    else if (event.key === "Escape" && isOpen) close();
    else return;
    event.preventDefault();
    event.stopPropagation();
  });
  return { root: element("div", { class: "wi-combobox" }, input, options), input };
}
