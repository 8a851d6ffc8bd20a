// Interactive points on a picture: hovering describes the nearest one, a click selects it, a ring marks the selected
// one.
import { svgElement } from "../dom";
import { hideTooltip, showTooltip } from "./tooltip";
import type { StudyState } from "./state";

export class Spots {
  readonly point: number[] = [];
  readonly x: number[] = []; // pixels from the picture's corner
  readonly y: number[] = [];

  add(point: number, x: number, y: number): void {
    this.point.push(point);
    this.x.push(x);
    this.y.push(y);
  }

  // Index of the nearest point within reach; -1: none.
  nearest(x: number, y: number, reach: number): number {
    let best = -1;
    let least = reach * reach;
    for (let k = 0; k < this.x.length; ++k) {
      const distance = (this.x[k] - x) ** 2 + (this.y[k] - y) ** 2;
      if (distance < least) [best, least] = [k, distance];
    }
    return best;
  }
}

export interface Pointable {
  svg: SVGSVGElement;
  spots: Spots;
  state: StudyState;
  describe: (point: number, spot: number) => string[];
  reach?: number; // [px]
}

// Returns the function that redraws the ring of the selected point.
export function makePointable({ svg, spots, state, describe, reach = 28 }: Pointable): () => void {
  const hover = svgElement("circle", { class: "st-hover", r: 6, fill: "none", visibility: "hidden" });
  const rings = svgElement("g", { class: "st-rings" });
  svg.append(rings, hover);
  const at = (event: PointerEvent | MouseEvent): number => {
    const box = svg.getBoundingClientRect();
    return spots.nearest(event.clientX - box.left, event.clientY - box.top, reach);
  };
  svg.addEventListener("pointermove", (event) => {
    const k = at(event);
    svg.style.cursor = k < 0 ? "" : "pointer";
    if (k < 0) return leave();
    hover.setAttribute("cx", String(spots.x[k]));
    hover.setAttribute("cy", String(spots.y[k]));
    hover.setAttribute("visibility", "visible");
    if (event.pointerType !== "touch") showTooltip(describe(spots.point[k], k), event.clientX, event.clientY);
  });
  const leave = (): void => {
    hover.setAttribute("visibility", "hidden");
    hideTooltip();
  };
  svg.addEventListener("pointerleave", leave);
  svg.addEventListener("click", (event) => {
    const k = at(event);
    if (k >= 0) state.select(spots.point[k]);
  });
  const ring = (): void => {
    rings.replaceChildren();
    if (state.selected === null) return;
    for (let k = 0; k < spots.point.length; ++k) {
      if (spots.point[k] !== state.selected) continue;
      // Two circles, visible on any colour.
      for (const kind of ["st-ring-halo", "st-ring"]) rings.append(svgElement("circle", { class: kind, cx: spots.x[k], cy: spots.y[k], r: 7, fill: "none" }));
    }
  };
  ring();
  return ring;
}
