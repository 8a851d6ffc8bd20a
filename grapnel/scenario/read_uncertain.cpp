#include "grapnel/scenario/read_uncertain.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "grapnel/scenario/reader.hpp"
#include "grapnel/scenario/uncertain_inputs.hpp"
#include "grapnel/scenario/uncertain_numbers.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/write_yaml.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

using Kind = NumberDistribution::Kind;

constexpr const char* kKinds[] = {"normal",   "log_normal", "uniform", "integers",
                                  "discrete", "sphere",     "tilt",    "rotation"};

NumberDistribution constant(double value) { return {Kind::constant, value, 0, 0, 0, false}; }

// One entry of `uncertain`.
class UncertainReader {
 public:
  UncertainReader(const Node& entry, const UncertainPaths& where, const Node& scenario, FaultList& faults)
      : node_(entry), faults_(faults) {
    read_.where = where;
    const std::size_t before = faults.size();
    form_ = form_at(where, scenario, faults);
    if (form_.is_absent) report_unknown_keys(where, scenario, faults);
    sound_ = faults.size() == before;
    for (const char* kind : kKinds) {
      if (!node_.find(kind)) continue;
      kind_ = kind;
      break;
    }
    const std::string as = text_at(node_, "as");
    value_form_ = as == "factor" ? ValueForm::factor : as == "offset" ? ValueForm::offset : ValueForm::value;
  }

  ReadUncertain read(const Node& scenario, const CaptureProblem& problem) {
    if (sound_ && !kind_.empty()) read_kind();
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

  void read_kind() {
    const bool of_numbers = kind_ == "normal" || kind_ == "log_normal" || kind_ == "uniform" || kind_ == "integers";
    if (read_.where.paths.size() > 1 && !kind_node().find("covariance"))
      return fault(read_.where.path_marks[1], "several 'paths' are for normal with a 'covariance'");
    if (kind_ == "discrete") return read_discrete();
    if (!of_numbers) expect_absent({"as", "together"});
    if (kind_ == "rotation") return read_rotation();
    if (!expect_numbers()) return;
    if (kind_ == "sphere") return read_sphere();
    if (kind_ == "tilt") return read_tilt();
    if (kind_node().find("covariance")) return read_covariance();
    read_numbers();
  }

  void expect_absent(std::initializer_list<const char*> keys) {
    for (const char* key : keys) {
      const NodeEntry* entry = node_.entry(key);
      // Defaults have been filled in, at the mark of the mapping.
      if (!entry || (entry->mark.line == node_.mark.line && entry->mark.column == node_.mark.column)) continue;
      fault(entry->mark, fmt::format("'{}' has no meaning with {}", key, kind_));
    }
  }

  bool expect_numbers() {
    for (std::size_t p = 0; p < form_.forms.size(); ++p) {
      const Node& form = form_.forms[p];
      if (form.kind == Node::Kind::null || numbers_in(form)) continue;
      fault(read_.where.path_marks[p], fmt::format("at {} stands {} in the scenario, no number; only 'discrete' can "
                                                   "replace that",
                                                   shortened(read_.where.paths[p]), described(form)));
      return false;
    }
    const bool needs_own = value_form_ != ValueForm::value || kind_ == "tilt" || read_.where.paths.size() > 1;
    if (form_.is_absent && needs_own) {
      fault(
          read_.where.path_marks[0],
          fmt::format("the scenario has nothing at {} that the value could be relative to; give it there, or by 'set'",
                      shortened(path())));
      return false;
    }
    if (value_form_ == ValueForm::factor &&
        std::all_of(form_.nominal.begin(), form_.nominal.end(), [](double x) { return x == 0; })) {
      fault(part(node_, "as").mark,
            fmt::format("at {} stands 0, which no factor changes; use as: offset or as: value", shortened(path())));
      return false;
    }
    return true;
  }

  // --- Numbers ---

  // A parameter of every number: one for all, or one for each.
  std::optional<std::vector<double>> parameters(const char* key, std::optional<double> absent, std::size_t n) {
    const Node* given = kind_node().find(key);
    if (!given) {
      if (!absent) return {};
      return std::vector<double>(n, *absent);
    }
    if (const auto one = number_of(*given)) return std::vector<double>(n, *one);
    auto list = numbers_in(*given).value_or(std::vector<double>(n, 0.0));
    if (list.size() == n) return list;
    fault(given->mark, fmt::format("{}.{} has {}, must have {}, one for each number at {}", kind_, key,
                                   counted(list.size(), "item"), n, shortened(path())));
    return std::vector<double>(n, 0.0);
  }

  // How many numbers the parameters speak of where nothing stands in the scenario.
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
    const bool together = boolean_at(node_, "together");
    const std::size_t n = together ? 1 : count();
    std::vector<NumberDistribution> distributions;
    if (kind_ == "normal")
      distributions = normals(n);
    else if (kind_ == "log_normal")
      distributions = log_normals(n);
    else if (kind_ == "uniform")
      distributions = uniforms(n);
    else
      distributions = integers(n);
    if (!sound_) return;
    if (together)
      read_.value = CommonNumber{distributions[0], value_form_};
    else
      read_.value = IndependentNumbers{std::move(distributions), value_form_};
    if (dimensions(read_.value) == 0) fault(kind_mark(), "nothing of it is uncertain");
  }

  std::optional<double> neutral() const {
    if (value_form_ == ValueForm::factor) return 1;
    if (value_form_ == ValueForm::offset) return 0;
    return {};
  }

  // Cuts off what lies beyond 'from' and 'to'.
  void cut(std::vector<NumberDistribution>& distributions) {
    const Node& node = kind_node();
    if (!node.find("from") && !node.find("to")) return;
    const std::size_t n = distributions.size();
    const auto from = *parameters("from", -HUGE_VAL, n), to = *parameters("to", HUGE_VAL, n);
    for (std::size_t i = 0; i < n; ++i) {
      NumberDistribution& d = distributions[i];
      d.from = from[i], d.to = to[i], d.cut = true;
      const std::string wrong = cut_fault(kind_, d);
      if (!wrong.empty()) return fault(kind_mark(), wrong);
    }
  }

  std::vector<NumberDistribution> normals(std::size_t n) {
    const auto mean = parameters("mean", neutral(), n), deviation = parameters("deviation", 0.0, n);
    if (!mean) {
      fault(kind_mark(), "normal needs a 'mean'; about the scenario's own value it is as: offset or as: factor");
      return {};
    }
    std::vector<NumberDistribution> result;
    for (std::size_t i = 0; i < n; ++i) result.push_back({Kind::normal, (*mean)[i], (*deviation)[i], 0, 0, false});
    cut(result);
    return settled(std::move(result));
  }

  std::vector<NumberDistribution> log_normals(std::size_t n) {
    const auto neutral_median = value_form_ == ValueForm::factor ? std::optional<double>(1) : std::nullopt;
    const auto median = parameters("median", neutral_median, n), deviation = parameters("deviation", 0.0, n);
    if (!median) {
      fault(kind_mark(), "log_normal needs a 'median'; about the scenario's own value it is as: factor");
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
    cut(result);
    return settled(std::move(result));
  }

  // What does not vary is a constant.
  static std::vector<NumberDistribution> settled(std::vector<NumberDistribution> distributions) {
    for (NumberDistribution& d : distributions) {
      if (d.scale == 0) d = constant(d.location);
    }
    return distributions;
  }

  std::vector<NumberDistribution> uniforms(std::size_t n) {
    const auto from = *parameters("from", 0.0, n), to = *parameters("to", 0.0, n);
    std::vector<NumberDistribution> result;
    for (std::size_t i = 0; i < n; ++i) {
      if (from[i] > to[i]) fault(kind_mark(), fmt::format("uniform.from is {}, above to, {}", from[i], to[i]));
      result.push_back(from[i] == to[i] ? constant(from[i])
                                        : NumberDistribution{Kind::uniform, 0, 0, from[i], to[i], false});
    }
    return result;
  }

  std::vector<NumberDistribution> integers(std::size_t n) {
    const double from = number_at(kind_node(), "from").value_or(0), to = number_at(kind_node(), "to").value_or(0);
    if (!(from < to)) fault(kind_mark(), fmt::format("integers.from is {}, must be less than to, {}", from, to));
    if (value_form_ != ValueForm::value) fault(part(node_, "as").mark, "integers are values, no factors or offsets");
    return std::vector<NumberDistribution>(n, {Kind::integers, 0, 0, from, to, false});
  }

  void read_covariance() {
    expect_absent({"together"});
    const std::size_t n = count();
    const Node& node = part(kind_node(), "covariance");
    std::vector<double> matrix;
    for (const Node& row : node.items) {
      const auto numbers = numbers_in(row).value_or(std::vector<double>{});
      if (numbers.size() == n) matrix.insert(matrix.end(), numbers.begin(), numbers.end());
    }
    if (node.items.size() != n || matrix.size() != n * n)
      return fault(node.mark, fmt::format("normal.covariance must be {} by {}: {} at the {}", n, n,
                                          n == 1 ? "one number stands" : fmt::format("{} numbers stand", n),
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
    if (!factor)
      return fault(node.mark, "normal.covariance is indefinite; no random numbers have it" + why_indefinite(matrix, n));
    for (const char* key : {"from", "to"}) {
      if (const NodeEntry* entry = kind_node().entry(key))
        fault(entry->mark, fmt::format("normal.{} has no meaning with a covariance", key));
    }
    const auto mean = parameters("mean", neutral(), n);
    if (!mean) return fault(kind_mark(), "normal needs a 'mean'; about the scenario's own values it is as: offset");
    read_.value = CorrelatedNumbers{*mean, std::move(*factor), value_form_};
  }

  // --- Vectors and orientations ---

  bool expect_vector() {
    if (form_.is_absent && kind_ == "sphere")
      form_.forms[0] = list_node(std::vector<double>(3, 0.0)), form_.nominal.assign(3, 0.0);
    if (form_.forms[0].is_sequence() && count() == 3) return true;
    fault(read_.where.path_marks[0],
          fmt::format("{} is for a vector, a list of 3 numbers; at {} stands {}", kind_, shortened(path()),
                      count() == 1 ? "one number" : counted(count(), "number")));
    return false;
  }

  NumberDistribution length_at(const char* key) {
    const Node* given = kind_node().find(key);
    if (!given) return constant(1);
    if (const auto number = number_of(*given)) return constant(*number);
    NumberDistribution d;
    for (const char* kind : {"normal", "log_normal", "uniform"}) {
      const Node* node = given->find(kind);
      if (!node) continue;
      const auto number = [&](const char* name, double absent) { return number_at(*node, name).value_or(absent); };
      d.from = number("from", -HUGE_VAL), d.to = number("to", HUGE_VAL);
      d.scale = number("deviation", 0);
      const std::string kind_name = kind;
      d.kind = kind_name == "normal" ? Kind::normal : kind_name == "uniform" ? Kind::uniform : Kind::log_normal;
      d.location = number(kind_name == "log_normal" ? "median" : "mean", 1);
      d.cut = kind_name != "uniform" && (node->find("from") || node->find("to"));
      const std::string name = fmt::format("{}.{}.{}", kind_, key, kind);
      if (d.kind == Kind::log_normal && !(d.location > 0))
        fault(node->mark, fmt::format("{}.median is {}, must be greater than 0", name, d.location));
      else if (d.kind == Kind::uniform && !(d.from < d.to))
        fault(node->mark, fmt::format("{}.from is {}, must be less than to, {}", name, d.from, d.to));
      else if (const std::string wrong = d.cut ? cut_fault(name, d) : ""; !wrong.empty())
        fault(node->mark, wrong);
      if (d.kind != Kind::uniform && d.scale == 0) d = constant(d.location);
    }
    return d;
  }

  void read_sphere() {
    if (!expect_vector()) return;
    const NumberDistribution length = length_at("length");
    read_.value = SphereVector{length};
    const Node& given = part(kind_node(), "length");
    const std::string wrong = sound_ ? length_fault("sphere.length", given, length) : "";
    if (!wrong.empty()) fault(given.mark, wrong);
  }

  void read_tilt() {
    if (!expect_vector()) return;
    if (std::hypot(form_.nominal[0], form_.nominal[1], form_.nominal[2]) == 0)
      return fault(read_.where.path_marks[0],
                   fmt::format("at {} stands a vector without length, which has no direction "
                               "to tilt",
                               shortened(path())));
    read_.value = TiltedVector{number_at(kind_node(), "deviation").value_or(0), length_at("factor")};
    if (sound_ && dimensions(read_.value) == 0) fault(kind_mark(), "nothing of it is uncertain");
  }

  void read_rotation() {
    if (!form_.forms[0].is_sequence() || count() != 4) {
      return fault(
          read_.where.path_marks[0],
          fmt::format("rotation is for what has an orientation, a 'quaternion_wxyz' or 'rpy': name the mapping, "
                      "such as targets.NAME.state"));
    }
    const Node& node = kind_node();
    read_.value = UncertainRotation{is_text(node), number_at(node, "deviation").value_or(0)};
  }

  void read_discrete() {
    expect_absent({"as", "together"});
    const Node &node = kind_node(), &weights = part(node, "weights");
    read_.choices = part(node, "values").items;
    const auto is_number = [](const Node& value) {
      return value.is_scalar() && numbers_in(value).has_value();
    };  // finite
    read_.choices_are_numbers = std::all_of(read_.choices.begin(), read_.choices.end(), is_number);
    auto given = numbers_in(weights).value_or(std::vector<double>(read_.choices.size(), 1.0));
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
  const Node& node_;
  FaultList& faults_;
  ReadUncertain read_;
  UncertainForm form_;
  std::string kind_;
  ValueForm value_form_ = ValueForm::value;
  bool sound_ = true;
};

}  // namespace

ReadUncertain read_uncertain(const Node& entry, const UncertainPaths& where, const Node& scenario,
                             const CaptureProblem& problem, FaultList& faults) {
  if (where.paths.empty()) return {where, {}, {}, false, {}};
  return UncertainReader(entry, where, scenario, faults).read(scenario, problem);
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
