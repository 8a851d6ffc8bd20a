#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <stdexcept>

#include "grapnel/result/file_seal.hpp"
#include "grapnel/scenario/reader.hpp"
#include "grapnel/study_files/changed_scenario.hpp"
#include "grapnel/study_files/optimization_points.hpp"
#include "grapnel/study_files/study_document.hpp"
#include "grapnel/study_files/study_files.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/text_file.hpp"
#include "grapnel/text/units.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

// Whether the columns are X/x, X/y, X/z.
bool are_one_vector(const Measured& measured, const std::vector<Column>& columns) {
  if (measured.columns.size() != 3) return false;
  const std::string& first = columns[measured.columns[0]].name;
  const std::string stem = first.substr(0, first.size() - 1);
  const char* component = "xyz";
  for (std::size_t k = 0; k < 3; ++k) {
    if (columns[measured.columns[k]].name != stem + component[k]) return false;
  }
  return stem.ends_with('/');
}

// The columns of a name.
void find_columns(const Node& name, const std::string& place, const std::vector<Column>& columns, Measured& measured,
                  FaultList& faults) {
  std::vector<std::string> names;
  for (std::size_t c = 0; c < columns.size(); ++c) {
    names.push_back(columns[c].name);
    if (column_matches(name.text, columns[c].name)) measured.columns.push_back(c);
  }
  if (!measured.columns.empty() || columns.empty() || name.text.empty()) return;
  const std::string near = nearest(name.text, names);
  faults.add(name.mark, fmt::format("no column {} in {}{}", in_quotes(name.text), place,
                                    near.empty() ? "; a sweep's table.csv has them all, see docs/formats/study.md"
                                                 : "; did you mean " + in_quotes(near) + "?"));
}

// Reads a text or a mapping with 'column' and 'combine'. `large_is_bad` defines the worst of several columns.
Measured measured_by(const MeasuredFile& file, const Node& name, const std::string& place, bool large_is_bad,
                     const std::vector<Column>& columns, FaultList& faults) {
  Measured measured;
  measured.name = file.column;
  find_columns(name, place, columns, measured, faults);
  for (const std::size_t column : measured.columns) {
    const bool first = column == measured.columns.front();
    if (first || columns[column].unit == measured.unit)
      measured.unit = columns[column].unit;
    else
      measured.unit.clear();
  }
  const Combine worst = large_is_bad ? Combine::largest : Combine::least;
  measured.combine = file.combine.value_or(are_one_vector(measured, columns) ? Combine::norm : worst);
  if (measured.columns.size() > 1) measured.name = fmt::format("{} of {}", name_of(measured.combine), measured.name);
  return measured;
}

std::vector<ObjectiveTerm> objective_of(const ObjectiveFile& file, const Node& node, const std::string& place,
                                        bool maximize, const std::vector<Column>& columns, FaultList& faults) {
  if (const std::string* column = std::get_if<std::string>(&file))
    return {{measured_by({*column, {}}, node, place, !maximize, columns, faults), 1}};
  std::vector<ObjectiveTerm> terms;
  const auto& files = std::get<std::vector<TermFile>>(file);
  for (std::size_t i = 0; i < files.size(); ++i) {
    const bool large_is_bad = (files[i].weight > 0) != maximize;
    terms.push_back(
        {measured_by(files[i], part(node.items[i], "column"), item(place, i), large_is_bad, columns, faults),
         files[i].weight});
  }
  return terms;
}

std::vector<OptimizationLimit> limits_of(const std::vector<LimitFile>& files, const Node& list,
                                         const std::vector<Column>& columns, FaultList& faults) {
  std::vector<OptimizationLimit> limits;
  for (std::size_t i = 0; i < files.size(); ++i) {
    const bool at_most = files[i].at_most.has_value();
    const std::string place = item("limits", i);
    limits.push_back({measured_by(files[i], part(list.items[i], "column"), place, at_most, columns, faults), at_most,
                      at_most ? *files[i].at_most : files[i].at_least.value_or(0)});
    OptimizationLimit& limit = limits.back();
    const char* const key = at_most ? "at_most" : "at_least";
    Node bound = part(list.items[i], key);
    if (bound.written.empty() || limit.measured.columns.empty()) continue;
    bound.text = bound.written, bound.unit = 0;
    const std::string& unit = limit.measured.unit;
    if (take_unit(bound, unit.empty() ? "1" : unit, below(place, key), faults) == UnitReading::taken)
      limit.bound = number_of(bound).value();
  }
  return limits;
}

class OptimizationReader {
 public:
  explicit OptimizationReader(const std::filesystem::path& path)
      : path_(path), points_(std::make_shared<OptimizationPoints>()) {}

  Optimization read(std::vector<Fault>* warnings) {
    OptimizationFile file;
    StudyDocument document = read_document(path_, file, faults_);
    root_ = std::move(document.root);
    structure_is_sound_ = document.sound;
    points_->named = file.scenario;
    points_->scenario = path_beside(path_, points_->named);
    points_->set = read_changes(part(root_, "set"));
    result_.name = file.name;
    result_.file = path_.string();
    result_.text = std::move(document.bytes);
    result_.mode = file.simulate;
    result_.feasible = file.feasible;
    result_.search = file.search;
    const auto base = read_base(warnings);
    take_variables(file, base.get());
    if (base && structure_is_sound_) check_ends(*base);
    take_measures(file);
    faults_.throw_if_any();
    points_->finish(*base, faults_);
    finish_variables();
    faults_.throw_if_any();
    result_.sha256 = sha256(result_.text + base->sha256);
    result_.before = {*base, inward_normals(*base)};
    result_.point = [points = points_](std::span<const double> values) { return points->point(values); };
    result_.scenario_text = [points = points_](std::span<const double> values, const std::filesystem::path& place,
                                               const std::string& comment) {
      return points->scenario_text(values, place, comment);
    };
    return std::move(result_);
  }

 private:
  // The unchanged scenario, with "set".
  std::shared_ptr<const CaptureProblem> read_base(std::vector<Fault>* warnings) {
    if (points_->named.empty()) return nullptr;
    const std::size_t before = faults_.size();
    read_file(points_->scenario, part(root_, "scenario").mark, faults_, kLargestFile, points_->named);
    if (faults_.size() != before) return nullptr;
    try {
      auto base = std::make_shared<const CaptureProblem>(
          load_scenario(points_->scenario, points_->set, points_->files, warnings));
      result_.columns = offered_columns(*base, result_.mode == StudyMode::run);
      expect_impact(result_.mode, *base, root_, faults_);
      return base;
    } catch (const InputError& error) {
      for (const Fault& fault : error.faults()) faults_.add(fault);
    }
    return nullptr;
  }

  void take_variables(const OptimizationFile& file, const CaptureProblem* base) {
    const Node& list = part(root_, "variables");
    for (std::size_t i = 0; i < file.variables.size(); ++i) {
      SearchedVariable variable =
          searched_variable(file.variables[i], list.items[i], item("variables", i), base, faults_);
      for (const SearchedVariable& other : points_->variables) {
        if (other.name == variable.name && !variable.name.empty())
          faults_.add(variable.mark,
                      fmt::format("{} varies {}, as {} does", variable.place, in_quotes(variable.name), other.place));
      }
      points_->variables.push_back(std::move(variable));
    }
  }

  // Each variable at both ends, the others not applied.
  void check_ends(const CaptureProblem& base) {
    for (const SearchedVariable& variable : points_->variables) {
      for (const double end : {variable.from, variable.to}) {
        const std::size_t before = faults_.size();
        try {
          points_->check(variable, end, base);
        } catch (const InputError& error) {
          for (const Fault& fault : error.faults()) faults_.add(fault);
        } catch (const std::exception& error) {
          faults_.add(variable.mark,
                      fmt::format("{}: {} (scenario {})", variable.place, error.what(), in_quotes(base.name)));
        }
        if (faults_.size() != before) break;
      }
    }
  }

  void take_measures(const OptimizationFile& file) {
    result_.maximize = file.maximize.has_value();
    const char* key = result_.maximize ? "maximize" : "minimize";
    if (const auto& objective = result_.maximize ? file.maximize : file.minimize)
      result_.objective = objective_of(*objective, part(root_, key), key, result_.maximize, result_.columns, faults_);
    result_.limits = limits_of(file.limits, part(root_, "limits"), result_.columns, faults_);
    keep_columns();
    result_.columns.push_back(feasibility_column());
  }

  // Columns of every case, and the measured columns.
  void keep_columns() {
    std::vector<bool> kept;
    for (const Column& column : result_.columns) kept.push_back(column.by_default);
    const auto each = [&](auto&& what) {
      for (ObjectiveTerm& term : result_.objective) what(term.measured.columns);
      for (OptimizationLimit& limit : result_.limits) what(limit.measured.columns);
    };
    each([&](const std::vector<std::size_t>& columns) {
      for (const std::size_t column : columns) kept[column] = true;
    });
    std::vector<std::size_t> place(kept.size());
    std::vector<Column> columns;
    for (std::size_t c = 0; c < kept.size(); ++c) {
      place[c] = columns.size();
      if (kept[c]) columns.push_back(std::move(result_.columns[c]));
    }
    result_.columns = std::move(columns);
    each([&](std::vector<std::size_t>& measured) {
      for (std::size_t& column : measured) column = place[column];
    });
  }

  void finish_variables() {
    for (const SearchedVariable& variable : points_->variables) {
      for (OptimizationVariable& shown : points_->shown(variable)) result_.variables.push_back(std::move(shown));
    }
  }

  std::filesystem::path path_;
  std::shared_ptr<OptimizationPoints> points_;
  Node root_;
  FaultList faults_;
  Optimization result_;
  bool structure_is_sound_ = false;
};

}  // namespace

Optimization load_optimization(const std::filesystem::path& path, std::vector<Fault>* warnings) {
  return OptimizationReader(path).read(warnings);
}

}  // namespace grapnel
