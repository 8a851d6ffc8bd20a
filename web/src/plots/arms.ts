// The joints of each arm: an arm consists of the links below one link on the base. Without a scene all joints form one
// arm.
import type { Scene } from "../data";

export interface Arm {
  name: string;
  joints: { name: string; index: number; sliding: boolean }[]; // index: component of joints/...
}

export function arms(jointNames: string[], scene: Scene | null): Arm[] {
  const links = (scene?.bodies ?? []).filter((body) => body.kind === "link" && body.joint);
  const root = new Map<string, string>(); // link -> the arm's first link
  for (const link of links) root.set(link.name, root.get(link.parent ?? "") ?? link.name);
  const byJoint = new Map(links.map((link) => [link.joint!.name, link]));
  const groups = new Map<string, Arm>();
  jointNames.forEach((name, index) => {
    const link = byJoint.get(name);
    const key = link ? root.get(link.name)! : "";
    if (!groups.has(key)) groups.set(key, { name: key, joints: [] });
    groups.get(key)!.joints.push({ name, index, sliding: link?.joint?.type === "prismatic" });
  });
  for (const arm of groups.values()) arm.name = armName(arm);
  return [...groups.values()];
}

// The common prefix of the joint names ("arm-1-joint-" -> "arm-1"), else the name of the first link.
function armName(arm: Arm): string {
  const names = arm.joints.map((joint) => joint.name);
  let common = names[0];
  for (const name of names) while (!name.startsWith(common)) common = common.slice(0, -1);
  if (names.length < 2) common = "";
  const word = common.replace(/[-_. ]*(joint|jnt|j)?[-_. ]*$/i, "");
  return word || arm.name || "joints";
}

// A joint's name without the arm's: "joint-1" of "arm-1-joint-1".
export function shortJoint(name: string, arm: Arm): string {
  const rest = name.startsWith(arm.name) ? name.slice(arm.name.length).replace(/^[-_. ]+/, "") : name;
  return rest || name;
}
