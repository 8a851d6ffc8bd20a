// Measures of the configuration for impulses: effective masses, ellipsoids, distances of the line of impulse from the
// centres of mass.
import { element } from "../dom";
import { number } from "../format";
import type { EndEffectorMeasure, ImpactMeasures, ImpactReport } from "../summary_types";
import { list, num, text, type Partly } from "./read";
import { fold, pairs, table, vectorCell, type Cell, type Column } from "./table";

const kColumns: Column[] = [
  { head: "End-effector" },
  {
    head: "Impulse index",
    unit: "kg",
    numeric: true,
    title: "impulse of a point contact that stops all of the present relative velocity, per speed",
  },
  { head: "Effective mass, robot", unit: "kg", numeric: true },
  { head: "Effective mass, pair", unit: "kg", numeric: true },
  { head: "Distance from the robot's centre of mass", unit: "m", numeric: true },
  { head: "Distance from the system's centre of mass", unit: "m", numeric: true },
  { head: "Impulse ellipsoid", unit: "kg" },
  { head: "Angular impulse ellipsoid", unit: "kg m²" },
];

export function measuresPart(impact: Partly<ImpactReport>): HTMLElement[] {
  const measures = impact.measures;
  if (!measures) return [];
  const rows = list(measures.end_effectors).map((one): Cell[] => [
    text(one.end_effector),
    number(num(one.impulse_index)),
    number(num(one.robot_effective_mass)),
    number(num(one.pair_effective_mass)),
    number(num(one.miss_of_robot_com)),
    number(num(one.miss_of_system_com)),
    vectorCell(one.linear_mass),
    vectorCell(one.angular_inertia),
  ]);
  return [
    element("h3", {}, "Measures of the configuration"),
    table("Measures", kColumns, rows),
    pairs([
      [
        "impulse of all grasps together",
        `largest ${number(num(measures.largest_impulse))}, smallest ${number(num(measures.smallest_impulse))}, present motion ${number(num(measures.coupled_index))} (1: as against an immovable robot)`,
      ],
      ["distance of the resultant impulse from the robot's centre of mass", withMeters(measures.miss_of_robot_com)],
      ["distance from the system's centre of mass", withMeters(measures.miss_of_system_com)],
    ]),
    fold("Matrices and ellipsoids", ...list(measures.end_effectors).flatMap(matrices)),
    ...subspaces(measures),
  ];
}

function withMeters(value: unknown): string {
  return num(value) === null ? "" : `${number(num(value))} m`;
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

function subspaces(measures: Partly<ImpactMeasures>): HTMLElement[] {
  return (
    [
      ["zero_disturbance", "Impulses that do not change the base's motion"],
      ["zero_base_angular_velocity", "Impulses that do not change the base's angular velocity"],
    ] as const
  ).flatMap(([key, title]) => {
    const basis = list(measures[key]);
    if (basis.length === 0) return [];
    const rows = basis.flatMap((one, i) =>
      list(one.grasps).map((grasp): Cell[] => [
        String(i + 1),
        text(grasp.end_effector),
        vectorCell(grasp.impulse),
        vectorCell(grasp.angular_impulse),
      ]),
    );
    const columns: Column[] = [
      { head: "Base vector" },
      { head: "End-effector" },
      { head: "Impulse", unit: "N s" },
      { head: "Angular impulse", unit: "N m s" },
    ];
    return [fold(`${title}: ${basis.length} dimensions`, table(title, columns, rows))];
  });
}
