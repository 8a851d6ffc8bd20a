// The 3D replay of one run or of two: a picture of the bodies at the clock's instant, playback, and display options.
import "./replay.css";
import type { Clock } from "../clock";
import { element } from "../dom";
import type { Run } from "../run";
import { impactsOf } from "./impacts";
import { keyList, listenKeys } from "./keyboard";
import { makeStill } from "./print";
import { webgl } from "./stage";
import { Toolbar } from "./toolbar";
import { Transport } from "./transport";
import { VideoRecorder, videoType } from "./video";
import { messageInstead, type Pose, Viewport } from "./viewport";

export interface Replay {
  bodyPose(name: string, run?: number): Pose | null; // as drawn, in W; null: not drawn
  cameraName(): string; // "inertial", "follow base", "follow NAME", "top"; "": no picture
  cameraDirection(): [number, number, number]; // unit vector from the view target to the camera
  renderCount(): number; // number of pictures drawn
  compare(variant: Run | null): void; // a variant of the first run, translucent; null: none
  dispose(): void;
}

export function createReplay(host: HTMLElement, runs: Run[], clock: Clock): Replay {
  const root = element("section", { class: "replay", "aria-label": "3D replay" });
  host.append(root);
  const first = runs.find((run) => run.samples > 0) ?? runs[0];
  const transport = new Transport(clock, first, impactsOf(first));
  const picture = element("div", { class: "replay-viewport" });
  const viewport = makeViewport(picture, runs, clock);
  const camera = (index: number): void => {
    if (!viewport || !viewport.rig.list[index]) return;
    viewport.setCamera(index);
    toolbar?.select(index, viewport.rig.active.follow !== null);
  };
  const toolbar = viewport ? makeToolbar(viewport, camera) : undefined;
  if (toolbar) {
    root.append(toolbar.host);
    picture.append(toolbar.turn);
  }
  const keys = keyList();
  const help = (): void => (keys.open ? keys.close() : keys.showModal());
  toolbar?.offerKeys(help);
  root.append(picture, moreButton(root), keys);
  if (viewport) root.append(viewport.legendHost);
  if (clock.end > clock.begin) root.append(transport.host);
  if (viewport && clock.end > clock.begin) offerVideo(transport, viewport, clock, first);
  const ends = [
    clock.listen(() => {
      transport.update();
      viewport?.invalidate();
    }),
    listenKeys(root, {
      clock,
      transport,
      camera,
      reset: () => viewport?.rig.reset(),
      zoom: (factor) => viewport?.rig.zoom(factor),
      orbit: (right, up) => viewport?.rig.orbit(right, up),
      help,
    }),
  ];
  if (viewport) ends.push(makeStill(root, viewport, clock, impactsOf(first)));
  return {
    bodyPose: (name, run) => viewport?.bodyPose(name, run) ?? null,
    cameraName: () => viewport?.rig.active.id ?? "",
    cameraDirection: () => viewport?.rig.sight() ?? [0, 0, 0],
    renderCount: () => viewport?.stage.count ?? 0,
    compare: (variant) => {
      transport.rescale();
      viewport?.compare(variant);
    },
    dispose: () => {
      clock.pause();
      for (const end of ends) end();
      viewport?.dispose();
      root.remove();
    },
  };
}

// On narrow screens, where the replay remains visible, this hides everything except playback.
function moreButton(root: HTMLElement): HTMLElement {
  const button = element("button", { type: "button", class: "replay-more replay-chip", "aria-expanded": "false" }, "More");
  button.addEventListener("click", () => {
    const open = root.classList.toggle("opened");
    button.setAttribute("aria-expanded", String(open));
    button.textContent = open ? "Less" : "More";
  });
  return button;
}

function offerVideo(transport: Transport, viewport: Viewport, clock: Clock, run: Run): void {
  const offer = videoType(globalThis as unknown as Parameters<typeof videoType>[0]);
  if ("why" in offer) {
    transport.offerVideo(null, offer.why);
    return;
  }
  const name = String(run.summary?.scenario?.name ?? "replay");
  const recorder = new VideoRecorder(clock, viewport, offer.type, name, (recording, message) => transport.recording(recording, message));
  transport.offerVideo(() => (recorder.recording ? recorder.stop() : recorder.start()), "");
}

// Undefined: no scene, or no WebGL; a message is shown instead.
function makeViewport(picture: HTMLElement, runs: Run[], clock: Clock): Viewport | undefined {
  const drawn = runs.filter((run) => run.scene && run.scene.bodies.length > 0 && run.samples > 0);
  if (drawn.length === 0) {
    const still = runs.every((run) => run.samples === 0);
    const what = still ? "timeseries.h5, which has the motion of the bodies" : "scene.json, which has the shapes of the bodies";
    messageInstead(picture, "No replay", `The result folder has no ${what}.`);
    return undefined;
  }
  const canvas = element("canvas", { class: "replay-canvas", tabindex: "0", role: "img" });
  canvas.setAttribute("aria-label", "Motion of base, arms and targets. Drag, or W, A, S, D, to turn; plus and minus to zoom; space plays; left and right step.");
  const context = webgl(canvas);
  if (!context) {
    messageInstead(picture, "No 3D picture", "This browser offers no WebGL 2, which the picture needs. Time, plots and tables still work.");
    return undefined;
  }
  picture.append(canvas);
  return new Viewport(picture, canvas, context, drawn, clock);
}

function makeToolbar(viewport: Viewport, camera: (index: number) => void): Toolbar {
  const toolbar = new Toolbar(viewport.rig.list, viewport.shown, (what) => viewport.views[0].offers(what), viewport.views.some((view) => view.bending.isThere), {
    camera,
    reset: () => viewport.rig.reset(),
    turn: (on) => {
      viewport.rig.turnWithBody = on;
      viewport.invalidate();
    },
    bent: (times) => {
      viewport.bent = times;
      viewport.refresh();
    },
    changed: () => viewport.refresh(),
  });
  const active = viewport.rig.list.indexOf(viewport.rig.active);
  toolbar.select(active, viewport.rig.active.follow !== null);
  return toolbar;
}
