// Derivatives of the impulse with respect to uncertain parameters, in a sortable table.
import { element } from "../dom";
import { unitText } from "../format";
import { kImpactSensitivity, type FieldNote, type ImpactReport } from "../summary_types";
import { describedTable, those } from "./described";
import { list, text, type Partly } from "./read";
import { fold } from "./table";

export function sensitivitiesPart(impact: Partly<ImpactReport>): HTMLElement[] {
  const all = list(impact.sensitivities);
  if (all.length === 0) return [];
  const names = list(impact.grasps).map((grasp) => text(grasp.end_effector));
  const [, perUnit, about] = those(kImpactSensitivity, "impulse_magnitude")[0];
  const notes: FieldNote[] = [
    ...those(kImpactSensitivity, "parameter"),
    ["of", "", "end-effector or target that the parameter belongs to"],
    ["per", "", "unit of the parameter"],
    ...names.map((_, i): FieldNote => [`impulse ${i}`, perUnit, about]),
    ...those(kImpactSensitivity, "base_angular_velocity_change", "base_velocity_change"),
  ];
  const heads: Record<string, string> = { base_angular_velocity_change: "Base rate", base_velocity_change: "Base velocity" };
  names.forEach((name, i) => (heads[`impulse ${i}`] = `Impulse, ${name}`));
  const rows = all.map((one) => ({
    ...one,
    of: text(one.end_effector, text(one.target, "")),
    per: unitText(text(one.unit)),
    ...Object.fromEntries(names.map((_, i) => [`impulse ${i}`, list(one.impulse_magnitude)[i]])),
    ...(one.undefined ? { "impulse 0": `undefined: ${text(one.undefined)}` } : {}),
  }));
  return [
    fold(
      `Sensitivities of the impulse to uncertain parameters (${all.length})`,
      element(
        "p",
        { class: "small" },
        "Change of the impulse's magnitude and of the base's motion per unit of each parameter. Units differ from row to row; a heading sorts by its column, by size.",
      ),
      ...describedTable("Sensitivities", notes, rows, { heads, sizes: true, sortBy: "impulse 0" }),
    ),
  ];
}
