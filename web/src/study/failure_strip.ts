// Points without a value in a chart of values: crosses in a strip below the plot area, so that they are not taken for
// points with a small value.
import type * as Plot from "@observablehq/plot";
import { svgElement } from "../dom";

// Height of the strip [px], an inset of the plot area. Crosses are at its middle.
export const kStrip = 16;

// The strip itself, a mark for a plot with these margins.
export function failureStrip(width: number, height: number, margin: { left: number; right: number; bottom: number }): Plot.Markish {
  const strip = (): SVGElement =>
    svgElement("rect", { class: "st-strip", x: margin.left, y: height - margin.bottom - kStrip, width: width - margin.left - margin.right, height: kStrip, fill: "currentColor", "fill-opacity": 0.06 });
  return strip as Plot.Markish;
}
