// Measures of the configuration for impulses: effective masses, ellipsoids, distances of the line of impulse from the
// centres of mass.
import { element } from "../dom";
import { number } from "../format";
import { kEndEffectorMeasure, kImpactMeasures, type EndEffectorMeasure, type ImpactReport } from "../summary_types";
import { describedPairs, describedTable, without } from "./described";
import { impulseSets } from "./grasp_tables";
import { list, num, text, type Partly } from "./read";
import { fold, table, vectorCell, type Cell } from "./table";

const kMatrices = ["inverse_inertia", "pair_inverse_inertia", "linear_axes", "angular_axes"];

export function measuresPart(impact: Partly<ImpactReport>): HTMLElement[] {
  const measures = impact.measures;
  if (!measures) return [];
  const all = list(measures.end_effectors);
  return [
    element("h3", {}, "Measures of the configuration"),
    ...describedTable("Measures", without(kEndEffectorMeasure, ...kMatrices), all),
    ...describedPairs(without(kImpactMeasures, "base_response"), measures),
    fold("Matrices and ellipsoids", ...all.flatMap(matrices)),
    ...(
      [
        ["zero_disturbance", "Impulses that do not change the base's motion"],
        ["zero_base_angular_velocity", "Impulses that do not change the base's angular velocity"],
      ] as const
    ).flatMap(([key, title]) => impulseSets(title, `${title}: ${list(measures[key]).length} dimensions`, list(measures[key]))),
  ];
}

function matrices(one: Partly<EndEffectorMeasure>): HTMLElement[] {
  const axes = list(one.linear_axes).map((axis, i): Cell[] => [
    `linear ${i + 1}`,
    vectorCell(axis),
    number(num(list(one.linear_mass)[i])),
    "kg",
  ]);
  const turning = list(one.angular_axes).map((axis, i): Cell[] => [
    `angular ${i + 1}`,
    vectorCell(axis),
    number(num(list(one.angular_inertia)[i])),
    "kg m²",
  ]);
  return [
    element("h4", {}, text(one.end_effector)),
    table(
      `Ellipsoids of ${text(one.end_effector)}`,
      [{ head: "Axis" }, { head: "Direction" }, { head: "Semi-axis", numeric: true }, { head: "Unit" }],
      [...axes, ...turning],
    ),
    matrix(
      `Inverse inertia at ${text(one.end_effector)}: twist per impulse, [angular; linear], in W`,
      one.inverse_inertia,
    ),
    matrix("The same relative to the target", one.pair_inverse_inertia),
  ];
}

function matrix(caption: string, rows: number[][] | undefined): HTMLElement {
  const names = ["ωx", "ωy", "ωz", "vx", "vy", "vz"];
  const heads = ["", "angular x", "angular y", "angular z", "x", "y", "z"].map((head, i) => ({ head, numeric: i > 0 }));
  const cells = list(rows).map((row, i): Cell[] => [names[i], ...list(row).map((value) => number(num(value), 3))]);
  return table(caption, heads, cells);
}
