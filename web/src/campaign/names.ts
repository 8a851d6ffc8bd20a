// Names too long for their place, shortened so that they still tell things apart. No DOM.
import { shortened } from "../study/describe";

// Each name in at most `most` letters: whole parts are replaced by "…", the first and the middle ones before those near
// the end, but no part that distinguishes it from another name.
export function distinctNames(names: string[], most: number): string[] {
  const all = [...new Set(names)].map((name) => name.split(/(?<=[./])/));
  const made = names.map((name) => {
    if (name.length <= most) return name;
    const parts = name.split(/(?<=[./])/);
    const gone = new Set<number>();
    for (const k of order(parts.length)) {
      gone.add(k);
      const text = without(parts, gone);
      if (all.filter((other) => without(other, gone) === text).length > 1) gone.delete(k);
      else if (text.length <= most) return filled(parts, gone, k, most);
    }
    return shortened(without(parts, gone), most);
  });
  return made;
}

// Which parts go first: the first, those after the second, the second. The last stays.
function order(count: number): number[] {
  const middle = Array.from({ length: Math.max(0, count - 3) }, (_, k) => k + 2);
  return [0, ...middle, 1].filter((k) => k < count - 1);
}

// The end of the part that went last comes back as far as there is room: "…velocity/x" says more than "…x".
function filled(parts: string[], gone: Set<number>, last: number, most: number): string {
  const text = without(parts, gone);
  const room = most - text.length;
  if (last === 0 || room < 3) return text;
  return without(parts.map((part, k) => (k === last ? `…${part.slice(-room)}` : part)), new Set([...gone].filter((k) => k !== last)));
}

function without(parts: string[], gone: Set<number>): string {
  return parts.map((part, k) => (gone.has(k) ? "…" : part)).join("").replace(/[./]?…+/g, "…");
}
