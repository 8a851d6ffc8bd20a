// Colours that people who cannot tell red from green can tell apart (after Okabe and Ito), for light and dark pages.

export const kSeriesColors = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#8a7400", "#56b4e9", "#e69f00", "#777777"];
export const kDashes: number[][] = [[], [6, 3], [2, 2], [8, 3, 2, 3]];

// Of lines beyond the eighth the dash changes.
export function lineStyle(index: number): { color: string; dash: number[] } {
  return {
    color: kSeriesColors[index % kSeriesColors.length],
    dash: kDashes[Math.floor(index / kSeriesColors.length) % kDashes.length],
  };
}

// The name of what follows the first overlap of bodies.
export const kBeyond = "beyond validity";

export const kPhaseTints: Record<string, string> = {
  approach: "rgba(0,114,178,0.07)",
  contact: "rgba(213,94,0,0.22)",
  post_impact: "rgba(0,158,115,0.07)",
  released: "rgba(119,119,119,0.08)",
  [kBeyond]: "rgba(90,90,90,0.24)",
};

// "contact_2" is tinted as "contact".
export function phaseTint(phase: string): string {
  if (phase.startsWith(kBeyond)) return kPhaseTints[kBeyond];
  return kPhaseTints[phase] ?? kPhaseTints[phase.replace(/_\d+$/, "")] ?? "transparent";
}
