// The replay as a video file: recorded in real time as displayed, with labels, legend and time.
import type { Clock } from "../clock";
import { download } from "../dom";

const kRate = 30; // pictures per second, at most
const kTypes = ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm"];

// What this browser records, or why it records nothing.
export function videoType(scope: { MediaRecorder?: { isTypeSupported(type: string): boolean }; HTMLCanvasElement?: { prototype: object } }): { type: string } | { why: string } {
  if (!scope.MediaRecorder || !scope.HTMLCanvasElement || !("captureStream" in scope.HTMLCanvasElement.prototype)) return { why: "This browser cannot record a canvas." };
  const type = kTypes.find((one) => scope.MediaRecorder!.isTypeSupported(one));
  return type ? { type } : { why: "This browser cannot write WebM video." };
}

// Who draws the picture, and what tells of it.
export interface Filmed {
  size(): { width: number; height: number }; // [px] of the video
  paint(context: CanvasRenderingContext2D): void; // the current picture
  onPicture(listener: (() => void) | null): void; // called after each picture
  invalidate(): void;
}

export class VideoRecorder {
  private recorder: MediaRecorder | null = null;
  private ends: () => void = () => {};

  constructor(
    private readonly clock: Clock,
    private readonly filmed: Filmed,
    private readonly type: string,
    private readonly name: string,
    private readonly changed: (recording: boolean, said: string) => void,
  ) {}

  get recording(): boolean {
    return this.recorder !== null;
  }

  // From the instant shown, or from the beginning where that is the end; until playing ends.
  start(): void {
    if (this.recorder) return;
    const canvas = document.createElement("canvas");
    Object.assign(canvas, this.filmed.size());
    const context = canvas.getContext("2d");
    if (!context) {
      this.changed(false, "There is no canvas to record.");
      return;
    }
    const stream = canvas.captureStream(kRate);
    const recorder = new MediaRecorder(stream, { mimeType: this.type, videoBitsPerSecond: 8_000_000 });
    const parts: Blob[] = [];
    recorder.addEventListener("dataavailable", (event) => event.data.size > 0 && parts.push(event.data));
    recorder.addEventListener("stop", () => this.save(new Blob(parts, { type: "video/webm" }), stream));
    recorder.addEventListener("error", () => this.stop());
    this.recorder = recorder;
    this.filmed.onPicture(() => this.filmed.paint(context));
    this.filmed.paint(context);
    recorder.start(1000);
    this.clock.play();
    const unlisten = this.clock.listen(() => {
      if (!this.clock.playing) this.stop();
    });
    const hidden = (): void => {
      if (document.hidden) this.stop(); // no pictures are drawn out of sight
    };
    document.addEventListener("visibilitychange", hidden);
    this.ends = () => {
      unlisten();
      document.removeEventListener("visibilitychange", hidden);
    };
    this.changed(true, "Recording, in real time");
    this.filmed.invalidate();
  }

  stop(): void {
    const recorder = this.recorder;
    if (!recorder) return;
    this.recorder = null;
    this.ends();
    this.clock.pause();
    // The last picture is drawn with the next frame.
    setTimeout(() => {
      this.filmed.onPicture(null);
      if (recorder.state !== "inactive") recorder.stop();
    }, 150);
  }

  private save(video: Blob, stream: MediaStream): void {
    for (const track of stream.getTracks()) track.stop();
    if (video.size === 0) {
      this.changed(false, "Nothing was recorded.");
      return;
    }
    download(`${this.name.replace(/[^\w.-]+/g, "-")}.webm`, video);
    this.changed(false, `Video saved, ${(video.size / 1e6).toFixed(1)} MB`);
  }
}
