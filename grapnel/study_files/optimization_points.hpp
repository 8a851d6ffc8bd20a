#pragma once

/// @file
/// Variables and captures of an optimization, from trees. Thread safety: const members from any thread, once the
/// files have been read.

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "grapnel/scenario/scenario_files.hpp"
#include "grapnel/study/optimization.hpp"
#include "grapnel/study/quantity.hpp"
#include "grapnel/study_files/file_structures.hpp"

namespace grapnel {

/// An item of 'variables'. Only the members of its kind are in use.
struct SearchedVariable {
  enum class Kind { path, quantity, patch, posture };
  Kind kind = Kind::path;
  std::string name;   // as tables have it
  std::string unit;   // of from and to
  std::string place;  // "variables[0]", for messages
  Mark mark, from_mark, to_mark;
  double from = 0, to = 1;
  std::uint8_t written_unit = 0;  // of from and to: Node::unit
  std::string path;
  Mark path_mark;
  Quantity quantity;
  bool in_degrees = false;
  ContactPatch patch;

  double in_si(double value) const;
};

/// Reads a variable at a node whose structure has been checked. `base`: the scenario, for names; null if there is none.
SearchedVariable searched_variable(const VariableFile& file, const Node& node, const std::string& place,
                                   const CaptureProblem* base, FaultList& faults);

class OptimizationPoints {
 public:
  std::filesystem::path scenario;
  std::string named;  // its text in the file
  std::vector<Change> set;
  std::vector<SearchedVariable> variables;
  PostureSpace posture;
  mutable ScenarioFiles files;

  /// Applies one variable alone. @throws InputError, std::exception for errors of its value.
  void check(const SearchedVariable& variable, double value, const CaptureProblem& base) const;
  /// Data of the unchanged scenario that the points need.
  void finish(const CaptureProblem& base, FaultList& faults);
  /// The numbers of a variable.
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
