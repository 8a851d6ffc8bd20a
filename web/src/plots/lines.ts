// Construction of lines from series, for the catalogs of plots.
import { columnHead } from "../format";
import type { NamedRoles } from "../roles";
import type { Run, Series } from "../run";
import { magnitudes } from "./kinematics";
import { lazily, type Line } from "./spec";

export interface Context {
  run: Run;
  index: number; // of the run in the report
  planar: boolean;
  used: Set<string>; // paths that any plot displays
  roles: NamedRoles;
}

export const kAxes = ["x", "y", "z"];

// x red, y green, z blue, as in the replay.
export function axisStyle(component: number): { color: string } {
  return { color: `axis ${kAxes[component]}` };
}

export function take(context: Context, path: string): Series | undefined {
  context.used.add(path);
  return context.run.series(path);
}

interface LineOptions {
  label: string;
  color?: string;
  dash?: number[];
  width?: number;
  hidden?: boolean;
}

export function componentLine(context: Context, series: Series, component: number, options: LineOptions): Line {
  const name = series.components[component];
  const path = series.width > 1 ? `${series.path}/${name}` : series.path;
  return derivedLine(context, path, series.unit, options, () => column(series.data, series.width, component));
}

export function derivedLine(
  context: Context,
  key: string,
  unit: string,
  options: LineOptions,
  values: () => Float64Array,
): Line {
  return {
    key,
    label: options.label,
    unit,
    column: columnHead(key, unit),
    run: context.index,
    color: options.color ?? "step 0",
    dash: options.dash ?? [],
    width: options.width ?? 1.5,
    hidden: options.hidden,
    values: lazily(values),
  };
}

export function column(data: ArrayLike<number>, width: number, component: number): Float64Array {
  const result = new Float64Array(Math.floor(data.length / width));
  for (let i = 0; i < result.length; ++i) result[i] = data[i * width + component];
  return result;
}

// x, y, z; for planar motion x and y, or z for rotations.
export function components(context: Context, rotation: boolean): number[] {
  return context.planar ? (rotation ? [2] : [0, 1]) : [0, 1, 2];
}

export function vectorLines(context: Context, series: Series | undefined, rotation: boolean): Line[] {
  if (!series) return [];
  return components(context, rotation).map((c) =>
    componentLine(context, series, c, { label: kAxes[c], ...axisStyle(c) }),
  );
}

export function isZero(series: Series | undefined): boolean {
  return !series || series.data.every((value) => value === 0 || Number.isNaN(value));
}

export function magnitudeLine(context: Context, series: Series, options: LineOptions): Line {
  return derivedLine(context, `${series.path}/magnitude`, series.unit, options, () =>
    magnitudes(series.data, series.width),
  );
}
