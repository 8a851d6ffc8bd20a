// The page of a run with an engine for tests: it answers with variants that the program has computed before.
// `start` is that of the viewer; the element "variants" contains { paths, variants, errors } by their overrides.
import { start } from "../src/start";

class FakeEngine {
  #known = JSON.parse(document.getElementById("variants").textContent);
  #stop = () => undefined;
  runs = []; // for tests: the overrides of every request
  delay = 0; // [ms]

  async paths() {
    return this.#known.paths;
  }
  async run({ overrides, plan }, progress) {
    const key = JSON.stringify(overrides.map((one) => [one.path, one.value]));
    this.runs.push({ key, plan });
    progress?.("planning", 0.5);
    await new Promise((resolve, reject) => {
      setTimeout(resolve, this.delay);
      this.#stop = () => reject(new Error("cancelled"));
    });
    const { variants, errors } = this.#known;
    if (errors[key]) throw new Error(errors[key]);
    if (!variants[key]) throw new Error(`the test has no variant ${key}`);
    return structuredClone(variants[key]);
  }
  cancel() {
    this.#stop();
  }
}

start(() => (window.__engine = new FakeEngine()));
