// A plot's lines as CSV (RFC 4180): time, phase, one column per line with its unit. For two runs, all rows of A, then
// those of B, with a column `run`.
import type { Run } from "../run";
import type { Line } from "./spec";

export interface CsvWindow {
  min: number;
  max: number;
}

export function plotCsv(lines: Line[], runs: Run[], window: CsvWindow | null): string {
  const used = runs.map((_, i) => i).filter((i) => lines.some((line) => line.run === i));
  const keys = [...new Set(lines.map((line) => line.key))];
  const head = keys.map((key) => lines.find((line) => line.key === key)!.column);
  const several = runs.length > 1;
  const rows = [[...(several ? ["run"] : []), "time [s]", "phase", ...head]];
  for (const i of used) {
    const columns = keys.map((key) => lines.find((line) => line.key === key && line.run === i)?.values());
    const { time } = runs[i];
    for (let k = 0; k < time.length; ++k) {
      if (window && (time[k] < window.min || time[k] > window.max)) continue;
      const values = columns.map((column) => (column ? numberText(column[k]) : ""));
      rows.push([...(several ? [runs[i].data.label] : []), String(time[k]), phaseAt(runs[i], k), ...values]);
    }
  }
  return rows.map((row) => row.map(field).join(",")).join("\n") + "\n";
}

function phaseAt(run: Run, sample: number): string {
  return run.phases.find((span) => sample >= span.first && sample <= span.last)?.name ?? "";
}

// The shortest text of a single-precision number: 0.1, not 0.10000000149.
export function numberText(value: number): string {
  if (!Number.isFinite(value)) return Number.isNaN(value) ? "NaN" : value > 0 ? "Inf" : "-Inf";
  const single = Math.fround(value);
  for (let digits = 6; digits <= 9; ++digits) {
    const text = Number(value.toPrecision(digits));
    if (Math.fround(text) === single) return String(text);
  }
  return String(value);
}

// Names come from files: quoted if CSV requires it.
export function field(text: string): string {
  return /[",\r\n]/.test(text) ? `"${text.replace(/"/g, '""')}"` : text;
}
