#pragma once

/// @file
/// Data of the page over a folder of results: IndexData of web/src/data.ts (change both together).

#include <filesystem>
#include <string_view>

#include "grapnel/report/report_data.hpp"

namespace grapnel {

/// All results in a folder and in the folders below it, the newest first: kind, name, time, verdicts and report of
/// each. Links are not followed, and folders within a result (series, shards) are not searched. A damaged result is
/// listed with its error. `page`: the file that will contain the links. @throws std::runtime_error naming the folder:
/// it does not exist, or it holds no results.
ReportData index_data(const std::filesystem::path& folder, const std::filesystem::path& page, std::string_view version);

}  // namespace grapnel
