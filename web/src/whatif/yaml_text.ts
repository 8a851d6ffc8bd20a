// Values as YAML in flow style, and words of a shell. No DOM.

// As --set and scenario files read it: numbers with all digits, texts in quotes only where needed.
export function flowText(value: unknown): string {
  if (typeof value === "number") return numberText(value);
  if (typeof value === "string") return isPlain(value) ? value : JSON.stringify(value);
  if (Array.isArray(value)) return `[${value.map(flowText).join(", ")}]`;
  if (value !== null && typeof value === "object") return `{${Object.entries(value).map(([key, item]) => `${flowText(key)}: ${flowText(item)}`).join(", ")}}`;
  return value === true ? "true" : value === false ? "false" : "null";
}

function numberText(value: number): string {
  if (value === Infinity) return ".inf";
  if (value === -Infinity) return "-.inf";
  return Object.is(value, -0) ? "0" : String(value);
}

// Neither a number, nor a truth value, nor with characters that have a meaning.
function isPlain(text: string): boolean {
  return /^[A-Za-z_][\w ./^*-]*$/.test(text) && !/ $/.test(text) && !/^(true|false|null|yes|no|on|off|y|n)$/i.test(text);
}

// One word of a POSIX shell.
export function shellWord(text: string): string {
  return /^[\w/.,:@%+=-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`;
}
