// The capture window: evaluated times, their limits, and the selected time.
import { element, svgElement } from "../dom";
import { number } from "../format";
import { padded, tickTexts, ticks } from "../plots/axes";
import type { PlanReport, WindowPoint, WindowReport } from "../summary_types";
import { list, num, text, withUnit, words, type Partly } from "./read";
import { fold, mark, table, type Cell } from "./table";

const kDegree = Math.PI / 180;

export function windowPart(plan: Partly<PlanReport>): HTMLElement[] {
  const window = plan.window;
  const points = list(window?.points).filter((point) => num(point.time) !== null);
  if (!window || points.length === 0) return [];
  return [
    element("h3", {}, "Capture window"),
    element("p", {}, ...verdict(window, points)),
    chart(window, points, words(plan.objective)),
    fold(`Evaluated times (${points.length})`, pointTable(points)),
  ];
}

function verdict(window: Partly<WindowReport>, points: Partly<WindowPoint>[]): (Node | string)[] {
  const reached = points.filter((point) => point.reachable === true).length;
  const span = `${points.length} times between ${withUnit(num(points[0].time), "s")} and ${withUnit(num(points[points.length - 1].time), "s")}`;
  const parts =
    num(window.time) === null
      ? [mark("bad", `none of ${span} is reachable`)]
      : [mark("good", `capture at ${withUnit(num(window.time), "s", 6)}`), `, selected from ${span}; ${reached} reachable`];
  if (num(window.not_before) !== null) parts.push(`; by distance alone, none before ${withUnit(num(window.not_before), "s", 6)}`);
  return [...parts, "."];
}

// ---- The chart: strips above each other with one axis of time ----

interface Strip {
  name: string;
  values: (number | null)[];
  limit?: number; // limit beyond which no capture is reachable
}

const kWidth = 720;
const kStrip = 84;
const kGap = 16;
const kLeft = 66;
const kRight = 12;

function chart(window: Partly<WindowReport>, points: Partly<WindowPoint>[], objective: string): HTMLElement {
  const strips = stripsOf(points, objective);
  const times = points.map((point) => num(point.time)!);
  const begin = times[0];
  const end = Math.max(times[times.length - 1], begin + 1e-9);
  const toX = (t: number) => kLeft + ((t - begin) / (end - begin)) * (kWidth - kLeft - kRight);
  const bottom = strips.length * (kStrip + kGap);
  const svg = svgElement("svg", { viewBox: `0 0 ${kWidth} ${bottom + 40}`, class: "window-chart", role: "img" });
  svg.append(svgElement("title", {}, "Limits of the capture over its time"));
  strips.forEach((strip, i) => svg.append(...stripParts(strip, points, toX, kGap / 2 + i * (kStrip + kGap))));
  for (const t of ticks({ min: begin, max: end }, 8)) svg.append(svgElement("text", { x: toX(t), y: bottom + 14, "text-anchor": "middle" }, number(t)));
  svg.append(svgElement("text", { x: (kLeft + kWidth - kRight) / 2, y: bottom + 32, "text-anchor": "middle" }, "time of capture [s]"));
  const chosen = num(window.time);
  if (chosen !== null) svg.append(svgElement("line", { x1: toX(chosen), x2: toX(chosen), y1: 0, y2: bottom - kGap / 2, class: "chosen" }));
  return element(
    "figure",
    { class: "window-figure" },
    svg,
    element(
      "figcaption",
      { class: "small" },
      "Dots: a plan was found. Crosses: no plan was found or possible. Dashed: the selected time. A horizontal line is a limit of reachability: a grasp point beyond the reach of arm and base (1), an approach direction that points back to the servicer (90°).",
    ),
  );
}

function stripsOf(points: Partly<WindowPoint>[], objective: string): Strip[] {
  const of = (key: "reach_share" | "speed" | "objective" | "direction_angle") => points.map((point) => num(point[key]));
  const strips: Strip[] = [{ name: "reach share", values: of("reach_share"), limit: 1 }];
  const angles = of("direction_angle").map((angle) => (angle === null ? null : angle / kDegree));
  if (angles.some((angle) => angle !== null)) strips.push({ name: "direction off [°]", values: angles, limit: 90 });
  strips.push({ name: "speed [m/s]", values: of("speed") });
  const objectives = points.map((point) => (point.reachable === true ? num(point.objective) : null));
  if (objectives.some((value) => value !== null)) strips.push({ name: objective, values: objectives });
  return strips;
}

function stripParts(strip: Strip, points: Partly<WindowPoint>[], toX: (t: number) => number, top: number): SVGElement[] {
  const known = strip.values.filter((value) => value !== null);
  const range = padded(Math.min(...known, strip.limit ?? Infinity), Math.max(...known, strip.limit ?? -Infinity));
  const toY = (value: number) => top + kStrip - ((value - range.min) / (range.max - range.min)) * kStrip;
  const parts: SVGElement[] = [svgElement("rect", { x: kLeft, y: top, width: kWidth - kLeft - kRight, height: kStrip, class: "frame" })];
  const levels = ticks(range, 3);
  const texts = tickTexts(levels);
  levels.forEach((level, i) => {
    parts.push(svgElement("line", { x1: kLeft, x2: kWidth - kRight, y1: toY(level), y2: toY(level), class: "grid" }));
    parts.push(svgElement("text", { x: kLeft - 6, y: toY(level) + 4, "text-anchor": "end" }, texts[i]));
  });
  const middle = top + kStrip / 2;
  parts.push(svgElement("text", { x: 12, y: middle, "text-anchor": "middle", transform: `rotate(-90 12 ${middle})` }, strip.name));
  if (strip.limit !== undefined) parts.push(svgElement("line", { x1: kLeft, x2: kWidth - kRight, y1: toY(strip.limit), y2: toY(strip.limit), class: "limit" }));
  points.forEach((point, i) => {
    const value = strip.values[i];
    if (value === null) return;
    const x = toX(num(point.time)!);
    const y = toY(value);
    const about = svgElement("title", {}, `${withUnit(num(point.time), "s", 6)}: ${number(value)}${point.reachable === true ? "" : `; ${text(point.reason)}`}`);
    parts.push(
      point.reachable === true
        ? svgElement("circle", { cx: x, cy: y, r: 2.6, class: "reached" }, about)
        : svgElement("path", { d: `M${x - 2.6},${y - 2.6}l5.2,5.2m0,-5.2l-5.2,5.2`, class: "missed" }, about),
    );
  });
  return parts;
}

function pointTable(points: Partly<WindowPoint>[]): HTMLElement {
  const rows = points.map((point): Cell[] => [
    number(num(point.time), 6),
    point.reachable === true ? "yes" : "no",
    number(num(point.objective)),
    number(num(point.speed)),
    number(num(point.direction_angle) === null ? null : num(point.direction_angle)! / kDegree),
    number(num(point.reach_share)),
    text(point.reason, ""),
  ]);
  return table(
    "Evaluated times",
    [
      { head: "Time", unit: "s", numeric: true },
      { head: "Reachable" },
      { head: "Objective", numeric: true },
      { head: "Speed", unit: "m/s", numeric: true, title: "of the fastest grasp point relative to the servicer's centre of mass" },
      { head: "Direction off", unit: "deg", numeric: true, title: "between the approach direction and the line from the arm's first joint" },
      { head: "Reach share", numeric: true, title: "distance over the reach of base and arm" },
      { head: "Why not" },
    ],
    rows,
  );
}
