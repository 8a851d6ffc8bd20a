// Two runs: their key numbers side by side.
import { element } from "../dom";
import { number, quiet, unitText } from "../format";
import type { Run } from "../run";
import { keyFacts, type Fact } from "./facts";
import { differenceName, kComparison, type Names } from "./names";
import { list, text } from "./read";
import { scenarioDifferences } from "./scenario";
import { absent, mark, table, type Cell, type Column } from "./table";
import { answerMark, kNoVerdicts } from "./verdict";

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
  const explanation = same ? "Both ran the same scenario, byte for byte." : "The scenarios differ:";
  return element("div", {}, table("What was compared", columns, rows), element("p", {}, explanation), ...(same ? [] : scenarioDifferences(runs)));
}

function code(value: unknown): Cell {
  const full = text(value);
  return element("code", { title: full }, full.slice(0, 16));
}

// The verdicts of both, one row per question.
export function answers(runs: Run[], names: Names = kComparison): HTMLElement {
  const [a, b] = runs.map((run) => list(run.summary?.verdicts));
  const questions = [...new Set([...a, ...b].map((one) => text(one.question)))];
  if (questions.length === 0) return absent(kNoVerdicts);
  const answer = (all: typeof a, question: string) => {
    const one = all.find((one) => one.question === question) ?? {};
    return element("span", {}, answerMark(one), element("span", { class: "said-below" }, text(one.sentence, "")));
  };
  return table(
    "Verdicts",
    [{ head: "" }, { head: names[0] }, { head: names[1] }],
    questions.map((question): Cell[] => [question, answer(a, question), answer(b, question)]),
  );
}

// Rounding errors are no difference.
export function difference(a: number, b: number): number {
  return quiet(b - a, Math.max(Math.abs(a), Math.abs(b)));
}

// What the impact did differently: a comparison begins with it.
const kOfImpact = /^(impulse|mean force|peak force) |^(energy|base rate)$/;

export function impactDifferences(runs: Run[], names: Names = kComparison): HTMLElement | null {
  return runs.some((run) => run.summary?.impact) ? numbers("Differences at the impact", runs, names, (fact) => kOfImpact.test(fact.key)) : null;
}
export function otherNumbers(runs: Run[], names: Names = kComparison): HTMLElement {
  const impact = runs.some((run) => run.summary?.impact);
  return numbers(impact ? "Other key numbers" : "Key numbers", runs, names, (fact) => !impact || !kOfImpact.test(fact.key));
}

function numbers(caption: string, runs: Run[], names: Names, wanted: (fact: Fact) => boolean): HTMLElement {
  const [a, b] = runs.map((run) => keyFacts(run).filter(wanted));
  const keys = a.map((fact) => fact.key);
  b.forEach((fact, i) => {
    // Rows that exist only in B keep their position in B.
    if (!keys.includes(fact.key)) keys.splice(i > 0 ? keys.indexOf(b[i - 1].key) + 1 : 0, 0, fact.key);
  });
  const columns: Column[] = [
    { head: "Quantity" },
    { head: names[0], numeric: true },
    { head: names[1], numeric: true },
    { head: differenceName(names), numeric: true },
    { head: "Change", unit: "%", numeric: true },
    { head: "Unit" },
  ];
  const rows = keys.map((key) =>
    row(
      a.find((fact) => fact.key === key),
      b.find((fact) => fact.key === key),
    ),
  );
  return table(caption, columns, rows);
}

function row(a: Fact | undefined, b: Fact | undefined): Cell[] {
  const one = (a ?? b)!;
  const both = a?.value !== null && a?.value !== undefined && b?.value !== null && b?.value !== undefined;
  const step = both ? difference(a.value!, b.value!) : null;
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
