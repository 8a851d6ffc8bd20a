#include "grapnel/study_files/read_uncertain.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "grapnel/scenario/reader.hpp"
#include "grapnel/scenario/schema.hpp"
#include "grapnel/study_files/study_units.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/units.hpp"
#include "grapnel/text/write_yaml.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

using Kind = NumberDistribution::Kind;

NumberDistribution constant(double value) { return {Kind::constant, value, 0, 0, 0, false}; }

// The relative resolution of probabilities is about 1e-16: an interval with a smaller probability would have only some
// million values.
constexpr double kLeastPart = 1e-10;
// Number of deviations beyond which less than one number is expected in 10^9 cases, the limit of a campaign.
constexpr double kFarAway = 6;

std::string far_away(const std::string& name, const NumberDistribution& d, bool above, double deviations) {
  return fmt::format(
      "{}.{} is {:.9g}, {:.4g} deviations {} the {}, {:.9g}; beyond about 37 the probability is zero in double "
      "precision: correct the interval or the {}, or use uniform",
      name, above ? "from" : "to", above ? d.from : d.to, deviations, above ? "above" : "below",
      d.kind == Kind::normal ? "mean" : "median", d.location, d.kind == Kind::normal ? "mean" : "median");
}

// Error of a distribution on one line; empty if it is valid. `name` is its name in the file, "sphere.length.normal".
// Truncated distributions may have an empty interval, or an interval without probability in double precision.
std::string cut_fault(const std::string& name, const NumberDistribution& d) {
  if (!(d.from < d.to)) return fmt::format("{}.from is {}, must be less than to, {}", name, d.from, d.to);
  if (d.scale == 0) {
    if (d.location >= d.from && d.location <= d.to) return {};
    return fmt::format("{}.{} is {:.9g} and its deviation 0, which is not between {:.9g} and {:.9g}", name,
                       d.kind == Kind::normal ? "mean" : "median", d.location, d.from, d.to);
  }
  if (d.kind == Kind::log_normal && d.to <= 0) return fmt::format("{}.to is {}, must be greater than 0", name, d.to);
  const auto [low, high] = d.standard_bounds();
  const bool above = low > 0;
  // As in the sampling: above the median by the mirror image, whose probabilities keep their precision.
  const double less = normal_probability(above ? -high : low), most = normal_probability(above ? -low : high);
  if (most < std::numeric_limits<double>::min()) return far_away(name, d, above, above ? low : -high);
  if (most - less < kLeastPart * most)
    return fmt::format("{}.from is {} and to {}, too close to each other for the deviation, {:.9g}: use uniform", name,
                       d.from, d.to, d.scale);
  return {};
}

// Error of a length, which must not be negative; `given` is its description in the file.
std::string length_fault(const std::string& name, const Length& given, const NumberDistribution& d) {
  const auto negative = [](const std::string& what, double value) {
    return fmt::format("{} is {:.9g}, must be at least 0", what, value);
  };
  const auto* file = std::get_if<LengthFile>(&given);
  if (!file) return d.location < 0 ? negative(name, d.location) : std::string();
  if (file->uniform) return file->uniform->from < 0 ? negative(name + ".uniform.from", file->uniform->from) : "";
  if (!file->normal) return {};
  const std::optional<double>& from = file->normal->from;
  const std::string whole = name + ".normal";
  if (from && *from < 0) return negative(whole + ".from", *from);
  if (d.is_constant() && d.location < 0) return negative(whole + ".mean", d.location);
  if (d.kind == Kind::normal && !from && d.location < kFarAway * d.scale)
    return fmt::format("{} has mean {:.9g} and deviation {:.9g}, which gives lengths below 0; add from: 0", whole,
                       d.location, d.scale);
  return {};
}

// The reason for an indefinite covariance, if two numbers show it.
std::string why_indefinite(const std::vector<double>& matrix, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    if (matrix[i * n + i] < 0) return fmt::format(": [{}][{}] is {}, a variance", i, i, matrix[i * n + i]);
    for (std::size_t j = 0; j < i; ++j) {
      const double most = std::sqrt(std::max(0.0, matrix[i * n + i]) * std::max(0.0, matrix[j * n + j]));
      if (std::abs(matrix[i * n + j]) > most * (1 + 1e-9))
        return fmt::format(": [{}][{}] is {}, at most {:.9g} is possible with these variances", i, j, matrix[i * n + j],
                           most);
    }
  }
  return {};
}

// The key of an entry's distribution.
std::string kind_of(const UncertainFile& file) {
  return file.normal       ? "normal"
         : file.log_normal ? "log_normal"
         : file.uniform    ? "uniform"
         : file.integers   ? "integers"
         : file.discrete   ? "discrete"
         : file.sphere     ? "sphere"
         : file.tilt       ? "tilt"
         : file.rotation   ? "rotation"
                           : "";
}

// One entry of `uncertain`.
class UncertainReader {
 public:
  UncertainReader(const UncertainFile& file, const Node& entry, const UncertainPaths& where, const Node& scenario,
                  FaultList& faults)
      : file_(file), node_(entry), faults_(faults), kind_(kind_of(file)), value_form_(file.as) {
    read_.where = where;
    const std::size_t before = faults.size();
    form_ = form_at(where, scenario, faults);
    if (form_.is_absent) report_unknown_keys(where, scenario, faults);
    sound_ = faults.size() == before;
  }

  ReadUncertain read(const Node& scenario, const CaptureProblem& problem) {
    if (sound_ && !kind_.empty()) read_kind();
    if (sound_ && !kind_.empty()) expect_joint_units(scenario, problem);
    if (sound_ && !kind_.empty()) read_.inputs = inputs_of(read_, form_, scenario, problem);
    return std::move(read_);
  }

 private:
  void fault(const Mark& mark, const std::string& message) {
    faults_.add(mark, read_.where.place + ": " + message);
    sound_ = false;
  }
  const Node& kind_node() const { return part(node_, kind_); }
  const Mark& kind_mark() const { return node_.entry(kind_)->mark; }
  std::size_t count() const { return form_.nominal.size(); }
  std::string path() const { return read_.where.paths[0]; }

  // Numbers with units for revolute or prismatic joints.
  void expect_joint_units(const Node& scenario, const CaptureProblem& problem) {
    const std::string stated = place_rule(path()).unit;
    if (units_of_place(stated).size() < 2) return;
    const std::vector<std::string> units = units_at(read_, form_, scenario, problem);
    const std::size_t before = faults_.size();
    for (const NodeEntry& entry : kind_node().entries)
      check_joint_units(entry.value, stated, units, fmt::format("{}: {}.{}", read_.where.place, kind_, entry.key),
                        faults_);
    sound_ = faults_.size() == before;
  }

  void read_kind() {
    const bool of_numbers = kind_ == "normal" || kind_ == "log_normal" || kind_ == "uniform" || kind_ == "integers";
    const bool is_correlated = file_.normal && !file_.normal->covariance.empty();
    if (read_.where.paths.size() > 1 && !is_correlated)
      return fault(read_.where.path_marks[1], "several 'paths' are for normal with a 'covariance'");
    if (kind_ == "discrete") return read_discrete();
    if (!of_numbers) expect_absent({"as", "together"});
    if (kind_ == "rotation") return read_rotation();
    if (!expect_numbers()) return;
    if (kind_ == "sphere") return read_sphere();
    if (kind_ == "tilt") return read_tilt();
    if (is_correlated) return read_covariance();
    read_numbers();
  }

  void expect_absent(std::initializer_list<const char*> keys) {
    for (const char* key : keys) {
      if (const NodeEntry* entry = node_.entry(key))
        fault(entry->mark, fmt::format("'{}' has no meaning with {}", key, kind_));
    }
  }

  bool expect_numbers() {
    for (std::size_t p = 0; p < form_.forms.size(); ++p) {
      const Node& form = form_.forms[p];
      if (form.kind == Node::Kind::null || numbers_in(form)) continue;
      fault(read_.where.path_marks[p],
            fmt::format("the scenario has {1} at {0}, not a number; only 'discrete' can replace it",
                        shortened(read_.where.paths[p]), described(form)));
      return false;
    }
    const bool needs_own = value_form_ != ValueForm::value || kind_ == "tilt" || read_.where.paths.size() > 1;
    if (form_.is_absent && needs_own) {
      fault(read_.where.path_marks[0],
            fmt::format("the scenario has no value at {} for a relative value; add it there, or by 'set'",
                        shortened(path())));
      return false;
    }
    if (value_form_ == ValueForm::factor &&
        std::all_of(form_.nominal.begin(), form_.nominal.end(), [](double x) { return x == 0; })) {
      fault(part(node_, "as").mark,
            fmt::format("the value at {} is 0, which a factor does not change; use as: offset or as: value",
                        shortened(path())));
      return false;
    }
    return true;
  }

  // --- Numbers ---

  // A parameter of every number: one for all, or one for each; if it is absent, the default, if there is one.
  std::optional<std::vector<double>> parameters(const OneOrEach& given, const char* key, std::optional<double> absent,
                                                std::size_t n) {
    if (!given) {
      if (!absent) return {};
      return std::vector<double>(n, *absent);
    }
    if (const double* one = std::get_if<double>(&*given)) return std::vector<double>(n, *one);
    const auto& list = std::get<std::vector<double>>(*given);
    if (list.size() == n) return list;
    fault(part(kind_node(), key).mark, fmt::format("{}.{} has {}, must have {}, one for each number at {}", kind_, key,
                                                   counted(list.size(), "item"), n, shortened(path())));
    return std::vector<double>(n, 0.0);
  }

  // Number of values in the parameters, if the scenario has no value.
  void shape_by_parameters() {
    if (!form_.is_absent) return;
    std::size_t n = 0;
    for (const NodeEntry& entry : kind_node().entries) {
      if (entry.value.is_sequence()) n = std::max(n, entry.value.items.size());
    }
    form_.nominal.assign(std::max<std::size_t>(n, 1), 0.0);
    form_.forms[0] = n > 0 ? list_node(form_.nominal) : number_node(0);
  }

  void read_numbers() {
    shape_by_parameters();
    const std::size_t n = file_.together ? 1 : count();
    std::vector<NumberDistribution> distributions = file_.normal       ? normals(*file_.normal, n)
                                                    : file_.log_normal ? log_normals(*file_.log_normal, n)
                                                    : file_.uniform    ? uniforms(*file_.uniform, n)
                                                                       : integers(*file_.integers, n);
    if (!sound_) return;
    if (file_.together)
      read_.value = CommonNumber{distributions[0], value_form_};
    else
      read_.value = IndependentNumbers{std::move(distributions), value_form_};
    if (dimensions(read_.value) == 0) fault(kind_mark(), "no component is uncertain");
  }

  std::optional<double> neutral() const {
    if (value_form_ == ValueForm::factor) return 1;
    if (value_form_ == ValueForm::offset) return 0;
    return {};
  }

  // Truncates the distribution to 'from' and 'to'.
  void cut(const OneOrEach& least, const OneOrEach& most, std::vector<NumberDistribution>& distributions) {
    if (!least && !most) return;
    const std::size_t n = distributions.size();
    const auto from = *parameters(least, "from", -HUGE_VAL, n), to = *parameters(most, "to", HUGE_VAL, n);
    for (std::size_t i = 0; i < n; ++i) {
      NumberDistribution& d = distributions[i];
      d.from = from[i], d.to = to[i], d.cut = true;
      const std::string wrong = cut_fault(kind_, d);
      if (!wrong.empty()) return fault(kind_mark(), wrong);
    }
  }

  std::vector<NumberDistribution> normals(const NormalFile& file, std::size_t n) {
    const auto mean = parameters(file.mean, "mean", neutral(), n),
               deviation = parameters(file.deviation, "deviation", 0.0, n);
    if (!mean) {
      fault(kind_mark(),
            "normal needs a 'mean'; use as: offset or as: factor for a distribution about the scenario's value");
      return {};
    }
    std::vector<NumberDistribution> result;
    for (std::size_t i = 0; i < n; ++i) result.push_back({Kind::normal, (*mean)[i], (*deviation)[i], 0, 0, false});
    cut(file.from, file.to, result);
    return settled(std::move(result));
  }

  std::vector<NumberDistribution> log_normals(const LogNormalFile& file, std::size_t n) {
    const auto neutral_median = value_form_ == ValueForm::factor ? std::optional<double>(1) : std::nullopt;
    const auto median = parameters(file.median, "median", neutral_median, n),
               deviation = parameters(file.deviation, "deviation", 0.0, n);
    if (!median) {
      fault(kind_mark(), "log_normal needs a 'median'; use as: factor for a distribution about the scenario's value");
      return {};
    }
    std::vector<NumberDistribution> result;
    for (std::size_t i = 0; i < n; ++i) {
      if (!((*median)[i] > 0)) {
        fault(part(kind_node(), "median").mark,
              fmt::format("log_normal.median is {}, must be greater than 0", (*median)[i]));
        return {};
      }
      result.push_back({Kind::log_normal, (*median)[i], (*deviation)[i], 0, 0, false});
    }
    cut(file.from, file.to, result);
    return settled(std::move(result));
  }

  // A parameter without variation is a constant.
  static std::vector<NumberDistribution> settled(std::vector<NumberDistribution> distributions) {
    for (NumberDistribution& d : distributions) {
      if (d.scale == 0) d = constant(d.location);
    }
    return distributions;
  }

  std::vector<NumberDistribution> uniforms(const UniformFile& file, std::size_t n) {
    const auto from = *parameters(file.from, "from", 0.0, n), to = *parameters(file.to, "to", 0.0, n);
    std::vector<NumberDistribution> result;
    for (std::size_t i = 0; i < n; ++i) {
      if (from[i] > to[i]) fault(kind_mark(), fmt::format("uniform.from is {}, above to, {}", from[i], to[i]));
      result.push_back(from[i] == to[i] ? constant(from[i])
                                        : NumberDistribution{Kind::uniform, 0, 0, from[i], to[i], false});
    }
    return result;
  }

  std::vector<NumberDistribution> integers(const IntegersFile& file, std::size_t n) {
    const double from = static_cast<double>(file.from), to = static_cast<double>(file.to);
    if (!(from < to)) fault(kind_mark(), fmt::format("integers.from is {}, must be less than to, {}", from, to));
    if (value_form_ != ValueForm::value) fault(part(node_, "as").mark, "integers are values, not factors or offsets");
    return std::vector<NumberDistribution>(n, {Kind::integers, 0, 0, from, to, false});
  }

  void read_covariance() {
    expect_absent({"together"});
    const std::size_t n = count();
    const Node& node = part(kind_node(), "covariance");
    const std::vector<std::vector<double>>& rows = file_.normal->covariance;
    std::vector<double> matrix;
    for (const std::vector<double>& row : rows) {
      if (row.size() == n) matrix.insert(matrix.end(), row.begin(), row.end());
    }
    if (rows.size() != n || matrix.size() != n * n)
      return fault(node.mark, fmt::format("normal.covariance must be {} by {}: {} at the {}", n, n,
                                          n == 1 ? "one number is" : fmt::format("{} numbers are", n),
                                          read_.where.paths.size() == 1 ? "path" : "paths"));
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        if (matrix[i * n + j] == matrix[j * n + i]) continue;
        return fault(node.items[i].items[j].mark,
                     fmt::format("normal.covariance[{}][{}] is {}, but [{}][{}] is {}; a covariance is symmetric", i, j,
                                 matrix[i * n + j], j, i, matrix[j * n + i]));
      }
    }
    auto factor = semidefinite_factor(matrix, n);
    if (!factor) return fault(node.mark, "normal.covariance is indefinite" + why_indefinite(matrix, n));
    for (const char* key : {"from", "to"}) {
      if (const NodeEntry* entry = kind_node().entry(key))
        fault(entry->mark, fmt::format("normal.{} has no meaning with a covariance", key));
    }
    const auto mean = parameters(file_.normal->mean, "mean", neutral(), n);
    if (!mean)
      return fault(kind_mark(), "normal needs a 'mean'; use as: offset for a distribution about the scenario's values");
    read_.value = CorrelatedNumbers{*mean, std::move(*factor), value_form_};
  }

  // --- Vectors and orientations ---

  bool expect_vector() {
    if (form_.is_absent && kind_ == "sphere")
      form_.forms[0] = list_node(std::vector<double>(3, 0.0)), form_.nominal.assign(3, 0.0);
    if (form_.forms[0].is_sequence() && count() == 3) return true;
    fault(read_.where.path_marks[0],
          fmt::format("{} requires a vector, a list of 3 numbers; at {} there is {}", kind_, shortened(path()),
                      count() == 1 ? "one number" : counted(count(), "number")));
    return false;
  }

  // `name` is the length's in the file, "sphere.length".
  NumberDistribution distribution_of(const Length& length, const std::string& name) {
    if (const double* number = std::get_if<double>(&length)) return constant(*number);
    const auto& file = std::get<LengthFile>(length);
    NumberDistribution d;
    const auto take_cut = [&](Kind kind, double location, const auto& one) {
      const bool is_cut = one.from || one.to;
      d = {kind, location, one.deviation, one.from.value_or(-HUGE_VAL), one.to.value_or(HUGE_VAL), is_cut};
    };
    std::string kind = "uniform";
    if (file.normal)
      kind = "normal", take_cut(Kind::normal, file.normal->mean, *file.normal);
    else if (file.log_normal)
      kind = "log_normal", take_cut(Kind::log_normal, file.log_normal->median, *file.log_normal);
    else if (file.uniform)
      d = {Kind::uniform, 1, 0, file.uniform->from, file.uniform->to, false};
    const std::string whole = name + "." + kind;
    const Mark& mark = part(part(kind_node(), name.substr(name.rfind('.') + 1)), kind).mark;
    if (d.kind == Kind::log_normal && !(d.location > 0))
      fault(mark, fmt::format("{}.median is {}, must be greater than 0", whole, d.location));
    else if (d.kind == Kind::uniform && !(d.from < d.to))
      fault(mark, fmt::format("{}.from is {}, must be less than to, {}", whole, d.from, d.to));
    else if (const std::string wrong = d.cut ? cut_fault(whole, d) : ""; !wrong.empty())
      fault(mark, wrong);
    if (d.kind != Kind::uniform && d.scale == 0) d = constant(d.location);
    return d;
  }

  void read_sphere() {
    if (!expect_vector()) return;
    const NumberDistribution length = distribution_of(file_.sphere->length, "sphere.length");
    read_.value = SphereVector{length};
    const std::string wrong = sound_ ? length_fault("sphere.length", file_.sphere->length, length) : "";
    if (!wrong.empty()) fault(part(kind_node(), "length").mark, wrong);
  }

  void read_tilt() {
    if (!expect_vector()) return;
    if (std::hypot(form_.nominal[0], form_.nominal[1], form_.nominal[2]) == 0)
      return fault(read_.where.path_marks[0],
                   fmt::format("the vector at {} is zero and has no direction to tilt", shortened(path())));
    const TiltFile& file = *file_.tilt;
    read_.value =
        TiltedVector{file.deviation, file.factor ? distribution_of(*file.factor, "tilt.factor") : constant(1)};
    if (sound_ && dimensions(read_.value) == 0) fault(kind_mark(), "no component is uncertain");
  }

  void read_rotation() {
    if (!form_.forms[0].is_sequence() || count() != 4) {
      return fault(read_.where.path_marks[0],
                   fmt::format("rotation requires an orientation, a 'quaternion_wxyz' or 'rpy': use the path of the "
                               "mapping, such as targets.NAME.state"));
    }
    const auto* turn = std::get_if<TurnFile>(&*file_.rotation);
    read_.value = UncertainRotation{!turn, turn ? turn->deviation : 0};
  }

  void read_discrete() {
    expect_absent({"as", "together"});
    const Node &node = kind_node(), &weights = part(node, "weights");
    read_.choices = part(node, "values").items;
    const auto is_number = [](const Node& value) {
      return value.is_scalar() && numbers_in(value).has_value();
    };  // finite
    read_.choices_are_numbers = std::all_of(read_.choices.begin(), read_.choices.end(), is_number);
    auto given = file_.discrete->weights.value_or(std::vector<double>(read_.choices.size(), 1.0));
    if (given.size() != read_.choices.size())
      return fault(weights.mark, fmt::format("discrete.weights has {}, must have {}, one for each value",
                                             counted(given.size(), "item"), read_.choices.size()));
    double sum = 0;
    for (double& weight : given) weight = sum += weight;
    if (!(sum > 0) || !std::isfinite(sum))
      return fault(weights.mark, "discrete.weights must have a sum greater than 0");
    read_.value = ChosenValue{std::move(given)};
  }

 private:
  const UncertainFile& file_;
  const Node& node_;
  FaultList& faults_;
  ReadUncertain read_;
  UncertainForm form_;
  std::string kind_;
  ValueForm value_form_;
  bool sound_ = true;
};

}  // namespace

ReadUncertain read_uncertain(const UncertainFile& file, const Node& entry, const UncertainPaths& where,
                             const Node& scenario, const CaptureProblem& problem, FaultList& faults) {
  if (where.paths.empty()) return {where, {}, {}, false, {}};
  return UncertainReader(file, entry, where, scenario, faults).read(scenario, problem);
}

std::vector<Change> changes_of(const ReadUncertain& uncertain, const UncertainForm& form,
                               const std::vector<double>& numbers) {
  std::vector<Change> changes;
  std::size_t at = 0;
  for (std::size_t p = 0; p < uncertain.where.paths.size(); ++p) {
    const Mark& mark = uncertain.where.path_marks[p];
    Node value;
    if (!uncertain.choices.empty()) {
      value = uncertain.choices[static_cast<std::size_t>(numbers[0])];
    } else if (form.is_absent) {
      value = numbers.size() == 1 ? number_node(numbers[0], mark) : list_node(numbers, mark);
    } else {
      const std::size_t count = numbers_in(form.forms[p])->size();
      value = with_numbers(form.forms[p], std::span(numbers).subspan(at, count), mark);
      at += count;
    }
    const std::string text = flow_text(value);
    changes.push_back({uncertain.where.paths[p], mark, std::move(value), text});
  }
  return changes;
}

}  // namespace grapnel
