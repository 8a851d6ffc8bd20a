#include <fmt/format.h>

#include <optional>
#include <stdexcept>
#include <unordered_map>

#include "grapnel/campaign/campaign_table.hpp"
#include "grapnel/campaign/shard_store.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/csv_text.hpp"
#include "grapnel/result/file_seal.hpp"
#include "grapnel/result/growing_dataset.hpp"
#include "grapnel/result/hdf5_file.hpp"
#include "grapnel/study/grid.hpp"
#include "grapnel/study/study_table.hpp"

namespace grapnel {
namespace {

namespace fs = std::filesystem;
using hdf5::GrowingDataset;
using hdf5::Handle;
using hdf5::write_attribute;

constexpr std::size_t kCsvBlock = 1 << 20;          // [bytes] handed to the file at once
constexpr std::size_t kRememberedReasons = 100000;  // beyond, equal texts may come twice

std::vector<std::size_t> sizes_of(const Campaign& campaign) {
  std::vector<std::size_t> sizes;
  for (const StudyAxis& axis : campaign.design) sizes.push_back(axis.values.size());
  return sizes;
}

/// Positions on the design axes of case k.
std::vector<std::size_t> position_of(const Campaign& campaign, const std::vector<std::size_t>& sizes, std::uint64_t k) {
  if (sizes.empty()) return {};
  return grid_position(sizes, static_cast<std::size_t>(k / campaign.cases));
}

/// table.h5 while it is written. HDF5 is held for one block of rows at a time: reading the shards needs it too.
class TableFile {
 public:
  TableFile(const fs::path& path, const Campaign& campaign, const std::string& version)
      : campaign_(campaign), sizes_(sizes_of(campaign)) {
    const hdf5::Session session;
    file_.emplace(hdf5::create_on_disk(path));
    try {
      write_root(version);
      begin_datasets();
    } catch (...) {
      close();
      throw;
    }
  }
  ~TableFile() {
    if (!file_) return;
    const hdf5::Session session;
    close();
  }
  TableFile(const TableFile&) = delete;
  TableFile& operator=(const TableFile&) = delete;

  void add(const CampaignRow& row) {
    k_.push_back(row.index);
    status_.push_back(static_cast<int>(row.status));
    success_.push_back(row.success ? 1 : 0);
    reason_.push_back(number_of(row.reason));
    const std::vector<std::size_t> position = position_of(campaign_, sizes_, row.index);
    std::size_t next = 0;
    for (std::size_t a = 0; a < position.size(); ++a) {
      const StudyAxis& axis = campaign_.design[a];
      numbers_[next++].push_back(axis.is_numeric ? axis.values[position[a]].number : static_cast<double>(position[a]));
    }
    for (const double value : row.inputs) numbers_[next++].push_back(value);
    for (const double value : row.values) numbers_[next++].push_back(value);
    if (k_.size() == hdf5::kRowsOfChunk) flush();
  }

  /// Writes what is left and closes the file.
  void finish() {
    flush();
    const hdf5::Session session;
    hdf5::check(H5Fflush(file_->id(), H5F_SCOPE_GLOBAL), "flushing");
    close();
  }

 private:
  void close() {
    datasets_.clear();
    rows_.clear();
    reasons_.reset();
    file_.reset();
  }

  void write_root(const std::string& version) {
    const Handle root(H5Gopen2(file_->id(), "/", H5P_DEFAULT), H5Gclose, "/");
    write_attribute(root, "schema", std::string("grapnel-campaign-table/1"));
    write_attribute(root, "version", version);
    write_attribute(root, "campaign", campaign_.name);
    write_attribute(root, "sha256", campaign_.sha256);
    hdf5::write_attribute_u64(root, "seed", campaign_.seed);
    hdf5::write_attribute_u64(root, "cases", campaign_.cases);
    write_attribute(root, "simulate", std::string(name_of(campaign_.mode)));
    write_attribute(root, "sampling", std::string(name_of(campaign_.sampling)));
    write_attribute(root, "plan", std::string(name_of(campaign_.plan)));
    // Attributes hold 64 KiB at most, a campaign's text may be longer.
    const Handle text = hdf5::write_strings(*file_, "campaign_text", {campaign_.text});
    hdf5::describe_dataset(text, "", "the campaign file");
  }

  const GrowingDataset& row_dataset(const char* name, hid_t type, const char* unit, const char* description) {
    rows_.emplace_back(*file_, "", name, type);
    hdf5::describe_dataset(rows_.back().handle(), unit, description);
    return rows_.back();
  }

  void number_dataset(const std::string& group, int order, const CampaignTable::Head& head, hid_t type) {
    datasets_.emplace_back(*file_, group, head.name, type);
    hdf5::describe_dataset(datasets_.back().handle(), head.unit, head.description);
    write_attribute(datasets_.back().handle(), "name", head.name);
    write_attribute(datasets_.back().handle(), "order", order);
    numbers_.emplace_back().reserve(hdf5::kRowsOfChunk);
  }

  void begin_datasets() {
    row_dataset("k", H5T_STD_U64LE, "1", "number of the case, from 0");
    const GrowingDataset& status =
        row_dataset("status", H5T_STD_I32LE, "1", "how the case ended, counted from 0 in the attribute names");
    write_attribute(status.handle(), "names",
                    std::vector<std::string>{name_of(CaseStatus::ok), name_of(CaseStatus::failed),
                                             name_of(CaseStatus::unreachable)});
    row_dataset("success", H5T_STD_U8LE, "1", "1: ok, and all criteria hold");
    row_dataset("reason", H5T_STD_I32LE, "1",
                "why a case is not ok, counted from 0 in the dataset reasons; 0: no reason");
    const Handle text = hdf5::string_type(false);
    reasons_.emplace(*file_, "", "reasons", text.id());
    hdf5::describe_dataset(reasons_->handle(), "", "why cases are not ok");
    number_of("");
    int order = 0;
    for (const StudyAxis& axis : campaign_.design) {
      number_dataset("design", order++, {axis.name, axis.unit, axis.description},
                     axis.is_numeric ? H5T_IEEE_F64LE : H5T_STD_I32LE);
      if (axis.is_numeric) continue;
      std::vector<std::string> labels;
      for (const AxisValue& value : axis.values) labels.push_back(value.label);
      write_attribute(datasets_.back().handle(), "names", labels);
    }
    order = 0;
    for (const CampaignInput& input : campaign_.inputs)
      number_dataset("inputs", order++, {input.name, input.unit, input.description}, H5T_IEEE_F64LE);
    order = 0;
    for (const Column& column : campaign_.columns)
      number_dataset("columns", order++, {column.name, column.unit, column.description}, H5T_IEEE_F64LE);
  }

  int number_of(const std::string& reason) {
    if (const auto known = reason_numbers_.find(reason); known != reason_numbers_.end()) return known->second;
    const int number = reason_count_++;
    new_reasons_.push_back(reason);
    if (reason_numbers_.size() < kRememberedReasons) reason_numbers_.emplace(reason, number);
    return number;
  }

  void flush() {
    const hdf5::Session session;
    rows_[0].append(H5T_NATIVE_UINT64, k_.size(), k_.data());
    rows_[1].append(H5T_NATIVE_INT, status_.size(), status_.data());
    rows_[2].append(H5T_NATIVE_UINT8, success_.size(), success_.data());
    rows_[3].append(H5T_NATIVE_INT, reason_.size(), reason_.data());
    for (std::size_t i = 0; i < datasets_.size(); ++i) {
      datasets_[i].append(H5T_NATIVE_DOUBLE, numbers_[i].size(), numbers_[i].data());
      numbers_[i].clear();
    }
    std::vector<const char*> texts;
    for (const std::string& reason : new_reasons_) texts.push_back(reason.c_str());
    const Handle text = hdf5::string_type(false);
    reasons_->append(text.id(), texts.size(), texts.data());
    new_reasons_.clear();
    k_.clear();
    status_.clear();
    success_.clear();
    reason_.clear();
  }

  const Campaign& campaign_;
  std::vector<std::size_t> sizes_;
  std::optional<Handle> file_;
  std::vector<GrowingDataset> rows_;      // k, status, success, reason
  std::vector<GrowingDataset> datasets_;  // design, inputs, columns
  std::optional<GrowingDataset> reasons_;
  // Of rows that are not written yet; numbers in the order of datasets_.
  std::vector<std::uint64_t> k_;
  std::vector<int> status_, reason_;
  std::vector<std::uint8_t> success_;
  std::vector<std::vector<double>> numbers_;
  std::vector<std::string> new_reasons_;
  std::unordered_map<std::string, int> reason_numbers_;
  int reason_count_ = 0;
};

std::string head_of(const std::string& name, const std::string& unit) {
  return "," + csv_quoted(unit.empty() ? name : name + " [" + unit + "]");
}

/// table.csv while it is written.
class TableText {
 public:
  TableText(const fs::path& path, const Campaign& campaign)
      : file_(path), campaign_(campaign), sizes_(sizes_of(campaign)), text_("k") {
    for (const StudyAxis& axis : campaign.design) text_ += head_of(axis.name, axis.unit);
    text_ += ",status,success,reason";
    for (const CampaignInput& input : campaign.inputs) text_ += head_of(input.name, input.unit);
    for (const Column& column : campaign.columns) text_ += head_of(column.name, column.unit);
    text_ += "\n";
  }

  void add(const CampaignRow& row) {
    text_ += std::to_string(row.index);
    const std::vector<std::size_t> position = position_of(campaign_, sizes_, row.index);
    for (std::size_t a = 0; a < position.size(); ++a) {
      const StudyAxis& axis = campaign_.design[a];
      const AxisValue& value = axis.values[position[a]];
      text_ += ",";
      if (axis.is_numeric)
        append_csv_number(value.number, text_);
      else
        text_ += csv_quoted(value.label);
    }
    text_ += std::string(",") + name_of(row.status) + (row.success ? ",1," : ",0,") + csv_quoted(row.reason);
    for (const auto* numbers : {&row.inputs, &row.values}) {
      for (const double value : *numbers) {
        text_ += ",";
        append_csv_number(value, text_);
      }
    }
    text_ += "\n";
    if (text_.size() < kCsvBlock) return;
    file_.write(text_);
    text_.clear();
  }

  void finish() {
    file_.write(text_);
    file_.commit();
  }

 private:
  AtomicFile file_;
  const Campaign& campaign_;
  std::vector<std::size_t> sizes_;
  std::string text_;
};

void check_row(const CampaignRow& row, const Campaign& campaign) {
  if (row.inputs.size() == campaign.inputs.size() && row.values.size() == campaign.columns.size()) return;
  throw std::runtime_error("case " + std::to_string(row.index) + " has " + std::to_string(row.inputs.size()) +
                           " inputs and " + std::to_string(row.values.size()) + " columns, the campaign " +
                           std::to_string(campaign.inputs.size()) + " and " + std::to_string(campaign.columns.size()));
}

}  // namespace

void for_each_row(const fs::path& folder, const Campaign& campaign, const TakeRow& take) {
  for_each_block(folder, campaign, [&](std::vector<CampaignRow>&& rows) {
    for (const CampaignRow& row : rows) take(row);
  });
}

void write_campaign_tables(const fs::path& folder, const Campaign& campaign, const std::string& version, bool with_csv,
                           const std::function<void(const TakeRow&)>& rows) {
  const fs::path path = folder / "table.h5";
  AtomicFile file(path);
  std::optional<TableText> text;
  if (with_csv) text.emplace(folder / "table.csv", campaign);
  try {
    TableFile table(file.temporary(), campaign, version);
    rows([&](const CampaignRow& row) {
      check_row(row, campaign);
      table.add(row);
      if (text) text->add(row);
    });
    table.finish();
    seal_file(file.temporary());
  } catch (const std::exception& e) {
    const std::string what = e.what();
    // The text's own messages name its path.
    throw std::runtime_error(what.starts_with("cannot ") ? what : "cannot write " + path.string() + ": " + what);
  }
  file.commit();
  if (text) text->finish();
}

void write_campaign_tables(const fs::path& folder, const Campaign& campaign, const std::string& version,
                           bool with_csv) {
  write_campaign_tables(folder, campaign, version, with_csv, [&](const TakeRow& take) {
    std::uint64_t count = 0;
    for_each_row(folder, campaign, [&](const CampaignRow& row) {
      ++count;
      take(row);
    });
    // All were there a moment ago.
    if (count < campaign.total()) {
      throw std::runtime_error(
          fmt::format("only {} of {} cases can be read from its shards; the same command computes the others again",
                      count, campaign.total()));
    }
  });
}

}  // namespace grapnel
