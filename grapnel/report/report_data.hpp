#pragma once

/// @file
/// What a report holds, from result folders alone: the JSON of web/src/data.ts (both change together).

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace grapnel {

/// What a result folder holds: of `grapnel run` (summary.json), `sweep` (study.json, table.csv), `optimize`
/// (comparison.json, evaluations.csv), `campaign` or `map` (campaign.json, table.h5).
enum class ResultKind { run, sweep, optimization, campaign };

/// By the files in it. @throws std::runtime_error naming the folder and what was looked for, or what there is too much
/// of.
ResultKind kind_of_results(const std::filesystem::path& folder);

/// Results that no page could show.
class TooLarge : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct ReportData {
  std::string title;  // the scenario's or study's name
  std::string json;   // ReportData of web/src/data.ts, in UTF-8
};

/// The data of one result folder; `kind` if the folder may hold results of several. `version`: of Grapnel. Of a run
/// only summary.json must be sound: what is missing or damaged besides is a note in the data. @throws
/// std::runtime_error naming path and fault, TooLarge.
ReportData report_data(const std::filesystem::path& folder, std::string_view version,
                       std::optional<ResultKind> kind = std::nullopt);

/// The data of two runs, A and B.
ReportData comparison_data(const std::filesystem::path& a, const std::filesystem::path& b, std::string_view version);

}  // namespace grapnel
