#include "grapnel/study_files/file_structures.hpp"

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

constexpr std::string_view kName = "Shown in results.";
constexpr std::string_view kDescription = "For the reader of the file.";
constexpr std::string_view kScenario = "The scenario file, its path relative to this file.";
constexpr std::string_view kSimulate =
    "impact: planning and the impact at the planned final configuration, no motion in time; run: the whole capture.";
constexpr std::string_view kColumn =
    "A column of the study table, or the beginning of several up to a '/'; '*' stands for any part.";
constexpr std::string_view kCombine =
    "Of several columns. Absent: norm of the components x, y, z of a vector, else the worst of them.";

constexpr Field changes_key(std::string_view text) {
  return key<std::string>("set", "", text).as("values by path").by_default("{}");
}

// What has no meaning in other kinds of axes and variables.
constexpr std::string_view kOfQuantities = "it belongs to quantities", kOfPatches = "it belongs to patches";

}  // namespace

template <>
struct Described<LabelledFile> {
  using T = LabelledFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::label>("label", "What tables show.").required(),
      changes_key("Values of the scenario, by path."),
      field<&T::scenario>("scenario", "Another scenario file in place of the study's, relative to this file.")
          .optional(),
  });
  static constexpr Type type = structure<T>("labelled", "", fields);
};

template <>
struct Described<AxisFile> {
  using T = AxisFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::path>("path", "A value of the scenario, as for --set: targets.target-1.mass.").optional(),
      field<&QuantityFile::quantity>("quantity", "What has no single value in a scenario file."),
      field<&T::name>("name", "Of an axis whose values are labelled sets of changes.").optional(),
      field<&QuantityFile::grasp>(
          "grasp",
          "End-effector of the grasp that relative_speed, relative_direction or approach_angle is of; absent: all.")
          .optional(),
      field<&QuantityFile::target>("target", "The target that target_spin or mass_ratio is of; absent: all.")
          .optional(),
      field<&QuantityFile::axis>(
          "axis",
          "Unit. target_spin: the spin axis in W; absent: the present one. relative_direction, approach_angle: about "
          "which they turn, in the target's frame at the capture; absent: its z."),
      field<&QuantityFile::direction>(
          "direction", "Unit, in W: of the relative velocity (relative_speed); absent: into the target."),
      field<&QuantityFile::unit>("unit", "Of the values of an angle (target_spin: per second); absent: rad.")
          .optional(),
      key<std::string>("values", "", "The values, one by one.").as("anything").items(1, 1000000).optional(),
      field<&T::from>("from", "First of equally spaced values.").in_any_unit(),
      field<&T::to>("to", "Last of them.").in_any_unit(),
      field<&T::count>("count", "How many, both ends included.").at_least(2).at_most(1000000).optional(),
      field<&T::spacing>("spacing", "Equal differences or equal ratios; absent: linear.").optional(),
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
      when("quantity", "relative_speed, relative_direction, approach_angle").forbid("target", "give 'grasp'"),
      when("quantity", "target_spin, mass_ratio").forbid("grasp", "give 'target'"),
      when("quantity", "target_spin, mass_ratio").forbid("direction", "it belongs to relative_speed"),
      when("quantity", "relative_direction, approach_angle").forbid("direction", "it belongs to relative_speed"),
      when("quantity", "relative_speed, mass_ratio").forbid("axis", "it belongs to quantities that turn"),
      when("quantity", "relative_speed, mass_ratio").forbid("unit", "it is no angle").narrow<double>("values", 0),
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
      changes_key("Values of the scenario that are other than in its file, by path, for all points."),
      field<&T::simulate>("simulate", kSimulate),
      field<&T::axes>("axes", "What is varied. The points are all combinations; the first axis varies slowest.")
          .items(1, 32)
          .required(),
      field<&T::columns>("columns",
                         "Which columns to keep, by name or the beginning of one up to a '/'; '*' stands for any part. "
                         "Absent: all.")
          .called("a list")
          .items(1, 0)
          .optional(),
  });
  static constexpr Type type = structure<T>("study",
                                            "Many captures: one scenario, and the values that are varied on a grid. SI "
                                            "units, radians where nothing else is said.",
                                            fields);
};

template <>
struct Described<NormalFile> {
  using T = NormalFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::mean>("mean", "Absent: 0 for an offset, 1 for a factor.").in_any_unit().items(1, 0),
      field<&T::deviation>("deviation", "Standard deviation; 0: not uncertain.").in_any_unit().at_least(0).items(1, 0),
      field<&T::covariance>("covariance",
                            "Symmetric, positive semidefinite, row by row: of all numbers at the path or paths.")
          .in_any_unit()
          .items(1, 0)
          .optional(),
      field<&T::from>("from", "Least value.").in_any_unit().items(1, 0),
      field<&T::to>("to", "Greatest value.").in_any_unit().items(1, 0),
  });
  static constexpr auto rules = std::to_array<Rule>({one_of("deviation, covariance")});
  static constexpr Type type =
      structure<T>("normal", "Normal; with 'from' or 'to' only what lies between them.", fields, rules);
};

template <>
struct Described<LogNormalFile> {
  using T = LogNormalFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::median>("median", "Absent: 1 for a factor.").in_any_unit().items(1, 0),
      field<&T::deviation>("deviation", "Standard deviation of the natural logarithm.")
          .at_least(0)
          .items(1, 0)
          .required(),
      field<&T::from>("from", "Least value.").in_any_unit().at_least(0).items(1, 0),
      field<&T::to>("to", "Greatest value.").in_any_unit().at_least(0).items(1, 0),
  });
  static constexpr Type type = structure<T>("log_normal", "The logarithm is normal.", fields);
};

template <>
struct Described<UniformFile> {
  using T = UniformFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::from>("from", "Least value.").in_any_unit().items(1, 0).required(),
      field<&T::to>("to", "Greatest value.").in_any_unit().items(1, 0).required(),
  });
  static constexpr Type type = structure<T>("uniform", "Equally likely everywhere between two values.", fields);
};

template <>
struct Described<IntegersFile> {
  using T = IntegersFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::from>("from", "Least.").at_least(0).at_most(kLargestWhole),
      field<&T::to>("to", "Greatest.").at_least(0).at_most(kLargestWhole),
  });
  static constexpr Type type = structure<T>("integers", "Whole numbers, equally likely; for seeds.", fields);
};

template <>
struct Described<DiscreteFile> {
  using T = DiscreteFile;
  static constexpr auto fields = std::to_array<Field>({
      key<std::string>("values", "", "Anything that may stand at the path.").as("anything").items(1, 100000).required(),
      field<&T::weights>("weights", "How likely, relative to each other; absent: equally.").at_least(0).items(1, 0),
  });
  static constexpr Type type = structure<T>("discrete", "One of several values.", fields);
};

template <>
struct Described<NormalLengthFile> {
  using T = NormalLengthFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::mean>("mean", "").in_any_unit().required(),
      field<&T::deviation>("deviation", "").in_any_unit().at_least(0).required(),
      field<&T::from>("from", "").in_any_unit(),
      field<&T::to>("to", "").in_any_unit(),
  });
  static constexpr Type type = structure<T>("normal_length", "", fields);
};
template <>
struct Described<LogNormalLengthFile> {
  using T = LogNormalLengthFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::median>("median", "").in_any_unit().required(),
      field<&T::deviation>("deviation", "").at_least(0).required(),
      field<&T::from>("from", "").in_any_unit(),
      field<&T::to>("to", "").in_any_unit(),
  });
  static constexpr Type type = structure<T>("log_normal_length", "", fields);
};
template <>
struct Described<UniformLengthFile> {
  using T = UniformLengthFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::from>("from", "").in_any_unit().required(),
      field<&T::to>("to", "").in_any_unit().required(),
  });
  static constexpr Type type = structure<T>("uniform_length", "", fields);
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
      field<&T::length>("length", "Its length.").in_any_unit().called("a number; a distribution").required(),
  });
  static constexpr Type type = structure<T>("sphere", "A vector of random direction.", fields);
};

template <>
struct Described<TiltFile> {
  using T = TiltFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::deviation>("deviation", "rad",
                           "Standard deviation of the tilt about each of two axes perpendicular to the vector.")
          .at_least(0),
      field<&T::factor>("factor", "On its length.").called("a number; a distribution"),
  });
  static constexpr Type type =
      structure<T>("tilt", "The scenario's own vector, turned a little, and its length multiplied.", fields);
};

template <>
struct Described<TurnFile> {
  using T = TurnFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::deviation>("deviation", "rad", "Standard deviation of the turn about each axis of the turned frame.")
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
                      "A value of the scenario, as for --set: a number, a list or mapping of numbers; for 'rotation' "
                      "what has the orientation; for 'discrete' anything.")
          .optional(),
      field<&T::paths>("paths", "Several of them, for a normal distribution with a covariance.")
          .called("a list")
          .items(1, 0)
          .optional(),
      field<&T::as>("as", "What is drawn: the value itself, a factor on the scenario's own, or what is added to it."),
      field<&T::together>("together", "One number is drawn for all numbers at the path; else each has its own."),
      field<&T::normal>("normal", ""),
      field<&T::log_normal>("log_normal", ""),
      field<&T::uniform>("uniform", ""),
      field<&T::integers>("integers", ""),
      field<&T::discrete>("discrete", ""),
      field<&T::sphere>("sphere", ""),
      field<&T::tilt>("tilt", ""),
      field<&T::rotation>("rotation", "An orientation: uniform over all, or the scenario's own turned a little.")
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
      field<&T::name>("name", "What results call it.").required(),
      field<&T::holds>("holds", "The expression.").required(),
  });
  static constexpr Type type = structure<T>("condition", "", fields);
};

/// The mapping `worst` of a SeriesToKeep.
struct WorstKeys;
template <>
struct Described<WorstKeys> {
  using T = SeriesToKeep;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::worst>("count", "How many.").at_least(0).at_most(100000).required(),
      field<&T::worst_by>("by", "The column.").required(),
  });
  static constexpr Type type = structure<T>("worst", "So many with the largest value of a column.", fields);
};
template <>
struct Described<SeriesToKeep> {
  using T = SeriesToKeep;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::sample>("sample", "The first so many cases.").at_least(0).at_most(100000),
      field<&T::failures>("failures", "The first so many that failed.").at_least(0).at_most(100000),
      group<T, WorstKeys>("worst", "").optional(),
  });
  static constexpr Type type =
      structure<T>("series", "Of which cases the complete results are kept, as of 'grapnel run'.", fields);
};
template <>
struct Described<KeepFile> {
  using T = KeepFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::columns>("columns",
                         "Of each case, by name or the beginning of one up to a '/'; '*' stands for any part. Absent: "
                         "all. What 'success' and 'worst' read is always kept.")
          .called("a list")
          .items(1, 0)
          .optional(),
      field<&T::series>("series", ""),
  });
  static constexpr Type type = structure<T>("keep", "What is kept.", fields);
};

template <>
struct Described<CampaignFile> {
  using T = CampaignFile;
  static constexpr auto fields = std::to_array<Field>({
      version_key("constant grapnel-campaign/1"),
      field<&T::name>("name", kName).required(),
      field<&T::description>("description", kDescription).as("any text").optional(),
      field<&T::scenario>("scenario", kScenario).required(),
      changes_key("Values of the scenario that are other than in its file, by path, for all cases."),
      field<&T::simulate>("simulate", kSimulate),
      field<&T::cases>("cases", "How many; with design axes: at each of their points.")
          .at_least(1)
          .at_most(kMostCases)
          .required(),
      field<&T::seed>("seed", "Another seed, other cases.").at_least(0).at_most(kLargestWhole),
      field<&T::sampling>("sampling",
                          "random: independent. latin_hypercube: every input alone is spread evenly over its "
                          "distribution. sobol: all together are, by a scrambled Sobol sequence."),
      field<&T::plan>("plan",
                      "nominal: the approach is planned once, for the scenario as it stands, and all cases follow that "
                      "plan. per_case: planned anew for the true values of each."),
      field<&T::uncertain>("uncertain", "What is not known exactly, and how it is distributed.")
          .items(1, 300)
          .required(),
      field<&T::success>("success",
                         "Conditions on a case's columns and inputs that must all hold for a success; absent: "
                         "captured, where the scenario has grasps.")
          .called("an expression; {name, holds}")
          .items(1, 0),
      field<&T::keep>("keep", ""),
      field<&T::confidence>("confidence", "Of the intervals in the results, two-sided.").at_least(0.5).at_most(0.9999),
      field<&T::quantiles>("quantiles",
                           "Probabilities whose quantiles the results have, increasing; absent: 0.01, 0.05, 0.25, 0.5, "
                           "0.75, 0.95, 0.99.")
          .at_least(0)
          .at_most(1)
          .items(1, 100),
      field<&T::time_limit>("time_limit", "s", "Of one case, on the wall; a case that takes longer fails. 0: none.")
          .at_least(0),
      field<&T::design>("design",
                        "Axes as in studies; their values apply to the scenario before the uncertain ones are drawn. "
                        "For 'grapnel map'.")
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
      field<&TermFile::weight>("weight", "Factor in the sum."),
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
      field<&T::path>("path", "A number of the scenario, as for --set: approach.duration.").optional(),
      field<&QuantityFile::quantity>("quantity", "What has no single value in a scenario file; as in studies."),
      field<&T::patch>("patch", "TARGET.POINT: the grasp point moves on a patch around it.").optional(),
      field<&T::posture>("posture",
                         "The arms' final posture: the planner is to find the solution nearest to the present one, "
                         "moved along each direction of the null space."),
      field<&QuantityFile::grasp>("grasp", "End-effector of the grasp that a quantity is of; absent: all.").optional(),
      field<&QuantityFile::target>("target", "The target that a quantity is of; absent: all.").optional(),
      field<&QuantityFile::axis>("axis", "Unit. About which a quantity turns; as in studies."),
      field<&QuantityFile::direction>("direction", "Unit, in W: of the relative velocity (relative_speed)."),
      field<&QuantityFile::unit>("unit", "Of an angle; absent: rad.").optional(),
      field<&T::from>("from", "Least value.").in_any_unit(),
      field<&T::to>("to", "Largest value.").in_any_unit(),
      field<&T::u>("u", "Unit, in the target's frame: a direction of the patch."),
      field<&T::v>("v", "Unit, across u: the other direction."),
      field<&T::radius>("radius", "m", "Of a patch that is a disc.").above(0),
      field<&T::half_widths>("half_widths", "m", "Of a patch that is a rectangle: along u and along v.").above(0),
  });
  static constexpr auto rules = std::to_array<Rule>({
      one_of("path, quantity, patch, posture"),
      when("patch").require("u, v").require_one_of("radius, half_widths"),
      when("patch").forbid("from, to", "radius or half_widths say it"),
      when("patch").forbid("grasp, target, axis, direction", kOfQuantities),
      when("patch").forbid("unit", "a patch is in metres"),
      when("path").require("from, to").forbid("u, v, radius, half_widths", kOfPatches),
      when("path").forbid("grasp, target, axis, direction", kOfQuantities),
      when("path").forbid("unit", "scenarios are in SI units and radians"),
      when("posture").require("from, to").forbid("u, v, radius, half_widths", kOfPatches),
      when("posture").forbid("grasp, target, axis, direction", kOfQuantities),
      when("posture").forbid("unit", "joint values are in radians and metres"),
      when("quantity").require("from, to").forbid("u, v, radius, half_widths", kOfPatches),
      when("quantity", "relative_speed, relative_direction, approach_angle").forbid("target", "give 'grasp'"),
      when("quantity", "target_spin, mass_ratio").forbid("grasp", "give 'target'"),
      when("quantity", "target_spin, mass_ratio").forbid("direction", "it belongs to relative_speed"),
      when("quantity", "relative_direction, approach_angle").forbid("direction", "it belongs to relative_speed"),
      when("quantity", "relative_speed, mass_ratio").forbid("axis", "it belongs to quantities that turn"),
      when("quantity", "relative_speed, mass_ratio").forbid("unit", "it is no angle"),
  });
  static constexpr Type type = structure<T>("variable", "", fields, rules);
};

template <>
struct Described<SearchSetup> {
  using T = SearchSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::evaluations>("evaluations",
                             "Captures to simulate, at most: half of them a sample that fills the ranges, half for "
                             "local searches.")
          .at_least(1)
          .at_most(1000000),
      field<&T::seed>("seed", "Of the sample; the same seed gives the same results.")
          .at_least(0)
          .at_most(kLargestWhole),
      field<&T::refine>("refine", "Best points of the sample from which local searches begin; 0: the sample is all.")
          .at_least(0)
          .at_most(100),
  });
  static constexpr Type type = structure<T>("search", "How the best is looked for.", fields);
};

template <>
struct Described<OptimizationFile> {
  using T = OptimizationFile;
  static constexpr auto fields = std::to_array<Field>({
      version_key("constant grapnel-optimization/1"),
      field<&T::name>("name", kName).required(),
      field<&T::description>("description", kDescription).as("any text").optional(),
      field<&T::scenario>("scenario", kScenario).required(),
      changes_key("Values of the scenario that are other than in its file, by path."),
      field<&T::simulate>("simulate",
                          "impact: planning and the impact at the planned final configuration, no motion in time, so "
                          "that clearances and limits on the way do not show; run: the whole capture."),
      field<&T::minimize>("minimize", "What is to be least.")
          .called("the name of a column; a list of weighted terms")
          .items(1, 0),
      field<&T::maximize>("maximize", "What is to be largest.")
          .called("the name of a column; a list of weighted terms")
          .items(1, 0),
      field<&T::variables>("variables", "What may be varied.").items(1, 32).required(),
      field<&T::limits>("limits", "What must hold."),
      field<&T::feasible>("feasible",
                          "Whether joints must stay within their limits and bodies clear of each other, where that is "
                          "watched (simulate: run)."),
      field<&T::search>("search", ""),
  });
  static constexpr auto rules = std::to_array<Rule>({one_of("minimize, maximize")});
  static constexpr Type type =
      structure<T>("optimization",
                   "Which of many captures is best: one scenario, the numbers that may be varied, what is to be least "
                   "or largest, and what must hold. SI units, radians where nothing else is said.",
                   fields, rules);
};

const Type& labelled_value_description() { return type_of<LabelledFile>(); }
const Type& study_file_description() { return type_of<StudyFile>(); }
const Type& campaign_file_description() { return type_of<CampaignFile>(); }
const Type& optimization_file_description() { return type_of<OptimizationFile>(); }

}  // namespace grapnel
