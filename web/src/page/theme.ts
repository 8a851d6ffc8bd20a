// Light, dark, or the system setting. The choice is stored if the browser allows it.
import { element } from "../dom";
import { roving } from "../roving";

type Theme = "auto" | "light" | "dark";
const kKey = "grapnel-theme";
const kThemes: Theme[] = ["auto", "light", "dark"];

function stored(): Theme {
  try {
    const found = localStorage.getItem(kKey) as Theme | null;
    return found && kThemes.includes(found) ? found : "auto";
  } catch {
    return "auto"; // the browser has no storage for files
  }
}

function apply(theme: Theme): void {
  const root = document.documentElement;
  if (theme === "auto") delete root.dataset.theme;
  else root.dataset.theme = theme;
  window.dispatchEvent(new Event("grapnel-theme"));
}

export function themeToggle(): HTMLElement {
  let now = stored();
  apply(now);
  const buttons = kThemes.map((theme) => {
    const button = element("button", { type: "button", "aria-pressed": String(theme === now) }, theme);
    button.addEventListener("click", () => {
      now = theme;
      try {
        localStorage.setItem(kKey, theme);
      } catch {
        // not stored
      }
      buttons.forEach((one, i) => one.setAttribute("aria-pressed", String(kThemes[i] === now)));
      apply(theme);
    });
    return button;
  });
  const group = element("div", { class: "theme", role: "toolbar", "aria-label": "Colours of the page" }, ...buttons);
  roving(group);
  return group;
}
