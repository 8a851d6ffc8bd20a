// Joints tinted by their torque: from the colour of joints to red at the effort limit.
import { Color, Mesh, MeshStandardMaterial } from "three";
import { roleColor, type Scheme } from "../colors";
import type { Scene } from "../data";
import type { Instant, Run, Series } from "../run";
import { shareUsed } from "./actuators";
import type { BodyView } from "./bodies";

interface Tinted {
  component: number;
  limit: number | null;
  largest: number;
  materials: MeshStandardMaterial[];
}

export class TorqueTint {
  private readonly joints: Tinted[] = [];
  private readonly series: Series | undefined;

  constructor(
    private readonly run: Run,
    scene: Scene,
    bodies: BodyView[],
  ) {
    this.series = run.series("joints/effort");
    if (!this.series) return;
    const limits = Array.isArray(scene.limits?.joints) ? scene.limits.joints : [];
    for (const view of bodies) {
      const component = this.series.components.indexOf(view.body.joint?.name ?? "");
      const materials = component < 0 ? [] : ownMaterials(view);
      if (materials.length === 0) continue;
      const limit = limits.find((one) => one.joint === view.body.joint!.name)?.effort ?? null;
      this.joints.push({ component, limit, largest: this.largest(component), materials });
    }
  }

  get empty(): boolean {
    return this.joints.length === 0;
  }

  update(instant: Instant, shown: boolean, scheme: Scheme): void {
    if (!this.series || this.empty) return;
    const efforts = shown ? this.run.at(this.series, instant) : [];
    const [plain, full] = ["joint", "limit"].map((role) => new Color(roleColor(role, scheme)));
    for (const joint of this.joints) {
      const share = shown ? Math.min(1, shareUsed(efforts[joint.component], joint.limit, joint.largest)) : 0;
      for (const material of joint.materials) material.color.copy(plain).lerp(full, share);
    }
  }

  private largest(component: number): number {
    const { data, width } = this.series!;
    let most = 0;
    for (let i = component; i < data.length; i += width) most = Math.max(most, Math.abs(data[i]) || 0);
    return most;
  }
}

// Replaces the shared material of a link's drawn joint by a separate one.
function ownMaterials(view: BodyView): MeshStandardMaterial[] {
  const made: MeshStandardMaterial[] = [];
  view.joint?.traverse((part) => {
    if (!(part instanceof Mesh) || !(part.material instanceof MeshStandardMaterial)) return;
    part.material = part.material.clone();
    made.push(part.material);
  });
  return made;
}
