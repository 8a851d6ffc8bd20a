// What everything in the replay is painted with. A role ("base", "arm 1", "ghost") has one colour per theme; materials
// are made once per role and recoloured when the theme changes.
import { Color, LineBasicMaterial, type Material, MeshBasicMaterial, MeshStandardMaterial, ShaderMaterial, Vector2 } from "three";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { roleColor, type Scheme } from "../colors";

export type Theme = Scheme;
export { roleColor };

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

// Of materials: a role's own colour; large lit surfaces are paler on light pages, where it is dark for thin lines'
// sake.
function paintColor(role: string, theme: Theme): Color {
  const [, surface] = /^surface (.*)$/.exec(role) ?? [];
  const color = new Color(roleColor(surface ?? role, theme));
  const pale = surface === undefined || theme === "dark" ? 0 : surface.startsWith("target") ? 0.13 : surface === "base" ? 0.25 : 0;
  return color.lerp(new Color(0xffffff), pale);
}

interface Painted {
  role: string;
  set(color: Color): void;
  material: Material;
}

export class Paints {
  private readonly made = new Map<string, Painted>();
  private readonly viewport = new Vector2(800, 500); // [device pixels], shared by all rims
  theme: Theme = "light";

  // Lit surfaces of bodies. Translucent surfaces hide other translucent surfaces behind them, so that a ghost remains
  // readable.
  surface(role: string, opacity = 1): MeshStandardMaterial {
    return this.keep(`surface ${opacity} ${role}`, `surface ${role}`, () => {
      const material = new MeshStandardMaterial({ roughness: role === "panel" ? 0.35 : 0.62, metalness: 0.04, transparent: opacity < 1, opacity });
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
  // Lines with opacity per vertex.
  fading(role: string, opacity: number): LineBasicMaterial {
    return this.keep(`fading ${opacity} ${role}`, role, () => {
      return new LineBasicMaterial({ transparent: true, opacity, depthWrite: false, vertexColors: true });
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
      color: { value: paintColor(role, this.theme) },
      opacity: { value: opacity },
    };
    const material = new ShaderMaterial({
      vertexShader: kRimVertex,
      fragmentShader: kRimFragment,
      uniforms,
      side: 1, // back faces
      transparent: opacity < 1,
    });
    this.made.set(key, { role, material, set: (color) => uniforms.color.value.copy(color) });
    return material;
  }

  resize(width: number, height: number, pixelRatio: number): void {
    this.viewport.set(width / pixelRatio, height / pixelRatio);
  }
  apply(theme: Theme): void {
    this.theme = theme;
    for (const one of this.made.values()) one.set(paintColor(one.role, theme));
  }
  dispose(): void {
    for (const one of this.made.values()) one.material.dispose();
    this.made.clear();
  }

  private keep<M extends Material & { color: Color }>(key: string, role: string, make: () => M): M {
    const found = this.made.get(key);
    if (found) return found.material as M;
    const material = make();
    material.color.copy(paintColor(role, this.theme));
    this.made.set(key, { role, material, set: (color) => material.color.copy(color) });
    return material;
  }
}
