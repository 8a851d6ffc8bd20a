// The renderer with its lights: draws when asked to, and then once.
import { DirectionalLight, Group, HemisphereLight, Scene, Vector3, WebGLRenderer } from "three";
import type { Camera } from "three";
import { BufferGeometry, Float32BufferAttribute, LineSegments } from "three";
import type { Paints } from "./palette";

export class Stage {
  readonly scene = new Scene();
  readonly world = new Group(); // W, moved as the view asks
  readonly renderer: WebGLRenderer;
  count = 0; // pictures drawn
  private readonly key = new DirectionalLight(0xffffff, 1.75);
  private readonly fill = new DirectionalLight(0xeef3ff, 0.85);
  private readonly sky = new HemisphereLight(0xffffff, 0xb4bcc6, 1.65);
  private pending = 0;
  private draw: () => void = () => {};

  constructor(
    readonly canvas: HTMLCanvasElement,
    context: WebGL2RenderingContext,
  ) {
    this.renderer = new WebGLRenderer({ canvas, context, antialias: true, alpha: true });
    this.renderer.setClearColor(0x000000, 0); // the page's own background
    this.sky.position.set(0, 0, 1);
    this.scene.add(this.world, this.key, this.key.target, this.fill, this.fill.target, this.sky);
  }

  onDraw(draw: () => void): void {
    this.draw = draw;
  }

  // One picture with the next frame, however often it is asked for.
  invalidate = (): void => {
    if (this.pending) return;
    this.pending = requestAnimationFrame(() => {
      this.pending = 0;
      this.draw();
    });
  };

  // Lights go with the camera: from its upper left, and a weak one from its right.
  render(camera: Camera): void {
    const x = new Vector3();
    const y = new Vector3();
    const z = new Vector3();
    camera.updateMatrixWorld();
    camera.matrixWorld.extractBasis(x, y, z);
    this.key.position.set(0, 0, 0).addScaledVector(x, -0.5).addScaledVector(y, 0.7).addScaledVector(z, 1);
    this.fill.position.set(0, 0, 0).addScaledVector(x, 0.9).addScaledVector(y, -0.1).addScaledVector(z, 0.4);
    this.renderer.render(this.scene, camera);
    ++this.count;
  }

  resize(width: number, height: number, pixelRatio: number): void {
    this.renderer.setPixelRatio(pixelRatio);
    this.renderer.setSize(width, height, false);
  }

  dispose(): void {
    cancelAnimationFrame(this.pending);
    this.scene.traverse((object) => {
      const geometry = (object as { geometry?: { dispose(): void } }).geometry;
      geometry?.dispose();
    });
    this.renderer.dispose();
  }
}

// What a browser needs for three. Null: no WebGL here.
export function webgl(canvas: HTMLCanvasElement): WebGL2RenderingContext | null {
  try {
    return canvas.getContext("webgl2", { alpha: true, antialias: true, depth: true, powerPreference: "default" });
  } catch {
    return null;
  }
}

// Squares in a plane z = `height` about a centre, with a step of 1, 2 or 5 times a power of ten [m].
export function grid(centre: Vector3, radius: number, height: number, paints: Paints): { object: LineSegments; step: number } {
  const wish = radius / 5;
  const power = 10 ** Math.floor(Math.log10(wish));
  const step = [1, 2, 5, 10].map((k) => k * power).find((s) => s >= wish * 0.999) ?? wish;
  const half = Math.ceil((3 * radius) / step);
  const [cx, cy] = [Math.round(centre.x / step), Math.round(centre.y / step)];
  const points: number[] = [];
  for (let k = -half; k <= half; ++k) {
    points.push((cx + k) * step, (cy - half) * step, height, (cx + k) * step, (cy + half) * step, height);
    points.push((cx - half) * step, (cy + k) * step, height, (cx + half) * step, (cy + k) * step, height);
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(points, 3));
  const object = new LineSegments(geometry, paints.line("grid", 0.2));
  object.renderOrder = -1;
  return { object, step };
}
