// The values of the scenario that overrides can replace, as a tree: found by path or by pattern. No DOM.
import type { Settable } from "./engine_interface";

interface Place {
  path: string;
  value: unknown; // undefined: only its parts have values
  parts: Map<string, Place>; // keys, names or indices of items
}

export interface Found {
  path: string;
  value: unknown;
  names: string[]; // what the stars of the pattern stand for
}

export class Settings {
  private readonly root: Place = { path: "", value: undefined, parts: new Map() };

  // `all`: the engine's, with items of lists by index or by name, and with defaults. `stated`: the values of the
  // scenario's own text, to which the tree is then limited: keys that a scenario does not state may not be allowed in
  // it. Numbers of the text that have a unit are the engine's. `names`: of bodies, end-effectors and so on; in paths they
  // may contain dots.
  constructor(
    readonly all: readonly Settable[],
    private readonly names: readonly string[] = [],
    stated?: unknown,
  ) {
    if (stated !== undefined) fill(this.root, stated);
    for (const one of all) {
      if (stated === undefined) fill(this.placeAt(one.path), one.value);
      else this.convert(one);
    }
  }

  // Undefined: not given in the base case.
  value(path: string): unknown {
    const place = this.find(path);
    return place && gathered(place);
  }

  // The path with items of lists by name, where the scenario states the value.
  named(path: string): string {
    return this.find(path)?.path ?? path;
  }

  // Values whose path has this form; a star stands for any one step: "targets.*.mass".
  match(pattern: string): Found[] {
    let found: { place: Place; names: string[] }[] = [{ place: this.root, names: [] }];
    for (const step of pattern.split(".")) {
      found = found.flatMap(({ place, names }) => {
        if (step !== "*") return place.parts.has(step) ? [{ place: place.parts.get(step)!, names }] : [];
        return [...place.parts].map(([key, part]) => ({ place: part, names: [...names, nameOf(part) ?? key] }));
      });
    }
    return found.flatMap(({ place, names }) => {
      const value = gathered(place);
      return value === undefined || value === null ? [] : [{ path: place.path, value, names }];
    });
  }

  // The path in the forms that messages of errors may have: items by name and by index.
  spellings(path: string): string[] {
    let place: Place | undefined = this.root;
    let indexed = "";
    for (const step of stepsOf(path, this.names)) {
      const keys: string[] = place ? [...place.parts.keys()] : [];
      const isList: boolean = place !== undefined && kLists.has(place.path);
      const index: number = isList && !/^\d+$/.test(step) ? keys.indexOf(step) : -1;
      indexed += index >= 0 || /^\d+$/.test(step) ? `[${index >= 0 ? index : step}]` : `${indexed ? "." : ""}${step}`;
      place = place?.parts.get(step);
    }
    return [...new Set([path, indexed])];
  }

  // An item of a list also by its index.
  private find(path: string): Place | undefined {
    return stepsOf(path, this.names).reduce<Place | undefined>((at, step) => at && (at.parts.get(step) ?? (/^\d+$/.test(step) ? [...at.parts.values()][Number(step)] : undefined)), this.root);
  }
  private convert({ path, value }: Settable): void {
    const place = this.find(path);
    const given = place && gathered(place);
    if (place && given !== undefined && !hasNumbers(given) && hasNumbers(value)) fill(place, value);
  }
  private placeAt(path: string): Place {
    let place = this.root;
    for (const step of stepsOf(path, this.names)) place = part(place, step);
    return place;
  }
}

// Lists whose items have names.
const kLists = new Set(["targets", "grasps", "materials", "obstacles", "robot.links", "robot.end_effectors", "robot.wheels"]);

// "targets[0].mass" -> "targets", "0", "mass". A name with dots is one step.
export function stepsOf(path: string, names: readonly string[] = []): string[] {
  const dotted = names.filter((name) => /[.[]/.test(name)).sort((a, b) => b.length - a.length);
  const steps: string[] = [];
  let rest = path;
  while (rest !== "") {
    const index = /^\[(\d+)\]/.exec(rest);
    rest = index ? rest.slice(index[0].length) : rest.replace(/^\./, "");
    if (index) {
      steps.push(index[1]);
      continue;
    }
    const name = dotted.find((one) => rest.startsWith(one) && /^($|[.[])/.test(rest.slice(one.length)));
    const step = name ?? /^[^.[]*/.exec(rest)![0];
    if (step === "") break; // not a path
    steps.push(step);
    rest = rest.slice(step.length);
  }
  return steps;
}

function part(place: Place, key: string): Place {
  let made = place.parts.get(key);
  if (!made) {
    const path = /^\d+$/.test(key) ? `${place.path}[${key}]` : place.path ? `${place.path}.${key}` : key;
    place.parts.set(key, (made = { path, value: undefined, parts: new Map() }));
  }
  return made;
}

function fill(place: Place, value: unknown): void {
  place.value = value;
  if (Array.isArray(value)) value.forEach((item, i) => fill(part(place, labelOf(item) ?? String(i)), item));
  else if (value !== null && typeof value === "object") for (const [key, item] of Object.entries(value)) fill(part(place, key), item);
}

function labelOf(item: unknown): string | undefined {
  if (item === null || typeof item !== "object") return undefined;
  const { name, end_effector } = item as { name?: unknown; end_effector?: unknown };
  return typeof name === "string" ? name : typeof end_effector === "string" ? end_effector : undefined;
}

function nameOf(place: Place): string | undefined {
  const name = place.parts.get("name")?.value ?? place.parts.get("end_effector")?.value;
  return typeof name === "string" ? name : undefined;
}

function gathered(place: Place): unknown {
  if (place.value !== undefined) return place.value;
  if (place.parts.size === 0) return undefined;
  const parts = [...place.parts].map(([key, one]): [string, unknown] => [key, gathered(one)]);
  if (parts.every(([key]) => /^\d+$/.test(key))) return parts.sort((a, b) => Number(a[0]) - Number(b[0])).map(([, value]) => value);
  return Object.fromEntries(parts);
}

// ---- Numbers in values ----

export function isNumber(value: unknown): value is number {
  return typeof value === "number" && Number.isFinite(value);
}

export type Vec3 = [number, number, number];
export function isVector(value: unknown): value is Vec3 {
  return Array.isArray(value) && value.length === 3 && value.every(isNumber);
}

// Every number of a value times a factor.
export function scaled(value: unknown, factor: number): unknown {
  if (isNumber(value)) return factor * value;
  if (Array.isArray(value)) return value.map((item) => scaled(item, factor));
  if (value !== null && typeof value === "object") return Object.fromEntries(Object.entries(value).map(([key, item]) => [key, scaled(item, factor)]));
  return value;
}

// In the order of the value.
export function numbersIn(value: unknown): number[] {
  if (isNumber(value)) return [value];
  return value !== null && typeof value === "object" ? Object.values(value).flatMap(numbersIn) : [];
}

export function hasNumbers(value: unknown): boolean {
  if (isNumber(value)) return true;
  return value !== null && typeof value === "object" && Object.values(value).length > 0 && Object.values(value).every(hasNumbers);
}
