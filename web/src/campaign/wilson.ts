// Probabilities from counts. No DOM.
import type { Proportion } from "./model";

// Wilson's score interval (1927), two-sided.
export function wilson(successes: number, trials: number, confidence: number): Proportion {
  if (!(trials > 0)) return { successes: 0, trials: 0, estimate: NaN, lower: 0, upper: 1 };
  const z = normalQuantile(0.5 + confidence / 2);
  const p = successes / trials;
  const share = (z * z) / trials;
  const middle = (p + share / 2) / (1 + share);
  const half = (z * Math.sqrt((p * (1 - p)) / trials + share / (4 * trials))) / (1 + share);
  return { successes, trials, estimate: p, lower: successes === 0 ? 0 : Math.max(0, middle - half), upper: successes === trials ? 1 : Math.min(1, middle + half) };
}

type Stated = { [Key in "estimate" | "lower" | "upper"]?: number | null };

// As stored in the file; missing bounds are computed.
export function proportionOf(stated: Stated | null | undefined, successes: number, trials: number, confidence: number): Proportion {
  const given = (key: keyof Stated): number | null => {
    const value = stated?.[key];
    return typeof value === "number" ? value : null;
  };
  const count = Number.isFinite(successes) ? successes : Math.round((given("estimate") ?? NaN) * trials);
  const made = wilson(count, Number.isFinite(count) ? trials : 0, confidence);
  return { ...made, estimate: given("estimate") ?? made.estimate, lower: given("lower") ?? made.lower, upper: given("upper") ?? made.upper };
}

// Inverse of the standard normal distribution function, for p from 0.5 to 1: Newton's method on the integral, which is
// summed as a series (Abramowitz and Stegun 26.2.10).
export function normalQuantile(p: number): number {
  if (!(p > 0.5)) return 0;
  let z = Math.min(6, Math.sqrt(-2 * Math.log(1 - p)) || 6);
  for (let k = 0; k < 60; ++k) {
    const step = (normal(z) - p) / density(z);
    if (!Number.isFinite(step)) break;
    z -= Math.max(-1, Math.min(1, step));
    if (Math.abs(step) < 1e-13 * z) break;
  }
  return z;
}

const density = (z: number): number => Math.exp((-z * z) / 2) / Math.sqrt(2 * Math.PI);

function normal(z: number): number {
  let term = z;
  let sum = z;
  for (let k = 1; k < 400 && Math.abs(term) > 1e-17 * sum; ++k) sum += term *= (z * z) / (2 * k + 1);
  return 0.5 + density(z) * sum;
}
