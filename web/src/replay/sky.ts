// Decorative stars and Earth: not computed, but fixed in W, which makes rotation visible.
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
import { kSun } from "./stage";

const kStars = 1400;
const kEarthSize = 0.17; // radius over distance

const kVertex = `
varying vec3 at;
void main() { at = normalize(position); gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }`;
const kFragment = `
uniform vec3 sun; varying vec3 at;
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
  vec3 color = mix(ground, vec3(0.85), 0.8 * cloud);
  gl_FragColor = vec4(color * (0.03 + 1.1 * max(0.0, dot(at, sun))), 1.0);
#include <colorspace_fragment>
}`;

export class Sky {
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(27, 1, 0.1, 200);

  // `earth`: direction to the Earth, in W.
  constructor(earth: Vector3) {
    const globe = new Mesh(new SphereGeometry(100 * kEarthSize, 64, 48), new ShaderMaterial({ vertexShader: kVertex, fragmentShader: kFragment, uniforms: { sun: { value: kSun } } }));
    globe.position.copy(earth).normalize().multiplyScalar(100);
    this.scene.add(stars(), globe);
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
