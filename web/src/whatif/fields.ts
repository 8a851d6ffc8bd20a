// A field of the panel: a quantity by slider and number, by choice, or by the components of a direction.
import { element } from "../dom";
import { number, unitText, withUnit } from "../format";
import type { Quantity, Value } from "./groups";
import { isNumber, type Vec3 } from "./settings";

export interface Field {
  root: HTMLElement;
  quantity: Quantity;
  show(value: Value | undefined): void; // undefined: that of the base case
  fail(message: string): void; // "": no error
}

const kDigits = 4; // of values that a slider sets

let count = 0; // for unique ids

export function fieldOf(quantity: Quantity, changed: (value: Value | undefined) => void): Field {
  const id = `whatif-${++count}`;
  const error = element("p", { class: "wi-error", id: `${id}-error` });
  error.hidden = true;
  const reset = element("button", { type: "button", class: "chip wi-reset", "aria-label": `${quantity.name}: value of the base case` }, "Reset");
  reset.hidden = true;
  reset.addEventListener("click", () => {
    input.show(quantity.base);
    reset.hidden = true;
    changed(undefined);
  });
  const set = (value: Value): void => {
    const same = JSON.stringify(value) === JSON.stringify(quantity.base);
    reset.hidden = same;
    changed(same ? undefined : value);
  };
  const input = inputOf(quantity, id, set);
  input.show(quantity.base);
  const note = quantity.note ? element("span", { class: "wi-note" }, quantity.note) : null;
  const unit = unitText(quantity.unit);
  const label = element("label", { for: id }, quantity.name, unit ? element("span", { class: "unit" }, ` [${unit}]`) : null);
  const root = element("div", { class: "wi-field" }, element("div", { class: "wi-label" }, label, note), ...input.parts, reset, error);
  return {
    root,
    quantity,
    show: (value) => {
      input.show(value ?? quantity.base);
      reset.hidden = value === undefined;
    },
    fail: (message) => {
      error.textContent = message;
      error.hidden = message === "";
      for (const one of root.querySelectorAll("input, select")) {
        if (message) one.setAttribute("aria-invalid", "true");
        else one.removeAttribute("aria-invalid");
        if (message) one.setAttribute("aria-describedby", error.id);
        else one.removeAttribute("aria-describedby");
      }
    },
  };
}

interface Input {
  parts: HTMLElement[];
  show(value: Value): void;
}

function inputOf(quantity: Quantity, id: string, set: (value: Value) => void): Input {
  if (quantity.choices) return choiceInput(quantity.choices, id, set);
  return isNumber(quantity.base) ? numberInput(quantity, id, set) : vectorInput(quantity, id, set);
}

function choiceInput(choices: string[], id: string, set: (value: Value) => void): Input {
  const select = element("select", { id }, ...choices.map((one) => element("option", { value: one }, one)));
  select.addEventListener("change", () => set(select.value));
  return { parts: [select], show: (value) => (select.value = String(value)) };
}

// The slider's positions are from 0 to 1.
function numberInput(quantity: Quantity, id: string, set: (value: Value) => void): Input {
  const { low, high, log } = quantity;
  const slider = element("input", { type: "range", id, min: "0", max: "1", step: "any" });
  const exact = element("input", { type: "number", step: "any", "aria-label": `${quantity.name}, exact value` });
  const valueAt = (part: number): number => (log ? low * (high / low) ** part : low + part * (high - low));
  const partOf = (value: number): number => (log ? Math.log(Math.max(value, low) / low) / Math.log(high / low) : (value - low) / (high - low));
  const speak = (value: number): void => slider.setAttribute("aria-valuetext", withUnit(value, quantity.unit) || number(value));
  slider.addEventListener("input", () => {
    const value = Number(valueAt(Number(slider.value)).toPrecision(kDigits));
    exact.value = String(value);
    speak(value);
    set(value);
  });
  exact.addEventListener("input", () => {
    const value = exact.valueAsNumber;
    if (!Number.isFinite(value)) return;
    slider.value = String(partOf(value));
    speak(value);
    set(value);
  });
  const show = (value: Value): void => {
    const shown = Number(value);
    slider.value = String(partOf(shown));
    exact.value = String(Number(shown.toPrecision(6)));
    speak(shown);
  };
  return { parts: [slider, exact], show };
}

function vectorInput(quantity: Quantity, id: string, set: (value: Value) => void): Input {
  const inputs = ["x", "y", "z"].map((axis, k) => element("input", { type: "number", step: "any", "aria-label": `${quantity.name}, ${axis}`, ...(k === 0 ? { id } : {}) }));
  for (const one of inputs)
    one.addEventListener("input", () => {
      const value = inputs.map((input) => input.valueAsNumber);
      if (value.every(Number.isFinite) && Math.hypot(...value) > 0) set(value as Vec3);
    });
  return {
    parts: [element("div", { class: "wi-vector" }, ...inputs)],
    show: (value) => inputs.forEach((input, k) => (input.value = String(Number((value as Vec3)[k].toPrecision(6))))),
  };
}
