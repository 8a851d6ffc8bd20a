// A variant beside the base case: verdicts, key numbers, ledger and changed values.
import { element } from "../dom";
import { answers, impactDifferences, otherNumbers } from "../page/compare";
import { ledgerOfBoth } from "../page/ledger";
import { kVariant } from "../page/names";
import { list } from "../page/read";
import { fold, mark } from "../page/table";
import type { Run } from "../run";
import { settingText, succeeds, type Variant } from "./variants";

export function besideBase(base: Run, { run, request, name }: Variant): HTMLElement[] {
  const both = [base, run];
  const warnings = [...list(run.summary.warnings), ...run.data.notes].map((one) => element("li", {}, mark("warn", String(one))));
  const changes = request.overrides.map((one) => element("li", {}, element("code", {}, settingText(one))));
  return [
    element("h3", {}, `${name} beside the base case`),
    element("ul", { class: "wi-changes", "aria-label": "Changed values" }, ...changes),
    ...(warnings.length > 0 ? [element("ul", { class: "wi-changes", "aria-label": "Warnings of the variant" }, ...warnings)] : []),
    ...[impactDifferences(both, kVariant), answers(both, kVariant), otherNumbers(both, kVariant)].filter((one) => one !== null),
    fold("Ledgers of both", ...ledgerOfBoth(base.summary, run.summary, kVariant)),
  ];
}

export function successMark(run: Run): HTMLElement {
  return succeeds(run.summary) ? mark("good", "captured, ledger passes") : mark("bad", run.summary.ledger?.pass === false ? "ledger fails" : "not captured");
}
