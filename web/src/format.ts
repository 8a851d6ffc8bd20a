// Number formatting with a suitable number of digits, and units.

// Four significant digits; powers of ten above 10^5 and below 10^-3. Rounding noise remains recognizable.
export function number(value: number | null | undefined, digits = 4): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-3) {
    const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
    const power = `10${superscript(exponent)}`;
    return (trim(mantissa) === "1" ? power : `${trim(mantissa)}·${power}`).replace("-", "−");
  }
  // toPrecision writes 10000 as 1.000e+4.
  return (size >= 10 ** digits ? String(Math.round(value)) : trim(value.toPrecision(digits))).replace("-", "−");
}

// 0 for rounding error: a value below 1e-12 of the numbers from which it was computed.
export function quiet(value: number, scale: number): number {
  return Math.abs(value) < 1e-12 * Math.abs(scale) ? 0 : value;
}

export function withUnit(value: number | null | undefined, unit: string, digits = 4): string {
  const shown = number(value, digits);
  return unit === "" || unit === "1" || shown === "–" ? shown : `${shown} ${unitText(unit)}`;
}

// A command with paths relative to the page's folder, so that it works from any folder: the page knows its location
// once it is open.
export function pasted(command: string): string {
  if (!command || typeof location === "undefined" || location.protocol !== "file:") return command;
  const folder = decodeURIComponent(location.pathname).replace(/\/[^/]*$/, "") || "/";
  const word = /^[\w/.,:@%+=-]+$/.test(folder) ? folder : `'${folder.replaceAll("'", "'\\''")}'`;
  return `cd ${word} && ${command}`;
}

// "base rate [rad/s]"
export function label(name: string, unit: string): string {
  return columnHead(name, unitText(unit));
}

// The same in CSV files, with units as in table.csv: "inertia [kg m^2]".
export function columnHead(name: string, unit: string): string {
  return unit === "" || unit === "1" ? name : `${name} [${unit}]`;
}

// A unit for display, "kg m²" for "kg m^2", without line breaks; "" for none. The only place with this conversion.
export function unitText(unit: string): string {
  if (unit === "1") return "";
  return unit.replace(/\^(-?\d+)(?![\d.])/g, (_, exponent: string) => superscript(exponent)).replace(/ /g, "\u00a0");
}

export function magnitude(v: number[] | null | undefined): number {
  return v ? Math.hypot(...v) : NaN;
}

function trim(text: string): string {
  return text.includes(".") ? text.replace(/\.?0+$/, "") : text;
}

const kSuperscripts = "⁰¹²³⁴⁵⁶⁷⁸⁹";
function superscript(exponent: string): string {
  const sign = exponent.startsWith("-") ? "⁻" : "";
  return sign + exponent.replace(/^[+-]/, "").replace(/\d/g, (d) => kSuperscripts[Number(d)]);
}
