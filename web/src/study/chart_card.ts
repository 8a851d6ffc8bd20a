// The frame of every chart: title, controls, picture, legend, and downloads.
import { download, element } from "../dom";
import { roving } from "../roving";
import { composeSvg, downloadPng, fileName, type LegendItem, svgText } from "./export";
import { breakable } from "./describe";
import { button } from "./ui";

export interface ChartCard {
  root: HTMLElement;
  controls: HTMLElement; // above the picture
  body: HTMLElement; // the picture
  note: HTMLElement; // below it: what is left out, and why
  setTitle(text: string): void;
  setLegend(items: LegendItem[]): void;
}

export interface ChartCardSpec {
  id: string; // of the section, and in window.__grapnel
  title: string;
  study: string; // in file names
  csv: () => string; // description of the picture
}

export function chartCard(spec: ChartCardSpec): ChartCard {
  const heading = element("h2", { class: "st-card-title" }, spec.title);
  const controls = element("div", { class: "st-controls" });
  const legendBox = element("div", { class: "st-legend" });
  const body = element("div", { class: "st-chart" });
  const note = element("p", { class: "st-note" });
  let legend: LegendItem[] = [];
  const name = (ending: string): string => `${fileName(spec.study, spec.id)}.${ending}`;
  const picture = (): SVGSVGElement => composeSvg(body, `${(heading.textContent ?? "").replace(/\u200b/g, "")} – ${spec.study}`, () => legend);
  const downloads = element(
    "div",
    { class: "st-downloads", role: "toolbar", "aria-label": `Download ${spec.title}` },
    button("SVG", () => download(name("svg"), svgText(picture()), "image/svg+xml"), { title: "Download as SVG, in light colours" }),
    button("PNG", () => void downloadPng(name("png"), picture()), { title: "Download as PNG, in light colours" }),
    button("CSV", () => download(name("csv"), spec.csv(), "text/csv"), { title: "Download the numbers shown" }),
  );
  const root = element(
    "section",
    { class: "card st-card", id: `study-${spec.id}`, "aria-label": spec.title },
    element("div", { class: "st-card-head" }, heading, downloads),
    controls,
    legendBox,
    body,
    note,
  );
  roving(downloads);
  new MutationObserver(() => unnamedParts(body)).observe(body, { childList: true, subtree: true });
  return {
    root,
    controls,
    body,
    note,
    setTitle: (text) => (heading.textContent = breakable(text)),
    setLegend: (items) => {
      legend = items;
      legendBox.replaceChildren(...items.map(legendEntry));
    },
  };
}

// For screen readers a chart is one picture with one name; groups of marks have none.
function unnamedParts(body: HTMLElement): void {
  for (const part of body.querySelectorAll("svg g[aria-label]:not([role])")) part.removeAttribute("aria-label");
}

function legendEntry(item: LegendItem): HTMLElement {
  const mark = element("span", { class: `st-mark st-mark-${item.shape ?? "line"}`, "aria-hidden": "true" });
  mark.style.color = item.color; // not by setAttribute: the page's policy may forbid style attributes
  if (item.shape === "cross") mark.textContent = "×";
  if (item.dash) mark.classList.add(parseFloat(item.dash) <= 2 ? "st-mark-dotted" : "st-mark-dashed");
  return element("span", { class: "st-legend-item" }, mark, item.text);
}
