// A chart as a file: SVG with explicit colours, or PNG. Always in light colours, for papers.
import { download, svgElement } from "../dom";
import { css } from "../plots/theme_colors";
import { wrapped } from "./parallel_layout";

export interface LegendItem {
  color: string;
  text: string;
  dash?: string;
  shape?: "line" | "dot" | "ring" | "cross";
}

const kCopiedStyles = ["fill", "stroke", "stroke-width", "stroke-dasharray", "stroke-opacity", "fill-opacity", "opacity", "font-size",
  "font-family", "font-weight", "text-anchor", "color", "shape-rendering", "paint-order"];

// All pictures inside `root` at their positions, with the legend above them.
export function composeSvg(root: HTMLElement, title: string, legend: () => LegendItem[]): SVGSVGElement {
  const { dataset } = document.documentElement;
  const theme = dataset.theme;
  // Charts redraw at the event, before the next frame is displayed.
  const turn = (to: string | undefined): void => {
    if (to === undefined) delete dataset.theme;
    else dataset.theme = to;
    window.dispatchEvent(new Event("grapnel-theme"));
  };
  const dark = css("--scheme") === "dark";
  if (dark) turn("light");
  try {
    return compose(root, title, legend());
  } finally {
    if (dark) turn(theme);
  }
}

function compose(root: HTMLElement, title: string, legend: LegendItem[]): SVGSVGElement {
  const frame = root.getBoundingClientRect();
  const out = svgElement("svg", { xmlns: "http://www.w3.org/2000/svg", "font-family": "system-ui, sans-serif", "font-size": 12 });
  const lines = wrapped(title, Math.max(20, Math.floor(frame.width / 7.6)), 4);
  lines.forEach((line, row) => out.append(svgElement("text", { x: 8, y: 18 + 17 * row, "font-size": 13, "font-weight": 600, fill: "#111" }, line)));
  const begin = 11 + 17 * lines.length;
  const top = begin + drawLegend(out, legend, frame.width, begin);
  for (const panel of root.querySelectorAll<HTMLElement>("[data-panel-title]")) {
    const box = panel.getBoundingClientRect();
    const [x, y] = [box.left - frame.left + 8, box.top - frame.top + top + 14];
    out.append(svgElement("text", { x, y, "font-weight": 600, fill: "#333" }, panel.dataset.panelTitle ?? ""));
  }
  for (const picture of root.querySelectorAll<SVGSVGElement | HTMLCanvasElement>("svg, canvas")) {
    if (picture.parentElement?.closest("svg") || picture.closest("[data-no-export]")) continue;
    const box = picture.getBoundingClientRect();
    if (box.width === 0) continue;
    const place = { x: box.left - frame.left, y: box.top - frame.top + top, width: box.width, height: box.height };
    out.append(picture instanceof HTMLCanvasElement ? svgElement("image", { ...place, href: picture.toDataURL() }) : placed(picture, place));
  }
  const [width, height] = [Math.ceil(frame.width + 12), Math.ceil(frame.height + top + 8)];
  for (const [name, value] of Object.entries({ width, height, viewBox: `0 0 ${width} ${height}` })) out.setAttribute(name, String(value));
  out.prepend(svgElement("rect", { width, height, fill: "#fff" }));
  return out;
}

function placed(picture: SVGSVGElement, place: Record<string, number>): SVGSVGElement {
  const copy = picture.cloneNode(true) as SVGSVGElement;
  const pairs: [Element, Element][] = [[picture, copy]];
  for (let pair = pairs.pop(); pair; pair = pairs.pop()) {
    const [from, to] = pair;
    const style = getComputedStyle(from);
    to.removeAttribute("class");
    to.removeAttribute("style");
    for (const name of kCopiedStyles) to.setAttribute(name, style.getPropertyValue(name));
    for (let k = 0; k < from.children.length; ++k) pairs.push([from.children[k], to.children[k]]);
  }
  for (const style of copy.querySelectorAll("style")) style.remove();
  copy.setAttribute("overflow", "visible");
  for (const [name, value] of Object.entries(place)) copy.setAttribute(name, String(value));
  return copy;
}

// Returns the height used.
function drawLegend(out: SVGSVGElement, legend: LegendItem[], width: number, top: number): number {
  let [x, y] = [8, top + 10];
  for (const item of legend) {
    const wide = 34 + item.text.length * 6.6;
    if (x + wide > width && x > 8) [x, y] = [8, y + 18];
    if (item.shape === "dot") out.append(svgElement("circle", { cx: x + 10, cy: y - 4, r: 4, fill: item.color }));
    else if (item.shape === "ring") out.append(svgElement("circle", { cx: x + 10, cy: y - 4, r: 4, fill: "none", stroke: item.color, "stroke-width": 1.8 }));
    else if (item.shape === "cross") out.append(svgElement("path", { d: `M${x + 6},${y - 8}l8,8m0,-8l-8,8`, stroke: item.color, "stroke-width": 1.5 }));
    else out.append(svgElement("path", { d: `M${x},${y - 4}h20`, stroke: item.color, "stroke-width": 2, "stroke-dasharray": item.dash ?? "" }));
    out.append(svgElement("text", { x: x + 26, y, fill: "#333" }, item.text));
    x += wide;
  }
  return legend.length > 0 ? y - top + 12 : 0;
}

export function svgText(svg: SVGSVGElement): string {
  return `<?xml version="1.0" encoding="UTF-8"?>\n${new XMLSerializer().serializeToString(svg)}\n`;
}

export async function downloadPng(name: string, svg: SVGSVGElement, scale = 2): Promise<void> {
  const picture = new Image();
  picture.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svgText(svg))}`;
  await picture.decode();
  const canvas = document.createElement("canvas");
  canvas.width = Number(svg.getAttribute("width")) * scale;
  canvas.height = Number(svg.getAttribute("height")) * scale;
  canvas.getContext("2d")?.drawImage(picture, 0, 0, canvas.width, canvas.height);
  const blob = await new Promise<Blob | null>((done) => canvas.toBlob(done, "image/png"));
  if (blob) download(name, blob);
}

export function fileName(...parts: string[]): string {
  return parts.join(" ").toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-|-$/g, "").slice(0, 80) || "chart";
}
