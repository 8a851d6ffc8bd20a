// Names of two runs that are shown side by side.
export type Names = readonly [string, string];

export const kComparison: Names = ["A", "B"];
export const kVariant: Names = ["base case", "variant"];

// "B − A"
export function differenceName([a, b]: Names): string {
  return `${b} − ${a}`;
}
