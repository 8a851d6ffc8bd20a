// The colour scale of a success map: vertical beside the map, or horizontal below it on narrow screens.
import * as Plot from "@observablehq/plot";
import { svgElement } from "../dom";
import { css } from "../plots/theme_colors";
import { kStyle } from "../study/scales";

export const kRampWidth = 74; // of the vertical scale [px]
export const kProbabilityColor: Plot.ScaleOptions = { type: "linear", scheme: "viridis", domain: [0, 1] };

const kSteps = 50;
const [kTop, kBottom] = [26, 44]; // as the map's margins [px]

export function uprightRamp(title: string, height: number): SVGSVGElement {
  const apply = Plot.scale({ color: kProbabilityColor })!.apply;
  const ink = css("--ink");
  const long = height - kTop - kBottom;
  const at = (p: number): number => kTop + (1 - p) * long;
  const svg = svgElement("svg", { width: kRampWidth, height, viewBox: `0 0 ${kRampWidth} ${height}`, "font-size": 12, fill: ink, role: "img", "aria-label": `Colours: ${title} from 0 to 1` });
  for (let k = 0; k < kSteps; ++k) svg.append(svgElement("rect", { x: 4, y: at((k + 1) / kSteps), width: 14, height: long / kSteps + 0.5, fill: String(apply((k + 0.5) / kSteps)) }));
  for (const p of [0, 0.2, 0.4, 0.6, 0.8, 1]) {
    svg.append(svgElement("path", { d: `M18,${at(p)}h5`, stroke: ink }));
    svg.append(svgElement("text", { x: 27, y: at(p) + 4 }, p.toFixed(1)));
  }
  svg.append(svgElement("text", { transform: `translate(64,${at(0.5)}) rotate(-90)`, "text-anchor": "middle", "font-weight": 600 }, title));
  return svg;
}

export function flatRamp(title: string, width: number): Node {
  return Plot.legend({ color: { ...kProbabilityColor, label: title }, width: Math.min(320, width - 20), marginLeft: 12, marginRight: 12, ticks: 5, style: kStyle }) as unknown as Node;
}
