#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "grapnel/campaign/case_pool.hpp"
#include "grapnel/campaign/changed_scenario.hpp"
#include "grapnel/campaign/study_document.hpp"
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/compare/identification.hpp"
#include "grapnel/result/file_seal.hpp"
#include "grapnel/scenario/reader.hpp"
#include "grapnel/scenario/scenario_files.hpp"
#include "grapnel/scenario/schema.hpp"
#include "grapnel/scenario/sections.hpp"
#include "grapnel/text/error_text.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/parse_yaml.hpp"
#include "grapnel/text/text_file.hpp"
#include "grapnel/text/units.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

enum class ParameterScale { linear, logarithmic };

struct ParameterFile {
  std::string path, name;
  std::vector<std::string> paths;
  double from = 0, to = 1;
  std::optional<double> start, uncertainty;
  ParameterScale scale = ParameterScale::linear;
};
struct LogFile {
  std::string log, map, name;
  std::vector<std::string> free_bias;
};
struct FitSearchFile {
  std::uint64_t starts = 3, seed = 0, iterations = 50;
};
struct IdentificationFile {
  std::string name, description, scenario;
  std::vector<ParameterFile> parameters;
  std::vector<LogFile> logs;
  FitSearchFile search;
  bool cross_validate = true;
};

}  // namespace

template <>
struct Described<ParameterScale> : Enumeration<ParameterScale, "ParameterScale", "linear", "logarithmic"> {};

template <>
struct Described<ParameterFile> {
  using T = ParameterFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::path>("path", "A number of the scenario, as for `--set`: `targets.target-1.mass`.").optional(),
      field<&T::paths>("paths", "Several numbers that have the same value.").items(1, 100).optional(),
      field<&T::name>("name", "Name in results. Absent: the first path.").optional(),
      field<&T::from>("from", "Minimum value.").in_any_unit().required(),
      field<&T::to>("to", "Maximum value.").in_any_unit().required(),
      field<&T::start>("start",
                       "First estimate. Absent: the scenario's value if it is between the bounds, else the middle.")
          .in_any_unit()
          .optional(),
      field<&T::uncertainty>("uncertainty",
                             "Standard uncertainty of `start` by other measurements: a prior of the fit. Absent: none.")
          .in_any_unit()
          .above(0)
          .optional(),
      field<&T::scale>("scale",
                       "logarithmic: the search and the interval are in the logarithm of the value, which must be "
                       "positive."),
  });
  static constexpr auto rules = std::to_array<Rule>({one_of("path, paths"), needs("uncertainty", "start")});
  static constexpr Type type = structure<T>("parameter", "", fields, rules);
};

template <>
struct Described<LogFile> {
  using T = LogFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::log>("log", "The log, its path relative to this file.").required(),
      field<&T::map>("map", "Its mapping file, as for `grapnel compare`, relative to this file.").required(),
      field<&T::name>("name", "Name in results and of its folder. Absent: the name of the log.").optional(),
      key<std::string>("set", "", "Values of the scenario in this experiment, by path, such as initial states.")
          .as("values by path")
          .by_default("{}"),
      field<&T::free_bias>("free_bias", "Names of quantities with an unknown bias of each component.").optional(),
  });
  static constexpr Type type = structure<T>("identification_log", "", fields);
};

template <>
struct Described<FitSearchFile> {
  using T = FitSearchFile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::starts>("starts",
                        "Number of searches: the first begins at the starts of the parameters, the others between "
                        "their bounds.")
          .at_least(1)
          .at_most(1000),
      field<&T::seed>("seed", kSeedText).at_least(0).at_most(kLargestWhole),
      field<&T::iterations>("iterations", "Maximum number of iterations of a search.").at_least(1).at_most(1000),
  });
  static constexpr Type type = structure<T>("fit_search", "Searches for the smallest residuals.", fields);
};

template <>
struct Described<IdentificationFile> {
  using T = IdentificationFile;
  static constexpr auto fields = std::to_array<Field>({
      version_key("constant grapnel-identification/1"),
      field<&T::name>("name", "Name in results.").required(),
      description_key(),
      field<&T::scenario>("scenario", "The scenario file, its path relative to this file.").required(),
      key<std::string>("set", "", "Values that replace those of the scenario file, by path.")
          .as("values by path")
          .by_default("{}"),
      field<&T::parameters>("parameters", "The parameters that are identified.").items(1, 32).required(),
      field<&T::logs>("logs", "Logs of experiments.").items(1, 100).required(),
      field<&T::search>("search", ""),
      field<&T::cross_validate>("cross_validate",
                                "Whether each of several logs is compared with the fit to the others."),
  });
  static constexpr Type type = structure<T>("identification",
                                            "Parameters of a scenario that logs of measurements determine, for "
                                            "`grapnel identify`. SI units and radians unless stated otherwise.",
                                            fields);
};

namespace {

const nlohmann::ordered_json& identification_schema_document() {
  static const nlohmann::ordered_json kSchema =
      schema_of(type_of<IdentificationFile>(), "Grapnel identification, version 1");
  return kSchema;
}

// A parameter with its places in the file.
struct ReadParameter {
  std::vector<std::string> paths;
  std::vector<Mark> path_marks;
  Mark mark, from_mark, to_mark;
  std::uint8_t written_unit = 0;  // of its numbers: Node::unit
  std::string place;              // "parameters[0]"
};

// The scenarios of an identification. Thread safety: const members from any thread.
class IdentifiedScenario {
 public:
  std::filesystem::path file;
  std::vector<Change> set;
  std::vector<ReadParameter> parameters;
  mutable ScenarioFiles files;

  std::vector<Change> changes(std::span<const double> values) const {
    std::vector<Change> all = set;
    for (std::size_t k = 0; k < parameters.size(); ++k) add(parameters[k], values[k], parameters[k].mark, all);
    return all;
  }
  // The scenario of one experiment.
  CaptureProblem load(std::span<const double> values, std::span<const Change> of_log,
                      std::vector<Fault>* warnings = nullptr) const {
    std::vector<Change> all = changes(values);
    all.insert(all.end(), of_log.begin(), of_log.end());
    return load_scenario(file, all, files, warnings);
  }
  // A parameter alone at a value. @throws InputError
  void check(const ReadParameter& parameter, double value, const Mark& mark) const {
    std::vector<Change> all = set;
    add(parameter, value, mark, all);
    load_scenario(file, all, files);
  }
  std::optional<double> present(const std::string& path) const {
    Node now = changed_tree(file, set, files);
    const auto value = value_at(std::move(now), path);
    return value ? number_of(*value) : std::nullopt;
  }
  std::string text(std::span<const double> values, const std::filesystem::path& place,
                   const std::string& comment) const {
    const CaptureProblem problem = load(values, {});
    return changed_scenario_text({file, changed_tree(file, changes(values), files), problem}, problem, place,
                                 ", identified", comment);
  }

 private:
  static void add(const ReadParameter& parameter, double value, const Mark& mark, std::vector<Change>& all) {
    for (std::size_t i = 0; i < parameter.paths.size(); ++i) {
      Change change{parameter.paths[i], parameter.path_marks[i], {}, fmt::format("{}", value)};
      change.value.kind = Node::Kind::scalar;
      change.value.mark = mark;
      change.value.text = change.text;
      change.value.unit = parameter.written_unit;
      all.push_back(std::move(change));
    }
  }
};

// The series of a run. @throws std::runtime_error, FitStopped
TimeSeries series_of(const CaptureProblem& problem, const std::stop_token& stop) {
  CaptureResult result = simulate_capture(problem, [&](const std::string&, double, double) {
    if (stop.stop_requested()) throw FitStopped{};
  });
  if (result.status != CaptureStatus::completed) throw std::runtime_error(result.failure);
  if (const LedgerEntry* wrong = result.ledger.worst_failure())
    throw std::runtime_error(kNotConserved + failure_text(*wrong));
  return std::move(result.series);
}

// A log, and the runs that it is compared with.
struct ReadLog {
  std::shared_ptr<const IdentifiedScenario> scenario;
  std::vector<Change> set;
  std::optional<MappedLog> log;
  std::vector<std::string> free_bias;

  std::vector<ComparedQuantity> simulate(std::span<const double> values, const std::stop_token& stop) const {
    std::vector<ComparedQuantity> quantities = log->against(series_of(scenario->load(values, set), stop));
    for (ComparedQuantity& one : quantities) {
      if (std::find(free_bias.begin(), free_bias.end(), one.name) != free_bias.end())
        one.bias_uncertainty = std::numeric_limits<double>::infinity();
    }
    return quantities;
  }
};

class IdentificationReader {
 public:
  IdentificationReader(const std::filesystem::path& path, const std::stop_token& stop)
      : path_(path), stop_(stop), scenario_(std::make_shared<IdentifiedScenario>()) {}

  Identification read(std::vector<Fault>* warnings) {
    read_file_structure();
    result_.name = file_.name, result_.file = path_.string();
    scenario_->file = path_beside(path_, file_.scenario);
    scenario_->set = read_changes(part(root_, "set"));
    result_.problem.settings = {file_.search.starts, file_.search.seed, file_.search.iterations, file_.cross_validate};
    read_base();
    for (std::size_t k = 0; k < file_.parameters.size(); ++k) take_parameter(k);
    for (std::size_t i = 0; i < file_.logs.size(); ++i) check_log(i);
    faults_.throw_if_any();
    for (std::size_t i = 0; i < file_.logs.size(); ++i) take_log(i, warnings);
    faults_.throw_if_any();
    result_.sha256 = sha256(result_.text + digests_);
    result_.scenario_text = [scenario = scenario_](std::span<const double> values, const std::filesystem::path& place,
                                                   const std::string& comment) {
      return scenario->text(values, place, comment);
    };
    return std::move(result_);
  }

 private:
  void read_file_structure() {
    const auto source = std::make_shared<const std::string>(path_.string());
    const auto bytes = read_file(path_, {source, 0, 0}, faults_);
    const auto text = bytes ? checked_text(*bytes, source, faults_) : std::nullopt;
    auto root = text ? parse_document(*text, source, faults_) : std::nullopt;
    if (!root) faults_.throw_if_any();
    result_.text = *bytes;
    root_ = std::move(*root);
    if (root_.kind == Node::Kind::null) faults_.add({source, 1, 1}, "the file is empty");
    faults_.throw_if_any();
    take_units_of_parameters();
    check_structure(root_, identification_schema_document(), "the identification", faults_);
    faults_.throw_if_any();
    read_structure(root_, type_of<IdentificationFile>(), &file_);
  }

  // Numbers have the unit of their place in the scenario.
  void take_units_of_parameters() {
    Node* list = root_.find("parameters");
    for (std::size_t k = 0; list && k < list->items.size(); ++k) {
      Node& one = list->items[k];
      const Node* path = one.find("path");
      if (const Node* several = one.find("paths"); several && !several->items.empty()) path = &several->items.front();
      if (!path || !path->is_scalar()) continue;
      const std::string unit = place_rule(path->text).unit;
      for (const char* key : {"from", "to", "start", "uncertainty"}) {
        Node* value = one.find(key);
        if (value && value->is_scalar() && !unit.empty())
          take_unit(*value, unit, below(item("parameters", k), key), faults_);
      }
    }
  }

  void read_base() {
    const std::size_t before = faults_.size();
    read_file(scenario_->file, part(root_, "scenario").mark, faults_, kLargestFile, file_.scenario);
    faults_.throw_if_any();
    try {
      const CaptureProblem base = load_scenario(scenario_->file, scenario_->set, scenario_->files);
      result_.problem.settings.tolerance = std::max(base.integration.relative_tolerance, 1e-13);
    } catch (const InputError& error) {
      for (const Fault& fault : error.faults()) faults_.add(fault);
    }
    if (faults_.size() != before) faults_.throw_if_any();
  }

  // ---- Parameters ----

  void take_parameter(std::size_t k) {
    const ParameterFile& file = file_.parameters[k];
    const Node& node = part(root_, "parameters").items[k];
    ReadParameter read;
    read.place = item("parameters", k), read.mark = node.mark;
    read.from_mark = part(node, "from").mark, read.to_mark = part(node, "to").mark;
    read.written_unit = part(node, "from").unit != 0 ? part(node, "from").unit : part(node, "to").unit;
    read.paths = file.paths.empty() ? std::vector<std::string>{file.path} : file.paths;
    for (std::size_t i = 0; i < read.paths.size(); ++i)
      read.path_marks.push_back(file.paths.empty() ? part(node, "path").mark : part(node, "paths").items[i].mark);
    FittedParameter one;
    one.name = file.name.empty() ? read.paths.front() : file.name;
    one.unit = unit_of(read);
    one.from = file.from, one.to = file.to, one.uncertainty = file.uncertainty;
    one.is_logarithmic = file.scale == ParameterScale::logarithmic;
    if (check_range(file, node, read)) {
      one.start = start_of(file, node, read);
      check_ends(read, one);
    }
    check_duplicates(read, one);
    scenario_->parameters.push_back(std::move(read));
    result_.paths.push_back(scenario_->parameters.back().paths);
    result_.problem.parameters.push_back(std::move(one));
  }

  // Of a place with several units, such as that of joints, the unit in the file.
  static std::string unit_of(const ReadParameter& read) {
    const std::string stated = place_rule(read.paths.front()).unit;
    const std::vector<std::string_view> units = units_of_place(stated);
    if (units.size() == 1) return std::string(units[0]);
    return read.written_unit > 0 && read.written_unit <= units.size() ? std::string(units[read.written_unit - 1u]) : "";
  }

  bool check_range(const ParameterFile& file, const Node& node, const ReadParameter& read) {
    const std::size_t before = faults_.size();
    if (!(file.from < file.to) || !std::isfinite(file.to - file.from))
      faults_.add(read.from_mark, fmt::format("{}: 'from' must be less than 'to', and both finite", read.place));
    else if (file.scale == ParameterScale::logarithmic && !(file.from > 0))
      faults_.add(read.from_mark, fmt::format("{}.from is {}, must be greater than 0 with 'scale: logarithmic'",
                                              read.place, file.from));
    else if (file.start && !(*file.start >= file.from && *file.start <= file.to))
      faults_.add(part(node, "start").mark, fmt::format("{}.start is {}, must be between 'from' and 'to', {} and {}",
                                                        read.place, *file.start, file.from, file.to));
    return faults_.size() == before;
  }

  double start_of(const ParameterFile& file, const Node&, const ReadParameter& read) const {
    if (file.start) return *file.start;
    const auto present = scenario_->present(read.paths.front());
    if (present && *present >= file.from && *present <= file.to) return *present;
    return file.scale == ParameterScale::logarithmic ? std::sqrt(file.from * file.to) : (file.from + file.to) / 2;
  }

  void check_ends(const ReadParameter& read, const FittedParameter& one) {
    for (const auto& [value, mark] : {std::pair{one.from, read.from_mark}, {one.to, read.to_mark}}) {
      try {
        scenario_->check(read, value, mark);
      } catch (const InputError& error) {
        for (const Fault& fault : error.faults()) faults_.add(fault);
        return;
      }
    }
  }

  void check_duplicates(const ReadParameter& read, const FittedParameter& one) {
    for (std::size_t k = 0; k < scenario_->parameters.size(); ++k) {
      const ReadParameter& other = scenario_->parameters[k];
      const bool shares = std::any_of(read.paths.begin(), read.paths.end(), [&](const std::string& path) {
        return std::find(other.paths.begin(), other.paths.end(), path) != other.paths.end();
      });
      if (shares || result_.problem.parameters[k].name == one.name)
        faults_.add(read.mark, fmt::format("{} has the {} of {}, {}", read.place, shares ? "path" : "name", other.place,
                                           in_quotes(one.name)));
    }
  }

  // ---- Logs ----

  std::string name_of_log(std::size_t i) const {
    const LogFile& file = file_.logs[i];
    return file.name.empty() ? std::filesystem::path(file.log).stem().string() : file.name;
  }

  // Names are folders.
  void check_log(std::size_t i) {
    const Node& node = part(root_, "logs").items[i];
    const std::string name = name_of_log(i);
    const bool is_plain =
        !name.empty() && name[0] != '.' && name[0] != '-' && std::all_of(name.begin(), name.end(), [](char c) {
          return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' ||
                 c == '.' || c == ' ';
        });
    const Mark& mark = file_.logs[i].name.empty() ? node.mark : part(node, "name").mark;
    if (!is_plain)
      faults_.add(mark, fmt::format("{}: the name {} must have letters, digits, '-', '_' and '.' only; state another "
                                    "one with 'name'",
                                    item("logs", i), in_quotes(name)));
    for (std::size_t k = 0; k < i; ++k) {
      if (name_of_log(k) != name) continue;
      faults_.add(mark, fmt::format("{} has the name of {}, {}; state another one with 'name'", item("logs", i),
                                    item("logs", k), in_quotes(name)));
    }
  }

  void take_log(std::size_t i, std::vector<Fault>* warnings) {
    const LogFile& file = file_.logs[i];
    const Node& node = part(root_, "logs").items[i];
    auto read = std::make_shared<ReadLog>();
    read->scenario = scenario_, read->set = read_changes(part(node, "set")), read->free_bias = file.free_bias;
    std::vector<double> starts;
    for (const FittedParameter& one : result_.problem.parameters) starts.push_back(one.start);
    std::optional<CaptureProblem> problem;
    TimeSeries series;
    try {
      problem = scenario_->load(starts, read->set, i == 0 ? warnings : nullptr);
      series = series_of(*problem, stop_);
    } catch (const InputError& error) {
      for (const Fault& fault : error.faults()) add_once(fault, faults_);
      return;
    } catch (const std::exception& error) {
      faults_.add(node.mark, fmt::format("{}: the starts of the parameters cannot be simulated: {}", item("logs", i),
                                         error_text(error)));
      return;
    }
    try {
      read->log.emplace(series, path_beside(path_, file.log), path_beside(path_, file.map));
    } catch (const InputError& error) {
      for (const Fault& fault : error.faults()) add_once(fault, faults_);
      return;
    }
    digests_ += problem->sha256 + read->log->description().sha256;
    result_.logs.push_back({name_of_log(i), {problem->name, problem->sha256}, read->log->description()});
    check_quantities(i, *read, series);
    add_log(i, read);
  }

  void check_quantities(std::size_t i, const ReadLog& read, const TimeSeries& series) {
    std::vector<std::string> names;
    bool any = false;
    for (const ComparedQuantity& one : read.log->against(series)) {
      names.push_back(one.name);
      any = any || one.uncertainty;
    }
    const Node& node = part(root_, "logs").items[i];
    if (!any)
      faults_.add(part(node, "map").mark,
                  fmt::format("{}: no quantity of the mapping has an 'uncertainty', which weights its residuals",
                              item("logs", i)));
    for (std::size_t k = 0; k < read.free_bias.size(); ++k) {
      if (std::find(names.begin(), names.end(), read.free_bias[k]) == names.end())
        faults_.add(part(node, "free_bias").items[k].mark,
                    fmt::format("the mapping has no quantity {}{}", in_quotes(read.free_bias[k]),
                                suggestion(read.free_bias[k], names, "quantities")));
    }
  }

  void add_log(std::size_t i, const std::shared_ptr<ReadLog>& read) {
    FittedLog& log = result_.problem.logs.emplace_back();
    log.name = name_of_log(i);
    log.simulate = [read](std::span<const double> values, const std::stop_token& stop) {
      return read->simulate(values, stop);
    };
    log.times = read->log->times();
    const MappedTime& clock = read->log->clock();
    if (const double* stated = std::get_if<double>(&clock.offset)) log.offset = *stated;
    log.fits_offset = std::holds_alternative<SearchedOffset>(clock.offset);
    log.offset_range = clock.search;
    if (const double* stated = std::get_if<double>(&clock.drift)) log.drift = *stated;
    log.fits_drift = std::holds_alternative<SearchedDrift>(clock.drift), log.largest_drift = clock.largest_drift;
    log.reference = clock.reference;
  }

  std::filesystem::path path_;
  std::stop_token stop_;
  std::shared_ptr<IdentifiedScenario> scenario_;
  FaultList faults_;
  Node root_;
  IdentificationFile file_;
  Identification result_;
  std::string digests_;
};

}  // namespace

std::string identification_schema() { return published(identification_schema_document()); }

Identification load_identification(const std::filesystem::path& path, const std::stop_token& stop,
                                   std::vector<Fault>* warnings) {
  return IdentificationReader(path, stop).read(warnings);
}

}  // namespace grapnel
