#pragma once

/// @file
/// Common parts of study, campaign and optimization files: a text whose tree is checked against its schema and read
/// into a structure of file_structures.hpp; columns by patterns; errors shared by several points.

#include <filesystem>
#include <string>
#include <vector>

#include "grapnel/study/column.hpp"
#include "grapnel/study_files/file_structures.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

struct StudyDocument {
  std::string bytes;
  Node root;           // locations of all keys, and arbitrary values of a scenario
  bool sound = false;  // false: the structure has errors, and values may have any form
};

/// Reads a file into its structure. Errors of the structure are added to `faults`. @throws InputError if the file
/// cannot be read, is not YAML, or is of another kind.
StudyDocument read_document(const std::filesystem::path& path, StudyFile& file, FaultList& faults);
StudyDocument read_document(const std::filesystem::path& path, CampaignFile& file, FaultList& faults);
StudyDocument read_document(const std::filesystem::path& path, OptimizationFile& file, FaultList& faults);

/// The changes of a mapping {path: value}.
std::vector<Change> read_changes(const Node& mapping);

/// Per column whether a pattern of the list selects it; the default columns without a list. A pattern that selects no
/// column is an error.
std::vector<bool> chosen_columns(const Node& list, const std::vector<Column>& columns, FaultList& faults);

/// Adds an error unless it exists already.
void add_once(Fault fault, FaultList& faults);
void add_once(const Mark& mark, std::string message, FaultList& faults);

/// Reports an error if a file simulates the impact of a scenario without impact.
void expect_impact(StudyMode mode, const CaptureProblem& problem, const Node& root, FaultList& faults);

/// Reports an error unless a name, if given, is that of a grasp's end-effector or of a target.
bool expect_grasp_or_target(const std::string& name, const Mark& mark, const std::string& place, bool of_grasp,
                            const CaptureProblem& problem, FaultList& faults);

}  // namespace grapnel
