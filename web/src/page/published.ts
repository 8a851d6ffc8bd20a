// The thesis's result for the same capture, and the result that conserves momentum.
import { element } from "../dom";
import { number } from "../format";
import { list, num, size, text, withUnit, type PartlySummary } from "./read";
import { absent, fold, pairs, table, vectorCell, type Column } from "./table";

export function publishedSection(s: PartlySummary): HTMLElement[] {
  const impact = s.impact;
  if (!impact) return [absent("This run has no impact.")];
  const published = impact.as_published;
  if (!published)
    return [
      fold(
        "Not defined for this impact",
        element("p", {}, `Why: ${text(impact.as_published_absent, "the summary does not say")}.`),
      ),
    ];
  const columns: Column[] = [
    { head: "End-effector" },
    { head: "Impulse, consistent", unit: "N s", numeric: true },
    { head: "Impulse, as published", unit: "N s", numeric: true },
    { head: "Difference", unit: "%", numeric: true },
    { head: "Consistent", unit: "N s" },
    { head: "As published", unit: "N s" },
  ];
  const rows = list(published.grasps).map((one) => {
    const own = list(impact.grasps).find((grasp) => grasp.end_effector === one.end_effector);
    const consistent = num(own?.impulse_magnitude);
    const as = num(one.impulse_magnitude) ?? size(one.impulse);
    const part = consistent !== null && as !== null && consistent > 0 ? (100 * (as - consistent)) / consistent : null;
    return [
      text(one.end_effector),
      number(consistent),
      number(as),
      number(part, 3),
      vectorCell(own?.impulse),
      vectorCell(one.impulse),
    ];
  });
  return [
    element(
      "p",
      { class: "lead" },
      "Consistent: all impulses act at one point and total momentum is conserved. As published: the thesis's equations (3.8)–(3.13), which assume zero momentum of the robot after the impact, although it received the impulse; the momentum error is listed below.",
    ),
    table("Impulses, consistent and as published", columns, rows),
    pairs([
      [
        "linear momentum error as published",
        errorText(published.linear_momentum_error, published.relative_linear_momentum_error, "N s"),
      ],
      [
        "angular momentum error as published",
        errorText(published.angular_momentum_error, published.relative_angular_momentum_error, "N m s"),
      ],
    ]),
  ];
}

function errorText(value: unknown, relative: unknown, unit: string): string {
  const part = num(relative) !== null ? ` (${number(100 * num(relative)!, 3)} % of the ledger's scale)` : "";
  return `${withUnit(num(value), unit)}${part}`;
}
