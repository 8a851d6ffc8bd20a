#pragma once

/// @file
/// The table of a study and its files; docs/formats/study.md is their contract.

#include <filesystem>
#include <string>
#include <vector>

#include "grapnel/study/run_case.hpp"

namespace grapnel {

/// Rows of a study with all that is needed to understand them.
struct StudyTable {
  struct Head {
    std::string name, unit, description;
  };
  std::string study_name;
  std::string study_text;
  std::string sha256;  // Study::sha256
  StudyMode mode = StudyMode::run;
  std::vector<StudyAxis> axes;
  std::vector<Head> columns;
  std::vector<CaseRow> rows;  // in the study's order
  std::string study_file;     // as the user named it

  std::size_t count(CaseStatus status) const;
};

/// "impact", "run".
const char* name_of(StudyMode mode);

/// Heads and settings without rows.
StudyTable empty_table(const Study& study);

/// First line of table.csv, and one line per row; with their ends.
std::string csv_head(const StudyTable& table);
std::string csv_line(const StudyTable& table, const CaseRow& row);

/// table.csv. Written atomically, as the others. @throws std::runtime_error naming the path and the reason.
void write_study_csv(const StudyTable& table, const std::filesystem::path& path);

/// table.h5: one dataset per axis and column, the settings as attributes. `version` is the program's.
void write_study_hdf5(const StudyTable& table, const std::string& version, const std::filesystem::path& path);

/// study.json: the settings, for those who read the CSV.
std::string study_settings_json(const StudyTable& table, const std::string& version);

}  // namespace grapnel
