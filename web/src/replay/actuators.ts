// Wheels, gyros and thrusters of the base: discs and cones, coloured by saturation; plumes of thrusters that fire.
import { Color, ConeGeometry, CylinderGeometry, Group, Mesh, MeshBasicMaterial, Quaternion, Vector3 } from "three";
import { roleColor, type Scheme } from "../colors";
import type { Scene } from "../data";
import type { Instant, Run, Series } from "../run";
import type { BodyView } from "./bodies";

const kY = new Vector3(0, 1, 0);
const kDisc = new CylinderGeometry(1, 1, 0.35, 28);
const kNozzle = new ConeGeometry(1, 2, 20);
const kPlume = new ConeGeometry(1, 1, 24, 1, true);

// The share of its limit that an actuator uses, from 0; at 1 it is saturated. Without a limit: of the run's largest value.
export function shareUsed(value: number, limit: number | null | undefined, largest: number): number {
  const whole = typeof limit === "number" && Number.isFinite(limit) && limit > 0 ? limit : largest;
  return whole > 0 && Number.isFinite(value) ? Math.abs(value) / whole : 0;
}

// Green far from saturation, orange near it, red at the limit.
export function saturationColor(share: number, scheme: Scheme): Color {
  const [idle, near, full] = ["idle", "near", "limit"].map((role) => new Color(roleColor(role, scheme)));
  const x = Math.min(1, Math.max(0, share));
  return x < 0.7 ? idle.lerp(near, x / 0.7) : near.lerp(full, (x - 0.7) / 0.3);
}

interface Drawn {
  series: Series;
  component: number;
  limit: number | null;
  largest: number;
  material: MeshBasicMaterial;
  turn?: (instant: Instant) => void; // of a gyro's disc
  plume?: Mesh;
}

export class Actuators {
  readonly object = new Group();
  private readonly drawn: Drawn[] = [];

  // Moves with the base.
  constructor(
    private readonly run: Run,
    scene: Scene,
    base: BodyView | undefined,
  ) {
    if (!base) return;
    const list = Array.isArray(scene.actuators) ? scene.actuators : [];
    const size = Math.max(base.radius, 0.1);
    let rotors = 0;
    for (const one of list) {
      if (one.kind === "thruster") this.addThruster(one, size);
      else this.addRotor(one, base, size, rotors++, list.length);
    }
  }

  get empty(): boolean {
    return this.drawn.length === 0;
  }

  update(instant: Instant, base: BodyView | undefined, shown: boolean, scheme: Scheme): void {
    this.object.visible = shown && base?.track !== undefined && !this.empty;
    if (!this.object.visible) return;
    this.object.position.copy(base!.object.position);
    this.object.quaternion.copy(base!.object.quaternion);
    for (const one of this.drawn) {
      const value = this.run.at(one.series, instant)[one.component];
      const share = shareUsed(value, one.limit, one.largest);
      one.material.color.copy(saturationColor(share, scheme));
      one.turn?.(instant);
      if (!one.plume) continue;
      one.plume.visible = share > 1e-3;
      one.plume.scale.setY(Math.max(1e-3, share) * one.plume.userData.length).setX(0.3 * one.plume.userData.length).setZ(0.3 * one.plume.userData.length);
    }
  }

  private add(path: string, name: string, limit: number | null, material: MeshBasicMaterial): Drawn | undefined {
    const series = this.run.series(path);
    const component = series?.components.indexOf(name) ?? -1;
    if (!series || component < 0) return undefined;
    let largest = 0;
    for (let i = component; i < series.data.length; i += series.width) largest = Math.max(largest, Math.abs(series.data[i]) || 0);
    const made = { series, component, limit, largest, material };
    this.drawn.push(made);
    return made;
  }

  // Rotors have no position: they are drawn along their axes about the base's centre of mass, visible through it.
  private addRotor(one: Scene["actuators"][number], base: BodyView, size: number, index: number, count: number): void {
    const material = new MeshBasicMaterial({ transparent: true, opacity: 0.85, depthTest: false });
    const made = this.add(one.kind === "gyro" ? "gyros/rate" : "wheels/rate", one.name, one.limit, material);
    if (!made) return;
    const disc = new Mesh(kDisc, material);
    disc.renderOrder = 15;
    const radius = (count > 4 ? 0.1 : 0.14) * size;
    disc.scale.setScalar(radius);
    const axis = new Vector3(...one.axis).normalize();
    const aside = 0.45 + 0.12 * Math.floor(index / 3);
    disc.position.set(...base.body.com).addScaledVector(axis, aside * size);
    const spin = one.spin_axis ? new Vector3(...one.spin_axis).normalize() : axis;
    disc.quaternion.setFromUnitVectors(kY, spin);
    this.object.add(disc);
    const angles = one.kind === "gyro" ? this.run.series("gyros/angle") : undefined;
    const at = angles?.components.indexOf(one.name) ?? -1;
    if (!angles || at < 0) return;
    const zero = disc.quaternion.clone();
    made.turn = (instant) => disc.quaternion.setFromAxisAngle(axis, this.run.at(angles, instant)[at]).multiply(zero);
  }

  private addThruster(one: Scene["actuators"][number], size: number): void {
    const material = new MeshBasicMaterial();
    const made = this.add("thrusters/force", one.name, one.limit, material);
    if (!made || !one.position) return;
    const force = new Vector3(...one.axis).normalize();
    const place = (mesh: Mesh): Mesh => {
      mesh.position.set(...one.position!);
      mesh.quaternion.copy(new Quaternion().setFromUnitVectors(kY, force)); // cones point along the force; exhaust leaves their base
      this.object.add(mesh);
      return mesh;
    };
    place(new Mesh(kNozzle, material)).scale.setScalar(0.035 * size);
    const exhaust = new MeshBasicMaterial({ color: 0xffa040, transparent: true, opacity: 0.55, depthWrite: false });
    const plume = place(new Mesh(kPlume.clone().translate(0, -0.5, 0), exhaust));
    plume.userData.length = 0.7 * size;
    plume.visible = false;
    made.plume = plume;
  }
}
