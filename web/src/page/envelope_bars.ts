// Captures of three or more grasps at a glance: how much of its envelope each grasp used, as bars.
import { element } from "../dom";
import { number, withUnit } from "../format";
import type { Run } from "../run";
import { list, num, text } from "./read";
import { mark } from "./table";

export interface EnvelopeShare {
  grasp: string; // end-effector
  captured: boolean;
  reason: string;
  shares: { name: string; value: number; limit: number; unit: string }[]; // share: value / limit
}

const kFewest = 3; // fewer grasps are clear as sentences

// Empty: sentences are clearer, or the scene has no envelopes.
export function envelopeShares(run: Run): EnvelopeShare[] {
  const grasps = list(run.summary?.capture?.grasps);
  const limits = list(run.scene?.limits?.grasps);
  if (grasps.length < kFewest || limits.length === 0) return [];
  return grasps.map((grasp) => {
    const envelope = limits.find((one) => one?.end_effector === grasp.end_effector);
    const share = (name: string, value: unknown, limit: unknown, unit: string) => {
      const [is, most] = [num(value), num(limit)];
      return is !== null && most !== null && most > 0 ? [{ name, value: is, limit: most, unit }] : [];
    };
    return {
      grasp: text(grasp.end_effector),
      captured: grasp.captured === "yes" || grasp.captured === "assumed",
      reason: text(grasp.reason, ""),
      shares: [...share("distance", grasp.distance, envelope?.position, "m"), ...share("speed", grasp.velocity, envelope?.velocity, "m/s")],
    };
  });
}

export function envelopeBars(shares: EnvelopeShare[]): HTMLElement {
  const names = [...new Set(shares.flatMap((one) => one.shares.map((share) => share.name)))];
  return element(
    "div",
    { class: "envelopes" },
    ...shares.map((one) =>
      element(
        "div",
        { class: "envelope", title: one.reason },
        mark(one.captured ? "good" : "bad", one.grasp),
        ...names.map((name) => bar(name, one.shares.find((share) => share.name === name))),
      ),
    ),
  );
}

function bar(name: string, share: EnvelopeShare["shares"][number] | undefined): HTMLElement {
  if (!share) return element("span", { class: "reason" }, `${name} –`);
  const used = share.value / share.limit;
  const fill = element("span", {});
  fill.style.width = `${100 * Math.min(1, used)}%`;
  const label = `${name} ${withUnit(share.value, share.unit, 3)} of ${withUnit(share.limit, share.unit, 3)}`;
  return element("span", { class: "envelope-share", title: label }, element("span", { class: `bar ${used > 1 ? "bad" : used > 0.8 ? "warn" : ""}`, role: "img", "aria-label": label }, fill), element("span", { class: "reason" }, `${name} ${number(100 * used, 2)} %`));
}
