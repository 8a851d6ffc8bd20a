#include "grapnel/api/campaign.hpp"

#include <iterator>

#include "grapnel/api/report.hpp"
#include "grapnel/api/version.hpp"
#include "grapnel/campaign/campaign.hpp"
#include "grapnel/campaign/campaign_folder.hpp"
#include "grapnel/campaign/case_pool.hpp"
#include "grapnel/campaign/run_campaign.hpp"
#include "grapnel/campaign/statistics.hpp"
#include "grapnel/campaign/study_files.hpp"

namespace grapnel {
namespace {

CampaignOptions pool_options(const CampaignRun& run) {
  CampaignOptions options;
  options.threads = threads_of(run.threads);
  options.stop = run.stop;
  if (run.progress) options.progress = [&run](const CaseProgress& at) { run.progress(at.done, at.total); };
  return options;
}

CampaignSummary summary_of(const CaseProgress& done, double confidence) {
  const Proportion success = wilson(done.successes, done.done, confidence);
  return {done.done, done.successes, done.not_ok, success.estimate, success.lower, success.upper, done.stopped};
}

}  // namespace

CampaignOutcome simulate_campaign(const std::filesystem::path& file, const CampaignRun& run) {
  const Campaign campaign = load_campaign(file);
  CampaignOutcome result;
  for (const CampaignInput& input : campaign.inputs)
    result.inputs.push_back({input.name, input.unit, input.description});
  for (const Column& column : campaign.columns)
    result.columns.push_back({column.name, column.unit, column.description});

  const BlockWork work = block_work(campaign);
  CaseProgress progress;
  const std::uint64_t total = progress.total = campaign.total();
  std::vector<std::vector<CaseRow>> rows(block_count(kCasesInProgress, total));
  progress = run_jobs(
      rows.size(), pool_options(run), progress,
      [&](std::size_t job, const RowSink& submit, const std::stop_token& stop) {
        submit(work(block_at(job, kCasesInProgress, total), stop));
      },
      [&](std::size_t job, std::vector<CaseRow> fresh) {
        std::move(fresh.begin(), fresh.end(), std::back_inserter(rows[job]));
      });
  for (std::vector<CaseRow>& block : rows) {
    for (CaseRow& row : block)
      result.cases.push_back({row.index, row.status == CaseStatus::ok, row.success, std::move(row.reason),
                              std::move(row.inputs), std::move(row.values)});
  }
  result.summary = summary_of(progress, campaign.confidence);
  return result;
}

CampaignSummary simulate_campaign(const std::filesystem::path& file, const std::filesystem::path& folder,
                                  const CampaignRun& run) {
  Campaign campaign = load_campaign(file);
  std::filesystem::create_directories(folder);
  ShardStore store(folder, campaign, {.version = version(), .writer = {}});
  take_total(campaign, store);
  const CampaignOptions options = pool_options(run);
  const CaseProgress done = run_campaign(block_work(campaign), store, options);
  if (!done.stopped) {
    write_campaign_tables(campaign, folder, false, options.threads);
    if (has_reports()) save_report(folder);
  }
  return summary_of(done, campaign.confidence);
}

}  // namespace grapnel
