// A plot as a picture for files and printing.
import { knownRole, phaseTint, roleColor } from "../colors";
import type { Run } from "../run";
import { logFloor, logValues } from "./axes";
import { shades } from "./phases";
import type { PlotSpec } from "./spec";
import { svgPlot } from "./svg";

export function pictureOf(
  spec: PlotSpec,
  runs: Run[],
  window: [number, number],
  size: { width: number; height: number },
): string {
  let values = spec.lines.map((line) => line.values());
  if (spec.log) {
    const floor = logFloor(values, spec.floor);
    values = values.map((one) => logValues(one, floor));
  }
  return svgPlot({
    id: spec.id,
    title: spec.title,
    xTitle: "time [s]",
    yTitle: spec.axis,
    limits: (spec.limits ?? []).map((limit) => ({ ...limit, color: roleColor("limit", "light") })),
    window: { min: window[0], max: window[1] },
    log: spec.log ?? false,
    lines: spec.lines.map((line, i) => ({
      label: line.label,
      color: line.color === "ink" ? "#000000" : (knownRole(line.color, "light") ?? line.color),
      dash: line.dash,
      width: Math.max(1, line.width * 0.85),
      time: runs[line.run].time,
      values: values[i],
    })),
    phases: (spec.window ? [] : shades(runs)).map((phase) => ({ ...phase, tint: phaseTint(phase.name) })),
    ...size,
  });
}

// Renders the SVG at `scale` times its size.
export async function pngOf(svg: string, scale: number): Promise<Blob> {
  const url = URL.createObjectURL(new Blob([svg], { type: "image/svg+xml" }));
  try {
    const image = new Image();
    image.src = url;
    await image.decode();
    const canvas = document.createElement("canvas");
    canvas.width = image.naturalWidth * scale;
    canvas.height = image.naturalHeight * scale;
    const context = canvas.getContext("2d");
    if (!context) throw new Error("this browser draws no PNG");
    context.drawImage(image, 0, 0, canvas.width, canvas.height);
    return await new Promise((done, fail) =>
      canvas.toBlob((blob) => (blob ? done(blob) : fail(new Error("no PNG"))), "image/png"),
    );
  } finally {
    URL.revokeObjectURL(url);
  }
}
