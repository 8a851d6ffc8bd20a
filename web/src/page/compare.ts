// Two runs: their key numbers side by side.
import { element } from "../dom";
import { number, unitText } from "../format";
import type { Run } from "../run";
import { keyFacts, type Fact } from "./facts";
import { text } from "./read";
import { scenarioDifferences } from "./scenario";
import { shortVerdicts } from "./verdict";
import { mark, table, type Cell, type Column } from "./table";

export function differingScenarios(runs: Run[]): HTMLElement {
  const [a, b] = runs.map((run) => run.summary ?? {});
  const same = a.scenario?.sha256 !== undefined && a.scenario?.sha256 === b.scenario?.sha256;
  const columns: Column[] = [{ head: "" }, { head: "A" }, { head: "B" }];
  const rows: Cell[][] = [
    ["Scenario", text(a.scenario?.name), text(b.scenario?.name)],
    ["SHA-256", code(a.scenario?.sha256), code(b.scenario?.sha256)],
    ["Grapnel", text(a.version), text(b.version)],
    ["Impact law", text(a.impact?.law), text(b.impact?.law)],
    ["Result folder", text(runs[0].data.folder), text(runs[1].data.folder)],
  ];
  const said = same ? "Both ran the same scenario, byte for byte." : "The scenarios differ:";
  return element("div", {}, table("What was compared", columns, rows), element("p", {}, said), ...(same ? [] : scenarioDifferences(runs)));
}

function code(value: unknown): Cell {
  const full = text(value);
  return element("code", { title: full }, full.slice(0, 16));
}

// The verdicts of A and B on capture, conservation and feasibility.
export function answers(runs: Run[]): HTMLElement {
  const [a, b] = runs.map((run) => shortVerdicts(run.summary ?? {}));
  const answer = (one: (typeof a)[number]) =>
    element("span", {}, mark(one.tone, one.word), element("span", { class: "said-below" }, one.said));
  return table(
    "Verdicts",
    [{ head: "" }, { head: "A" }, { head: "B" }],
    a.map((one, i): Cell[] => [one.question, answer(one), answer(b[i])]),
  );
}

export function keyNumbers(runs: Run[]): HTMLElement {
  const [a, b] = runs.map(keyFacts);
  const keys = a.map((fact) => fact.key);
  b.forEach((fact, i) => {
    // Rows that exist only in B keep their position in B.
    if (!keys.includes(fact.key)) keys.splice(i > 0 ? keys.indexOf(b[i - 1].key) + 1 : 0, 0, fact.key);
  });
  const columns: Column[] = [
    { head: "Quantity" },
    { head: "A", numeric: true },
    { head: "B", numeric: true },
    { head: "B − A", numeric: true },
    { head: "Change", unit: "%", numeric: true },
    { head: "Unit" },
  ];
  const rows = keys.map((key) =>
    row(
      a.find((fact) => fact.key === key),
      b.find((fact) => fact.key === key),
    ),
  );
  return table("Key numbers", columns, rows);
}

function row(a: Fact | undefined, b: Fact | undefined): Cell[] {
  const one = (a ?? b)!;
  const both = a?.value !== null && a?.value !== undefined && b?.value !== null && b?.value !== undefined;
  const step = both ? b.value! - a.value! : null;
  const relative = step !== null && a!.value !== 0 && !one.percent ? (100 * step) / Math.abs(a!.value!) : null;
  return [
    one.name,
    cell(a),
    cell(b),
    step === null ? null : number(step),
    relative === null ? null : number(relative, 3),
    unitText(one.unit),
  ];
}

function cell(fact: Fact | undefined): Cell {
  if (!fact) return "absent";
  const shown = element("span", { title: fact.detail }, number(fact.value));
  if (fact.tone) shown.append(" ", mark(fact.tone, (fact.word ?? "").replace(/:$/, "")));
  return shown;
}
