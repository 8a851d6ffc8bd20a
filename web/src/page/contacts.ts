// Contacts between shapes: the pairs that touched, and the others by name.
import { element } from "../dom";
import * as described from "../summary_types"; // by name: types not yet generated (scripts/tables) cause no error
import { describedTable } from "./described";
import { list, num, type Partly, type PartlySummary } from "./read";
import { absent, fold, mark } from "./table";

type Pair = Partly<described.ContactPairReport>;

export function hasContacts(s: PartlySummary): boolean {
  return list(s.contacts).length > 0;
}

export function contactsSection(s: PartlySummary): HTMLElement[] {
  const all = list(s.contacts);
  if (all.length === 0) return [absent("The summary has no contacts between shapes.")];
  const touching = all.filter(hasTouched);
  const apart = all.filter((one) => !hasTouched(one)).map(bodies);
  const stages = list(s.stages);
  const cells = { bodies, beyond_model: (one: Pair) => (one.beyond_model ? mark("warn", "yes") : "no") };
  return [
    ...(stages.length > 0 ? describedTable("Stages of captures", described.kStagesReport, stages, { few: 20 }) : []),
    ...(touching.some((one) => one.beyond_model)
      ? [element("p", {}, mark("warn", "An overlap was too deep for the contact model: forces of these pairs are not reliable."))]
      : []),
    ...describedTable("Pairs that touched", described.kContactPairReport, touching, { cells, few: 20 }),
    ...describedTable("Impacts of hard pairs", [["bodies", "", "pair of bodies"], ...described.kHardContactReport], touching.filter((one) => one.hard).map(impactsOf), { cells: { bodies }, few: 20 }),
    ...(touching.length === 0 ? [element("p", {}, "No pair touched.")] : []),
    ...(apart.length > 0 ? [fold(`${apart.length === 1 ? "1 pair" : `${apart.length} pairs`} did not touch`, element("p", {}, `${apart.join("; ")}.`))] : []),
  ];
}

function hasTouched(one: Pair): boolean {
  return (num(one.touches) ?? 0) > 0;
}

type Impacts = Partly<described.HardContactReport> & Pick<Pair, "bodies">;

function impactsOf(one: Pair): Impacts {
  return { bodies: one.bodies, ...one.hard };
}

function bodies(one: Pick<Pair, "bodies">): string {
  return list(one.bodies).join(" – ");
}
