// Differences of two texts by lines (Myers' greedy algorithm: the shortest list of changes). No DOM.

export interface DiffLine {
  side: "both" | "a" | "b"; // "a": only in the first
  text: string;
  a: number | null; // its number in either, from 1
  b: number | null;
}

const kMostChanges = 2000; // limit on the number of changes, because the cost of the search grows with its square

// Null: too many differences.
export function lineDiff(a: string, b: string): DiffLine[] | null {
  const [x, y] = [linesOf(a), linesOf(b)];
  let begin = 0;
  while (begin < x.length && begin < y.length && x[begin] === y[begin]) ++begin;
  let end = 0;
  while (end < x.length - begin && end < y.length - begin && x[x.length - 1 - end] === y[y.length - 1 - end]) ++end;
  const path = shortestPath(x.slice(begin, x.length - end), y.slice(begin, y.length - end));
  if (!path) return null;
  const result: DiffLine[] = [];
  let [i, k] = [0, 0];
  const both = () => result.push({ side: "both", text: x[i], a: ++i, b: ++k });
  while (i < begin) both();
  for (const side of path) {
    if (side === "both") both();
    else if (side === "a") result.push({ side, text: x[i], a: ++i, b: null });
    else result.push({ side, text: y[k], a: null, b: ++k });
  }
  while (i < x.length) both();
  return result;
}

// Groups of changes with `context` lines around them; null represents omitted lines.
export function hunks(lines: DiffLine[], context: number): (DiffLine | null)[] {
  const near = lines.map(() => false);
  lines.forEach((line, i) => {
    if (line.side === "both") return;
    for (let k = Math.max(0, i - context); k <= Math.min(lines.length - 1, i + context); ++k) near[k] = true;
  });
  const result: (DiffLine | null)[] = [];
  lines.forEach((line, i) => {
    if (near[i]) result.push(line);
    else if (i === 0 || near[i - 1]) result.push(null);
  });
  return result;
}

function linesOf(text: string): string[] {
  const lines = text.replace(/\r\n/g, "\n").split("\n");
  if (lines.at(-1) === "") lines.pop();
  return lines;
}

function shortestPath(x: string[], y: string[]): DiffLine["side"][] | null {
  const [n, m] = [x.length, y.length];
  const size = Math.min(n + m, kMostChanges);
  let furthest = new Map<number, number>([[1, 0]]);
  const trace: Map<number, number>[] = [];
  for (let d = 0; d <= size; ++d) {
    trace.push(new Map(furthest));
    for (let diagonal = -d; diagonal <= d; diagonal += 2) {
      const down = diagonal === -d || (diagonal !== d && (furthest.get(diagonal - 1) ?? -1) < (furthest.get(diagonal + 1) ?? -1));
      let i = down ? furthest.get(diagonal + 1)! : furthest.get(diagonal - 1)! + 1;
      while (i < n && i - diagonal < m && x[i] === y[i - diagonal]) ++i;
      furthest.set(diagonal, i);
      if (i >= n && i - diagonal >= m) return backwards(trace, n, m);
    }
  }
  return null;
}

function backwards(trace: Map<number, number>[], n: number, m: number): DiffLine["side"][] {
  const path: DiffLine["side"][] = [];
  let [i, k] = [n, m];
  for (let d = trace.length - 1; d >= 0; --d) {
    const diagonal = i - k;
    const at = trace[d];
    const down = diagonal === -d || (diagonal !== d && (at.get(diagonal - 1) ?? -1) < (at.get(diagonal + 1) ?? -1));
    const from = down ? diagonal + 1 : diagonal - 1;
    const i0 = d === 0 ? 0 : at.get(from)!;
    const k0 = d === 0 ? 0 : i0 - from;
    while (i > i0 && k > k0) {
      path.push("both");
      --i;
      --k;
    }
    if (d > 0) path.push(down ? "b" : "a");
    [i, k] = [i0, k0];
  }
  return path.reverse();
}
