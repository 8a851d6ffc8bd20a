// The contents of a plot, independent of drawing: lines over the samples of one run or two. Screen, SVG and CSV use it.

export interface Line {
  key: string; // the same quantity in two runs has the same key
  label: string; // in the legend, without unit
  unit: string;
  column: string; // head of its column in a CSV file, with unit
  run: number; // index into the runs of the report
  color: string; // a role of colors.ts, or "#rrggbb"; "ink": the page's own
  dash: number[];
  width: number; // [px]
  hidden?: boolean; // initially hidden; a click in the legend displays it
  values: () => Float64Array; // per sample of its run; NaN: no value
}

// A limit, drawn across the plot.
export interface Limit {
  label: string; // "rating of tip-1"
  value: number;
}

export interface PlotSpec {
  id: string;
  group: string;
  title: string;
  axis: string; // "joint rate [rad/s]"
  unit: string;
  lines: Line[];
  limits?: Limit[];
  log?: boolean;
  floor?: number; // of a logarithmic axis: smaller values are drawn on its bottom
  window?: [number, number]; // the part of time that the plot is about [s]; else everything
  start?: [number, number]; // the part of time shown first [s]; the button "show all" shows everything
  note?: string;
  xTitle?: string;
}

// Computes on first use: a page opens before all lines are computed.
export function lazily(compute: () => Float64Array): () => Float64Array {
  let known: Float64Array | null = null;
  return () => (known ??= compute());
}
