// Plots that show a series as recorded, under a plain name: the orbit, flexible parts, couplings, tendons; and
// series that this viewer does not know, from a newer version.
import { lineStyle } from "../colors";
import { label } from "../format";
import { words } from "../page/read";
import type { Series } from "../run";
import { axisStyle, componentLine, isZero, kAxes, take, type Context } from "./lines";
import type { PlotSpec } from "./spec";

interface Named {
  path: RegExp; // its first group is a name
  group: string;
  title: (name: string) => string;
  axis: string;
  id?: string;
}

const kNamed: Named[] = [
  { path: /^(base)\/orbital_position$/, group: "Orbit", title: () => "Base position in the orbit's axes", axis: "position", id: "orbit-base" },
  { path: /^(base)\/orbital_velocity$/, group: "Orbit", title: () => "Base velocity in the orbit's axes", axis: "velocity" },
  { path: /^targets\/(.+)\/orbital_position$/, group: "Orbit", title: (name) => `Position in the orbit's axes, ${name}`, axis: "position" },
  { path: /^targets\/(.+)\/orbital_velocity$/, group: "Orbit", title: (name) => `Velocity in the orbit's axes, ${name}`, axis: "velocity" },
  { path: /^orbit\/radius$/, group: "Orbit", title: () => "Distance from the central body's centre", axis: "distance" },
  { path: /^orbit\/radial$/, group: "Orbit", title: () => "Radial direction of the orbit, outward", axis: "component in W" },
  { path: /^orbit\/along_track$/, group: "Orbit", title: () => "Along-track direction of the orbit", axis: "component in W" },
  { path: /^elastic\/deflection$/, group: "Flexible parts", title: () => "Deflection of flexible links and gears", axis: "deflection", id: "elastic-deflection" },
  { path: /^elastic\/velocity$/, group: "Flexible parts", title: () => "Rate of deflection of flexible links and gears", axis: "rate" },
  { path: /^system\/elastic_energy$/, group: "Energy", title: () => "Elastic energy of flexible links and gears", axis: "energy" },
  { path: /^couplings\/effort$/, group: "Torques", title: () => "Efforts of couplings on the joints that follow", axis: "effort" },
  { path: /^tendons\/tension$/, group: "Torques", title: () => "Tension of the tendons", axis: "tension" },
  { path: /^tendons\/excursion$/, group: "Torques", title: () => "Excursion of the tendons", axis: "excursion" },
  { path: /^gyros\/rotor_rate$/, group: "Control", title: () => "Rotor rates of the gyros", axis: "rate in the gimbal" },
  { path: /^gyros\/spin_torque$/, group: "Control", title: () => "Rotor motors of the gyros", axis: "torque" },
  { path: /^gyros\/momentum$/, group: "Control", title: () => "Angular momentum of the gyros", axis: "angular momentum" },
  { path: /^base\/internal_angular_momentum$/, group: "Momentum", title: () => "Angular momentum of wheels and gyros", axis: "angular momentum" },
];

export const kPlainGroups = ["Orbit", "Flexible parts"];

export function plainPlots(context: Context): PlotSpec[] {
  const series = context.run.all();
  return kNamed.flatMap(({ path, group, title, axis, id }) =>
    series.flatMap((one) => {
      const found = path.exec(one.path);
      const known = found && take(context, one.path);
      if (!known || isZero(known)) return [];
      return [plot(context, known, { id: id ?? one.path.replace(/\//g, "-"), group, title: title(found[1] ?? ""), axis })];
    }),
  );
}

// Series that no other plot shows.
export function otherPlots(context: Context): PlotSpec[] {
  context.used.add("system/center_of_mass");
  return context.run
    .all()
    .filter((series) => !context.used.has(series.path) && !/^links\/|quaternion_wxyz$/.test(series.path) && !isZero(series))
    .map((series) => {
      const parts = series.path.split("/").map(words);
      const quantity = parts[parts.length - 1];
      return plot(context, series, { id: `other-${series.path}`, group: "Other", title: plainTitle(parts), axis: quantity });
    });
}

// "Measured force, left" for a path like "grippers/left/measured_force".
function plainTitle(parts: string[]): string {
  const quantity = parts[parts.length - 1];
  const of = parts.length > 1 ? `, ${parts.slice(parts.length > 2 ? 1 : 0, -1).join(" ")}` : "";
  return `${quantity.charAt(0).toUpperCase()}${quantity.slice(1)}${of}`;
}

function plot(context: Context, series: Series, about: Pick<PlotSpec, "id" | "group" | "title"> & { axis: string }): PlotSpec {
  const lines = series.components.map((name, c) =>
    componentLine(context, series, c, {
      label: name === "" ? about.title : words(name),
      ...(kAxes.includes(name) ? axisStyle(kAxes.indexOf(name)) : lineStyle(c)),
    }),
  );
  return { ...about, axis: label(about.axis, series.unit), unit: series.unit, lines, note: series.description };
}
