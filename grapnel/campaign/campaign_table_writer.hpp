#pragma once

/// @file
/// The rows of a campaign or a sweep as one table: table.h5 and table.csv. The table of a campaign is built from the
/// shards with bounded memory. docs/formats/campaign.md and study.md are their contract. result/campaign_table.hpp
/// reads the former.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "grapnel/campaign/campaign.hpp"

namespace grapnel {

using TakeRow = std::function<void(const CaseRow&)>;

/// Calls `take` with every row on disk, in the order of the indices, a block at a time.
void for_each_row(const std::filesystem::path& folder, const Campaign& campaign, const TakeRow& take);

/// The files, from the shards; each is the old or the new one, complete. Same rows, same bytes. `version` is the
/// program's. Both may be written at the same time. @throws std::runtime_error naming path and reason.
void write_campaign_table(const std::filesystem::path& folder, const Campaign& campaign, const std::string& version);
void write_campaign_csv(const std::filesystem::path& folder, const Campaign& campaign);
/// Both files from other rows, such as those of a sweep: `rows` calls its argument with each row, in the order of the
/// indices.
void write_campaign_tables(const std::filesystem::path& folder, const Campaign& campaign, const std::string& version,
                           bool with_csv, const std::function<void(const TakeRow&)>& rows);

/// First line of table.csv, and one line per row; with their ends.
std::string csv_head(const Campaign& campaign);
std::string csv_line(const Campaign& campaign, const CaseRow& row);
/// The design part of a line: the value of each axis at point `point`, with a comma before each.
std::string csv_of_design(const Campaign& campaign, std::uint64_t point);

}  // namespace grapnel
