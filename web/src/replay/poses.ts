// Poses of bodies and frames at an instant: linear interpolation of positions, slerp of attitudes.
import { Quaternion, Vector3 } from "three";
import type { Instant, Run, Series } from "../run";

export interface PoseTrack {
  run: Run;
  position: Series;
  quaternion: Series; // w, x, y, z
}

// Undefined: the run has no record of it.
export function poseTrack(run: Run, prefix: string): PoseTrack | undefined {
  const position = run.series(`${prefix}/position`);
  const quaternion = run.series(`${prefix}/quaternion_wxyz`);
  if (!position || !quaternion || position.width !== 3 || quaternion.width !== 4 || run.samples === 0) return undefined;
  return { run, position, quaternion };
}

const kNext = new Quaternion();

export function poseAt(track: PoseTrack, instant: Instant, position: Vector3, quaternion: Quaternion): void {
  position.fromArray(track.run.at(track.position, instant));
  sample(track.quaternion, instant.index, quaternion);
  if (instant.fraction > 0 && instant.index + 1 < track.run.samples) {
    sample(track.quaternion, instant.index + 1, kNext);
    quaternion.slerp(kNext, instant.fraction);
  }
  quaternion.normalize();
}

export function vectorAt(run: Run, series: Series, instant: Instant): Vector3 {
  return new Vector3().fromArray(run.at(series, instant));
}

function sample(series: Series, index: number, out: Quaternion): void {
  const d = series.data;
  const k = 4 * index;
  out.set(d[k + 1], d[k + 2], d[k + 3], d[k]);
}
