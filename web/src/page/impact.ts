// The impact: impulses on grasps, impulses that the arms transmit, changes of motion.
import { element } from "../dom";
import { number } from "../format";
import type { ImpactReport } from "../summary_types";
import { list, num, text, withUnit, words, type Partly, type PartlySummary } from "./read";
import { graspTables, profiles, rebounds } from "./grasp_tables";
import { marginsPart } from "./margins";
import { measuresPart } from "./measures";
import { brake, jointPart } from "./passed_on";
import { sensitivitiesPart } from "./sensitivities";
import { absent, changeText, fold, mark, pairs, table, vectorCell, type Cell, type Column } from "./table";

export function impactSection(s: PartlySummary): HTMLElement[] {
  if (!s.impact) return [absent("This run has no impact, or its summary does not list it.")];
  const later = list(s.later_impacts).map((impact, i) =>
    fold(
      `Impact ${i + 2}, at ${withUnit(num(impact.time), "s")}: ${list(impact.grasps)
        .map((grasp) => text(grasp.end_effector))
        .join(", ")}`,
      ...oneImpact(impact),
    ),
  );
  return [...oneImpact(s.impact), ...later, ...releases(s)];
}

function oneImpact(impact: Partly<ImpactReport>): HTMLElement[] {
  return [
    overview(impact),
    ...notes(impact),
    ...graspTables(impact),
    ...rebounds(impact),
    ...profiles(impact),
    ...marginsPart(impact),
    ...jointPart(impact),
    ...brake(impact),
    ...loops(impact),
    ...measuresPart(impact),
    ...sensitivitiesPart(impact),
  ];
}

function overview(impact: Partly<ImpactReport>): HTMLElement {
  const compliant = impact.compliant ?? {};
  const before = num(impact.kinetic_energy_before);
  const after = num(impact.kinetic_energy_after);
  return pairs([
    ["law", words(impact.law)],
    ["time", withUnit(num(impact.time), "s")],
    [impact.law === "compliant" ? "duration" : "duration for mean forces", withUnit(num(impact.duration), "s")],
    ["joints during it", text(impact.joints_during, "")],
    ["kinetic energy", before === null || after === null ? "" : `${number(before)} → ${withUnit(after, "J")}`],
    ["base: change of rate", changeText(impact.base_angular_velocity_change, "rad/s")],
    ["base: change of velocity", changeText(impact.base_velocity_change, "m/s")],
    ["rank of the contact inertia", impact.rows ? `${impact.rank} of ${impact.rows} rows` : ""],
    ["hypothesis of restitution", text(impact.hypothesis, "")],
    [
      "it ended",
      compliant.end
        ? `${words(compliant.end)}; ${withUnit(num(compliant.energy_lost), "J")} lost, ${withUnit(num(compliant.elastic_energy_after), "J")} left in springs`
        : "",
    ],
    ["residual impulse at the end", compliant.end ? withUnit(num(compliant.residual_impulse), "N s") : ""],
  ]);
}

function notes(impact: Partly<ImpactReport>): HTMLElement[] {
  const said: string[] = [];
  const [rank, rows] = [num(impact.rank), num(impact.rows)];
  if (rank !== null && rows !== null && rank < rows) {
    said.push(
      `${rows - rank} of ${rows} impulse components are not determined: closed loops can carry self-stresses. The minimum-norm impulses are shown.`,
    );
  }
  if (impact.unique === false) said.push("The distribution of the impulse over simultaneous contacts is not unique.");
  if (impact.energy_created === true)
    said.push("The impact increases the energy, as a consequence of the selected hypothesis.");
  if (impact.inconsistent) said.push(`No motion has the specified restitution: ${text(impact.inconsistent)}.`);
  const result: HTMLElement[] = said.map((one) => element("p", { class: "remark" }, mark("warn", one)));
  const stresses = list(impact.null_space);
  if (stresses.length > 0) {
    const rows = stresses.flatMap((stress, i) =>
      list(stress.grasps).map((grasp): Cell[] => [
        `${i + 1}`,
        text(grasp.end_effector),
        vectorCell(grasp.impulse),
        vectorCell(grasp.angular_impulse),
      ]),
    );
    const columns: Column[] = [
      { head: "Self-stress" },
      { head: "End-effector" },
      { head: "Impulse", unit: "N s" },
      { head: "Angular impulse", unit: "N m s" },
    ];
    result.push(fold("Self-stresses: impulses that change no velocity", table("Self-stresses", columns, rows)));
  }
  return result;
}

function loops(impact: Partly<ImpactReport>): HTMLElement[] {
  const rows = list(impact.loops).map((loop): Cell[] => [
    text(loop.target),
    list(loop.end_effectors).join(" – "),
    number(num(loop.end_effector_distance)),
    number(num(loop.grasp_point_distance)),
    number(num(loop.gap)),
  ]);
  if (rows.length === 0) return [];
  const columns: Column[] = [
    { head: "Target" },
    { head: "End-effectors" },
    { head: "Their distance", unit: "m", numeric: true },
    { head: "Grasp points' distance", unit: "m", numeric: true },
    { head: "Remaining gap", unit: "m", numeric: true },
  ];
  return [table("Grasps that close loops", columns, rows)];
}

function releases(s: PartlySummary): HTMLElement[] {
  const rows = list(s.releases).map((one): Cell[] => [
    withUnit(num(one.time), "s"),
    list(one.end_effectors).join(", "),
    list(one.targets).flat().join(", "),
  ]);
  return rows.length > 0
    ? [table("Releases", [{ head: "Time" }, { head: "End-effectors" }, { head: "Targets" }], rows)]
    : [];
}
