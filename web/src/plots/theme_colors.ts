// The page's colours for canvases, which know no style sheets.

let cache: Record<string, string> = {};
let dark = false;
const listeners = new Set<() => void>();

function update(): void {
  cache = {};
  dark = css("--scheme") === "dark";
  for (const listener of listeners) listener();
}
window.addEventListener("grapnel-theme", update);
window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", update);

export function css(name: string): string {
  return (cache[name] ??= getComputedStyle(document.documentElement).getPropertyValue(name).trim());
}

export function onThemeChange(listener: () => void): void {
  listeners.add(listener);
}

// Lighter on dark pages, so that thin lines stay readable.
const kOnDark: Record<string, string> = {
  "#0072b2": "#5a8ff5",
  "#d55e00": "#ff7a45",
  "#009e73": "#2cc295",
  "#cc79a7": "#e39ac4",
  "#8a7400": "#b8a23a",
  "#56b4e9": "#93dcff",
  "#e69f00": "#ffcf4d",
  "#777777": "#a0a0a0",
};

export function lineColor(color: string): string {
  if (cache["--scheme"] === undefined) dark = css("--scheme") === "dark";
  if (color === "ink") return css("--ink");
  return dark ? (kOnDark[color] ?? color) : color;
}
