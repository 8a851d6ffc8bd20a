// The page's colours for canvases, which do not support style sheets.

import { knownRole } from "../colors";

const kForced = window.matchMedia("(forced-colors: active)");
let cache: Record<string, string> = {};
let dark = false;
const listeners = new Set<() => void>();

function update(): void {
  cache = {};
  dark = isDark();
  for (const listener of listeners) listener();
}
window.addEventListener("grapnel-theme", update);
window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", update);
kForced.addEventListener("change", update);

// If the user's system chooses the colours, the page's background determines the scheme.
function isDark(): boolean {
  const named = css("--scheme") === "dark";
  return kForced.matches ? isDarkColor(getComputedStyle(document.body).backgroundColor, named) : named;
}

// "rgb(0, 0, 0)"
export function isDarkColor(color: string, otherwise: boolean): boolean {
  const found = /^rgba?\((\d+),\s*(\d+),\s*(\d+)/.exec(color);
  return found ? 0.2126 * Number(found[1]) + 0.7152 * Number(found[2]) + 0.0722 * Number(found[3]) < 110 : otherwise;
}

export function css(name: string): string {
  return (cache[name] ??= getComputedStyle(document.documentElement).getPropertyValue(name).trim());
}

export function onThemeChange(listener: () => void): void {
  listeners.add(listener);
}

// Lighter on dark pages, so that thin lines remain visible.
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

// Colour of a role of colors.ts, of "ink", or the colour itself.
export function lineColor(color: string): string {
  if (cache["--scheme"] === undefined) dark = isDark();
  if (color === "ink") return css("--ink");
  const role = knownRole(color, dark ? "dark" : "light");
  if (role) return role;
  return dark ? (kOnDark[color] ?? color) : color;
}
