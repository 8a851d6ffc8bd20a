// Reading a summary of which any key may be missing or of another kind.
import { withUnit as spaced } from "../format";

export function list(value: any): any[] {
  return Array.isArray(value) ? value : [];
}
export function num(value: any): number | null {
  return typeof value === "number" && Number.isFinite(value) ? value : null;
}
export function text(value: any, absent = "–"): string {
  return typeof value === "string" && value !== "" ? value : absent;
}
export function vector(value: any): number[] | null {
  return Array.isArray(value) && value.length > 0 && value.every((c) => typeof c === "number" && Number.isFinite(c))
    ? value
    : null;
}
export function size(value: any): number | null {
  const v = vector(value);
  return v ? Math.hypot(...v) : null;
}
// "post_impact_2" -> "post-impact 2", "linear_momentum_drift" -> "linear momentum drift"
export function words(key: any): string {
  return text(key)
    .replace(/^post_impact(?=_|$)/, "post-impact")
    .replace(/_/g, " ");
}

// A number and its unit, which no line break parts.
export function withUnit(value: number | null | undefined, unit: string, digits?: number): string {
  return spaced(value, unit, digits).replace(/ /g, "\u00a0");
}
