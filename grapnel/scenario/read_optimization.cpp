#include "grapnel/scenario/read_optimization.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "grapnel/result/sha256.hpp"
#include "grapnel/scenario/optimization_points.hpp"
#include "grapnel/scenario/read_optimization_terms.hpp"
#include "grapnel/scenario/reader.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "grapnel/scenario/schema.hpp"
#include "grapnel/scenario/study_document.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/text_file.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

class OptimizationReader {
 public:
  explicit OptimizationReader(const std::filesystem::path& path)
      : path_(path), points_(std::make_shared<OptimizationPoints>()) {}

  Optimization read(std::vector<Fault>* doubts) {
    read_text();
    points_->named = text_at(root_, "scenario");
    points_->scenario = path_beside(path_, points_->named);
    points_->set = read_changes(part(root_, "set"));
    result_.name = text_at(root_, "name");
    result_.file = path_.string();
    result_.mode = text_at(root_, "simulate") == "impact" ? StudyMode::impact : StudyMode::run;
    result_.feasible = boolean_at(root_, "feasible");
    read_search();
    const auto base = read_base(doubts);
    read_variables(base.get());
    if (base && structure_is_sound_) check_ends(*base);
    read_measures();
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
  void read_text() {
    StudyDocument document =
        read_study_document(path_, "optimization", "an optimization", optimization_schema_document(), faults_);
    result_.text = std::move(document.bytes);
    root_ = std::move(document.root);
    structure_is_sound_ = document.sound;
  }

  void read_search() {
    const Node& node = part(root_, "search");
    result_.search.evaluations = whole_number_at(node, "evaluations", 1'000'000);
    result_.search.seed = whole_number_at(node, "seed", std::uint64_t{1} << 53);
    result_.search.refine = whole_number_at(node, "refine", 100);
  }

  // The scenario as it is, with "set".
  std::shared_ptr<const CaptureProblem> read_base(std::vector<Fault>* doubts) {
    if (points_->named.empty()) return nullptr;
    const std::size_t before = faults_.size();
    read_file(points_->scenario, part(root_, "scenario").mark, faults_, kLargestFile, points_->named);
    if (faults_.size() != before) return nullptr;
    try {
      auto base = std::make_shared<const CaptureProblem>(
          load_scenario(points_->scenario, points_->set, points_->files, doubts));
      result_.columns = offered_columns(*base, result_.mode == StudyMode::run);
      if (result_.mode == StudyMode::impact && !base->impact)
        faults_.add(part(root_, "simulate").mark,
                    fmt::format("simulate: impact needs a scenario with 'impact', {} has none", in_quotes(base->name)));
      return base;
    } catch (const InputError& error) {
      for (const Fault& fault : error.faults()) faults_.add(fault);
    }
    return nullptr;
  }

  void read_variables(const CaptureProblem* base) {
    const Node& list = part(root_, "variables");
    for (std::size_t i = 0; i < list.items.size(); ++i) {
      SearchedVariable variable = read_searched_variable(list.items[i], item("variables", i), base, faults_);
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

  void read_measures() {
    const bool maximize = root_.find("maximize") != nullptr;
    const char* key = maximize ? "maximize" : "minimize";
    result_.maximize = maximize;
    result_.objective = read_objective(part(root_, key), key, maximize, result_.columns, faults_);
    result_.limits = read_limits(part(root_, "limits"), result_.columns, faults_);
    keep_columns();
    result_.columns.push_back(feasibility_column());
  }

  // Those that every case has, and those that are measured.
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

Optimization load_optimization(const std::filesystem::path& path, std::vector<Fault>* doubts) {
  return OptimizationReader(path).read(doubts);
}

}  // namespace grapnel
