// What everything in the replay is painted with. A role ("base", "arm 1", "ghost") has one colour per theme; materials are made once per
// role and recoloured when the theme changes.
import { Color, LineBasicMaterial, type Material, MeshBasicMaterial, MeshStandardMaterial, ShaderMaterial, Vector2 } from "three";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";

export type Theme = "light" | "dark";

// Hues that stay apart for colour-blind readers: arms are saturated, targets pale, the base grey. [light, dark]
const kArms: [string, string][] = [
  ["#2c7fb8", "#4a9fd8"],
  ["#d9713a", "#e8854f"],
  ["#259a78", "#38b48f"],
  ["#b56f9e", "#cf8fba"],
  ["#6f7bc8", "#8d99e4"],
  ["#8a7a2a", "#b5a345"],
];
const kTargets: [string, string][] = [
  ["#d8bf78", "#d0b468"],
  ["#b9b3d6", "#aca6cf"],
  ["#a9cfc0", "#9cc7b6"],
  ["#dbb0a4", "#d0a193"],
  ["#a8c4dd", "#9ab8d4"],
  ["#c9c9a2", "#bdbd92"],
];
const kFixed: Record<string, [string, string]> = {
  base: ["#a9b3bf", "#8f9baa"],
  joint: ["#596573", "#7f8c9a"],
  edge: ["#27323f", "#070a0e"],
  ghost: ["#8794a3", "#8c99a8"],
  second: ["#8a4fbf", "#bb8cf0"],
  impulse: ["#c2185b", "#ff6b9d"],
  force: ["#a04a00", "#ffb066"],
  system: ["#1c2733", "#f0f4f8"],
  robot: ["#48617a", "#9fb8d0"],
  mass: ["#1c2733", "#f0f4f8"],
  grid: ["#5d7083", "#8fa3b8"],
  "axis x": ["#c0392b", "#ff7b6b"],
  "axis y": ["#1e8449", "#58c98a"],
  "axis z": ["#2457c5", "#7aa5ff"],
};

export function roleColor(role: string, theme: Theme): string {
  const [kind, index] = role.split(" ");
  const pair =
    kFixed[role] ??
    (kind === "arm" ? kArms[Number(index) % kArms.length] : kind === "target" ? kTargets[Number(index) % kTargets.length] : kFixed.base);
  return pair[theme === "dark" ? 1 : 0];
}

// The page's theme: what its root says, else what the system prefers.
export function currentTheme(): Theme {
  const said = document.documentElement.dataset.theme;
  if (said === "dark" || said === "light") return said;
  return matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
}

// Returns what ends the listening.
export function listenTheme(changed: () => void): () => void {
  const media = matchMedia("(prefers-color-scheme: dark)");
  const observer = new MutationObserver(changed);
  observer.observe(document.documentElement, { attributes: true, attributeFilter: ["data-theme"] });
  media.addEventListener("change", changed);
  return () => {
    observer.disconnect();
    media.removeEventListener("change", changed);
  };
}

// Smooth bodies have no edges to draw; instead their back faces, pushed outwards by some pixels, make a dark rim.
const kRimVertex = `
uniform vec2 viewport; uniform float width;
void main() {
  vec4 p = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  vec2 n = (normalMatrix * normal).xy;
  float size = length(n);
  if (size > 1e-6) p.xy += n / size * width * 2.0 / viewport * p.w;
  gl_Position = p;
}`;
const kRimFragment = `
uniform vec3 color; uniform float opacity;
void main() { gl_FragColor = vec4(color, opacity);
#include <colorspace_fragment>
}`;

interface Painted {
  role: string;
  set(color: string): void;
  material: Material;
}

export class Paints {
  private readonly made = new Map<string, Painted>();
  private readonly viewport = new Vector2(800, 500); // [device pixels], shared by all rims
  theme: Theme = "light";

  // Lit surfaces of bodies. Translucent ones still hide what is behind them of their own kind, so that a ghost stays readable.
  surface(role: string, opacity = 1): MeshStandardMaterial {
    return this.keep(`surface ${opacity} ${role}`, role, () => {
      const material = new MeshStandardMaterial({ roughness: 0.62, metalness: 0.04, transparent: opacity < 1, opacity });
      material.polygonOffset = true; // edges lie on faces, and solid faces before translucent ones in the same place
      material.polygonOffsetFactor = opacity < 1 ? 3 : 1;
      material.polygonOffsetUnits = opacity < 1 ? 6 : 1;
      return material;
    });
  }
  // Unlit: arrows and markers. `onTop` shines faintly through bodies.
  flat(role: string, opacity = 1, onTop = false): MeshBasicMaterial {
    return this.keep(
      `flat ${opacity} ${onTop} ${role}`,
      role,
      () => new MeshBasicMaterial({ transparent: opacity < 1 || onTop, opacity, depthTest: !onTop, depthWrite: !onTop && opacity === 1 }),
    );
  }
  line(role: string, opacity = 1): LineBasicMaterial {
    return this.keep(`line ${opacity} ${role}`, role, () => {
      return new LineBasicMaterial({ transparent: opacity < 1, opacity, depthWrite: opacity === 1 });
    });
  }
  wideLine(role: string, width: number, opacity = 1): LineMaterial {
    return this.keep(
      `wide ${width} ${opacity} ${role}`,
      role,
      () => new LineMaterial({ linewidth: width, transparent: opacity < 1, opacity }),
    );
  }
  rim(role: string, opacity = 1): ShaderMaterial {
    const key = `rim ${opacity} ${role}`;
    const found = this.made.get(key);
    if (found) return found.material as ShaderMaterial;
    const uniforms = {
      viewport: { value: this.viewport },
      width: { value: 1.1 },
      color: { value: new Color(roleColor(role, this.theme)) },
      opacity: { value: opacity },
    };
    const material = new ShaderMaterial({
      vertexShader: kRimVertex,
      fragmentShader: kRimFragment,
      uniforms,
      side: 1, // back faces
      transparent: opacity < 1,
    });
    this.made.set(key, { role, material, set: (color) => uniforms.color.value.set(color) });
    return material;
  }

  resize(width: number, height: number, pixelRatio: number): void {
    this.viewport.set(width / pixelRatio, height / pixelRatio);
  }
  apply(theme: Theme): void {
    this.theme = theme;
    for (const one of this.made.values()) one.set(roleColor(one.role, theme));
  }
  dispose(): void {
    for (const one of this.made.values()) one.material.dispose();
    this.made.clear();
  }

  private keep<M extends Material & { color: Color }>(key: string, role: string, make: () => M): M {
    const found = this.made.get(key);
    if (found) return found.material as M;
    const material = make();
    material.color.set(roleColor(role, this.theme));
    this.made.set(key, { role, material, set: (color) => material.color.set(color) });
    return material;
  }
}
