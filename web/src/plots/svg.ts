// A plot as SVG text for papers and printing: white, black axes, its own legend; no style sheets, so that all programs
// draw the same picture.
import { number } from "../format";
import { decadeText, decadeTicks, extent, limitAt, offScale, padded, tickTexts, ticks, withLimits, type Range } from "./axes";

export interface SvgLine {
  label: string;
  color: string;
  dash: number[];
  width: number;
  time: ArrayLike<number>;
  values: ArrayLike<number>; // of a logarithmic axis: log10
}

export interface SvgPlot {
  id: string; // id of its definitions; a page may have several
  title: string;
  xTitle: string;
  yTitle: string;
  limits?: { label: string; value: number; color: string }[];
  window: Range;
  log: boolean;
  lines: SvgLine[];
  phases: { name: string; begin: number; end: number; tint: string }[];
  width: number;
  height: number;
}

const kFont = "Helvetica, Arial, sans-serif";

export function svgPlot(plot: SvgPlot): string {
  const legend = legendRows(plot);
  const y = yRange(plot);
  const strip = offScale(plot.limits ?? [], y, plot.log);
  const rows = legend.length + (strip.length > 0 ? 1 : 0);
  const box = { left: 64, top: 28 + 15 * rows + 6, right: plot.width - 14, bottom: plot.height + 15 * rows - 44 };
  const height = plot.height + 15 * rows;
  const toX = (t: number) =>
    box.left + ((t - plot.window.min) / (plot.window.max - plot.window.min)) * (box.right - box.left);
  const toY = (v: number) => box.bottom - ((v - y.min) / (y.max - y.min)) * (box.bottom - box.top);
  const clip = `clip-${plot.id.replace(/[^\w-]/g, (c) => c.codePointAt(0)!.toString(16))}`;
  const parts = [
    `<svg xmlns="http://www.w3.org/2000/svg" width="${plot.width}" height="${height}" viewBox="0 0 ${plot.width} ${height}" font-family="${kFont}" font-size="11">`,
    `<title>${escaped(plot.title)}</title>`,
    `<rect width="${plot.width}" height="${height}" fill="#ffffff"/>`,
    `<text x="${box.left}" y="17" font-size="13" font-weight="bold">${escaped(plot.title)}</text>`,
    ...legend.flatMap((row, i) => legendRow(row, box.left, 34 + 15 * i)),
    ...stripText(strip, plot, box),
    `<clipPath id="${clip}"><rect x="${box.left}" y="${box.top}" width="${box.right - box.left}" height="${box.bottom - box.top}"/></clipPath>`,
    `<g clip-path="url(#${clip})">`,
    ...plot.phases.map((phase) => phaseRect(phase, plot.window, toX, box)),
    ...gridLines(plot, y, toX, toY, box),
    ...plot.lines.map((line) => path(line, plot.window, toX, toY)),
    `</g>`,
    ...limitLines(plot, y, toY, box),
    ...frame(plot, y, toX, toY, box),
    `</svg>`,
  ];
  return parts.join("\n") + "\n";
}

type Box = { left: number; top: number; right: number; bottom: number };
type Scale = (value: number) => number;

function yRange(plot: SvgPlot): Range {
  let low = Infinity;
  let high = -Infinity;
  for (const line of plot.lines) {
    const found = extent(line.time, line.values, plot.window);
    if (!found) continue;
    low = Math.min(low, found.min);
    high = Math.max(high, found.max);
  }
  if (plot.log) return low <= high ? { min: Math.floor(low), max: Math.floor(high) + 1 } : padded(low, high);
  const wide = withLimits(low, high, (plot.limits ?? []).map((limit) => limit.value));
  return padded(wide.low, wide.high);
}

// Limits beyond the axis, in a separate row above the drawing.
function stripText(strip: string[], plot: SvgPlot, box: Box): string[] {
  if (strip.length === 0) return [];
  const color = plot.limits![0].color;
  return [`<text x="${px(box.left)}" y="${px(box.top - 6)}" fill="${color}" font-weight="bold">${escaped(strip.join("; "))}</text>`];
}

function limitLines(plot: SvgPlot, range: Range, toY: Scale, box: Box): string[] {
  const taken: number[] = [];
  return (plot.limits ?? []).flatMap((limit) => {
    const value = limitAt(limit.value, plot.log);
    if (!(value >= range.min && value <= range.max)) return [];
    const y = toY(value);
    let at = y - box.top > 16 ? y - 4 : y + 12;
    while (taken.some((other) => Math.abs(other - at) < 12)) at += 12;
    taken.push(at);
    const text = `${limit.label} ${number(limit.value)}`;
    return [
      `<path d="M${px(box.left)} ${px(y)}H${px(box.right)}" stroke="${limit.color}" stroke-width="1.1" stroke-dasharray="7 3 1.5 3"/>`,
      `<text x="${px(box.left + 4)}" y="${px(at)}" fill="${limit.color}" font-weight="bold">${escaped(text)}</text>`,
    ];
  });
}

function yTicks(plot: SvgPlot, y: Range): { values: number[]; texts: string[] } {
  const values = plot.log ? decadeTicks(y, 7) : ticks(y, 6);
  return { values, texts: plot.log ? values.map(decadeText) : tickTexts(values) };
}

function gridLines(plot: SvgPlot, y: Range, toX: Scale, toY: Scale, box: Box): string[] {
  const line = (x1: number, y1: number, x2: number, y2: number) =>
    `<path d="M${px(x1)} ${px(y1)}L${px(x2)} ${px(y2)}" stroke="#000000" stroke-opacity="0.1" stroke-width="0.6"/>`;
  return [
    ...ticks(plot.window, plot.width / 80).map((t) => line(toX(t), box.top, toX(t), box.bottom)),
    ...yTicks(plot, y).values.map((v) => line(box.left, toY(v), box.right, toY(v))),
  ];
}

function frame(plot: SvgPlot, y: Range, toX: Scale, toY: Scale, box: Box): string[] {
  const xs = ticks(plot.window, plot.width / 80);
  const xTexts = tickTexts(xs);
  const { values, texts } = yTicks(plot, y);
  const tick = (d: string) => `<path d="${d}" stroke="#000000" stroke-width="0.8"/>`;
  const middle = (box.top + box.bottom) / 2;
  return [
    `<path d="M${px(box.left)} ${px(box.top)}V${px(box.bottom)}H${px(box.right)}" fill="none" stroke="#000000" stroke-width="0.8"/>`,
    ...xs.flatMap((t, i) => [
      tick(`M${px(toX(t))} ${px(box.bottom)}v4`),
      `<text x="${px(toX(t))}" y="${px(box.bottom + 16)}" text-anchor="middle">${xTexts[i]}</text>`,
    ]),
    ...values.flatMap((v, i) => [
      tick(`M${px(box.left)} ${px(toY(v))}h-4`),
      `<text x="${px(box.left - 7)}" y="${px(toY(v) + 3.8)}" text-anchor="end">${texts[i]}</text>`,
    ]),
    `<text x="${px((box.left + box.right) / 2)}" y="${px(box.bottom + 34)}" text-anchor="middle">${escaped(plot.xTitle)}</text>`,
    `<text x="14" y="${px(middle)}" text-anchor="middle" transform="rotate(-90 14 ${px(middle)})">${escaped(plot.yTitle)}</text>`,
  ];
}

function phaseRect(phase: SvgPlot["phases"][number], window: Range, toX: Scale, box: Box): string {
  const left = toX(Math.max(phase.begin, window.min));
  const right = toX(Math.min(phase.end, window.max));
  if (!(right >= left)) return "";
  const [color, opacity] = solid(phase.tint);
  if (right - left < 0.5) {
    return `<path d="M${px(left)} ${px(box.top)}V${px(box.bottom)}" stroke="#d55e00" stroke-opacity="0.6" stroke-width="0.8"><title>${escaped(phase.name)}</title></path>`;
  }
  const width = right - left;
  return `<rect x="${px(left)}" y="${px(box.top)}" width="${px(width)}" height="${px(box.bottom - box.top)}" fill="${color}" fill-opacity="${opacity}"><title>${escaped(phase.name)}</title></rect>`;
}

// "rgba(0,114,178,0.07)" as a colour and an opacity, which all programs support.
export function solid(color: string): [string, number] {
  const found = /^rgba\((\d+),\s*(\d+),\s*(\d+),\s*([\d.]+)\)$/.exec(color);
  return found
    ? [`rgb(${found[1]},${found[2]},${found[3]})`, Number(found[4])]
    : [color === "transparent" ? "none" : color, 1];
}

// Omits points that would move the pen by less than a twentieth of a pixel.
function path(line: SvgLine, window: Range, toX: Scale, toY: Scale): string {
  let d = "";
  let pen = false;
  let lastX = NaN;
  let lastY = NaN;
  for (let i = 0; i < line.values.length; ++i) {
    const outside =
      (line.time[i] < window.min && line.time[i + 1] < window.min) ||
      (line.time[i] > window.max && line.time[i - 1] > window.max);
    if (outside || !Number.isFinite(line.values[i])) {
      pen = false;
      continue;
    }
    const x = toX(line.time[i]);
    const y = toY(line.values[i]);
    if (pen && Math.abs(x - lastX) < 0.05 && Math.abs(y - lastY) < 0.05) continue;
    d += `${pen ? "L" : "M"}${px(x)} ${px(y)}`;
    pen = true;
    lastX = x;
    lastY = y;
  }
  return `<path d="${d}" fill="none" stroke="${line.color}" stroke-width="${line.width}" stroke-linejoin="round"${dashed(line)}><title>${escaped(line.label)}</title></path>`;
}

function dashed(line: { dash: number[] }): string {
  return line.dash.length > 0 ? ` stroke-dasharray="${line.dash.join(" ")}"` : "";
}

// Entries of the legend, in rows that fit the width.
function legendRows(plot: SvgPlot): SvgLine[][] {
  const rows: SvgLine[][] = [];
  let used = Infinity;
  for (const line of plot.lines) {
    const needs = entryWidth(line);
    if (used + needs > plot.width - 78) {
      rows.push([]);
      used = 0;
    }
    rows[rows.length - 1].push(line);
    used += needs;
  }
  return rows;
}

function entryWidth(line: SvgLine): number {
  return 42 + 5.9 * line.label.length;
}

function legendRow(row: SvgLine[], left: number, y: number): string[] {
  let x = left;
  return row.flatMap((line) => {
    const at = x;
    x += entryWidth(line);
    return [
      `<path d="M${px(at)} ${y - 4}h22" stroke="${line.color}" stroke-width="${line.width}"${dashed(line)}/>`,
      `<text x="${px(at + 27)}" y="${y}">${escaped(line.label)}</text>`,
    ];
  });
}

function px(value: number): string {
  return String(Math.round(value * 100) / 100);
}

// Names come from untrusted files; control characters are not allowed in XML.
export function escaped(text: string): string {
  return text
    .replace(/[\u0000-\u0008\u000b\u000c\u000e-\u001f\ufffe\uffff]/g, "\ufffd")
    .replace(/&/g, "&amp;")
    .replace(/</g, "&lt;")
    .replace(/>/g, "&gt;")
    .replace(/"/g, "&quot;");
}
