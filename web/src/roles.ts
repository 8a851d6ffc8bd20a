// Which role each thing of a scene has, and with it its colour (colors.ts): the same in the replay and in plots.
import { kDashes } from "./colors";
import type { Scene } from "./data";

// Of bodies: "base", "arm 0", "target 1". An arm is what hangs on one link of the base.
export function rolesOf(scene: Scene): Map<string, string> {
  const roles = new Map<string, string>();
  let arms = 0;
  let targets = 0;
  for (const body of scene.bodies) {
    if (body.kind === "base") roles.set(body.name, "base");
    else if (body.kind === "target") roles.set(body.name, `target ${targets++}`);
    else if (body.kind === "part") roles.set(body.name, roles.get(body.parent ?? "") ?? `target ${targets}`);
    else {
      const parent = roles.get(body.parent ?? "");
      roles.set(body.name, parent?.startsWith("arm") ? parent : `arm ${arms++}`);
    }
  }
  return roles;
}

// Of names as series have them: end-effectors have their arm's role. Without a scene the order of names decides.
export class NamedRoles {
  private readonly hands = new Map<string, string>();
  private readonly targets = new Map<string, string>();

  constructor(scene: Scene | null) {
    if (!scene) return;
    const roles = rolesOf(scene);
    for (const body of scene.bodies) if (body.kind === "target") this.targets.set(body.name, roles.get(body.name)!);
    for (const end of scene.end_effectors) this.hands.set(end.name, roles.get(end.body) ?? "base");
  }

  endEffector(name: string): string {
    return known(this.hands, name, "arm");
  }
  target(name: string): string {
    return known(this.targets, name, "target");
  }
}

function known(roles: Map<string, string>, name: string, kind: string): string {
  if (!roles.has(name)) roles.set(name, `${kind} ${roles.size}`);
  return roles.get(name)!;
}

// Lines of one plot: several with one role (two end-effectors of one arm) differ by their dashes.
export function roleStyles(): (role: string) => { color: string; dash: number[] } {
  const met = new Map<string, number>();
  return (role) => {
    const count = met.get(role) ?? 0;
    met.set(role, count + 1);
    return { color: role, dash: kDashes[count % kDashes.length] };
  };
}
