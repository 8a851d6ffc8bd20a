#include <algorithm>
#include <chrono>
#include <fstream>
#include <string_view>

#include "commands.hpp"
#include "grapnel/campaign/campaign_report.hpp"
#include "grapnel/campaign/campaign_table_writer.hpp"
#include "grapnel/campaign/run_campaign.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/json_document.hpp"
#include "grapnel/study_files/study_files.hpp"
#include "grapnel/text/error_text.hpp"
#include "output_folder.hpp"
#include "run_problem.hpp"
#include "terminal.hpp"

namespace grapnel::app {
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

std::vector<CaseRow> run_and_write(const Campaign& study, const StudyOptions& options, const fs::path& folder,
                                   PartialTable& partial, const std::stop_token& stop) {
  Progress progress(options.quiet);
  const std::vector<CaseRow> rows = run_sweep(study,
                                              {.threads = threads_of(options.threads),
                                               .progress = [&](const CaseProgress& at) { progress.report_points(at); },
                                               .stop = stop},
                                              [&](const CaseRow& row) { partial.add(row); });
  if (stop.stop_requested()) return rows;
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
void warn_of_verdicts(const Campaign& study, const std::vector<CaseRow>& rows, const fs::path& file) {
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
      to_stderr("{}: warning: {} of {} points {}, see {} in table.csv\n", file.string(), count, rows.size(),
                verdict.words, verdict.column);
  }
}

}  // namespace

int sweep(const StudyOptions& options) {
  Campaign study;
  try {
    std::vector<Fault> warnings;
    study = load_study(options.study, &warnings);
    print_errors(warnings);
  } catch (const InputError& error) {
    print_errors(error.faults());
    return kBadInput;
  }
  if (options.only) return only_case(study, *options.only, options.output, {options.quiet, options.no_report});
  const std::optional<fs::path> made = results_folder(options.output, options.study, Outputs::sweep);
  if (!made) return kBadInput;
  const fs::path& folder = *made;
  if (!options.quiet) {
    to_stdout("grapnel {}, study {} (sha256 {})\n\n", GRAPNEL_VERSION, options.study.string(),
              study.sha256.substr(0, 12));
    flush_stdout();
  }
  PartialTable partial(folder / "table.partial.csv", study);
  std::vector<CaseRow> rows;
  const StopSignal stop(options.stop);
  try {
    rows = run_and_write(study, options, folder, partial, stop.token());
  } catch (const std::exception& error) {
    to_stderr("grapnel: error: {}\n", error_text(error));
    return kSimulationFailed;
  }
  if (stop.poll()) {
    partial.flush();
    to_stderr("{}: stopped: {} of {} points are kept in {}\n", options.study.string(), rows.size(), study.total(),
              partial.path().string());
    return kInterrupted;
  }
  partial.remove();
  const FolderReport report = write_folder_report(folder, ResultKind::sweep, options.no_report);
  if (!options.quiet)
    to_stdout("{}\nresults in {}: table.csv, table.h5, study.json\n{}", sweep_summary(study, rows), folder.string(),
              report.line);
  warn_of_verdicts(study, rows, options.study);
  const std::size_t ok = count_of(rows, CaseStatus::ok);
  if (ok == rows.size()) return report.failed ? kSimulationFailed : kDone;
  to_stderr("{}: warning: {} of {} points are not ok, see status and reason in table.csv\n", options.study.string(),
            rows.size() - ok, rows.size());
  return report.failed ? kSimulationFailed : kSomeFailed;
}

}  // namespace grapnel::app
