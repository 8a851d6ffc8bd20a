// Positions of labels on the lines of a map, and the numbers that they replace, without overlaps. No DOM; pixels.

export type Place = [number, number];

export interface Box {
  left: number;
  top: number;
  right: number;
  bottom: number;
}

export interface NamedLine {
  text: string;
  points: Place[];
}

export interface LineLabel {
  text: string;
  x: number; // of its middle
  y: number;
  box: Box;
}

const kLeast = 44; // minimum length of a labelled line [px]
const kHeight = 15;

// A name on every line that is long enough and has a free place inside `frame`, longest lines first: clear of all other
// names, and if possible of the other lines.
export function placeLabels(lines: NamedLine[], frame: Box): LineLabel[] {
  const order = [...lines].filter((l) => lengthOf(l.points) >= kLeast).sort((a, b) => lengthOf(b.points) - lengthOf(a.points));
  const placed: LineLabel[] = [];
  for (const line of order) {
    const others = lines.filter((l) => l !== line);
    const free = candidates(line, frame).filter((c) => placed.every((p) => !overlap(p.box, c.box)));
    const best = free.find((c) => others.every((o) => !crosses(o.points, c.box))) ?? (placed.some((p) => p.text === line.text) ? undefined : free[0]);
    if (best) placed.push(best);
  }
  return placed;
}

// Along the line, from its middle outward.
function candidates(line: NamedLine, frame: Box): LineLabel[] {
  const width = 7 * line.text.length + 8;
  const made: LineLabel[] = [];
  for (let k = 0; k < 37; ++k) {
    const [x, y] = along(line.points, 0.5 + (k % 2 === 0 ? 1 : -1) * Math.ceil(k / 2) * 0.026);
    const box = { left: x - width / 2, right: x + width / 2, top: y - kHeight / 2, bottom: y + kHeight / 2 };
    if (box.left >= frame.left && box.right <= frame.right && box.top >= frame.top && box.bottom <= frame.bottom) made.push({ text: line.text, x, y, box });
  }
  return made;
}

export function overlap(a: Box, b: Box): boolean {
  return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
}

// Whether a line comes into a box.
export function crosses(points: Place[], box: Box): boolean {
  return points.some((p, k) => k > 0 && segmentCrosses(points[k - 1], p, box));
}

// Clipping after Liang and Barsky (1984).
function segmentCrosses([x0, y0]: Place, [x1, y1]: Place, box: Box): boolean {
  let [from, to] = [0, 1];
  const clips: Place[] = [[x0 - x1, x0 - box.left], [x1 - x0, box.right - x0], [y0 - y1, y0 - box.top], [y1 - y0, box.bottom - y0]];
  for (const [step, room] of clips) {
    if (step === 0 && room < 0) return false;
    if (step < 0) from = Math.max(from, room / step);
    if (step > 0) to = Math.min(to, room / step);
  }
  return from <= to;
}

export function lengthOf(points: Place[]): number {
  return points.reduce((sum, [x, y], k) => (k > 0 ? sum + Math.hypot(x - points[k - 1][0], y - points[k - 1][1]) : 0), 0);
}

// The place at a share of a line's length.
function along(points: Place[], share: number): Place {
  let left = share * lengthOf(points);
  for (let k = 1; k < points.length; ++k) {
    const [[x0, y0], [x1, y1]] = [points[k - 1], points[k]];
    const size = Math.hypot(x1 - x0, y1 - y0);
    if (left <= size && size > 0) return [x0 + (left / size) * (x1 - x0), y0 + (left / size) * (y1 - y0)];
    left -= size;
  }
  return points[points.length - 1];
}
