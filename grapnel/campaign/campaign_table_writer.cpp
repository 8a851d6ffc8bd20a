#include <fmt/format.h>

#include <optional>
#include <stdexcept>
#include <unordered_map>

#include "grapnel/campaign/campaign_table_writer.hpp"
#include "grapnel/campaign/shard_store.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/campaign_table.hpp"
#include "grapnel/result/file_seal.hpp"
#include "grapnel/result/hdf5_file.hpp"
#include "grapnel/result/text_table.hpp"

namespace grapnel {
namespace {

namespace fs = std::filesystem;
using hdf5::GrowingDataset;
using hdf5::Handle;
using hdf5::write_attribute;

constexpr std::size_t kCsvBlock = 1 << 20;          // [bytes] written to the file per call
constexpr std::size_t kRememberedReasons = 100000;  // beyond, equal texts may come twice

bool is_sweep(const Campaign& campaign) { return campaign.kind == CampaignKind::sweep; }

/// One number of every row.
struct NumberColumn {
  const char* group;  // of table.h5
  int order;          // in its group
  CampaignTable::Head head;
};

/// All of them: the design's, the inputs', the columns'.
std::vector<NumberColumn> number_columns(const Campaign& campaign) {
  std::vector<NumberColumn> all;
  int order = 0;
  for (const StudyAxis& axis : campaign.design) {
    all.push_back({is_sweep(campaign) ? "axes" : "design", order++, {axis.name, axis.unit, axis.description}});
    if (axis.is_numeric) continue;
    for (const AxisValue& value : axis.values) all.back().head.labels.push_back(value.label);
  }
  order = 0;
  for (const CampaignInput& input : campaign.inputs)
    all.push_back({"inputs", order++, {input.name, input.unit, input.description}});
  order = 0;
  for (const Column& column : campaign.columns)
    all.push_back({"columns", order++, {column.name, column.unit, column.description}});
  return all;
}

/// A row's numbers, in the same order, each to the end of its list.
void append_numbers(const Campaign& campaign, const CaseRow& row, std::vector<std::vector<double>>& numbers) {
  std::size_t next = 0;
  if (!campaign.design.empty()) {
    const std::vector<std::size_t> position = campaign.position(row.index / campaign.cases);
    for (std::size_t a = 0; a < position.size(); ++a) {
      const StudyAxis& axis = campaign.design[a];
      numbers[next++].push_back(axis.is_numeric ? axis.values[position[a]].number : static_cast<double>(position[a]));
    }
  }
  for (const double value : row.inputs) numbers[next++].push_back(value);
  for (const double value : row.values) numbers[next++].push_back(value);
}

std::vector<std::string> status_names() {
  return {name_of(CaseStatus::ok), name_of(CaseStatus::failed), name_of(CaseStatus::unreachable)};
}

/// Attributes of table.h5 for the whole campaign, and the text of its file.
void write_root(const Handle& file, const Campaign& campaign, const std::string& version) {
  const bool sweep = is_sweep(campaign);
  const Handle root(H5Gopen2(file.id(), "/", H5P_DEFAULT), H5Gclose, "/");
  write_attribute(root, "schema", std::string(sweep ? "grapnel-study-table/1" : "grapnel-campaign-table/1"));
  write_attribute(root, "version", version);
  write_attribute(root, sweep ? "study" : "campaign", campaign.name);
  write_attribute(root, "sha256", campaign.sha256);
  if (!sweep) {
    hdf5::write_attribute_u64(root, "seed", campaign.seed);
    hdf5::write_attribute_u64(root, "cases", campaign.cases);
  }
  write_attribute(root, "simulate", name_of(campaign.mode));
  if (!sweep) {
    write_attribute(root, "sampling", name_of(campaign.sampling));
    write_attribute(root, "plan", name_of(campaign.plan));
  }
  // Attributes hold 64 KiB at most, a campaign's text may be longer.
  const Handle text = hdf5::write_strings(file, sweep ? "study_text" : "campaign_text", {campaign.text});
  hdf5::describe_dataset(text, "", sweep ? "the study file" : "the campaign file");
  if (sweep) write_attribute(text, "order", 0);
}

/// Writer of a campaign's table.h5. It holds HDF5 for one block of rows at a time, because reading the shards needs
/// HDF5 too.
class TableFile {
 public:
  TableFile(const fs::path& path, const Campaign& campaign, const std::string& version) : campaign_(campaign) {
    const hdf5::Session session;
    file_.emplace(hdf5::create_on_disk(path));
    try {
      write_root(*file_, campaign, version);
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

  void add(const CaseRow& row) {
    k_.push_back(row.index);
    status_.push_back(static_cast<int>(row.status));
    success_.push_back(row.success ? 1 : 0);
    reason_.push_back(number_of(row.reason));
    append_numbers(campaign_, row, numbers_);
    if (k_.size() == hdf5::kRowsOfChunk) flush();
  }

  /// Writes the remaining rows and closes the file.
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

  const GrowingDataset& row_dataset(const char* name, hid_t type, const char* unit, const char* description) {
    rows_.emplace_back(*file_, "", name, type);
    hdf5::describe_dataset(rows_.back().handle(), unit, description);
    return rows_.back();
  }

  void begin_datasets() {
    row_dataset("k", H5T_STD_U64LE, "1", "number of the case, from 0");
    const GrowingDataset& status =
        row_dataset("status", H5T_STD_I32LE, "1", "how the case ended, counted from 0 in the attribute names");
    write_attribute(status.handle(), "names", status_names());
    row_dataset("success", H5T_STD_U8LE, "1", "1: ok, and all criteria hold");
    row_dataset("reason", H5T_STD_I32LE, "1",
                "why a case is not ok, counted from 0 in the dataset reasons; 0: no reason");
    const Handle text = hdf5::string_type(false);
    reasons_.emplace(*file_, "", "reasons", text.id());
    hdf5::describe_dataset(reasons_->handle(), "", "why cases are not ok");
    number_of("");
    for (const NumberColumn& column : number_columns(campaign_)) {
      datasets_.emplace_back(*file_, column.group, column.head.name,
                             column.head.labels.empty() ? H5T_IEEE_F64LE : H5T_STD_I32LE);
      const Handle& dataset = datasets_.back().handle();
      hdf5::describe_dataset(dataset, column.head.unit, column.head.description);
      write_attribute(dataset, "name", column.head.name);
      write_attribute(dataset, "order", column.order);
      if (!column.head.labels.empty()) write_attribute(dataset, "names", column.head.labels);
      numbers_.emplace_back().reserve(hdf5::kRowsOfChunk);
    }
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
  std::optional<Handle> file_;
  std::vector<GrowingDataset> rows_;      // k, status, success, reason
  std::vector<GrowingDataset> datasets_;  // design, inputs, columns
  std::optional<GrowingDataset> reasons_;
  // Rows that are not written yet; numbers in the order of datasets_.
  std::vector<std::uint64_t> k_;
  std::vector<int> status_, reason_;
  std::vector<std::uint8_t> success_;
  std::vector<std::vector<double>> numbers_;
  std::vector<std::string> new_reasons_;
  std::unordered_map<std::string, int> reason_numbers_;
  int reason_count_ = 0;
};

/// A sweep's table.h5, built in memory: datasets have their full size from the beginning.
class SweepFile {
 public:
  explicit SweepFile(const Campaign& sweep)
      : sweep_(sweep), columns_(number_columns(sweep)), numbers_(columns_.size()) {}

  void add(const CaseRow& row) {
    status_.push_back(static_cast<int>(row.status));
    reasons_.push_back(row.reason);
    append_numbers(sweep_, row, numbers_);
  }

  /// The file's bytes.
  std::string image(const std::string& version) const {
    const hdf5::Session session;
    const Handle file = hdf5::create_in_memory("study");
    write_root(file, sweep_, version);
    for (std::size_t i = 0; i < sweep_.design.size(); ++i) write_numbers(file, i);
    write_choices(file, "status", status_, status_names(), 0,
                  {"status", "1", "how the point ended, counted from 0 in the attribute names"});
    describe(hdf5::write_strings(file, "reason", reasons_),
             {"reason", "", "why a point has failed or cannot be reached"}, 0);
    for (std::size_t i = sweep_.design.size(); i < columns_.size(); ++i) write_numbers(file, i);
    return hdf5::image_of(file);
  }

 private:
  static void describe(const Handle& dataset, const CampaignTable::Head& head, int order) {
    hdf5::describe_dataset(dataset, head.unit, head.description);
    write_attribute(dataset, "order", order);
  }

  // Texts that repeat: numbers into the attribute "names", counted from 0.
  static void write_choices(const Handle& file, const std::string& path, const std::vector<int>& values,
                            const std::vector<std::string>& names, int order, const CampaignTable::Head& head) {
    const Handle dataset =
        hdf5::write_dataset(file, path, {H5T_STD_I32LE, H5T_NATIVE_INT, {values.size()}, values.data()});
    describe(dataset, head, order);
    write_attribute(dataset, "names", names);
  }

  // A dataset cannot be a group too: beside "captured", "captured/judged" is "captured.judged".
  std::string dataset_name(const NumberColumn& column) const {
    std::string name = column.head.name;
    for (const Column& other : sweep_.columns)
      if (column.group == std::string_view("columns") && name.starts_with(other.name + "/"))
        name[other.name.size()] = '.';
    return name;
  }

  void write_numbers(const Handle& file, std::size_t i) const {
    const NumberColumn& column = columns_[i];
    const std::vector<double>& values = numbers_[i];
    const std::string path = column.group + ("/" + dataset_name(column));
    if (!column.head.labels.empty()) {
      write_choices(file, path, {values.begin(), values.end()}, column.head.labels, column.order, column.head);
      return;
    }
    describe(hdf5::write_dataset(file, path, {H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, {values.size()}, values.data()}),
             column.head, column.order);
  }

  const Campaign& sweep_;
  const std::vector<NumberColumn> columns_;
  std::vector<std::vector<double>> numbers_;  // in the order of columns_
  std::vector<int> status_;
  std::vector<std::string> reasons_;
};

std::string head_of(const std::string& name, const std::string& unit) {
  return "," + csv_quoted(unit.empty() ? name : name + " [" + unit + "]");
}

void check_row(const CaseRow& row, const Campaign& campaign) {
  if (row.inputs.size() == campaign.inputs.size() && row.values.size() == campaign.columns.size()) return;
  throw std::runtime_error("case " + std::to_string(row.index) + " has " + std::to_string(row.inputs.size()) +
                           " inputs and " + std::to_string(row.values.size()) + " columns, the campaign " +
                           std::to_string(campaign.inputs.size()) + " and " + std::to_string(campaign.columns.size()));
}

using EachRow = std::function<void(const TakeRow&)>;

// Writes a file; errors name its path.
template <class Write>
void write_named(const fs::path& path, Write&& write) {
  AtomicFile file(path);
  try {
    write(file);
  } catch (const std::exception& e) {
    const std::string what = e.what();
    throw std::runtime_error(what.starts_with("cannot ") ? what : "cannot write " + path.string() + ": " + what);
  }
  file.commit();
}

void write_table(const fs::path& folder, const Campaign& campaign, const std::string& version, const EachRow& rows) {
  write_named(folder / "table.h5", [&](AtomicFile& file) {
    const auto pass_rows_to = [&](auto& table) {
      rows([&](const CaseRow& row) {
        check_row(row, campaign);
        table.add(row);
      });
    };
    if (is_sweep(campaign)) {
      SweepFile table(campaign);
      pass_rows_to(table);
      std::string image = table.image(version);
      seal(image);
      file.write(image);
    } else {
      TableFile table(file.temporary(), campaign, version);
      pass_rows_to(table);
      table.finish();
      seal_file(file.temporary());
    }
  });
}

void write_csv(const fs::path& folder, const Campaign& campaign, const EachRow& rows) {
  write_named(folder / "table.csv", [&](AtomicFile& file) {
    std::string text = csv_head(campaign);
    rows([&](const CaseRow& row) {
      check_row(row, campaign);
      text += csv_line(campaign, row);
      if (text.size() < kCsvBlock) return;
      file.write(text);
      text.clear();
    });
    file.write(text);
  });
}

// All rows on disk, which existed a moment ago.
EachRow rows_of(const fs::path& folder, const Campaign& campaign) {
  return [&folder, &campaign](const TakeRow& take) {
    std::uint64_t count = 0;
    for_each_row(folder, campaign, [&](const CaseRow& row) {
      ++count;
      take(row);
    });
    if (count < campaign.total()) {
      throw std::runtime_error(
          fmt::format("only {} of {} cases can be read from its shards; rerun the command to compute the others again",
                      count, campaign.total()));
    }
  };
}

}  // namespace

std::string csv_head(const Campaign& campaign) {
  std::string line = is_sweep(campaign) ? "point" : "k";
  for (const StudyAxis& axis : campaign.design) line += head_of(axis.name, axis.unit);
  line += is_sweep(campaign) ? ",status,reason" : ",status,success,reason";
  for (const CampaignInput& input : campaign.inputs) line += head_of(input.name, input.unit);
  for (const Column& column : campaign.columns) line += head_of(column.name, column.unit);
  return line + "\n";
}

std::string csv_of_design(const Campaign& campaign, std::uint64_t point) {
  std::string fields;
  const std::vector<std::size_t> position = campaign.position(point);
  for (std::size_t a = 0; a < position.size(); ++a) {
    const StudyAxis& axis = campaign.design[a];
    fields += ",";
    if (axis.is_numeric)
      append_csv_number(axis.values[position[a]].number, fields);
    else
      fields += csv_quoted(axis.values[position[a]].label);
  }
  return fields;
}

std::string csv_line(const Campaign& campaign, const CaseRow& row) {
  std::string line = std::to_string(row.index);
  if (!campaign.design.empty()) line += csv_of_design(campaign, row.index / campaign.cases);
  line += std::string(",") + name_of(row.status);
  if (!is_sweep(campaign)) line += row.success ? ",1" : ",0";
  line += "," + csv_quoted(row.reason);
  for (const auto* numbers : {&row.inputs, &row.values}) {
    for (const double value : *numbers) {
      line += ",";
      append_csv_number(value, line);
    }
  }
  return line + "\n";
}

void for_each_row(const fs::path& folder, const Campaign& campaign, const TakeRow& take) {
  for_each_block(folder, campaign, [&](std::vector<CaseRow>&& rows) {
    for (const CaseRow& row : rows) take(row);
  });
}

void write_campaign_table(const fs::path& folder, const Campaign& campaign, const std::string& version) {
  write_table(folder, campaign, version, rows_of(folder, campaign));
}

void write_campaign_csv(const fs::path& folder, const Campaign& campaign) {
  write_csv(folder, campaign, rows_of(folder, campaign));
}

void write_campaign_tables(const fs::path& folder, const Campaign& campaign, const std::string& version, bool with_csv,
                           const std::function<void(const TakeRow&)>& rows) {
  write_table(folder, campaign, version, rows);
  if (with_csv) write_csv(folder, campaign, rows);
}

}  // namespace grapnel
