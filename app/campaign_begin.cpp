#include "campaign_begin.hpp"
#include "terminal.hpp"

#include "grapnel/scenario/read_campaign.hpp"
#include "grapnel/text/faults.hpp"

namespace grapnel::app {
namespace {

namespace fs = std::filesystem;

void say_lines(const char* text) { to_stderr("grapnel: error: {}\n", text); }

}  // namespace

std::optional<Campaign> campaign_from_file(const CampaignRunOptions& options, bool say) {
  try {
    std::vector<Fault> doubts;
    Campaign campaign = load_campaign(options.study, &doubts);
    if (say) say_faults(doubts);
    if (!options.envelope || !campaign.design.empty()) return campaign;
    if (say)
      to_stderr(
          "{}: error: grapnel envelope needs a 'design' of one or two axes; without one it is grapnel campaign "
          "that runs "
          "this file\n",
          options.study.string());
  } catch (const InputError& error) {
    if (!say) return std::nullopt;
    say_faults(error.faults());
  }
  return std::nullopt;
}

void say_campaign(const Campaign& campaign, const CampaignRunOptions& options) {
  if (options.quiet) return;
  to_stdout("grapnel {}, campaign {} (sha256 {})\n", GRAPNEL_VERSION, options.study.string(),
            campaign.sha256.substr(0, 12));
  flush_stdout();
}

void say_beginning(const ShardStore& store, const std::string& part) {
  if (!store.was_there()) {
    to_stdout("{} cases{}{}\n", store.total(), part.empty() ? "" : ", ", part);
  } else {
    StoreCounts there;
    store.missing(0, 1, &there);
    to_stdout("{} cases, {} of them are there{}{}\n", store.total(), there.rows, part.empty() ? "" : ", ", part);
  }
  flush_stdout();
}

void say_stopped(const fs::path& folder, std::uint64_t done, std::uint64_t total, const std::string& command) {
  to_stderr("grapnel: stopped: {} of {} cases are kept in {}; to go on: {}\n", done, total, folder.string(), command);
}

void take_total(Campaign& campaign, const ShardStore& store) {
  if (campaign.design.empty()) campaign.cases = store.total();
}

int with_store_errors(const fs::path& folder, const std::string& command, const std::function<int()>& work) {
  try {
    return work();
  } catch (const ForeignFolder& error) {
    say_lines(error.what());
    return kBadInput;
  } catch (const DamagedManifest& error) {
    say_lines(error.what());
    return kBadInput;
  } catch (const FolderInUse& error) {
    say_lines(error.what());
    return kSimulationFailed;
  } catch (const std::exception& error) {
    say_lines(error.what());
    to_stderr("grapnel: what is in {} stays valid; to go on: {}\n", folder.string(), command);
    return kSimulationFailed;
  }
}

}  // namespace grapnel::app
