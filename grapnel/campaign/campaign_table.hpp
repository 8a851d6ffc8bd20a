#pragma once

/// @file
/// The rows of a campaign or a sweep as one table: table.h5 and table.csv. A campaign's is made from the shards with
/// memory that does not grow with their number. docs/formats/campaign.md and study.md are their contract. Thread
/// safety: reentrant; one thread per CampaignTable.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "grapnel/campaign/campaign.hpp"

namespace grapnel {

using TakeRow = std::function<void(const CaseRow&)>;

/// Calls `take` with every row on disk, in the order of the indices, a block at a time.
void for_each_row(const std::filesystem::path& folder, const Campaign& campaign, const TakeRow& take);

/// Both files, from the shards; each is the old or the new one, complete. Same rows, same bytes. `version` is the
/// program's. @throws std::runtime_error naming path and reason.
void write_campaign_tables(const std::filesystem::path& folder, const Campaign& campaign, const std::string& version,
                           bool with_csv);
/// The same of rows from elsewhere, as a sweep's: `rows` calls what it is given with each, in the order of the indices.
void write_campaign_tables(const std::filesystem::path& folder, const Campaign& campaign, const std::string& version,
                           bool with_csv, const std::function<void(const TakeRow&)>& rows);

/// First line of table.csv, and one line per row; with their ends.
std::string csv_head(const Campaign& campaign);
std::string csv_line(const Campaign& campaign, const CaseRow& row);
/// What the line says of the design: the value of each axis at point `point`, a comma before each.
std::string csv_of_design(const Campaign& campaign, std::uint64_t point);

/// table.h5 of a campaign, one dataset at a time, as a whole (8 bytes a row) or in part.
class CampaignTable {
 public:
  /// @throws std::runtime_error naming path and fault, as the others.
  explicit CampaignTable(const std::filesystem::path& table);
  ~CampaignTable();
  CampaignTable(const CampaignTable&) = delete;
  CampaignTable& operator=(const CampaignTable&) = delete;

  struct Head {
    std::string name, unit, description;
  };
  const std::vector<Head>& inputs() const;
  const std::vector<Head>& columns() const;
  std::uint64_t rows() const;

  std::vector<double> input(std::size_t i) const;
  std::vector<double> column(std::size_t i) const;
  /// The numbers of rows from `first` on, as many as `out` holds.
  void read_input(std::size_t i, std::uint64_t first, std::span<double> out) const;
  void read_column(std::size_t i, std::uint64_t first, std::span<double> out) const;

  std::vector<std::uint64_t> indices() const;  // k of every row: with gaps if cases are missing
  std::vector<std::uint8_t> status() const;    // CaseStatus
  std::vector<std::uint8_t> success() const;
  std::vector<std::int32_t> reasons() const;  // per row, a number for reason_text(); 0: none
  std::string reason_text(std::int32_t number) const;

 private:
  struct File;
  std::unique_ptr<File> file_;
};

}  // namespace grapnel
