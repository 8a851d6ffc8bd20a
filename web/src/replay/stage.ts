// The renderer with its lights: draws on request, at most once per frame.
import { DirectionalLight, Group, HemisphereLight, PCFShadowMap, Scene, Vector3, WebGLRenderer } from "three";
import type { Camera } from "three";
import type { Sky } from "./sky";

// From the scene to the sun, in W: the light does not follow the camera, which makes changes of attitude visible.
export const kSun = new Vector3(0.42, -0.5, 0.76).normalize();

export class Stage {
  readonly scene = new Scene();
  readonly world = new Group(); // W, positioned by the view
  readonly renderer: WebGLRenderer;
  count = 0; // number of pictures drawn
  sky: Sky | null = null; // behind everything; null: the page's own background
  private readonly sun = new DirectionalLight(0xffffff, 2.1);
  private readonly fill = new DirectionalLight(0xeef3ff, 0.75); // follows the camera
  private readonly ambient = new HemisphereLight(0xffffff, 0xb4bcc6, 1.55);
  private pending = 0;
  private draw: () => void = () => {};

  constructor(
    readonly canvas: HTMLCanvasElement,
    context: WebGL2RenderingContext,
  ) {
    this.renderer = new WebGLRenderer({ canvas, context, antialias: true, alpha: true });
    this.renderer.setClearColor(0x000000, 0); // the page's own background
    this.renderer.autoClear = false;
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(1536, 1536);
    this.sun.shadow.bias = -0.0006;
    this.ambient.position.set(0, 0, 1);
    this.world.add(this.sun, this.sun.target);
    this.scene.add(this.world, this.fill, this.fill.target, this.ambient);
  }

  // The region with shadows: a ball in W.
  lightUp(centre: Vector3, radius: number): void {
    this.sun.target.position.copy(centre);
    this.sun.position.copy(centre).addScaledVector(kSun, 3 * radius);
    const camera = this.sun.shadow.camera;
    Object.assign(camera, { left: -radius, right: radius, top: radius, bottom: -radius, near: radius, far: 6 * radius });
    this.sun.shadow.normalBias = 0.004 * radius;
    camera.updateProjectionMatrix();
  }

  onDraw(draw: () => void): void {
    this.draw = draw;
  }

  // Draws one picture in the next frame, for any number of requests.
  invalidate = (): void => {
    if (this.pending) return;
    this.pending = requestAnimationFrame(() => {
      this.pending = 0;
      this.draw();
    });
  };

  render(camera: Camera): void {
    const x = new Vector3();
    const y = new Vector3();
    const z = new Vector3();
    camera.updateMatrixWorld();
    camera.matrixWorld.extractBasis(x, y, z);
    this.fill.position.set(0, 0, 0).addScaledVector(x, -0.4).addScaledVector(y, 0.5).addScaledVector(z, 1);
    this.renderer.clear();
    this.sky?.render(this.renderer, camera, this.world);
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
    this.sky?.dispose();
    this.renderer.dispose();
  }
}

// The WebGL context for three.js. Null: WebGL is not available.
export function webgl(canvas: HTMLCanvasElement): WebGL2RenderingContext | null {
  try {
    return canvas.getContext("webgl2", { alpha: true, antialias: true, depth: true, powerPreference: "default" });
  } catch {
    return null;
  }
}
