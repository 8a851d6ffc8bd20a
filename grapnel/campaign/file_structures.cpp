#include "grapnel/campaign/file_structures.hpp"

#include "grapnel/scenario/sections.hpp"

namespace grapnel {

template <>
struct Described<AngleUnit> : Enumeration<AngleUnit, "AngleUnit", "rad", "deg"> {};
template <>
struct Described<AxisFile::Spacing> : Enumeration<AxisFile::Spacing, "Spacing", "linear", "logarithmic"> {};
template <>
struct Described<ValueForm> : Enumeration<ValueForm, "ValueForm", "value", "factor", "offset"> {};
template <>
struct Described<AnyRotation> : Enumeration<AnyRotation, "AnyRotation", "uniform"> {};
template <>
struct Described<VariableFile::Posture> : Enumeration<VariableFile::Posture, "Posture", "null_space"> {};

namespace {

constexpr std::string_view kName = "Name in results.";
constexpr std::string_view kDescription = "A comment for readers of the file.";
constexpr std::string_view kScenario = "The scenario file, its path relative to this file.";
constexpr std::string_view kSimulate =
    "impact: planning and the impact at the planned final configuration, without motion afterwards. run: the complete "
    "scenario.";
constexpr std::string_view kColumn =
    "A column of the study table, or the first parts of several up to a `/`; `*` matches any part.";
constexpr std::string_view kCombine =
    "Combination of several columns. Absent: norm of the components x, y, z of a vector, else the worst of them.";

constexpr Field changes_key(std::string_view text) {
  return key<std::string>("set", "", text).as("values by path").by_default("{}");
}

// Keys without meaning in other kinds of axes and variables.
constexpr std::string_view kOfQuantities = "it belongs to quantities", kOfPatches = "it belongs to patches";

}  // namespace

template <>
struct Described<LabelledFile> {
  using T = LabelledFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::label>("label", "Label in tables.").required(),
      changes_key("Values of the scenario, by path."),
      field<&T::scenario>(
          "scenario",
          "Another scenario file in place of the study's, relative to this file. Only one axis may name scenarios.")
          .optional(),
  });
  static constexpr Type type = structure<T>("labelled", "", fields);
};

template <>
struct Described<AxisFile> {
  using T = AxisFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::path>(
          "path", "A value of the scenario, as for `--set`: `targets.target-1.mass`; any value that is valid there.")
          .optional(),
      field<&QuantityFile::quantity>("quantity", "A quantity without a single value in a scenario file."),
      field<&T::name>("name", "Name of an axis whose values are labelled sets of changes.").optional(),
      field<&QuantityFile::grasp>(
          "grasp", "End-effector of the grasp for relative_speed, relative_direction or approach_angle; absent: all.")
          .optional(),
      field<&QuantityFile::target>("target", "Target for target_spin or mass_ratio; absent: all.").optional(),
      field<&QuantityFile::axis>("axis",
                                 "Unit vector. target_spin: the spin axis in W, by default the present one. "
                                 "relative_direction, approach_angle: rotation axis in the target's frame at the "
                                 "capture, by default its z axis. Absent: the default of the quantity."),
      field<&QuantityFile::direction>(
          "direction",
          "Unit vector in W: direction of the relative velocity (relative_speed); absent: into the target."),
      field<&QuantityFile::unit>("unit", "Unit of the values of an angle (target_spin: per second); absent: rad.")
          .optional(),
      key<std::string>("values", "", "The values, one by one, with their unit or without.")
          .as("anything")
          .items(1, 1000000)
          .optional(),
      field<&T::from>("from", "First of equally spaced values.").in_any_unit(),
      field<&T::to>("to", "Last value.").in_any_unit(),
      field<&T::count>("count", "Number of values, including both ends.").at_least(2).at_most(1000000).optional(),
      field<&T::spacing>("spacing", "Equal differences or equal ratios. Absent: linear.").optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({
      one_of("path, quantity, name"),
      one_of("values, from"),
      needs("from", "to, count"),
      needs("to", "from"),
      needs("count", "from"),
      needs("spacing", "from"),
      when("path").forbid("grasp, target", "the path names it"),
      when("path").forbid("axis, direction", kOfQuantities),
      when("path").forbid("unit", "scenarios are in SI units and radians"),
      when("quantity").narrow<double>("values"),
      when("quantity", "relative_speed, relative_direction, approach_angle").forbid("target", "use 'grasp'"),
      when("quantity", "target_spin, mass_ratio").forbid("grasp", "use 'target'"),
      when("quantity", "target_spin, mass_ratio").forbid("direction", "it belongs to relative_speed"),
      when("quantity", "relative_direction, approach_angle").forbid("direction", "it belongs to relative_speed"),
      when("quantity", "relative_speed, mass_ratio").forbid("axis", "it belongs to quantities with a rotation axis"),
      when("quantity", "relative_speed, mass_ratio").forbid("unit", "it is not an angle").narrow<double>("values", 0),
      when("name").narrow<LabelledFile>("values"),
      when("name").forbid("grasp, target, axis, direction", kOfQuantities),
      when("name").forbid("unit", "the values are labels"),
      when("name").forbid("from", "its values are labelled, one by one"),
  });
  static constexpr Type type = structure<T>("axis", "", fields, rules);
};

template <>
struct Described<StudyFile> {
  using T = StudyFile;
  static constexpr auto fields = std::to_array<Field>({
      version_key("constant grapnel-study/1"),
      field<&T::name>("name", kName).required(),
      field<&T::description>("description", kDescription).as("any text").optional(),
      field<&T::scenario>("scenario",
                          "The scenario file, its path relative to this file. May be absent if every value of an axis "
                          "names one.")
          .optional(),
      changes_key("Values that replace those of the scenario file, by path, for all points."),
      field<&T::simulate>("simulate", kSimulate),
      field<&T::axes>(
          "axes", "Varied values. The points are all combinations, at most 10 million; the first axis varies slowest.")
          .items(1, 32)
          .required(),
      field<&T::columns>("columns",
                         "Columns to keep: a name, or a prefix up to a `/`; `*` matches any part, as in "
                         "`grasps/*/impulse_magnitude`. Absent: all except those that must be requested.")
          .called("a list")
          .items(1, 0)
          .optional(),
  });
  static constexpr Type type = structure<T>(
      "study",
      "Many captures: one scenario with values varied on a grid. SI units and radians unless stated otherwise.",
      fields);
};

template <>
struct Described<NormalFile> {
  using T = NormalFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::mean>("mean", "Mean. Absent: 0 for an offset, 1 for a factor.").in_any_unit().items(1, 0),
      field<&T::deviation>("deviation", "Standard deviation; 0: not uncertain.").in_any_unit().at_least(0).items(1, 0),
      field<&T::covariance>(
          "covariance", "Covariance of all numbers at the path or paths: symmetric, positive semidefinite, by rows.")
          .in_any_unit()
          .items(1, 0)
          .optional(),
      field<&T::from>("from", "Minimum value.").in_any_unit().items(1, 0),
      field<&T::to>("to", "Maximum value.").in_any_unit().items(1, 0),
  });
  static constexpr auto rules = std::to_array<Rule>({one_of("deviation, covariance")});
  static constexpr Type type = structure<T>("normal",
                                            "Normal distribution of numbers, truncated to the interval between `from` "
                                            "and `to`, which must not be too unlikely (some 37 deviations away).",
                                            fields, rules);
};

template <>
struct Described<LogNormalFile> {
  using T = LogNormalFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::median>("median", "Median. Absent: 1 for a factor.").in_any_unit().items(1, 0),
      field<&T::deviation>("deviation", "Standard deviation of the natural logarithm.")
          .at_least(0)
          .items(1, 0)
          .required(),
      field<&T::from>("from", "Minimum value.").in_any_unit().at_least(0).items(1, 0),
      field<&T::to>("to", "Maximum value.").in_any_unit().at_least(0).items(1, 0),
  });
  static constexpr Type type = structure<T>("log_normal", "Log-normal distribution: the logarithm is normal.", fields);
};

template <>
struct Described<UniformFile> {
  using T = UniformFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::from>("from", "Minimum value.").in_any_unit().items(1, 0).required(),
      field<&T::to>("to", "Maximum value.").in_any_unit().items(1, 0).required(),
  });
  static constexpr Type type = structure<T>("uniform", "Uniform distribution between two values.", fields);
};

template <>
struct Described<IntegersFile> {
  using T = IntegersFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::from>("from", "Minimum value.").at_least(0).at_most(kLargestWhole),
      field<&T::to>("to", "Maximum value.").at_least(0).at_most(kLargestWhole),
  });
  static constexpr Type type = structure<T>("integers", "Uniformly distributed whole numbers: seeds.", fields);
};

template <>
struct Described<DiscreteFile> {
  using T = DiscreteFile;
  static constexpr auto fields = std::to_array<Field>({
      key<std::string>("values", "", "Values that are valid at the path; of any kind.")
          .as("anything")
          .items(1, 100000)
          .required(),
      field<&T::weights>("weights", "Relative probabilities; absent: equal.").at_least(0).items(1, 0),
  });
  static constexpr Type type = structure<T>("discrete", "One of several values.", fields);
};

template <>
struct Described<NormalLengthFile> {
  using T = NormalLengthFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::mean>("mean", "Mean.").in_any_unit().required(),
      field<&T::deviation>("deviation", "Standard deviation.").in_any_unit().at_least(0).required(),
      field<&T::from>("from", "Minimum value.").in_any_unit(),
      field<&T::to>("to", "Maximum value.").in_any_unit(),
  });
  static constexpr Type type = structure<T>("normal_length", "Normal distribution; near 0 it needs `from: 0`.", fields);
};
template <>
struct Described<LogNormalLengthFile> {
  using T = LogNormalLengthFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::median>("median", "Median.").in_any_unit().required(),
      field<&T::deviation>("deviation", "Standard deviation of the natural logarithm.").at_least(0).required(),
      field<&T::from>("from", "Minimum value.").in_any_unit(),
      field<&T::to>("to", "Maximum value.").in_any_unit(),
  });
  static constexpr Type type = structure<T>("log_normal_length", "Log-normal distribution.", fields);
};
template <>
struct Described<UniformLengthFile> {
  using T = UniformLengthFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::from>("from", "Minimum value.").in_any_unit().required(),
      field<&T::to>("to", "Maximum value.").in_any_unit().required(),
  });
  static constexpr Type type = structure<T>("uniform_length", "Uniform distribution.", fields);
};
template <>
struct Described<LengthFile> {
  using T = LengthFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::normal>("normal", ""),
      field<&T::log_normal>("log_normal", ""),
      field<&T::uniform>("uniform", ""),
  });
  static constexpr auto rules = std::to_array<Rule>({one_of("normal, log_normal, uniform")});
  static constexpr Type type = structure<T>("length", "", fields, rules);
};

template <>
struct Described<SphereFile> {
  using T = SphereFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::length>("length", "Its length: a number, or a distribution; not below 0.")
          .in_any_unit()
          .called("a number; a distribution")
          .required(),
  });
  static constexpr Type type = structure<T>("sphere", "A vector in a direction uniform on the sphere.", fields);
};

template <>
struct Described<TiltFile> {
  using T = TiltFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::deviation>("deviation", "rad",
                           "Standard deviation of the tilt about each of two axes perpendicular to the vector.")
          .at_least(0),
      field<&T::factor>("factor", "Factor on its length.").called("a number; a distribution"),
  });
  static constexpr Type type = structure<T>("tilt",
                                            "The scenario's own vector, tilted about each of two axes perpendicular to "
                                            "it, its length multiplied by `factor`.",
                                            fields);
};

template <>
struct Described<TurnFile> {
  using T = TurnFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::deviation>("deviation", "rad",
                           "Standard deviation of the rotation about each axis of the rotated frame.")
          .at_least(0)
          .required(),
  });
  static constexpr Type type = structure<T>("turn", "", fields);
};

template <>
struct Described<UncertainFile> {
  using T = UncertainFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::path>("path",
                      "A value of the scenario, as for `--set`: a number, a list or mapping of numbers; for `rotation` "
                      "the mapping with the orientation; for `discrete` any value.")
          .optional(),
      field<&T::paths>("paths", "Several paths, for a normal distribution with a covariance.")
          .called("a list")
          .items(1, 0)
          .optional(),
      field<&T::as>("as",
                    "Meaning of the drawn number. value: replaces the scenario's value. factor: multiplies it. offset: "
                    "is added to it."),
      field<&T::together>(
          "together",
          "For a list or mapping of numbers: whether one number is drawn for all of them; else each has its own."),
      field<&T::normal>("normal", ""),
      field<&T::log_normal>("log_normal", ""),
      field<&T::uniform>("uniform", ""),
      field<&T::integers>("integers", ""),
      field<&T::discrete>("discrete", ""),
      field<&T::sphere>("sphere", ""),
      field<&T::tilt>("tilt", ""),
      field<&T::rotation>(
          "rotation", "An orientation: uniform over all orientations, or that of the scenario with a random rotation.")
          .called("uniform; {deviation: ...}"),
  });
  static constexpr auto rules = std::to_array<Rule>({
      one_of("normal, log_normal, uniform, integers, discrete, sphere, tilt, rotation"),
      one_of("path, paths"),
  });
  static constexpr Type type = structure<T>("uncertain", "", fields, rules);
};

template <>
struct Described<NamedCondition> {
  using T = NamedCondition;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::name>("name", "Name in results.").required(),
      field<&T::holds>("holds", "The expression.").required(),
  });
  static constexpr Type type = structure<T>("condition", "", fields);
};

/// The mapping `worst` of a SeriesSelection.
struct WorstKeys;
template <>
struct Described<WorstKeys> {
  using T = SeriesSelection;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::worst>("count", "Number of cases.").at_least(0).at_most(100000).required(),
      field<&T::worst_by>("by", "Name of the column.").required(),
  });
  static constexpr Type type = structure<T>("worst", "Number of cases with the largest values of a column.", fields);
};
template <>
struct Described<SeriesSelection> {
  using T = SeriesSelection;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::sample>("sample", "Number of first cases.").at_least(0).at_most(100000),
      field<&T::failures>("failures", "Number of first failed cases.").at_least(0).at_most(100000),
      group<T, WorstKeys>("worst", "").optional(),
  });
  static constexpr Type type =
      structure<T>("series", "Cases whose complete results of `grapnel run` are kept in `series/case-K/`.", fields);
};
template <>
struct Described<KeepFile> {
  using T = KeepFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::columns>("columns",
                         "Columns to keep, as in studies. The columns of `success` and series.worst.by are always "
                         "kept; with `captured` also the causes of a missed or lost grasp: "
                         "`grasps/*/captured`, `grasps/*/tolerance_used`, `grasps/*/lost` and `captured/judged`. "
                         "Absent: all.")
          .called("a list")
          .items(1, 0)
          .optional(),
      field<&T::series>("series", ""),
  });
  static constexpr Type type = structure<T>("keep", "Stored data.", fields);
};

template <>
struct Described<CampaignFile> {
  using T = CampaignFile;
  static constexpr auto fields = std::to_array<Field>({
      version_key("constant grapnel-campaign/1"),
      field<&T::name>("name", kName).required(),
      field<&T::description>("description", kDescription).as("any text").optional(),
      field<&T::scenario>("scenario", kScenario).required(),
      changes_key("Values that replace those of the scenario file, by path, for all cases."),
      field<&T::simulate>("simulate", kSimulate),
      field<&T::cases>("cases", "Number of cases; with a `design` at each of its points, 1e9 in total.")
          .at_least(1)
          .at_most(kMostCases)
          .required(),
      field<&T::seed>("seed", "Seed of the random numbers. Another seed gives other cases.")
          .at_least(0)
          .at_most(kLargestWhole),
      field<&T::sampling>("sampling",
                          "random: independent. latin_hypercube: every input alone is spread evenly over its "
                          "distribution. sobol: all inputs together are spread evenly, by a scrambled Sobol sequence."),
      field<&T::plan>(
          "plan",
          "nominal: the approach is planned once, for the nominal scenario, because the planner does not know the true "
          "values; all cases follow that plan. per_case: the planner knows each case's values."),
      field<&T::uncertain>("uncertain", "Uncertain values and their distributions.").items(1, 300).required(),
      field<&T::success>("success",
                         "Conditions on a case's columns and inputs. A case is a success if it is ok and all hold. "
                         "Absent: `captured`, if the scenario has grasps.")
          .called("an expression; {name, holds}")
          .items(1, 0),
      field<&T::keep>("keep", ""),
      field<&T::confidence>("confidence", "Two-sided confidence of the intervals in the results.")
          .at_least(0.5)
          .at_most(0.9999),
      field<&T::quantiles>("quantiles",
                           "Probabilities of the quantiles in the results, increasing; absent: 0.01, 0.05, 0.25, 0.5, "
                           "0.75, 0.95, 0.99.")
          .at_least(0)
          .at_most(1)
          .items(1, 100),
      field<&T::time_limit>("time_limit", "s",
                            "Elapsed time of one case; beyond it the case fails. It depends on the machine: omit it "
                            "where results must not. 0: none.")
          .at_least(0),
      field<&T::design>("design",
                        "Axes as in studies; their values apply to the scenario before the uncertain ones are drawn. "
                        "For `grapnel map`.")
          .items(1, 2)
          .optional(),
  });
  static constexpr Type type = structure<T>(
      "campaign", "Many captures of one scenario whose uncertain values are drawn at random. SI units and radians.",
      fields);
};

template <>
struct Described<TermFile> {
  static constexpr auto fields = std::to_array<Field>({
      field<&MeasuredFile::column>("column", kColumn).required(),
      field<&MeasuredFile::combine>("combine", kCombine),
      field<&TermFile::weight>("weight", "Factor of the term in the sum."),
  });
  static constexpr Type type = structure<TermFile>("term", "", fields);
};
template <>
struct Described<LimitFile> {
  static constexpr auto fields = std::to_array<Field>({
      field<&MeasuredFile::column>("column", kColumn).required(),
      field<&MeasuredFile::combine>("combine", kCombine),
      field<&LimitFile::at_most>("at_most", "Upper bound.").in_any_unit(),
      field<&LimitFile::at_least>("at_least", "Lower bound.").in_any_unit(),
  });
  static constexpr auto rules = std::to_array<Rule>({one_of("at_most, at_least")});
  static constexpr Type type = structure<LimitFile>("limit", "", fields, rules);
};

template <>
struct Described<VariableFile> {
  using T = VariableFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::path>("path", "A number of the scenario, as for `--set`: `approach.duration`.").optional(),
      field<&QuantityFile::quantity>("quantity", "Quantity without a single value in a scenario file; as in studies."),
      field<&T::patch>("patch",
                       "TARGET.POINT: the grasp point moves in a plane through it: two numbers, along the unit vectors "
                       "`u` and `v`. If the target has a sphere among its shapes, the point is projected onto it, and "
                       "its approach direction, normal and frame rotate with it.")
          .optional(),
      field<&T::posture>("posture",
                         "Of redundant arms with approach.plan: one number per dimension of the null space of the "
                         "generalized Jacobian at the scenario's own planned configuration [rad]. The configuration "
                         "moved by them becomes plan.guess with `objective: nearest`."),
      field<&QuantityFile::grasp>("grasp", "End-effector of the grasp for a quantity; absent: all.").optional(),
      field<&QuantityFile::target>("target", "Target for a quantity; absent: all.").optional(),
      field<&QuantityFile::axis>("axis", "Unit vector: rotation axis of a quantity; as in studies."),
      field<&QuantityFile::direction>("direction",
                                      "Unit vector in W: direction of the relative velocity (relative_speed)."),
      field<&QuantityFile::unit>("unit", "Unit of an angle; absent: rad.").optional(),
      field<&T::from>("from", "Minimum value.").in_any_unit(),
      field<&T::to>("to", "Maximum value.").in_any_unit(),
      field<&T::u>("u", "Unit vector in the target's frame: first direction of the patch."),
      field<&T::v>("v", "Unit vector in the target's frame, perpendicular to `u`: second direction of the patch."),
      field<&T::radius>("radius", "m", "Radius of a disc, onto which the square around it is mapped.").above(0),
      field<&T::half_widths>("half_widths", "m", "Half widths of a rectangle: along `u` and along `v`.").above(0),
  });
  static constexpr auto rules = std::to_array<Rule>({
      one_of("path, quantity, patch, posture"),
      when("patch").require("u, v").require_one_of("radius, half_widths"),
      when("patch").forbid("from, to", "radius or half_widths give the range"),
      when("patch").forbid("grasp, target, axis, direction", kOfQuantities),
      when("patch").forbid("unit", "a patch is in metres"),
      when("path").require("from, to").forbid("u, v, radius, half_widths", kOfPatches),
      when("path").forbid("grasp, target, axis, direction", kOfQuantities),
      when("path").forbid("unit", "scenarios are in SI units and radians"),
      when("posture").require("from, to").forbid("u, v, radius, half_widths", kOfPatches),
      when("posture").forbid("grasp, target, axis, direction", kOfQuantities),
      when("posture").forbid("unit", "joint values are in radians and metres"),
      when("quantity").require("from, to").forbid("u, v, radius, half_widths", kOfPatches),
      when("quantity", "relative_speed, relative_direction, approach_angle").forbid("target", "use 'grasp'"),
      when("quantity", "target_spin, mass_ratio").forbid("grasp", "use 'target'"),
      when("quantity", "target_spin, mass_ratio").forbid("direction", "it belongs to relative_speed"),
      when("quantity", "relative_direction, approach_angle").forbid("direction", "it belongs to relative_speed"),
      when("quantity", "relative_speed, mass_ratio").forbid("axis", "it belongs to quantities with a rotation axis"),
      when("quantity", "relative_speed, mass_ratio").forbid("unit", "it is not an angle"),
  });
  static constexpr Type type = structure<T>("variable", "", fields, rules);
};

template <>
struct Described<LocalSteps> {
  static constexpr Choice choices[] = {choice(LocalSteps::subplex, "subplex"),
                                       choice(LocalSteps::gradient, "gradient")};
  static constexpr Type type = enumeration<LocalSteps>("LocalSteps", choices);
};

template <>
struct Described<SearchSetup> {
  using T = SearchSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::evaluations>("evaluations", "Maximum number of simulated captures.").at_least(1).at_most(1000000),
      field<&T::seed>("seed", "Seed of the sample; the same seed gives the same results.")
          .at_least(0)
          .at_most(kLargestWhole),
      field<&T::refine>("refine", "Number of best points from which local searches start; 0: none.")
          .at_least(0)
          .at_most(100),
      field<&T::steps>("steps",
                       "Steps of local searches: `subplex` compares points, `gradient` follows derivatives of "
                       "objective and limits."),
  });
  static constexpr Type type = structure<T>("search", "Search for the optimum.", fields);
};

template <>
struct Described<OptimizationFile> {
  using T = OptimizationFile;
  static constexpr auto fields = std::to_array<Field>({
      version_key("constant grapnel-optimization/1"),
      field<&T::name>("name", kName).required(),
      field<&T::description>("description", kDescription).as("any text").optional(),
      field<&T::scenario>("scenario", kScenario).required(),
      changes_key("Values that replace those of the scenario file, by path."),
      field<&T::simulate>(
          "simulate",
          "impact: planning and the impact, with joints that follow their plan exactly; clearances, limits during the "
          "approach and tracking errors are not evaluated. run: the complete scenario."),
      field<&T::minimize>("minimize", "A column of the study's table, or terms that are added.")
          .called("the name of a column; a list of weighted terms")
          .items(1, 0),
      field<&T::maximize>("maximize", "The same, maximized.")
          .called("the name of a column; a list of weighted terms")
          .items(1, 0),
      field<&T::variables>("variables", "Variables of the search.").items(1, 32).required(),
      field<&T::limits>("limits", "Limits on columns."),
      field<&T::feasible>("feasible",
                          "Whether joints must stay within their limits and bodies clear of each other, as far as "
                          "these are monitored (`run`)."),
      field<&T::search>("search", ""),
  });
  static constexpr auto rules = std::to_array<Rule>({one_of("minimize, maximize")});
  static constexpr Type type =
      structure<T>("optimization",
                   "Search for the best capture: one scenario, variables, an objective to minimize or maximize, and "
                   "limits. SI units and radians unless stated otherwise.",
                   fields, rules);
};

const Type& labelled_value_description() { return type_of<LabelledFile>(); }
const Type& study_file_description() { return type_of<StudyFile>(); }
const Type& campaign_file_description() { return type_of<CampaignFile>(); }
const Type& optimization_file_description() { return type_of<OptimizationFile>(); }

}  // namespace grapnel
