#pragma once

/// @file
/// Contents of study, campaign and optimization files as plain data. file_structures.cpp describes every key with its
/// member, unit, range, default and meaning; the published schemas, the structure check and the reader are generated
/// from it. Arbitrary values of a scenario remain in the file's tree: `set`, and the `values` of axes and of discrete
/// distributions.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "grapnel/campaign/campaign.hpp"
#include "grapnel/campaign/uncertain_value.hpp"
#include "grapnel/describe/type.hpp"
#include "grapnel/study/optimization.hpp"
#include "grapnel/study/quantity.hpp"

namespace grapnel {

enum class AngleUnit { rad, deg };

/// Common base of the structures of axes and variables: a quantity, or another kind of value.
struct QuantityFile {
  std::optional<QuantityKind> quantity;
  std::string grasp, target;
  std::optional<Vector3d> axis, direction;
  AngleUnit unit = AngleUnit::rad;
};

struct AxisFile : QuantityFile {
  enum class Spacing { linear, logarithmic };
  std::string path, name;
  std::optional<double> from, to;
  std::uint64_t count = 2;
  Spacing spacing = Spacing::linear;
};

/// A value of an axis by name; its changes remain in the tree.
struct LabelledFile {
  std::string label, scenario;
};

struct StudyFile {
  std::string name, description, scenario;
  StudyMode simulate = StudyMode::run;
  std::vector<AxisFile> axes;
  std::vector<std::string> columns;
};

/// One number for all numbers at a path, or one for each.
using OneOrEach = std::optional<std::variant<double, std::vector<double>>>;

struct NormalFile {
  OneOrEach mean, deviation, from, to;
  std::vector<std::vector<double>> covariance;
};
struct LogNormalFile {
  OneOrEach median, deviation, from, to;
};
struct UniformFile {
  OneOrEach from, to;
};
struct IntegersFile {
  std::uint64_t from = 0, to = 9007199254740991;
};
struct DiscreteFile {
  std::optional<std::vector<double>> weights;
};
/// Distributions of a length.
struct NormalLengthFile {
  double mean = 0, deviation = 0;
  std::optional<double> from, to;
};
struct LogNormalLengthFile {
  double median = 1, deviation = 0;
  std::optional<double> from, to;
};
struct UniformLengthFile {
  double from = 0, to = 0;
};
/// A length that is drawn.
struct LengthFile {
  std::optional<NormalLengthFile> normal;
  std::optional<LogNormalLengthFile> log_normal;
  std::optional<UniformLengthFile> uniform;
};
using Length = std::variant<double, LengthFile>;
struct SphereFile {
  Length length;
};
struct TiltFile {
  double deviation = 0;
  std::optional<Length> factor;
};
struct TurnFile {
  double deviation = 0;
};
enum class AnyRotation { uniform };

/// An entry of `uncertain`: exactly one distribution is present.
struct UncertainFile {
  std::string path;
  std::vector<std::string> paths;
  ValueForm as = ValueForm::value;
  bool together = false;
  std::optional<NormalFile> normal;
  std::optional<LogNormalFile> log_normal;
  std::optional<UniformFile> uniform;
  std::optional<IntegersFile> integers;
  std::optional<DiscreteFile> discrete;
  std::optional<SphereFile> sphere;
  std::optional<TiltFile> tilt;
  std::optional<std::variant<AnyRotation, TurnFile>> rotation;
};

struct NamedCondition {
  std::string name, holds;
};
struct KeepFile {
  std::vector<std::string> columns;
  SeriesToKeep series;
};

struct CampaignFile {
  std::string name, description, scenario;
  StudyMode simulate = StudyMode::run;
  std::uint64_t cases = 0, seed = 0;
  Sampling sampling = Sampling::random;
  CampaignPlan plan = CampaignPlan::nominal;
  std::vector<UncertainFile> uncertain;
  std::optional<std::vector<std::variant<std::string, NamedCondition>>> success;
  KeepFile keep;
  double confidence = 0.95;
  std::optional<std::vector<double>> quantiles;
  double time_limit = 0;
  std::vector<AxisFile> design;
};

struct MeasuredFile {
  std::string column;
  std::optional<Combine> combine;
};
struct TermFile : MeasuredFile {
  double weight = 1;
};
struct LimitFile : MeasuredFile {
  std::optional<double> at_most, at_least;
};
using ObjectiveFile = std::variant<std::string, std::vector<TermFile>>;

struct VariableFile : QuantityFile {
  enum class Posture { null_space };
  std::string path, patch;
  std::optional<Posture> posture;
  std::optional<double> from, to;
  std::optional<Vector3d> u, v;
  std::optional<double> radius;
  std::optional<std::array<double, 2>> half_widths;
};

struct OptimizationFile {
  std::string name, description, scenario;
  StudyMode simulate = StudyMode::run;
  std::optional<ObjectiveFile> minimize, maximize;
  std::vector<VariableFile> variables;
  std::vector<LimitFile> limits;
  bool feasible = true;
  SearchSetup search;
};

const Type& labelled_value_description();
const Type& study_file_description();
const Type& campaign_file_description();
const Type& optimization_file_description();

}  // namespace grapnel
