// Numbers of campaigns in words: probabilities have enough digits to distinguish them from 0 and 1. No DOM.
import { number } from "../format";
import { counted } from "../study/describe";
import type { CampaignModel, Proportion } from "./model";

// 0.9734, 0.99982, 1: four digits, and more if the distance to 1 requires them.
export function probability(p: number, digits = 4): string {
  if (!Number.isFinite(p)) return "–";
  if (p === 0 || p === 1) return String(p);
  const rest = Math.min(p, 1 - p);
  const places = Math.min(12, Math.max(digits, 1 - Math.floor(Math.log10(rest))));
  return p.toFixed(places);
}

// "0.9702 to 0.9763", both with as many digits.
export function interval(p: Proportion): string {
  return `${probability(p.lower)} to ${probability(p.upper)}`;
}

export function percent(confidence: number): string {
  return `${Number((100 * confidence).toPrecision(6))}\u202f%`;
}

const kSamplings: Record<string, string> = { random: "random", latin_hypercube: "Latin hypercube", sobol: "Sobol" };
export function samplingName(sampling: string): string {
  return kSamplings[sampling] ?? sampling.replace(/_/g, " ");
}

// Ticks of an axis up to such a number: 2·10¹⁴ where all digits would overlap.
export function tickOf(most: number): { tickFormat?: (v: number) => string } {
  return most >= 1e5 ? { tickFormat: (v) => number(v) } : {};
}

export const kCaptureProbability = "Capture probability";

// Name of the share of successes: "captures" only if success requires nothing but closed grasps.
export function successName(model: CampaignModel): string {
  const text = model.criteria.length === 1 ? model.criteria[0].text.trim() : "";
  return /^captured( *(==|>=?) *[01](\.[05]*)?)?$/.test(text) ? kCaptureProbability : "Success probability";
}

// "97 340 of 100 000"
export function share(p: Proportion): string {
  return `${counted(p.successes)} of ${counted(p.trials)}`;
}
