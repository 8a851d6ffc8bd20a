// Appearance of charts of studies: sizes, axes, colours.
import * as Plot from "@observablehq/plot";
import { kSeriesColors } from "../colors";
import { css, lineColor } from "../plots/theme_colors";
import { label } from "../format";
import { clipped, powerTick, shortened, shown } from "./describe";
import type { Field } from "./field";

export const kStyle = { fontSize: "12px", fontFamily: "inherit", background: "none", color: "inherit", overflow: "visible" };

// Panels side by side, with equally filled rows.
export function columnsFor(panels: number, width: number, least: number): number {
  const most = Math.max(1, Math.floor((width + 16) / (least + 16)));
  return Math.max(1, Math.ceil(panels / Math.ceil(panels / most)));
}

// Axis options for a column: labels at their positions, powers of ten on logarithmic axes. `pixels`: length of the
// axis, `room`: of its name.
export function axisOptions(field: Field | null, name: string, log: boolean, pixels: number, room = pixels): Plot.ScaleOptions {
  const letters = Math.max(12, Math.floor(room / 6.6));
  if (!field) return { label: shortened(name, letters), labelArrow: "none" };
  const title = label(shortened(field.words, letters - field.unit.length - 3), shortened(field.unit, letters - 3));
  if (field.labels) {
    const ticks = field.labels.map((_, k) => k);
    const each = Math.max(4, Math.floor(pixels / Math.max(1, ticks.length) / 6.5));
    const format = (k: number): string => clipped(field.labels![k] ?? "", each);
    return { label: title, labelArrow: "none", domain: [-0.5, ticks.length - 0.5], ticks, tickFormat: format };
  }
  if (log) return { label: title, labelArrow: "none", type: "log", tickFormat: powerTick, ticks: Math.max(3, pixels / 60) };
  const few = field.role === "axis" && field.levels.length <= Math.min(9, pixels / 55);
  return {
    label: title,
    labelArrow: "none",
    ticks: few ? field.levels : Math.max(3, pixels / 70),
    tickFormat: few ? (v: number) => shown(field, v) : undefined,
  };
}

// From minimum to maximum, starting at zero if zero is close.
export function domainOf(least: number, greatest: number, log: boolean): [number, number] {
  if (!(greatest >= least)) return log ? [0.1, 1] : [0, 1];
  if (log) return greatest > least ? [least, greatest] : [least / 2, greatest * 2];
  if (least === greatest) {
    const half = Math.abs(least) * 0.1 || 1;
    return [least - half, greatest + half];
  }
  if (least >= 0 && least < 0.5 * greatest) return [0, greatest];
  if (greatest <= 0 && greatest > 0.5 * least) return [least, 0];
  return [least, greatest];
}

// Whether a column's values have separate colours: labels, and few values of an axis; others use a scale.
export function isApart(field: Field): boolean {
  return field.labels !== null || (field.role === "axis" && field.levels.length <= 8);
}

// Colours for the values of an axis: separate ones for few values, a scale for many numbers.
export function levelColor(field: Field | null): (level: number) => string {
  if (!field) return () => lineColor(kSeriesColors[0]);
  const levels = field.levels;
  if (isApart(field)) {
    const rank = new Map(levels.map((v, k) => [v, k]));
    if (field.colors) return (level) => lineColor(field.colors![level] ?? "#777777");
    return (level) => lineColor(kSeriesColors[(rank.get(level) ?? 7) % kSeriesColors.length]);
  }
  const scale = Plot.scale({ color: markColor(levels[0], levels[levels.length - 1]) });
  return (level) => (Number.isFinite(level) ? String(scale!.apply(level)) : "#888888");
}

// For lines and dots: viridis without the end that is close to the page's colour.
export function markColor(least: number, greatest: number): Plot.ScaleOptions {
  const range: [number, number] = css("--scheme") === "dark" ? [0.3, 1] : [0, 0.88];
  return { type: "linear", scheme: "viridis", range, domain: ends(least, greatest) };
}

function ends(least: number, greatest: number): [number, number] {
  if (!Number.isFinite(least)) return [0, 1]; // no numbers at all
  return greatest > least ? [least, greatest] : [least - 1, least + 1];
}

// For values of both signs a diverging scale about zero, else viridis; both are safe for colour-blind readers.
export function valueColor(least: number, greatest: number, log: boolean): Plot.ScaleOptions {
  if (least < 0 && greatest > 0) {
    const size = Math.max(-least, greatest);
    return { type: "linear", scheme: "RdBu", reverse: true, domain: [-size, size] };
  }
  if (log && least > 0) return { type: "log", scheme: "viridis", domain: [least, greatest > least ? greatest : least * 2] };
  return { type: "linear", scheme: "viridis", domain: ends(least, greatest) };
}
