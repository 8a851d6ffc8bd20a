// The quantities of the panel: what matters in a scenario, found among its values. No DOM.
import type { Run } from "../run";
import { approachGroups } from "./approach_quantities";
import { choice, decade, direct, factor, type Group, type Quantity, type Range, type Value } from "./groups";
import { hasNumbers, isNumber, isVector, type Settings, type Vec3 } from "./settings";
import { length, times, unit } from "./vectors";

export function quantitiesOf(settings: Settings, base: Run): Group[] {
  return [
    ...approachGroups(settings, base),
    ...spinGroups(settings, base),
    ...bodyGroups(settings),
    ...impactGroups(settings),
    ...jointGroups(settings),
    ...gainGroups(settings),
  ];
}

// ---- Targets and bodies ----

// Rate and axis of a target's rotation set the components of its angular velocity.
function spinGroups(settings: Settings, base: Run): Group[] {
  return settings.match("targets.*.state").flatMap(({ path: state, names: [target] }) => {
    const path = `${state}.angular_velocity`;
    const given = settings.value(path) ?? [0, 0, 0];
    if (!isVector(given)) return [];
    const rate = length(given);
    const axis: Vec3 = unit(given) ?? [0, 0, 1];
    const keys = { rate: `rate ${path}`, axis: `axis ${path}` };
    const quantities: Quantity[] = [{ key: keys.rate, name: "Spin rate", unit: "rad/s", base: rate, low: 0, high: rate > 0 ? 4 * rate : 0.5, log: false }];
    if (!base.scene?.planar)
      quantities.push({ key: keys.axis, name: "Spin axis", unit: "1", base: axis, low: -1, high: 1, log: false, note: "direction in W, of any length" });
    return {
      title: `Target ${target}`,
      quantities,
      paths: [path],
      overrides: (values) => {
        const along = unit((values.get(keys.axis) as Vec3 | undefined) ?? axis) ?? axis;
        return [{ path, value: times(along, (values.get(keys.rate) as number | undefined) ?? rate) }];
      },
      read: (value) => {
        if (!isVector(value)) return null;
        const along = unit(value) ?? axis;
        const same = along.every((x, k) => Math.abs(x - axis[k]) < 1e-12);
        if (!same && base.scene?.planar) return null;
        return [[keys.rate, length(value)], ...(same ? [] : [[keys.axis, along] as [string, Value]])];
      },
    };
  });
}

function bodyGroups(settings: Settings): Group[] {
  const parts = (title: string, body: string): Group[] =>
    ["mass", "inertia"].flatMap((key) => {
      const value = settings.value(`${body}.${key}`);
      return hasNumbers(value) ? [factor(title, key === "mass" ? "Mass, times" : "Inertia, times", `${body}.${key}`, value)] : [];
    });
  const targets = settings.match("targets.*.state").flatMap(({ path, names: [name] }) => parts(`Target ${name}`, path.replace(/\.state$/, "")));
  return [...targets, ...parts("Base of the robot", "robot.base")];
}

// ---- Impact and joints ----

const kImpact: [string, string, string, Range | null][] = [
  ["impact.restitution", "Restitution", "1", { low: 0, high: 1 }],
  ["impact.friction", "Friction", "1", { low: 0, high: 1 }],
  ["impact.contact.stiffness", "Contact stiffness", "N/m^n", null],
  ["impact.contact.damping", "Contact damping", "", null],
  ["impact.grasp.linear_stiffness", "Grasp stiffness", "N/m", null],
  ["impact.grasp.linear_damping", "Grasp damping", "N s/m", null],
  ["impact.grasp.angular_stiffness", "Angular grasp stiffness", "N m/rad", null],
  ["impact.duration", "Duration for mean forces", "s", null],
];
const kMaterial: [string, string, string, Range | null][] = [
  ["stiffness", "Contact stiffness", "N/m", null],
  ["restitution", "Restitution", "1", { low: 0.01, high: 1 }],
  ["friction", "Friction", "1", { low: 0, high: 1 }],
];
// Laws that use a key even if the file does not state it; its default is 0.
const kUsedBy: Record<string, string[]> = {
  "impact.restitution": ["bilateral_restitution", "restitution", "friction"],
  "impact.friction": ["friction"],
};

function impactGroups(settings: Settings): Group[] {
  const law = settings.value("impact.law");
  const impact = kImpact.flatMap(([path, name, unitName, range]) => {
    const used = typeof law === "string" && (kUsedBy[path] ?? []).includes(law);
    const base = settings.value(path) ?? (used ? 0 : undefined);
    return isNumber(base) ? [direct("Impact", name, unitName, path, base, range ?? decade(base))] : [];
  });
  const materials = settings.match("materials.*").flatMap(({ path, names: [name] }) =>
    kMaterial.flatMap(([key, text, unitName, range]) => {
      const base = settings.value(`${path}.${key}`);
      return isNumber(base) ? [direct(`Material ${name}`, text, unitName, `${path}.${key}`, base, range ?? decade(base))] : [];
    }),
  );
  return [...impact, ...materials];
}

// The phases after the capture: one mapping, or a list.
function phases(settings: Settings): string[] {
  const given = settings.value("post_impact");
  if (Array.isArray(given)) return given.map((_, k) => `post_impact[${k}]`);
  const named = settings.match("post_impact.*.duration").map(({ path }) => path.replace(/\.duration$/, ""));
  return named.length > 0 ? named : given === undefined ? [] : ["post_impact"];
}

function jointGroups(settings: Settings): Group[] {
  return phases(settings).flatMap((phase) => {
    const stated = settings.value(`${phase}.joints`) ?? "free";
    if (typeof stated !== "string") return [];
    const has = (key: string): boolean => settings.value(`${phase}.${key}`) !== undefined;
    const gains = has("kp") && has("kd") && stated !== "computed_torque"; // whose gains have other units
    const laws = ["detumble", "grasp_force"].filter((law) => gains && has(law));
    const choices = ["free", "braked", ...(gains ? ["pd", "keep_base_attitude"] : []), ...laws];
    if (gains && settings.value("impedance") !== undefined) choices.push("impedance");
    if (!choices.includes(stated)) choices.push(stated);
    return [choice(phaseTitle(phase), "Joints", `${phase}.joints`, stated, choices)];
  });
}

function phaseTitle(phase: string): string {
  const [, index] = /\[(\d+)\]$/.exec(phase) ?? [];
  return index === undefined ? "After the impact" : `After the impact, phase ${Number(index) + 1}`;
}

function gainGroups(settings: Settings): Group[] {
  const places: [string, string, string][] = [
    ["Approach", "approach.tracking", "of joints"],
    ["Approach", "approach.base_control", "of attitude"],
    ...phases(settings).flatMap((phase): [string, string, string][] => [
      [phaseTitle(phase), phase, "of joints"],
      [phaseTitle(phase), `${phase}.base_control`, "of attitude"],
    ]),
  ];
  return places.flatMap(([title, place, of]) =>
    ["kp", "kd"].flatMap((gain) => {
      const value = settings.value(`${place}.${gain}`);
      return hasNumbers(value) ? [factor(title, `Gain ${gain} ${of}, times`, `${place}.${gain}`, value)] : [];
    }),
  );
}
