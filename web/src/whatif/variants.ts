// Variants of a run: their requests, links and command lines. No DOM.
import type { PartlySummary } from "../data";
import { num } from "../page/read";
import type { Run } from "../run";
import type { Override, VariantRequest } from "./engine_interface";
import type { Settings } from "./settings";
import { flowText, shellWord } from "./yaml_text";

export interface Variant {
  name: string;
  request: VariantRequest;
  run: Run;
}

export function settingText(one: Override): string {
  return `${one.path}=${flowText(one.value)}`;
}

// "--set targets.sphere.mass=12"; one line each, joined for a POSIX shell.
export function commandText(overrides: Override[], scenario: string): string {
  const words = overrides.map((one) => `--set ${shellWord(settingText(one))}`);
  return `${["grapnel run", shellWord(scenario), ...words].join(" \\\n  ").replace("run \\\n  ", "run ")}\n`;
}

// ---- Success ----

// Captured, and no check of the ledger fails.
export function succeeds(s: PartlySummary): boolean {
  return s.status === "completed" && s.capture?.captured !== "no" && s.ledger?.pass !== false && s.impact !== undefined;
}

// ---- Links ----

const kLongestLink = 20_000;
const kMostOverrides = 200;

export interface Linked {
  name: string;
  request: VariantRequest;
}

// "#variant=..."
export function fragmentOf({ name, request }: Linked): string {
  const content = { name, plan: request.plan, set: request.overrides.map((one) => [one.path, one.value]) };
  return `#variant=${encodeURIComponent(JSON.stringify(content))}`;
}

// Null: the fragment is of another kind. @throws Error with a message for the user.
export function linkedVariant(fragment: string): Linked | null {
  if (!fragment.startsWith("#variant=")) return null;
  if (fragment.length > kLongestLink) throw new Error(`The link's variant is longer than ${kLongestLink} characters.`);
  let content: unknown;
  try {
    content = JSON.parse(decodeURIComponent(fragment.slice("#variant=".length)));
  } catch {
    throw new Error("The link's variant is damaged: it is not JSON.");
  }
  const { name, plan, set } = (content ?? {}) as { name?: unknown; plan?: unknown; set?: unknown };
  if (typeof name !== "string" || name.length > 200) throw new Error("The link's variant has no name of at most 200 characters.");
  if (plan !== "again" && plan !== "keep") throw new Error("The link's variant does not state its plan: again or keep.");
  if (!Array.isArray(set) || set.length > kMostOverrides) throw new Error(`The link's variant has no list of at most ${kMostOverrides} changed values.`);
  const overrides = set.map((one): Override => {
    if (!Array.isArray(one) || one.length !== 2 || typeof one[0] !== "string" || one[0] === "") throw new Error("A changed value of the link's variant is not a path and a value.");
    return { path: one[0], value: one[1] };
  });
  return { name, request: { plan, overrides } };
}

// ---- The joint motion of the base case as an override ----

// The approach with the final joint values that the planner found, for a variant with the same joint motion. A text:
// the reason why overrides cannot express it.
export function keptApproach(settings: Settings, base: Run): Override | string {
  const approach = settings.value("approach");
  const plan = base.summary.approach?.plan;
  const given = approach as Record<string, unknown> | undefined;
  if (given === undefined || given.plan === undefined) return "";
  const why = given.straight_in !== undefined ? "a final straight approach" : given.window !== undefined ? "a window of capture times" : settings.match("grasps.*.relative_velocity").length > 0 ? "relative velocities of grasps" : hasKnots(given.plan) ? "splines" : "";
  if (why) return `Overrides cannot express the joint motion of a plan with ${why}: the program plans again.`;
  const [position, rates] = [plan?.final_position, plan?.final_rates].map((list) => (Array.isArray(list) ? list.map(num) : []));
  if (position.length === 0 || position.length !== rates.length || [...position, ...rates].includes(null)) return "The result does not contain the planned joint values: the program plans again.";
  const { plan: _plan, final_rates: _rates, ...rest } = given;
  return { path: "approach", value: { ...rest, final_joints: position, final_rates: rates } };
}

function hasKnots(plan: unknown): boolean {
  return plan !== null && typeof plan === "object" && Number((plan as { knots?: unknown }).knots ?? 0) > 0;
}
