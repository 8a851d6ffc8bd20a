#pragma once

/// @file
/// What study, campaign and optimization files have in common: a text whose tree is checked against its schema and read
/// into a structure of file_structures.hpp; columns by patterns; faults that several points share.

#include <filesystem>
#include <string>
#include <vector>

#include "grapnel/study/column.hpp"
#include "grapnel/study_files/file_structures.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

struct StudyDocument {
  std::string bytes;
  Node root;           // where everything stands, and what is any value of a scenario
  bool sound = false;  // false: structure faults were added; what is read must expect anything
};

/// Reads a file into its structure. Faults of structure are added to `faults`.
/// @throws InputError if there is nothing to go on with: no file, no YAML, or a file of another kind.
StudyDocument read_document(const std::filesystem::path& path, StudyFile& file, FaultList& faults);
StudyDocument read_document(const std::filesystem::path& path, CampaignFile& file, FaultList& faults);
StudyDocument read_document(const std::filesystem::path& path, OptimizationFile& file, FaultList& faults);

/// The changes of a mapping {path: value}.
std::vector<Change> read_changes(const Node& mapping);

/// Per column whether a pattern of the list chooses it; those kept by default where there is no list. A pattern that
/// chooses none is a fault.
std::vector<bool> chosen_columns(const Node& list, const std::vector<Column>& columns, FaultList& faults);

/// Adds a fault that is not there yet.
void add_once(Fault fault, FaultList& faults);
void add_once(const Mark& mark, std::string message, FaultList& faults);

/// A fault where a file simulates the impact of a scenario without one.
void expect_impact(StudyMode mode, const CaptureProblem& problem, const Node& root, FaultList& faults);

/// A fault unless a name, where there is one, is that of a grasp's end-effector or of a target.
bool expect_grasp_or_target(const std::string& name, const Mark& mark, const std::string& place, bool of_grasp,
                            const CaptureProblem& problem, FaultList& faults);

}  // namespace grapnel
