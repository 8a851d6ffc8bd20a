// Arrows of vectors: a shaft and a head, unlit, faintly visible through bodies.
import { ConeGeometry, CylinderGeometry, Group, Mesh, Quaternion, Vector3 } from "three";
import type { Paints } from "./palette";

const kY = new Vector3(0, 1, 0);
const kShaft = new CylinderGeometry(1, 1, 1, 16);
const kHead = new ConeGeometry(1, 1, 24);

export class Arrow {
  readonly object = new Group();
  private readonly shafts: Mesh[] = [];
  private readonly heads: Mesh[] = [];
  readonly tip = new Vector3();

  // `thickness`: radius of the shaft [m].
  constructor(
    paints: Paints,
    readonly role: string,
    private readonly thickness: number,
  ) {
    for (const onTop of [false, true]) {
      const material = paints.flat(role, onTop ? 0.42 : 1, onTop);
      const shaft = new Mesh(kShaft, material);
      const head = new Mesh(kHead, material);
      shaft.renderOrder = head.renderOrder = onTop ? 20 : 10;
      this.shafts.push(shaft);
      this.heads.push(head);
      this.object.add(shaft, head);
    }
    this.object.visible = false;
  }

  // An arrow with that direction and length [m] from `origin`; hidden if it is too short to have a direction.
  set(origin: Vector3, direction: Vector3, length: number): void {
    const size = direction.length();
    this.object.visible = length > 0.5 * this.thickness && size > 0;
    if (!this.object.visible) return;
    this.object.position.copy(origin);
    this.object.quaternion.copy(new Quaternion().setFromUnitVectors(kY, direction.clone().divideScalar(size)));
    this.tip.copy(origin).addScaledVector(direction, length / size);
    const head = Math.min(6.5 * this.thickness, 0.6 * length);
    const thin = Math.min(this.thickness, 0.12 * length);
    for (const shaft of this.shafts) {
      shaft.scale.set(thin, length - head, thin);
      shaft.position.y = (length - head) / 2;
    }
    for (const mesh of this.heads) {
      mesh.scale.set(2.4 * thin, head, 2.4 * thin);
      mesh.position.y = length - head / 2;
    }
  }
  hide(): void {
    this.object.visible = false;
  }
}
