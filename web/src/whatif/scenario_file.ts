// The text of a scenario file with overrides applied as the program applies them; comments and units remain. No DOM.
import type { SourceTexts } from "../data";
import type { Override } from "./engine_interface";
import { plainValue, readYaml, YamlError, type YamlNode } from "./yaml_places";
import { flowText } from "./yaml_text";

// The scenario's file with the overrides of its run and these. The robot is inserted where an override changes a
// robot that has a separate file. @throws Error if the texts are missing, or if an override has no place in them.
export function scenarioWith(source: SourceTexts | null | undefined, overrides: Override[]): string {
  const files = Array.isArray(source?.files) ? source.files : [];
  const textOf = (part: string): string | undefined => files.find((file) => file?.part === part)?.text;
  let text = textOf("scenario");
  if (!text) throw new Error("The result does not contain the text of its scenario; use the overrides.");
  const own = (Array.isArray(source?.settings) ? source.settings : []).map(parsedSetting);
  const all = [...own, ...overrides];
  for (const one of all) {
    if (/^robot[.[]/.test(one.path)) text = withRobot(text, textOf("robot"));
    text = replaced(text, one);
  }
  return all.length > 0 ? header(text, all) : text;
}

// The values of the scenario of a run, its robot and ready-made targets included. Undefined: their text is missing or is
// not read here.
export function scenarioValues(source: SourceTexts | null | undefined): unknown {
  const files = Array.isArray(source?.files) ? source.files : [];
  const parsed = (part: string): Record<string, unknown> | undefined => {
    const text = files.find((file) => file?.part === part)?.text;
    return text ? (plainValue(readYaml(text)) as Record<string, unknown>) : undefined;
  };
  try {
    const text = scenarioWith(source, []);
    const values = plainValue(readYaml(text)) as Record<string, unknown>;
    if (typeof values.robot === "string" && values.import === undefined) values.robot = parsed("robot") ?? values.robot;
    if (Array.isArray(values.targets)) values.targets = values.targets.map((one: Record<string, unknown>) => ({ ...parsed(`target ${String(one.ready_made)}`), ...one }));
    return values;
  } catch (error) {
    console.warn(error);
    return undefined;
  }
}

// "path=value", where the value is YAML.
function parsedSetting(setting: unknown): Override {
  const text = String(setting);
  const at = text.indexOf("=");
  return { path: text.slice(0, at), value: plainValue(readYaml(text.slice(at + 1))) };
}

function header(text: string, overrides: Override[]): string {
  const lines = overrides.map((one) => `#   ${one.path}=${flowText(one.value)}`.replace(/[\r\n]+/g, " "));
  return `# A variant made in a report. Keep this file in the folder of the original: its paths are relative to it.\n# Changed values:\n${lines.join("\n")}\n${text}`;
}

// ---- Replacing a value ----

export function replaced(text: string, { path, value }: Override): string {
  const found = walk(readYaml(text), path);
  const put = (from: number, to: number, inserted: string): string => text.slice(0, from) + inserted + text.slice(to);
  const { node, missing } = found;
  const written = flowText(missing.slice(1).reduceRight<unknown>((inner, key) => ({ [key]: inner }), value));
  if (missing.length === 0) {
    const block = node.indent >= 0 || node.kind === "empty" || /^[|>]/.test(text[node.begin]);
    return block ? put(node.head, node.end, ` ${written}`) : put(node.begin, node.end, written);
  }
  const entry = `${flowText(missing[0])}: ${written}`;
  if (node.kind === "empty") return put(node.head, node.end, ` {${entry}}`);
  if (node.kind !== "mapping") throw new Error(`${path}: the file has a value without keys there.`);
  if (node.indent < 0) return put(node.end - 1, node.end - 1, `${node.entries.length > 0 ? ", " : ""}${entry}`);
  const lineEnd = text.indexOf("\n", node.end);
  const at = lineEnd < 0 ? text.length : lineEnd;
  return put(at, at, `\n${" ".repeat(node.indent)}${entry}`);
}

// The node at the path, or the last one that exists and the missing keys.
function walk(root: YamlNode, path: string): { node: YamlNode; missing: string[] } {
  let node = root;
  let rest = path;
  const fail = (what: string): never => {
    throw new Error(`${path}: ${what} The scenario file cannot express this; use the overrides.`);
  };
  while (rest !== "") {
    const [whole, digits] = /^\[(\d+)\]/.exec(rest) ?? [];
    if (whole !== undefined) {
      if (node.kind !== "list" || !node.items[Number(digits)]) return fail(`no item [${digits}] in the file.`);
      node = node.items[Number(digits)];
      rest = rest.slice(whole.length);
      continue;
    }
    rest = rest.replace(/^\./, "");
    const step = node.kind === "list" ? namedItem(node, rest) : longest(node.entries.map((entry) => [entry.key, entry.node]), rest);
    if (!step && node.kind === "list") return fail(`no item of this name in the file.`);
    if (!step) return { node, missing: rest.split(".") };
    node = step[1];
    rest = rest.slice(step[0].length);
  }
  return { node, missing: [] };
}

// An item by its name, or a grasp by its end-effector.
function namedItem(list: YamlNode, rest: string): [string, YamlNode] | undefined {
  const label = (item: YamlNode): string => String(["name", "end_effector"].map((key) => item.entries.find((entry) => entry.key === key)?.node.value).find((value) => typeof value === "string") ?? "");
  return longest(list.items.map((item) => [label(item), item]), rest);
}

// Names may contain dots: the longest that the path continues with.
function longest(names: [string, YamlNode][], rest: string): [string, YamlNode] | undefined {
  const fitting = names.filter(([name]) => name !== "" && rest.startsWith(name) && /^($|[.[])/.test(rest.slice(name.length)));
  return fitting.sort((a, b) => b[0].length - a[0].length)[0];
}

// ---- The robot in the scenario ----

function withRobot(text: string, robot: string | undefined): string {
  const found = walk(readYaml(text), "robot");
  if (found.missing.length > 0 || found.node.kind !== "scalar") return text; // the scenario contains it
  const file = String(found.node.value);
  if (!robot) throw new Error("The result does not contain the text of its robot file; use the overrides.");
  let content: unknown;
  try {
    content = plainValue(readYaml(robot));
  } catch (error) {
    if (!(error instanceof YamlError)) throw error;
    throw new Error(`The robot file is not one of Grapnel (${error.message}); use the overrides.`);
  }
  const folder = file.includes("/") ? file.replace(/[^/]*$/, "") : /\.ya?ml$/i.test(file) ? "" : null;
  return replaced(text, { path: "robot", value: moved(content, folder) });
}

// Files of meshes, relative to the scenario instead of the robot; `folder` null: the robot is a ready-made one.
function moved(value: unknown, folder: string | null): unknown {
  if (Array.isArray(value)) return value.map((item) => moved(item, folder));
  if (value === null || typeof value !== "object") return value;
  const mapping = value as Record<string, unknown>;
  const isMesh = mapping.shape === "mesh" && typeof mapping.file === "string";
  if (isMesh && folder === null) throw new Error("The meshes of a ready-made robot have no path in a scenario file; use the overrides.");
  return Object.fromEntries(Object.entries(mapping).map(([key, item]) => [key, isMesh && key === "file" && !String(item).startsWith("/") ? folder + String(item) : moved(item, folder)]));
}
