#pragma once

/// @file
/// table.h5 of a campaign as its analysis and its report read it. docs/formats/campaign.md is its contract. Thread
/// safety: const members may be called from several threads at once; they take turns with HDF5.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace grapnel {

/// One dataset at a time, as a whole or in part: a table may be larger than what memory should hold.
class CampaignTable {
 public:
  /// @throws std::runtime_error naming path and fault, as the others.
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

  /// Of every row: 8 bytes each as double, 4 as float.
  template <class Number = double>
  std::vector<Number> numbers(const Head& head) const;
  /// Of rows from `first` on, as many as `out` holds.
  void read(const Head& head, std::uint64_t first, std::span<double> out) const;

  std::vector<std::uint64_t> indices() const;  // k of every row: with gaps if cases are missing
  std::vector<std::uint8_t> status() const;    // CaseStatus: counts into status_names()
  const std::vector<std::string>& status_names() const;
  std::vector<std::uint8_t> success() const;
  std::vector<std::int32_t> reasons() const;  // per row, a number for reason_texts(); 0: none
  std::vector<std::string> reason_texts(const std::vector<std::int32_t>& numbers) const;

  /// What is thrown where the table's content is wrong.
  std::runtime_error fault(const std::string& what) const;

 private:
  struct File;
  std::unique_ptr<File> file_;
};

}  // namespace grapnel
