// All colours with a meaning: an arm, a target or an axis has one colour in the replay, in plots and in legends. They
// are distinguishable with red-green colour blindness (targets are darker than arms on light pages and lighter on dark
// ones), and have a contrast of at least 3 to the page.

export type Scheme = "light" | "dark";

// For charts of studies, where colours have no fixed meaning (after Okabe and Ito).
export const kSeriesColors = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#8a7400", "#56b4e9", "#e69f00", "#777777"];
export const kDashes: number[][] = [[], [6, 3], [2, 2], [8, 3, 2, 3]];

type Pair = [light: string, dark: string];

const kArms: Pair[] = [
  ["#0072b2", "#3f9be0"],
  ["#e0631a", "#ff8a4c"],
  ["#00906f", "#2fb08c"],
  ["#c2569f", "#e27fbd"],
  ["#5b57c9", "#b596ff"],
  ["#7a5230", "#c99b6d"],
];
const kTargets: Pair[] = [
  ["#6e5200", "#f2dd86"],
  ["#5c1f78", "#e3c8ff"],
  ["#1f5f68", "#a8ecf5"],
  ["#4f5a14", "#bccb5a"],
  ["#8c1238", "#ffb3a6"],
  ["#1a1f9e", "#7af5a8"],
];
// Only for items ordered along a chain: joints, kinds of energy. From dark to bright.
const kSteps: Pair[] = [
  ["#150c5c", "#9d95ff"],
  ["#6a1a9c", "#c98bff"],
  ["#a92395", "#f07fd8"],
  ["#d4456f", "#ff8a9c"],
  ["#d96a2b", "#ffb066"],
  ["#a8790a", "#f5d34a"],
  ["#5d7a1e", "#c8e05a"],
];
// Further colours, e.g. for a dozen thrusters: without order, all distinct.
const kMore: Pair[] = [
  ["#00637a", "#58d0e8"],
  ["#0b7a3b", "#5fe08f"],
  ["#7a1f1f", "#ff9d8f"],
  ["#1f4fd8", "#8fb0ff"],
  ["#4a4a4a", "#c8c8c8"],
  ["#b0006a", "#ff7ac0"],
  ["#6b6b00", "#e8e86a"],
  ["#2f7d6a", "#9be8df"],
  ["#8a4b00", "#ffc07a"],
];
const kFixed: Record<string, Pair> = {
  base: ["#687483", "#a3b0bf"],
  joint: ["#596573", "#7f8c9a"],
  edge: ["#27323f", "#070a0e"],
  obstacle: ["#7b838c", "#8b949e"],
  ghost: ["#8794a3", "#8c99a8"],
  second: ["#8f86d8", "#9aa0d8"],
  impulse: ["#e0007a", "#ff4fa3"],
  force: ["#a04a00", "#ffb066"],
  angular: ["#7a1fa2", "#d69bff"],
  system: ["#1c2733", "#f0f4f8"],
  robot: ["#2f4858", "#c4dbea"],
  mass: ["#1c2733", "#f0f4f8"],
  grid: ["#5d7083", "#8fa3b8"],
  limit: ["#b3261e", "#ff8a7d"],
  idle: ["#00734f", "#4cc79a"],
  near: ["#c77700", "#f0b35a"],
  panel: ["#27477f", "#335f9f"],
  cell: ["#c9d6ea", "#b9cdea"],
  "axis x": ["#b8001f", "#ff5a67"],
  "axis y": ["#35a04a", "#8be88b"],
  "axis z": ["#1f3fd0", "#7f9bff"],
};

// Colour of a role: "base", "arm 1", "target 0", "axis x", "step 3", ... Undefined: not a role.
export function knownRole(role: string, scheme: Scheme): string | undefined {
  const [kind, index] = role.split(" ");
  const list: Record<string, Pair[]> = { arm: kArms, target: kTargets, step: kSteps, more: kMore };
  const own = /^\d+$/.test(index ?? "") && Object.hasOwn(list, kind) ? list[kind] : undefined;
  const pair = Object.hasOwn(kFixed, role) ? kFixed[role] : own?.[Number(index) % own.length];
  return pair?.[scheme === "dark" ? 1 : 0];
}
export function roleColor(role: string, scheme: Scheme): string {
  return knownRole(role, scheme) ?? kFixed.base[scheme === "dark" ? 1 : 0];
}

// For lines in a given order; after the last step other colours follow, and the dash changes.
export function lineStyle(index: number): { color: string; dash: number[] } {
  const all = kSteps.length + kMore.length, at = index % all;
  const color = at < kSteps.length ? `step ${at}` : `more ${at - kSteps.length}`;
  const dash = 2 * Math.floor(index / all) + (at < kSteps.length ? 0 : 1);
  return { color, dash: kDashes[dash % kDashes.length] };
}

// The name of the interval after the first overlap of bodies.
export const kBeyond = "beyond validity";

export const kPhaseTints: Record<string, string> = {
  approach: "rgba(0,114,178,0.07)",
  contact: "rgba(213,94,0,0.22)",
  post_impact: "rgba(0,158,115,0.07)",
  motion: "rgba(0,158,115,0.07)",
  released: "rgba(119,119,119,0.08)",
  [kBeyond]: "rgba(90,90,90,0.24)",
};

// "contact_2" is tinted as "contact"; a phase with a user-defined name as motion.
export function phaseTint(phase: string): string {
  if (phase.startsWith(kBeyond)) return kPhaseTints[kBeyond];
  const plain = phase.replace(/_\d+$/, "");
  if (plain === "brake") return "transparent";  // takes no time
  return kPhaseTints[phase] ?? kPhaseTints[plain] ?? kPhaseTints.motion;
}
