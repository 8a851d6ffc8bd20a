// Stars, fixed in W, which makes rotation visible; and with an orbit the central body, in its computed direction and
// size. The pattern on its surface is decoration.
import {
  BufferGeometry,
  Float32BufferAttribute,
  type Group,
  Mesh,
  PerspectiveCamera,
  Points,
  PointsMaterial,
  Quaternion,
  Scene,
  ShaderMaterial,
  SphereGeometry,
  Vector3,
  type Camera,
  type WebGLRenderer,
} from "three";
import type { Scene as Bodies } from "../data";
import type { Instant, Run } from "../run";
import { kSun } from "./stage";

const kStars = 1400;

const kVertex = `
varying vec3 at;
void main() { at = normalize(position); gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }`;
const kFragment = `
uniform vec3 sun; uniform float earth; varying vec3 at;
float hash(vec3 p) { return fract(sin(dot(p, vec3(12.9898, 78.233, 37.719))) * 43758.5453); }
float noise(vec3 p) {
  vec3 i = floor(p), f = fract(p); f = f * f * (3.0 - 2.0 * f);
  return mix(mix(mix(hash(i), hash(i + vec3(1, 0, 0)), f.x), mix(hash(i + vec3(0, 1, 0)), hash(i + vec3(1, 1, 0)), f.x), f.y),
    mix(mix(hash(i + vec3(0, 0, 1)), hash(i + vec3(1, 0, 1)), f.x), mix(hash(i + vec3(0, 1, 1)), hash(i + vec3(1, 1, 1)), f.x), f.y), f.z);
}
float rough(vec3 p) { return 0.55 * noise(p) + 0.27 * noise(2.1 * p) + 0.18 * noise(4.3 * p); }
void main() {
  float land = smoothstep(0.52, 0.56, rough(2.4 * at + 3.0));
  float cloud = smoothstep(0.55, 0.75, rough(vec3(3.0, 3.0, 7.0) * at + 9.0));
  vec3 ground = mix(vec3(0.03, 0.12, 0.32), vec3(0.16, 0.24, 0.10), land);
  vec3 rock = mix(vec3(0.30, 0.27, 0.25), vec3(0.16, 0.15, 0.15), land);
  vec3 color = mix(rock, mix(ground, vec3(0.85), 0.8 * cloud), earth);
  gl_FragColor = vec4(color * (0.03 + 1.1 * max(0.0, dot(at, sun))), 1.0);
#include <colorspace_fragment>
}`;

const kDistance = 100; // at which it is drawn; only the ratio of its radius to it is visible

export interface CentralBody {
  name: string;
  at(instant: Instant): { direction: Vector3; ratio: number }; // to its centre, in W; radius over distance
}

// Null: the run has no orbit, or the radius of its central body is not known.
export function centralBodyOf(run: Run, scene: Bodies): CentralBody | null {
  const body = scene.central_body;
  const [radial, distance] = [run.series("orbit/radial"), run.series("orbit/radius")];
  if (!body || typeof body.radius !== "number" || !radial || !distance) return null;
  const size = body.radius;
  return {
    name: body.name,
    at: (instant) => ({
      direction: new Vector3().fromArray(run.at(radial, instant)).normalize().negate(),
      ratio: Math.min(0.999, size / run.at(distance, instant)[0]),
    }),
  };
}

export class Sky {
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(27, 1, 0.1, 200);

  private readonly globe: Mesh | null = null;

  constructor(private readonly central: CentralBody | null) {
    this.scene.add(stars());
    if (!central) return;
    const uniforms = { sun: { value: kSun }, earth: { value: central.name === "earth" ? 1 : 0 } };
    this.globe = new Mesh(new SphereGeometry(1, 128, 96), new ShaderMaterial({ vertexShader: kVertex, fragmentShader: kFragment, uniforms }));
    this.scene.add(this.globe);
  }

  pose(instant: Instant): void {
    if (!this.globe || !this.central) return;
    const { direction, ratio } = this.central.at(instant);
    this.globe.position.copy(direction).multiplyScalar(kDistance);
    this.globe.scale.setScalar(kDistance * ratio);
  }

  // Drawn first; all other objects are drawn over it.
  render(renderer: WebGLRenderer, camera: Camera, world: Group): void {
    this.camera.aspect = (camera as PerspectiveCamera).isPerspectiveCamera ? (camera as PerspectiveCamera).aspect : renderer.domElement.width / Math.max(1, renderer.domElement.height);
    this.camera.updateProjectionMatrix();
    this.camera.quaternion.copy(world.quaternion.clone().invert()).multiply(camera.getWorldQuaternion(new Quaternion()));
    renderer.setClearColor(0x04060b, 1);
    renderer.clear();
    renderer.setClearColor(0x000000, 0);
    renderer.render(this.scene, this.camera);
    renderer.clearDepth();
  }

  dispose(): void {
    for (const child of this.scene.children as (Mesh | Points)[]) {
      child.geometry.dispose();
      (child.material as ShaderMaterial | PointsMaterial).dispose();
    }
  }
}

// The same in every report: evenly distributed over the sphere, perturbed by a small generator.
function stars(): Points {
  let state = 12345;
  const random = (): number => (state = (1103515245 * state + 12345) % 2147483648) / 2147483648;
  const points: number[] = [];
  const colors: number[] = [];
  for (let i = 0; i < kStars; ++i) {
    const z = 2 * random() - 1;
    const angle = 2 * Math.PI * random();
    const r = Math.sqrt(1 - z * z);
    points.push(150 * r * Math.cos(angle), 150 * r * Math.sin(angle), 150 * z);
    const bright = 0.25 + 0.75 * random() ** 4;
    colors.push(bright, bright, bright);
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(points, 3));
  geometry.setAttribute("color", new Float32BufferAttribute(colors, 3));
  return new Points(geometry, new PointsMaterial({ size: 1.6, sizeAttenuation: false, vertexColors: true }));
}
