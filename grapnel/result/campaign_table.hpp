#pragma once

/// @file
/// Reader of table.h5 of a campaign, for its analysis and its report. docs/formats/campaign.md is its contract. Thread
/// safety: const members may be called from several threads concurrently; access to HDF5 is serialized.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace grapnel {

/// Reads one dataset at a time, whole or in part, because a table may exceed the memory.
class CampaignTable {
 public:
  /// @throws std::runtime_error naming path and error, as the other members.
  explicit CampaignTable(const std::filesystem::path& table);
  ~CampaignTable();
  CampaignTable(const CampaignTable&) = delete;
  CampaignTable& operator=(const CampaignTable&) = delete;

  /// A number per row.
  struct Head {
    std::string name, unit, description;
    std::vector<std::string> labels = {};  // of a design axis of labels: its numbers count from 0 into them
    std::string dataset = {};              // its path in the file
  };
  const std::vector<Head>& design() const;
  const std::vector<Head>& inputs() const;
  const std::vector<Head>& columns() const;
  std::uint64_t rows() const;
  const std::string& sha256() const;  // of the campaign

  /// Values of all rows: 8 bytes each as double, 4 as float.
  template <class Number = double>
  std::vector<Number> numbers(const Head& head) const;
  /// Values of rows from `first` on, as many as `out` holds.
  void read(const Head& head, std::uint64_t first, std::span<double> out) const;

  std::vector<std::uint64_t> indices() const;  // k of every row: with gaps if cases are missing
  std::vector<std::uint8_t> status() const;    // CaseStatus: counts into status_names()
  const std::vector<std::string>& status_names() const;
  std::vector<std::uint8_t> success() const;
  std::vector<std::int32_t> reasons() const;  // per row, a number for reason_texts(); 0: none
  std::vector<std::string> reason_texts(const std::vector<std::int32_t>& numbers) const;

  /// The exception for invalid content of the table.
  std::runtime_error fault(const std::string& what) const;

 private:
  struct File;
  std::unique_ptr<File> file_;
};

}  // namespace grapnel
