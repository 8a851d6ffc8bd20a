// The plan of the joint motion and the search for it.
import { element } from "../dom";
import { number } from "../format";
import type { PlanReport } from "../summary_types";
import { list, num, text, withUnit, words, type Partly, type PartlySummary } from "./read";
import { absent, fold, mark, pairs, table, type Cell, type Column } from "./table";
import { windowPart } from "./window";

export function planSection(s: PartlySummary): HTMLElement[] {
  const plan = s.approach?.plan;
  if (!plan) return [absent("This run has no plan of an approach.")];
  const looked = plan.found !== undefined;
  return [
    ...found(s, plan),
    pairs([
      [
        "objective",
        plan.objective && plan.objective !== "as_found"
          ? `${words(plan.objective)}: ${withUnit(num(plan.objective_value), plan.objective === "excursion" ? "rad² (m²)" : "")}`
          : "",
      ],
      ["required motion that no joint rates produce", num(plan.unmet_rate) === null ? "" : number(num(plan.unmet_rate))],
      [
        "initial guesses",
        looked
          ? `${number(num(plan.starts))}, of which ${number(num(plan.solutions))} led to a solution (${number(num(plan.distinct_solutions))} different ones) in ${number(num(plan.iterations))} Newton steps`
          : "",
      ],
      ["smallest singular value of the goals", looked ? withUnit(num(plan.smallest_singular_value), "m/rad") : ""],
      ["evaluations of the base's motion", number(num(plan.rhs_evaluations), 6)],
    ]),
    ...terms(plan),
    ...way(plan),
    ...windowPart(plan),
    ...finalValues(s, plan),
    ...misses(plan),
    ...straightIn(plan),
    ...navigation(s),
  ];
}

export function isUnplanned(s: PartlySummary): boolean {
  return s.status === "failed" && text(s.failure, "").startsWith("planning");
}

// Result of the search for final values.
function found(s: PartlySummary, plan: Partly<PlanReport>): HTMLElement[] {
  // The planner may find final values although it finds no approach.
  if (isUnplanned(s)) return [element("p", {}, mark("bad", "no plan found: the run failed while it planned the approach"))];
  if (plan.found === undefined)
    return plan.window ? [] : [element("p", { class: "lead" }, "The scenario gives the final joint values; no search was necessary.")];
  const outcome = plan.found === true ? mark("good", "final joint values found") : mark("bad", "no solution found; the closest attempt is shown");
  return [element("p", {}, outcome)];
}

// Terms of the objective, if there are several.
function terms(plan: Partly<PlanReport>): HTMLElement[] {
  const columns: Column[] = [{ head: "Objective" }, { head: "Weight", numeric: true }, { head: "Value", numeric: true }];
  const rows = list(plan.terms).map((term): Cell[] => [words(text(term.name)), number(num(term.weight), 6), number(num(term.value), 6)]);
  return rows.length < 2 ? [] : [table("Weighed objectives", columns, rows)];
}

// Constraints along the trajectory and their margins.
function way(plan: Partly<PlanReport>): HTMLElement[] {
  const way = plan.way;
  if (!way) return [];
  const share = (value: number | null) => (value === null ? "" : `${number(100 * value, 3)} % of the limit`);
  const bodies = text(way.body_a) ? `, ${text(way.body_a)} and ${text(way.body_b)} at t = ${number(num(way.clearance_time))} s` : "";
  const clearance = num(way.clearance);
  return [
    element("h3", {}, "Planned trajectory, followed exactly"),
    pairs([
      ["minimum clearance", clearance === null ? "" : withUnit(clearance, "m") + bodies],
      ["largest rotation of the base", way.attitude_kept ? "assumes that the base keeps its attitude exactly" : withUnit(num(way.base_turn), "rad")],
      ["margin to joint limits", withUnit(num(way.position_margin), "rad or m")],
      ["largest rate", share(num(way.rate_share))],
      ["largest effort", share(num(way.effort_share))],
      ["largest momenta of wheels", list(way.wheels).map((w) => `${text(w.wheel)}: ${number(100 * (num(w.share) ?? NaN), 3)} %`).join(", ")],
      ["inner knots of the splines", number(num(way.knots))],
    ]),
  ];
}

// Plans during the approach, and the errors of the estimates that they use.
function navigation(s: PartlySummary): HTMLElement[] {
  const columns: Column[] = [
    { head: "Planned at", unit: "s", numeric: true },
    { head: "Found" },
    { head: "Target" },
    { head: "Position error", unit: "m", numeric: true },
    { head: "Orientation", unit: "rad", numeric: true },
    { head: "Velocity", unit: "m/s", numeric: true },
    { head: "Angular velocity", unit: "rad/s", numeric: true },
  ];
  const rows = list(s.approach?.navigation).flatMap((plan) =>
    list(plan.estimates).map((one): Cell[] => [
      number(num(plan.time)),
      plan.found === false ? mark("warn", text(plan.failure)) : "yes",
      text(one.target),
      number(num(one.position_error), 3),
      number(num(one.orientation_error), 3),
      number(num(one.velocity_error), 3),
      number(num(one.angular_velocity_error), 3),
    ]),
  );
  if (rows.length === 0) return [];
  return [element("h3", {}, "Plans on estimates"), table("Plans and the errors of their estimates", columns, rows)];
}

function finalValues(s: PartlySummary, plan: Partly<PlanReport>): HTMLElement[] {
  const columns: Column[] = [
    { head: "Joint" },
    { head: "Planned position", unit: "rad; m", numeric: true },
    { head: "reached", unit: "rad; m", numeric: true },
    { head: "Planned rate", unit: "rad/s; m/s", numeric: true },
    { head: "reached", unit: "rad/s; m/s", numeric: true },
  ];
  const reached = s.approach?.end?.joints ?? {};
  const at = (name: string, values: number[] | undefined) => num(list(values)[list(reached.names).indexOf(name)]);
  const rows = list(plan.joints).map((joint, i): Cell[] => [
    text(joint),
    number(num(list(plan.final_position)[i])),
    number(at(joint, reached.position)),
    number(num(list(plan.final_rates)[i])),
    number(at(joint, reached.velocity)),
  ]);
  return rows.length > 0
    ? [fold(`Final joint values (${rows.length})`, table("Final joint values", columns, rows))]
    : [];
}

function misses(plan: Partly<PlanReport>): HTMLElement[] {
  const rows = list(plan.miss).map((one): Cell[] => [
    text(one.end_effector),
    number(num(one.distance), 3),
    number(num(one.angle), 3),
  ]);
  if (rows.length === 0) return [];
  return [
    table(
      "Miss when the plan is followed exactly",
      [
        { head: "End-effector" },
        { head: "Distance", unit: "m", numeric: true },
        { head: "Angle", unit: "rad", numeric: true },
      ],
      rows,
    ),
  ];
}

function straightIn(plan: Partly<PlanReport>): HTMLElement[] {
  const one = plan.straight_in;
  if (!one) return [];
  return [
    element("h3", {}, "Straight in"),
    pairs([
      ["begins at", withUnit(num(one.begin), "s")],
      ["stand-off", withUnit(num(one.stand_off), "m")],
      ["final speed", withUnit(num(one.final_speed), "m/s")],
      ["smallest singular value", number(num(one.smallest_singular_value))],
      [
        "damped",
        one.damped === true
          ? list(one.damped_interval)
              .map((t) => number(num(t)))
              .join(" to ") + " s"
          : one.damped === false
            ? "no"
            : "",
      ],
      [
        "motion missed",
        num(one.unmet) === null ? "" : `${number(num(one.unmet), 3)} at ${withUnit(num(one.unmet_time), "s")}`,
      ],
      ["error of the fit", num(one.fit_error) === null ? "" : `${number(num(one.fit_error), 3)} rad or m`],
    ]),
  ];
}
