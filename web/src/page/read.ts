// Reads a summary in which any key may be missing or have another type: a damaged file, or an earlier version.
import { withUnit as spaced } from "../format";
export type { Partly, PartlySummary } from "../data";

export function list<T>(value: readonly T[] | null | undefined): T[] {
  return Array.isArray(value) ? (value as T[]) : [];
}
export function num(value: unknown): number | null {
  return typeof value === "number" && Number.isFinite(value) ? value : null;
}
export function text(value: unknown, absent = "–"): string {
  return typeof value === "string" && value !== "" ? value : absent;
}
export function vector(value: unknown): number[] | null {
  return Array.isArray(value) && value.length > 0 && value.every((c) => typeof c === "number" && Number.isFinite(c))
    ? value
    : null;
}
export function size(value: unknown): number | null {
  const v = vector(value);
  return v ? Math.hypot(...v) : null;
}
// "post_impact_2" -> "post-impact 2", "linear_momentum_drift" -> "linear momentum drift"
export function words(key: unknown): string {
  return text(key)
    .replace(/^post_impact(?=_|$)/, "post-impact")
    .replace(/_/g, " ");
}

// A number and its unit without a line break in between.
export function withUnit(value: number | null | undefined, unit: string, digits?: number): string {
  return spaced(value, unit, digits).replace(/ /g, "\u00a0");
}
