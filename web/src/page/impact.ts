// The impact: impulses on grasps, impulses that the arms transmit, changes of motion.
import { element } from "../dom";
import { kCompliantReport, kImpactReport, kLoopGap, kLossReport, kReleaseReport, kRetainedModes, kSlipReport, type ImpactReport } from "../summary_types";
import { describedPairs, describedTable, without } from "./described";
import { graspTables, impulseSets } from "./grasp_tables";
import { marginsPart } from "./margins";
import { measuresPart } from "./measures";
import { brake, jointPart } from "./passed_on";
import { list, num, text, withUnit, type Partly, type PartlySummary } from "./read";
import { sensitivitiesPart } from "./sensitivities";
import { absent, fold, mark } from "./table";

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
  return [
    ...oneImpact(s.impact),
    ...later,
    ...describedTable("Grasps that slipped", kSlipReport, list(s.slips)),
    ...describedTable("Grasps lost under load", kLossReport, list(s.losses)),
    ...describedTable("Releases", kReleaseReport, list(s.releases)),
  ];
}

function oneImpact(impact: Partly<ImpactReport>): HTMLElement[] {
  return [
    ...describedPairs(without(kImpactReport, ...kElsewhere), impact),
    ...notes(impact),
    ...graspTables(impact),
    ...(impact.compliant ? [element("h3", {}, "Compliant impact"), ...describedPairs(kCompliantReport, impact.compliant)] : []),
    ...marginsPart(impact),
    ...jointPart(impact),
    ...brake(impact),
    ...describedTable("Grasps that close loops", kLoopGap, list(impact.loops)),
    ...describedTable("Impulses with the slowest flexible modes only", kRetainedModes, list(impact.by_modes)),
    ...measuresPart(impact),
    ...sensitivitiesPart(impact),
  ];
}

// Fields with a sentence, table or section that the page shows separately.
const kElsewhere = ["joint_names", "joint_velocity_change", "as_published_absent", "show_as_published", "unique", "energy_created", "inconsistent"];

function notes(impact: Partly<ImpactReport>): HTMLElement[] {
  const remarks: string[] = [];
  const [rank, rows] = [num(impact.rank), num(impact.rows)];
  if (rank !== null && rows !== null && rank < rows) {
    remarks.push(
      `${rows - rank} of ${rows} impulse components are not determined: closed loops can carry self-stresses. The minimum-norm impulses are shown.`,
    );
  }
  if (impact.unique === false) remarks.push("The distribution of the impulse over simultaneous contacts is not unique.");
  if (impact.energy_created === true)
    remarks.push("The impact increases the energy, as a consequence of the selected hypothesis.");
  if (impact.inconsistent) remarks.push(`No motion has the specified restitution: ${text(impact.inconsistent)}.`);
  return [
    ...remarks.map((one) => element("p", { class: "remark" }, mark("warn", one))),
    ...impulseSets("Self-stresses", "Self-stresses: impulses that change no velocity", list(impact.null_space)),
  ];
}
