#pragma once

/// @file
/// Data of a report, from result folders: the JSON of web/src/data.ts (change both together).

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace grapnel {

/// Kind of a result folder: of `grapnel run` (summary.json), `sweep` (study.json, table.csv), `optimize`
/// (comparison.json, evaluations.csv), `campaign` or `map` (campaign.json, table.h5).
enum class ResultKind { run, sweep, optimization, campaign };

/// Determined by its files. @throws std::runtime_error naming the folder and the expected files, or the conflicting
/// ones.
ResultKind kind_of_results(const std::filesystem::path& folder);

/// Results too large for a page.
class TooLarge : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct ReportData {
  std::string title;  // the scenario's or study's name
  std::string json;   // ReportData of web/src/data.ts, in UTF-8
};

/// The data of one result folder; `kind` if the folder may hold results of several. `version`: of Grapnel. For a run
/// only summary.json is required: other missing or damaged files become notes in the data. @throws std::runtime_error
/// naming path and error, TooLarge.
ReportData report_data(const std::filesystem::path& folder, std::string_view version,
                       std::optional<ResultKind> kind = std::nullopt);

/// The data of a page without runs: `value` under the key `kind`.
ReportData page_data(const char* kind, std::string title, nlohmann::ordered_json value, std::string_view version);

/// The data of two runs, A and B.
ReportData comparison_data(const std::filesystem::path& a, const std::filesystem::path& b, std::string_view version);

}  // namespace grapnel
