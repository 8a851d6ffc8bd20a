#pragma once

/// @file
/// The captures of an optimization, from trees. Thread safety: const members from any thread, once the files have been
/// read.

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "grapnel/scenario/optimization_variable.hpp"
#include "grapnel/scenario/read_study_axis.hpp"
#include "grapnel/scenario/scenario_files.hpp"
#include "grapnel/study/optimization.hpp"

namespace grapnel {

class OptimizationPoints {
 public:
  std::filesystem::path scenario;
  std::string named;  // the same as the file says it
  std::vector<Change> set;
  std::vector<SearchedVariable> variables;
  PostureSpace posture;
  mutable ScenarioFiles files;

  /// Applies one variable alone. @throws InputError, std::exception for what is wrong with it.
  void check(const SearchedVariable& variable, double value, const CaptureProblem& base) const;
  /// What the points need of the scenario as it is.
  void finish(const CaptureProblem& base, FaultList& faults);
  /// The numbers that a variable stands for.
  std::vector<OptimizationVariable> shown(const SearchedVariable& variable) const;

  StudyCase point(std::span<const double> values) const;
  std::string scenario_text(std::span<const double> values, const std::filesystem::path& place,
                            const std::string& comment) const;

 private:
  std::vector<Change> changes(std::span<const double> values) const;
  StudyCase moved(const CaptureProblem& before, std::span<const double> values) const;
  CaptureProblem before_moves(std::span<const double> values) const;
  Node tree(const std::vector<Change>& changes) const;

  std::shared_ptr<const CaptureProblem> base_;
};

}  // namespace grapnel
