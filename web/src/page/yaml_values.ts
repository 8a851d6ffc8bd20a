// Values of a YAML text by their paths, to compare what two files say instead of how they are written: comments, blank
// lines, quotes, the order of keys and the form of numbers have no influence. Block mappings and lists, values in one
// line, flow collections over several lines, block scalars. No DOM.

interface Level {
  indent: number;
  path: string;
  items: number; // list items so far
}

// Null: a form that this reader does not know, such as anchors; the caller compares lines then.
export function yamlValues(text: string): Map<string, string> | null {
  const values = new Map<string, string>();
  const levels: Level[] = [{ indent: -1, path: "", items: 0 }];
  const lines = text.replace(/\r\n/g, "\n").split("\n");
  for (let i = 0; i < lines.length; ++i) {
    let line = withoutComment(lines[i]);
    if (line.trim() === "" || /^(---|\.\.\.)/.test(line)) continue;
    if (/^\s*\t/.test(line) || /(^|[\s[,])[&*]\w/.test(line)) return null;
    while (isOpen(line) && i + 1 < lines.length) line += ` ${withoutComment(lines[++i]).trim()}`;
    if (isOpen(line)) return null;
    let indent = line.search(/\S/);
    let rest = line.slice(indent);
    while (levels.length > 1 && levels[levels.length - 1].indent >= indent && !(rest.startsWith("- ") && levels[levels.length - 1].indent === indent && !levels[levels.length - 1].path.endsWith("]"))) levels.pop();
    while (/^-(\s|$)/.test(rest)) {
      const list = levels[levels.length - 1];
      const path = `${list.path}[${list.items++}]`;
      levels.push({ indent, path, items: 0 });
      const inner = rest.slice(1).search(/\S/);
      if (inner < 0) {
        rest = "";
        break;
      }
      indent += 1 + inner;
      rest = rest.slice(1 + inner);
    }
    if (rest === "") continue;
    const parent = levels[levels.length - 1].path;
    const key = /^("[^"]*"|'[^']*'|[^\s"'[{][^:]*?):(?:\s+(.*))?$/.exec(rest);
    if (!key) {
      values.set(parent, normal(rest));
      continue;
    }
    const path = parent === "" ? unquoted(key[1]) : `${parent}.${unquoted(key[1])}`;
    const value = (key[2] ?? "").trim();
    if (/^[|>][-+\d]*$/.test(value)) {
      const block: string[] = [];
      while (i + 1 < lines.length && (lines[i + 1].trim() === "" || lines[i + 1].search(/\S/) > indent)) block.push(lines[++i].trim());
      values.set(path, block.join(" ").trim());
    } else if (value === "") levels.push({ indent, path, items: 0 });
    else values.set(path, normal(value));
  }
  return values;
}

// Outside of quotes.
function withoutComment(line: string): string {
  let quote = "";
  for (let i = 0; i < line.length; ++i) {
    const c = line[i];
    if (quote) quote = c === quote ? "" : quote;
    else if (c === '"' || c === "'") quote = /[\s:[{,]/.test(line[i - 1] ?? " ") ? c : "";
    else if (c === "#" && /^$|\s/.test(line[i - 1] ?? "")) return line.slice(0, i).trimEnd();
  }
  return line.trimEnd();
}

// Whether brackets are open at the end of the line.
function isOpen(line: string): boolean {
  const plain = line.replace(/"[^"]*"|'[^']*'/g, "");
  return (plain.match(/[[{]/g)?.length ?? 0) > (plain.match(/[\]}]/g)?.length ?? 0);
}

function unquoted(text: string): string {
  return /^(["']).*\1$/.test(text) ? text.slice(1, -1) : text.trim();
}

// "[0, 1.0, 2e0 ]" and "[0, 1, 2]" are one value.
function normal(value: string): string {
  return unquoted(value)
    .replace(/\s+/g, " ")
    .replace(/\s*([[\]{},])\s*/g, "$1")
    .replace(/(?<![\w.])[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?(?![\w.])/gi, (digits) => String(Number(digits)))
    .replace(/,/g, ", ");
}

export interface ValueChange {
  path: string;
  a: string | null; // null: absent
  b: string | null;
}

// In the order of A, then what only B has.
export function valueChanges(a: Map<string, string>, b: Map<string, string>): ValueChange[] {
  return [...new Set([...a.keys(), ...b.keys()])]
    .map((path) => ({ path, a: a.get(path) ?? null, b: b.get(path) ?? null }))
    .filter((one) => one.a !== one.b);
}
