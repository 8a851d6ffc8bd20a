// Reads YAML with the places of its values in the text, so that values can be replaced in a scenario file. The YAML of
// Grapnel's files: mappings and lists in block and flow style, scalars of all styles, comments; no anchors, no tags.
// No DOM.

export interface YamlNode {
  kind: "mapping" | "list" | "scalar" | "empty";
  begin: number; // of its text
  head: number; // after the colon or dash before it
  end: number;
  indent: number; // column of its keys or dashes; -1: flow style, or a scalar
  value: unknown; // of a scalar
  entries: { key: string; node: YamlNode }[]; // mapping
  items: YamlNode[]; // list
}

export class YamlError extends Error {}

export function readYaml(text: string): YamlNode {
  return new Reader(text).document();
}

// As JSON has it. Numbers with a unit remain texts.
export function plainValue(node: YamlNode): unknown {
  if (node.kind === "mapping") return Object.fromEntries(node.entries.map(({ key, node: one }) => [key, plainValue(one)]));
  if (node.kind === "list") return node.items.map(plainValue);
  return node.kind === "empty" ? null : node.value;
}

class Reader {
  private at = 0;

  constructor(private readonly text: string) {}

  document(): YamlNode {
    this.skip();
    if (this.text.startsWith("---", this.at)) {
      this.at += 3;
      this.skip();
    }
    const node = this.block(0);
    this.skip();
    if (this.at < this.text.length) this.fail("unexpected text");
    return node;
  }

  private fail(what: string): never {
    throw new YamlError(`line ${this.text.slice(0, this.at).split("\n").length}: ${what}`);
  }
  private column(at = this.at): number {
    return at - (this.text.lastIndexOf("\n", at - 1) + 1);
  }
  private get next(): string {
    return this.text[this.at] ?? "";
  }

  // Blanks, line ends and comments.
  private skip(): void {
    const found = /(?:[ \t\r\n]+|(?<![^ \t\r\n])#[^\n]*)*/y;
    found.lastIndex = this.at;
    this.at += found.exec(this.text)![0].length;
  }
  private blanks(): void {
    while (this.next === " " || this.next === "\t") ++this.at;
  }
  private lineEnds(): boolean {
    const rest = /[ \t]*(?:[ \t]#[^\n]*)?(?:\r?\n|$)/y;
    rest.lastIndex = this.at;
    return rest.test(this.text) || this.next === "#";
  }

  private made(kind: YamlNode["kind"], begin: number, indent = -1): YamlNode {
    return { kind, begin, head: begin, end: this.at, indent, value: null, entries: [], items: [] };
  }

  // A value at the present place whose lines are indented by at least `least`.
  private block(least: number): YamlNode {
    if (this.at >= this.text.length || this.column() < least) return this.made("empty", this.at);
    if (this.isDash()) return this.list(this.column());
    if (/^[&*!]/.test(this.next)) this.fail("anchors, aliases and tags are not supported");
    if (this.keyAhead() !== null) return this.mapping(this.column());
    return this.inline(least);
  }
  private isDash(): boolean {
    return this.next === "-" && /^[ \t\r\n]?$/.test(this.text[this.at + 1] ?? "");
  }

  private list(indent: number): YamlNode {
    const node = this.made("list", this.at, indent);
    while (this.at < this.text.length && this.column() === indent && this.isDash()) {
      ++this.at;
      const end = this.at;
      this.skip();
      const item = this.block(indent + 1);
      node.items.push(item.kind === "empty" ? { ...item, begin: end, head: end, end } : { ...item, head: end });
      node.end = item.kind === "empty" ? end : item.end;
      this.skip();
    }
    return node;
  }

  private mapping(indent: number): YamlNode {
    const node = this.made("mapping", this.at, indent);
    while (this.at < this.text.length && this.column() === indent) {
      const key = this.keyAhead();
      if (key === null) break;
      this.at = key.end;
      const end = this.at;
      let value: YamlNode;
      this.blanks();
      if (!this.lineEnds()) value = this.afterKey(indent);
      else {
        this.skip();
        // A list may stand below its key without indentation.
        value = this.column() === indent && this.at < this.text.length && this.isDash() ? this.list(indent) : this.block(indent + 1);
      }
      value = value.kind === "empty" ? { ...value, begin: end, head: end, end } : { ...value, head: end };
      node.entries.push({ key: key.name, node: value });
      node.end = value.end;
      this.skip();
    }
    return node;
  }
  private afterKey(indent: number): YamlNode {
    if (/^[&*!]/.test(this.next)) this.fail("anchors, aliases and tags are not supported");
    return this.inline(indent + 1);
  }

  // The key before ": " on this line.
  private keyAhead(): { name: string; end: number } | null {
    if (this.next === '"' || this.next === "'") {
      const start = this.at;
      const name = String(this.quoted().value);
      const end = /[ \t]*:(?=[ \t\r\n]|$)/y;
      end.lastIndex = this.at;
      const found = end.exec(this.text);
      const after = this.at + (found?.[0].length ?? 0);
      this.at = start;
      return found ? { name, end: after } : null;
    }
    const plain = /([^\s#[\]{},"'&*!|>%@`?-][^\n]*?|-[^\s][^\n]*?)[ \t]*:(?=[ \t\r\n]|$)/y;
    plain.lastIndex = this.at;
    const found = plain.exec(this.text);
    return found && !/ #/.test(found[1]) ? { name: found[1], end: this.at + found[0].length } : null;
  }

  // A scalar or a value in flow style; continuation lines are indented by at least `least`.
  private inline(least: number): YamlNode {
    if (this.next === "[" || this.next === "{") return this.flow();
    if (this.next === '"' || this.next === "'") return this.quoted();
    if (this.next === "|" || this.next === ">") return this.literal(least);
    return this.plain(least);
  }

  private plain(least: number): YamlNode {
    const begin = this.at;
    const line = /[^\n]*?(?=[ \t]*(?:[ \t]#[^\n]*)?\r?(?:\n|$))/y;
    const take = (): string => {
      line.lastIndex = this.at;
      const found = line.exec(this.text)![0];
      this.at += found.length;
      return found;
    };
    const lines = [take()];
    for (;;) {
      const more = /[ \t]*\r?\n([ ]*)(?=[^\s#])/y; // the text continues on the next line
      more.lastIndex = this.at;
      const found = more.exec(this.text);
      if (!found || found[1].length < least) break;
      this.at += found[0].length;
      lines.push(take());
    }
    return { ...this.made("scalar", begin), value: scalarValue(lines.join(" ")) };
  }

  private quoted(): YamlNode {
    const begin = this.at;
    const form = this.next === '"' ? /"(?:[^"\\]|\\[^])*"/y : /'(?:[^']|'')*'/y;
    form.lastIndex = this.at;
    const found = form.exec(this.text);
    if (!found) this.fail("a quote without its end");
    this.at += found[0].length;
    const inner = found[0].slice(1, -1).replace(/[ \t]*\r?\n[ \t]*/g, " ");
    return { ...this.made("scalar", begin), value: found[0][0] === "'" ? inner.replaceAll("''", "'") : unescaped(inner) };
  }

  private literal(least: number): YamlNode {
    const begin = this.at;
    const head = /[|>][-+]?[^\n]*\n/y;
    head.lastIndex = this.at;
    const folded = this.next === ">";
    const found = head.exec(this.text);
    if (!found) this.fail("a text block without lines");
    this.at += found[0].length;
    const lines: string[] = [];
    const line = /([ ]*)([^\n]*)(?:\n|$)/y;
    for (let end = this.at; end < this.text.length; ) {
      line.lastIndex = end;
      const [whole, blanks, content] = line.exec(this.text)!;
      if (content !== "" && blanks.length < least) break;
      lines.push(content);
      end += whole.length;
      if (content !== "") this.at = end - (whole.endsWith("\n") ? 1 : 0);
    }
    return { ...this.made("scalar", begin), value: lines.join(folded ? " " : "\n").trimEnd() };
  }

  // ---- Flow style ----

  private flow(): YamlNode {
    this.skip();
    if (this.next === "[") return this.flowList();
    if (this.next === "{") return this.flowMapping();
    if (this.next === '"' || this.next === "'") return this.quoted();
    if (/^[&*!]/.test(this.next)) this.fail("anchors, aliases and tags are not supported");
    const begin = this.at;
    const plain = /[^,[\]{}\n#:]*(?:(?::(?![ \t\r\n,\]}])|(?<![ \t])#)[^,[\]{}\n#:]*)*/y;
    plain.lastIndex = this.at;
    const found = plain.exec(this.text)![0].trimEnd();
    this.at += found.length;
    return found === "" ? this.made("empty", begin) : { ...this.made("scalar", begin), value: scalarValue(found) };
  }

  private flowList(): YamlNode {
    const node = this.made("list", this.at++);
    for (this.skip(); this.next !== "]"; this.skip()) {
      if (this.at >= this.text.length) this.fail("a list without its end");
      node.items.push(this.flow());
      this.separated("]");
    }
    ++this.at;
    return { ...node, end: this.at };
  }

  private flowMapping(): YamlNode {
    const node = this.made("mapping", this.at++);
    for (this.skip(); this.next !== "}"; this.skip()) {
      if (this.at >= this.text.length) this.fail("a mapping without its end");
      const key = this.flow();
      this.skip();
      if (this.next !== ":") this.fail("a key without a value");
      ++this.at;
      node.entries.push({ key: String(key.value), node: this.flow() });
      this.separated("}");
    }
    ++this.at;
    return { ...node, end: this.at };
  }
  private separated(end: string): void {
    this.skip();
    if (this.next === ",") ++this.at;
    else if (this.next !== end) this.fail(`expected ',' or '${end}'`);
  }
}

// By the core schema of YAML 1.2.
function scalarValue(text: string): unknown {
  if (/^(null|~|)$/i.test(text)) return null;
  if (/^true$/i.test(text)) return true;
  if (/^false$/i.test(text)) return false;
  return /^[-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?$/.test(text) ? Number(text) : text;
}

function unescaped(text: string): string {
  try {
    return JSON.parse(`"${text.replace(/\\([^])/g, (escape, one: string) => (one === " " ? " " : escape))}"`) as string;
  } catch {
    throw new YamlError(`an escape in "${text}" is not supported`);
  }
}
