// Directions of W's axes on the screen, and a scale bar, in the picture's corner.
import { type Camera, type Group, Quaternion, Vector3 } from "three";
import { element, svgElement } from "../dom";
import { number } from "../format";
import { niceLength } from "./ground";

const kReach = 24; // of an axis [px]
const kLongest = 130; // of the bar [px]

export interface ScaleBar {
  length: number; // [m]
  pixels: number;
}

// The longest length of 1, 2 or 5 times a power of ten that fits into the given pixels.
export function scaleBar(unitsPerPixel: number, longest = kLongest): ScaleBar | null {
  const most = unitsPerPixel * longest;
  if (!(most > 0) || !Number.isFinite(most)) return null;
  const next = niceLength(most * 1.0001);
  const length = next <= most ? next : ([0.5, 0.4, 0.2].map((part) => part * next).find((one) => one <= most && isNice(one)) ?? next / 10);
  return { length, pixels: length / unitsPerPixel };
}

function isNice(length: number): boolean {
  const lead = length / 10 ** Math.floor(Math.log10(length * 1.0001));
  return [1, 2, 5].some((k) => Math.abs(lead - k) < 1e-6);
}

export class Compass {
  readonly host = element("div", { class: "replay-compass", "aria-hidden": "true" });
  private readonly lines: SVGLineElement[] = [];
  private readonly letters: SVGTextElement[] = [];
  private readonly axes = svgElement("svg", { viewBox: "-36 -36 72 72", width: 72, height: 72 });
  private readonly bar = element("i");
  private readonly length = element("span");
  scale: ScaleBar | null = null;

  constructor() {
    for (const name of ["x", "y", "z"]) {
      const line = svgElement("line", { x1: 0, y1: 0, "stroke-width": 2.5, "stroke-linecap": "round" });
      const letter = svgElement("text", { "text-anchor": "middle", "dominant-baseline": "central" }, name);
      this.lines.push(line);
      this.letters.push(letter);
      this.axes.append(svgElement("g", {}, line, letter));
    }
    this.host.append(this.axes, element("div", { class: "replay-scale" }, this.length, this.bar));
  }

  update(camera: Camera, world: Group, unitsPerPixel: number, color: (role: string) => string): void {
    const turn = camera.getWorldQuaternion(new Quaternion()).invert().multiply(world.quaternion);
    const seen = [new Vector3(1, 0, 0), new Vector3(0, 1, 0), new Vector3(0, 0, 1)].map((axis) => axis.applyQuaternion(turn));
    seen.forEach((axis, i) => {
      const [x, y] = [kReach * axis.x, -kReach * axis.y];
      const near = Math.hypot(x, y);
      const out = near > 3 ? (near + 9) / near : 0; // the letter of an axis along the view is at the origin
      const paint = color(`axis ${"xyz"[i]}`);
      this.lines[i].setAttribute("x2", x.toFixed(1));
      this.lines[i].setAttribute("y2", y.toFixed(1));
      this.lines[i].style.stroke = paint;
      this.letters[i].setAttribute("x", (out ? x * out : 9).toFixed(1));
      this.letters[i].setAttribute("y", (out ? y * out : 9).toFixed(1));
      this.letters[i].style.fill = paint;
    });
    const order = [0, 1, 2].sort((a, b) => seen[a].z - seen[b].z); // axes towards the viewer are drawn last
    for (const i of order) this.axes.append(this.lines[i].parentElement!);
    this.scale = scaleBar(unitsPerPixel);
    this.bar.style.width = `${this.scale?.pixels.toFixed(1) ?? 0}px`;
    this.length.textContent = this.scale ? `${number(this.scale.length)} m` : "";
  }
}
