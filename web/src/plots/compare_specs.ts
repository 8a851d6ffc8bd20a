// Plots of two runs combined: the first solid, the second dashed; or their difference.
import type { Names } from "../page/names";
import type { Run } from "../run";
import { difference, type Sampled } from "./jumps";
import { lazily, type Limit, type Line, type PlotSpec } from "./spec";

export function overlay(a: PlotSpec[], b: PlotSpec[], [nameA, nameB]: Names): PlotSpec[] {
  const others = new Map(b.map((plot) => [plot.id, plot]));
  const result = a.map((plot) => {
    const other = others.get(plot.id);
    others.delete(plot.id);
    if (!other) return { ...plot, lines: marked(plot.lines, nameA, false), note: joined(plot.note, `Only in ${nameA}.`) };
    const window: [number, number] | undefined =
      plot.window && other.window
        ? [Math.min(plot.window[0], other.window[0]), Math.max(plot.window[1], other.window[1])]
        : plot.window;
    return { ...plot, window, lines: interleaved(plot.lines, other.lines, [nameA, nameB]), limits: joinedLimits([nameA, nameB], plot.limits, other.limits) };
  });
  const onlyB = [...others.values()].map((plot) => ({
    ...plot,
    lines: marked(plot.lines, nameB, true),
    note: joined(plot.note, `Only in ${nameB}.`),
  }));
  return [...result, ...onlyB];
}

// Series that are equal in both runs are shown once.
function joinedLimits([nameA, nameB]: Names, a: Limit[] = [], b: Limit[] = []): Limit[] {
  const alike = (x: Limit, y: Limit) => x.label === y.label && x.value === y.value;
  const both = a.filter((one) => b.some((other) => alike(one, other)));
  const own = (limits: Limit[], run: string) =>
    limits.filter((one) => !both.some((other) => alike(one, other))).map((one) => ({ ...one, label: `${one.label}, ${run}` }));
  return [...both, ...own(a, nameA), ...own(b, nameB)];
}

function joined(...notes: (string | undefined)[]): string {
  return notes.filter(Boolean).join(" ");
}

function marked(lines: Line[], name: string, dashed: boolean): Line[] {
  return lines.map((line) => ({ ...line, label: `${line.label} ${name}`, ...(dashed ? dashedLike(line) : {}) }));
}

// Lines that are already dashed have finer dashes in the second run.
function dashedLike(line: Line): { dash: number[]; width: number } {
  return { dash: line.dash.length > 0 ? [2, 2] : [6, 3], width: line.width };
}

function interleaved(a: Line[], b: Line[], [nameA, nameB]: Names): Line[] {
  const others = new Map(b.map((line) => [line.key, line]));
  const result: Line[] = [];
  for (const line of a) {
    result.push(...marked([line], nameA, false));
    const other = others.get(line.key);
    if (other) result.push(...marked([{ ...other, color: line.color, hidden: line.hidden }], nameB, true));
    others.delete(line.key);
  }
  return [...result, ...marked([...others.values()], nameB, true)];
}

function sampled(run: Run, line: Line): Sampled {
  return { time: run.time, values: line.values(), ranks: run.ranks };
}

// The second minus the first for common lines, at the samples of the first.
export function differences(plot: PlotSpec, runs: Run[], [nameA, nameB]: Names): Line[] {
  return plot.lines
    .filter((line) => line.run === 0)
    .flatMap((line) => {
      const other = plot.lines.find((one) => one.run === 1 && one.key === line.key);
      if (!other) return [];
      const values = lazily(() => difference(sampled(runs[0], line), sampled(runs[1], other)));
      const name = line.label.endsWith(` ${nameA}`) ? line.label.slice(0, -nameA.length - 1) : line.label;
      return [{ ...line, label: name, column: line.column.replace(/( \[|$)/, ` ${nameB}-${nameA}$1`), values }];
    });
}
