// Shaded intervals: the phases of the first run; the contacts of a second run, if they begin at other times; for each
// run the interval beyond validity, after bodies overlap.
import { kBeyond } from "../colors";
import type { Run } from "../run";

export interface Shade {
  name: string;
  begin: number; // [s]
  end: number;
}

export function shades(runs: Run[]): Shade[] {
  const first: Shade[] = runs[0]?.phases ?? [];
  const begins = new Set(first.map((phase) => phase.begin));
  const others = runs
    .slice(1)
    .flatMap((run) =>
      run.phases
        .filter((phase) => phase.name.startsWith("contact") && !begins.has(phase.begin))
        .map((phase) => ({ name: `${phase.name} ${run.data.label}`, begin: phase.begin, end: phase.begin })),
    );
  const beyond = runs
    .filter((run) => run.validUntil !== null && run.validUntil < run.end)
    .map((run) => ({ name: `${kBeyond} ${run.data.label}`.trim(), begin: run.validUntil!, end: run.end }));
  return [...first, ...others, ...beyond];
}
