// Plots of contacts between shapes: normal forces and depths of all pairs, and the force of each pair.
import { lineStyle } from "../colors";
import { label } from "../format";
import { componentLine, isZero, take, vectorLines, type Context } from "./lines";
import type { PlotSpec } from "./spec";

const kPath = /^contacts\/(.+)--(.+)\/normal_force$/;

// Pairs that never touch have no lines.
export function touchPlots(context: Context): PlotSpec[] {
  const pairs = context.run.all().flatMap((series) => {
    const found = kPath.exec(series.path);
    return found ? [{ path: series.path.slice(0, -"/normal_force".length), a: found[1], b: found[2], name: `${found[1]} – ${found[2]}` }] : [];
  });
  for (const { path } of pairs) for (const name of ["force", "normal_force", "point", "depth", "impacts", "impact_impulse"]) context.used.add(`${path}/${name}`);
  const touching = pairs.filter(({ path }) => !isZero(context.run.series(`${path}/normal_force`)));
  const struck = pairs.filter(({ path }) => !isZero(context.run.series(`${path}/impacts`)));
  const common = (quantity: string, title: string, unit: string, among = touching): PlotSpec => ({
    id: `contacts-${quantity}`,
    group: "Contacts",
    title,
    axis: label(quantity.replace(/_/g, " "), unit),
    unit,
    lines: among.flatMap(({ path, name }, i) => {
      const series = take(context, `${path}/${quantity}`);
      return series ? [componentLine(context, series, 0, { label: name, ...lineStyle(i) })] : [];
    }),
  });
  return [
    common("normal_force", "Normal forces of contacts", "N"),
    common("depth", "Depths of contacts", "m"),
    common("impacts", "Impacts of hard contacts so far", "", struck),
    common("impact_impulse", "Impulses of hard contacts so far", "N s", struck),
    ...touching.flatMap(({ path, a, b }): PlotSpec[] => {
      const series = take(context, `${path}/force`);
      if (!series) return [];
      return [
        {
          id: `contact-force-${a}-${b}`,
          group: "Contacts",
          title: `Contact force of ${a} on ${b}`,
          axis: label("force", series.unit),
          unit: series.unit,
          lines: vectorLines(context, series, false),
        },
      ];
    }),
  ];
}
