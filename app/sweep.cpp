#include <chrono>
#include <fstream>

#include "commands.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "grapnel/study/run_study.hpp"
#include "grapnel/study/study_summary.hpp"
#include "grapnel/study/study_table.hpp"
#include "grapnel/study_files/study_files.hpp"
#include "output_folder.hpp"
#include "process.hpp"
#include "single_case.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace {

namespace fs = std::filesystem;

// Rows as they come, for the case that the program is killed before the table is complete.
class PartialTable {
 public:
  PartialTable(fs::path path, const Study& study) : path_(std::move(path)), table_(empty_table(study)) {
    std::error_code ignored;
    fs::remove(path_, ignored);  // a new file, not one that a link here leads to
    file_.open(path_);
    file_ << csv_head(table_);
  }
  void add(const CaseRow& row) {
    file_ << csv_line(table_, row);
    const auto now = std::chrono::steady_clock::now();
    if (now - flushed_ < std::chrono::milliseconds(500)) return;
    flushed_ = now;
    file_.flush();
  }
  // The complete table is there.
  void remove() {
    file_.close();
    std::error_code ignored;
    fs::remove(path_, ignored);
  }

 private:
  fs::path path_;
  StudyTable table_;  // without rows
  std::ofstream file_;
  std::chrono::steady_clock::time_point flushed_ = std::chrono::steady_clock::now();
};

void write_table(const StudyTable& table, const fs::path& folder) {
  write_study_hdf5(table, GRAPNEL_VERSION, folder / "table.h5");
  write_study_csv(table, folder / "table.csv");
  write_file_atomically(folder / "study.json", study_settings_json(table, GRAPNEL_VERSION));
}

}  // namespace

int sweep(const SweepOptions& options) {
  Study study;
  std::size_t points = 0;
  try {
    std::vector<Fault> doubts;
    study = load_study(options.study, &doubts);
    points = point_count(study);
    say_faults(doubts);
  } catch (const InputError& error) {
    say_faults(error.faults());
    return kBadInput;
  }
  if (options.only) return sweep_point(study, *options.only, points, options);
  const std::optional<fs::path> made = results_folder(options.output, options.study);
  if (!made) return kBadInput;
  const fs::path& folder = *made;
  if (!options.quiet) {
    to_stdout("grapnel {}, study {} (sha256 {})\n\n", GRAPNEL_VERSION, options.study.string(),
              study.sha256.substr(0, 12));
    flush_stdout();
  }
  PartialTable partial(folder / "table.partial.csv", study);
  StudyTable table;
  try {
    Progress progress(options.quiet);
    StudyOptions run;
    run.threads = threads_of(options.threads);
    run.progress = [&](const StudyProgress& at) { progress.report_points(at.done, at.total, at.not_ok); };
    run.row = [&](const CaseRow& row) { partial.add(row); };
    table = run_study(study, run);
    write_table(table, folder);
  } catch (const std::exception& error) {
    to_stderr("grapnel: error: {}\n", error.what());
    return kSimulationFailed;
  }
  partial.remove();
  const FolderReport report = write_folder_report(folder, ResultKind::sweep, options.no_report);
  if (!options.quiet)
    to_stdout("{}\nresults in {}: table.csv, table.h5, study.json\n{}", study_summary(table), folder.string(),
              report.line);
  const std::size_t ok = table.count(CaseStatus::ok);
  if (ok == points) return report.failed ? kSimulationFailed : kDone;
  to_stderr("{}: warning: {} of {} points are not ok, see status and reason in table.csv\n", options.study.string(),
            points - ok, points);
  return report.failed ? kSimulationFailed : kSomeFailed;
}

}  // namespace grapnel::app
