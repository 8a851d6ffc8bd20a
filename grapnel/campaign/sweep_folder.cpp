#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <string_view>
#include <system_error>
#include <utility>

#include "grapnel/campaign/campaign_folder.hpp"
#include "grapnel/campaign/campaign_report.hpp"
#include "grapnel/campaign/campaign_table_writer.hpp"
#include "grapnel/campaign/result_folder.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/json_document.hpp"
#include "grapnel/text/error_text.hpp"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

// Writes rows during the computation, in case the program is killed before the table is complete.
class PartialTable {
 public:
  PartialTable(fs::path path, const Campaign& study) : path_(std::move(path)), study_(study) {
    std::error_code ignored;
    fs::remove(path_, ignored);  // creates a new file instead of following a link
    file_.open(path_);
    file_ << csv_head(study_);
  }
  void add(const CaseRow& row) {
    file_ << csv_line(study_, row);
    const auto now = std::chrono::steady_clock::now();
    if (now - flushed_ < std::chrono::milliseconds(500)) return;
    flushed_ = now;
    file_.flush();
  }
  void flush() { file_.flush(); }
  const fs::path& path() const { return path_; }
  // Removes the partial table once the complete one exists.
  void remove() {
    file_.close();
    std::error_code ignored;
    fs::remove(path_, ignored);
  }

 private:
  fs::path path_;
  const Campaign& study_;
  std::ofstream file_;
  std::chrono::steady_clock::time_point flushed_ = std::chrono::steady_clock::now();
};

std::vector<CaseRow> run_and_write(const Campaign& study, const FolderOptions& options, const fs::path& folder,
                                   PartialTable& partial, Listener& listener) {
  PoolOptions pool{.threads = threads_of(options.threads), .stop = options.stop};
  if (!options.quiet) {
    listener.points({});
    pool.progress = [&](const CaseProgress& at) { listener.points(at); };
  }
  const std::vector<CaseRow> rows = run_sweep(study, pool, [&](const CaseRow& row) { partial.add(row); });
  if (options.stop.stop_requested()) return rows;
  write_campaign_tables(folder, study, GRAPNEL_VERSION, true, [&](const TakeRow& take) {
    for (const CaseRow& row : rows) take(row);
  });
  write_file_atomically(folder / "study.json", sweep_json(study, rows, GRAPNEL_VERSION));
  // In a separate file, so that the results do not depend on the folder.
  write_file_atomically(folder / "source.json", json_text({{"schema", "grapnel-study-source/1"},
                                                           {"file_folder", folder_seen_from(folder, study.file)}}));
  return rows;
}

// Warns of completed points with bad verdicts: a column for each verdict.
void warn_of_verdicts(const Campaign& study, const std::vector<CaseRow>& rows, Listener& listener) {
  struct Verdict {
    std::string_view column;
    bool (*against)(double value);
    const char* words;
  };
  static constexpr auto is_no = [](double value) { return value == 0; };
  static constexpr Verdict kVerdicts[] = {
      {"ledger/feasible", is_no, "are not feasible"},
      {"worst_margin", [](double margin) { return margin < -1e-9; }, "exceed a rating"},
      {"stable", is_no, "have unstable control"},
      {"rest/at_rest", is_no, "do not come to rest"}};
  for (const Verdict& verdict : kVerdicts) {
    const auto column = std::find_if(study.columns.begin(), study.columns.end(),
                                     [&](const Column& c) { return c.name == verdict.column; });
    if (column == study.columns.end()) continue;
    const auto k = static_cast<std::size_t>(column - study.columns.begin());
    const auto count = std::count_if(rows.begin(), rows.end(), [&](const CaseRow& row) {
      return row.status == CaseStatus::ok && k < row.values.size() && verdict.against(row.values[k]);
    });
    if (count > 0)
      listener.warning(study.file, fmt::format("{} of {} points {}, see {} in table.csv", count, rows.size(),
                                               verdict.words, verdict.column));
  }
}

}  // namespace

Ending run_sweep_folder(const Campaign& study, const fs::path& folder, const FolderOptions& options,
                        Listener& listener) {
  PartialTable partial(folder / "table.partial.csv", study);
  std::vector<CaseRow> rows;
  try {
    rows = run_and_write(study, options, folder, partial, listener);
  } catch (const std::exception& error) {
    listener.error("grapnel", error_text(error));
    return Ending::failed;
  }
  if (options.stop.stop_requested()) {
    partial.flush();
    listener.remark(fmt::format("{}: stopped: {} of {} points are kept in {}", study.file, rows.size(), study.total(),
                                partial.path().string()));
    return Ending::interrupted;
  }
  partial.remove();
  const FolderReport report = write_folder_report(folder, ResultKind::sweep, options.no_report, listener);
  if (!options.quiet)
    listener.note(fmt::format("{}\nresults in {}: table.csv, table.h5, study.json\n{}", sweep_summary(study, rows),
                              folder.string(), report.line));
  warn_of_verdicts(study, rows, listener);
  const std::size_t ok = count_of(rows, CaseStatus::ok);
  if (ok == rows.size()) return report.failed ? Ending::failed : Ending::done;
  listener.warning(study.file, fmt::format("{} of {} points are not ok, see status and reason in table.csv",
                                           rows.size() - ok, rows.size()));
  return report.failed ? Ending::failed : Ending::some_failed;
}

}  // namespace grapnel
