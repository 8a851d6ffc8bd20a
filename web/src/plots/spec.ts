// What a plot shows, without how it is drawn: lines over the samples of one run or two. Screen, SVG and CSV are made from it.

export interface Line {
  key: string; // the same quantity in two runs has the same key
  label: string; // in the legend, without unit
  unit: string;
  column: string; // head of its column in a CSV file, with unit
  run: number; // index into the runs of the report
  color: string; // a role of colors.ts, or "#rrggbb"; "ink": the page's own
  dash: number[];
  width: number; // [px]
  hidden?: boolean; // at first; a click in the legend shows it
  right?: boolean; // by the axis at the right
  values: () => Float64Array; // per sample of its run; NaN: nothing to show
}

// A value that is not to be passed, drawn across the plot.
export interface Limit {
  label: string; // "rating of tip-1"
  value: number;
  right?: boolean;
}

export interface PlotSpec {
  id: string;
  group: string;
  title: string;
  axis: string; // "joint rate [rad/s]"
  rightAxis?: string;
  unit: string;
  lines: Line[];
  limits?: Limit[];
  log?: boolean;
  window?: [number, number]; // the part of time that it is about [s]; else everything
  note?: string;
  xTitle?: string;
}

// Computes once, when first asked for: a page opens before all lines are known.
export function lazily(compute: () => Float64Array): () => Float64Array {
  let known: Float64Array | null = null;
  return () => (known ??= compute());
}
